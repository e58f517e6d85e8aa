"""OpenCV's half of `cargo xtask bench --peers`; `core/benches/peer.rs` says the protocol.

One thread, no OpenCL: `matchTemplate(TM_CCOEFF_NORMED)`, `SIFT.detectAndCompute` and `BFMatcher(NORM_L2).knnMatch`,
`StereoBM` and `StereoSGBM` on the pixels and descriptors that the other side reads too. The request `describe <image> <count> <file>`, which only this
side gets, writes the descriptors of an image's strongest features.
"""

import os

os.environ["OPENCV_OPENCL_RUNTIME"] = "disabled"

import sys
import time

import cv2
import numpy as np


def read_images(path):
    data, images = open(path, "rb").read(), []
    while data:
        side = int.from_bytes(data[:4], "little")
        end = 4 + 4 * side * side
        images.append(np.frombuffer(data[4:end], "<f4").reshape(side, side).copy())
        data = data[end:]
    return images


def quickest(repetitions, work):
    best = float("inf")
    for _ in range(repetitions):
        start = time.perf_counter()
        result = work()
        best = min(best, time.perf_counter() - start)
    return best, result


def zncc(images, image, size, left, top, repetitions):
    image, size, left, top = images[int(image)], int(size), int(left), int(top)
    template = image[top : top + size, left : left + size].copy()
    work = lambda: cv2.matchTemplate(image, template, cv2.TM_CCOEFF_NORMED)
    seconds, scores = quickest(int(repetitions), work)
    return seconds, [f"{score:.7f}" for score in scores.ravel()[::97]]


def bits(image):
    return np.round(255 * image).astype(np.uint8)


def finder(count=0):
    """Lowe's thresholds: OpenCV's is his 0.03 times the three scales of an octave."""
    return cv2.SIFT_create(nfeatures=count, contrastThreshold=0.09, enable_precise_upscale=True)


def sift(images, image, repetitions):
    image, sift = bits(images[int(image)]), finder()
    seconds, (keypoints, _) = quickest(int(repetitions), lambda: sift.detectAndCompute(image, None))
    return seconds, [str(len(keypoints))]


def describe(images, image, count, path):
    _, descriptors = finder(int(count)).detectAndCompute(bits(images[int(image)]), None)
    assert len(descriptors) >= int(count), f"only {len(descriptors)} features"
    np.random.default_rng(0).permutation(descriptors[: int(count)]).astype(np.uint8).tofile(path)
    return 0, []


def match(images, path, queries, repetitions):
    descriptors = np.fromfile(path, np.uint8).reshape(-1, 128).astype(np.float32)
    query, train = descriptors[: int(queries)], descriptors[int(queries) :]
    work = lambda: cv2.BFMatcher(cv2.NORM_L2).knnMatch(query, train, k=2)
    seconds, found = quickest(int(repetitions), work)
    return seconds, [f"{m.trainIdx} {m.distance:.4f} {n.distance:.4f}" for m, n in found[::97]]


def stereo(images, method, image, count, repetitions):
    left, right, count = bits(images[int(image)]), bits(images[int(image) + 1]), int(count)
    if method == "block":
        matcher = cv2.StereoBM_create(count, 15)
        matcher.setUniquenessRatio(10)
        matcher.setTextureThreshold(10)
        matcher.setSpeckleWindowSize(100)
        matcher.setSpeckleRange(2)
        matcher.setDisp12MaxDiff(1)
    else:
        matcher = cv2.StereoSGBM_create(0, count, 5, 8 * 25, 32 * 25, 1, 63, 10, 100, 2, cv2.STEREO_SGBM_MODE_SGBM)
    seconds, found = quickest(int(repetitions), lambda: matcher.compute(left, right))
    places = [(200 + 190 * (k % 4), 50 + 250 * (k // 4)) for k in range(16)]
    medians = [np.median(found[y : y + 31, x : x + 31]) / 16 for x, y in places]
    return seconds, [f"{median:.4f}" for median in medians]


def main():
    cv2.setNumThreads(1)
    cv2.ocl.setUseOpenCL(False)
    images = read_images(sys.argv[1])
    works = {"zncc": zncc, "sift": sift, "describe": describe, "match": match, "stereo": stereo}
    for line in sys.stdin:
        name, *words = line.split()
        seconds, found = works[name](images, *words)
        print(f"{seconds:.9f}", *found, flush=True)


main()
