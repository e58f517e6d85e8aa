#!/usr/bin/env python3
"""Reference features of real images, by OpenCV's SIFT.

    python -m venv venv && venv/bin/pip install numpy opencv-python-headless
    SIGHTLINE_DATA=../shared/data venv/bin/python tests/reference/sift_reference.py [image ...]

writes `sift_reference.json` beside this file; `core/vision/src/sift/recorded_tests.rs` holds our features against it. The images
themselves are not committed. Further images (full scale 4095 where they have 16 bits) are reported and not written.

OpenCV runs with Lowe's thresholds: its contrast threshold c means |D| s >= c with s = 3 scales an octave, so that 0.09 is
Lowe's 0.03; `enable_precise_upscale` takes away the quarter pixel by which its keypoints are shifted otherwise. Grey is
0.299 R + 0.587 G + 0.114 B, rounded to 8 bits.

A pair is two images with the map between them: the two views of the graffiti wall with their homography, an image and
itself turned by a quarter, an image and the means of 2 x 2 of its pixels. With N the smaller of the numbers of keypoints
that lie inside the other image (domain.md 12.2):

    repeatability  = keypoints with one of the other image within 2.5 px of where they come to, in the second image's
                     pixels, counted in the image that has fewer of these / N
    matching score = matches by the nearest descriptor and ratio 0.8 that come to within 2.5 px / N
"""

import json
import os
import re
import sys
from pathlib import Path

import cv2
import numpy as np

HERE = Path(__file__).resolve().parent
DATA = Path(os.environ.get("SIGHTLINE_DATA", HERE.parents[2] / "shared" / "data"))
CONTRAST = 0.03
SCALES = 3
NEAR_PX = 2.5
RATIO = 0.8
SAMPLES = 60

IMAGES = [
    "sift-graf/graf1.png",
    "sift-graf/graf3.png",
    "sift-vlfeat-box/box.pgm",
    "kitti-seq1-frames-0-19/image_0/000000.png",
    "kitti-seq1-frames-0-19/image_1/000007.png",
    "kitti-seq1-frames-0-19/image_0/000019.png",
]
# first image, how the second comes from it
PAIRS = [
    ("sift-graf/graf1.png", "homography"),
    ("sift-graf/graf1.png", "turned"),
    ("sift-graf/graf3.png", "halved"),
    ("sift-vlfeat-box/box.pgm", "turned"),
    ("sift-vlfeat-box/box.pgm", "halved"),
    ("kitti-seq1-frames-0-19/image_0/000000.png", "turned"),
    ("kitti-seq1-frames-0-19/image_0/000000.png", "halved"),
    ("kitti-seq1-frames-0-19/image_0/000019.png", "halved"),
]


def read_image(path):
    """8 bits of grey."""
    pixels = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if pixels.ndim == 3:
        blue, green, red = (pixels[:, :, i].astype(np.float64) for i in range(3))
        return np.floor(0.299 * red + 0.587 * green + 0.114 * blue + 0.5).astype(np.uint8)
    if pixels.dtype == np.uint16:
        return np.clip(np.floor(pixels / 4095 * 255 + 0.5), 0, 255).astype(np.uint8)
    return pixels


def features(image, contrast=CONTRAST):
    """Rows of x, y, sigma, direction (rad), and descriptors."""
    sift = cv2.SIFT_create(contrastThreshold=SCALES * contrast, enable_precise_upscale=True)
    keypoints, descriptors = sift.detectAndCompute(image, None)
    rows = [(*k.pt, k.size / 2, np.deg2rad(k.angle)) for k in keypoints]
    return np.array(rows, np.float64).reshape(-1, 4), descriptors


def homography():
    """From view 1 of the wall to view 3."""
    text = (DATA / "sift-graf/H1to3p.xml").read_text()
    data = re.search(r"<data>(.*?)</data>", text, re.S).group(1)
    return np.array([float(word) for word in data.split()]).reshape(3, 3)


def second(name, image, how):
    """The second image of a pair, and the homography to it."""
    if how == "homography":
        return read_image(DATA / name.replace("graf1", "graf3")), homography()
    height, width = image.shape
    if how == "turned":
        return np.rot90(image, -1).copy(), np.array([[0, -1, height - 1], [1, 0, 0], [0, 0, 1.0]])
    even = image[: height // 2 * 2, : width // 2 * 2].astype(int)
    sums = even[::2, ::2] + even[1::2, ::2] + even[::2, 1::2] + even[1::2, 1::2]
    return ((sums + 2) // 4).astype(np.uint8), np.array([[0.5, 0, -0.25], [0, 0.5, -0.25], [0, 0, 1]])


def mapped(homography, points):
    there = np.c_[points, np.ones(len(points))] @ homography.T
    return there[:, :2] / there[:, 2:]


def inside(points, image):
    return (points >= 0).all(1) & (points <= np.array(image.shape[::-1]) - 1).all(1)


def compare(first, other, homography):
    """Numbers of keypoints, repeatability and matching score of (image, keypoints, descriptors) twice."""
    (image_a, a, descriptors_a), (image_b, b, descriptors_b) = first, other
    there, back = mapped(homography, a[:, :2]), mapped(np.linalg.inv(homography), b[:, :2])
    common = inside(there, image_b)
    common_b = inside(back, image_a)
    count = min(common.sum(), common_b.sum())
    near = np.hypot(*(there[:, None] - b[None, :, :2]).transpose(2, 0, 1)) <= NEAR_PX
    repeated = min(near[common].any(1).sum(), near[:, common_b].any(0).sum())
    pairs = cv2.BFMatcher(cv2.NORM_L2).knnMatch(descriptors_a[common], descriptors_b, k=2)
    matches = [m for m, n in pairs if m.distance <= RATIO * n.distance]
    off = [np.hypot(*(b[m.trainIdx, :2] - there[common][m.queryIdx])) for m in matches]
    correct = sum(distance <= NEAR_PX for distance in off)
    return {
        "keypoints": [len(a), len(b)],
        "common": int(count),
        "repeatability": round(float(repeated / count), 5),
        "matches": len(matches),
        "matching_score": round(float(correct / count), 5),
    }


def report(name, image):
    keypoints, _ = features(image)
    chosen = np.linspace(0, len(keypoints) - 1, min(SAMPLES, len(keypoints))).astype(int)
    rows = [[round(float(value), 4) for value in keypoints[i]] for i in chosen]
    print(f"{name}: {len(keypoints)} keypoints")
    return {"image": name, "keypoints": len(keypoints), "samples": rows}


def pair(name, how):
    image = read_image(DATA / name)
    other, homography = second(name, image, how)
    result = compare((image, *features(image)), (other, *features(other)), homography)
    print(name, how, result)
    return {"image": name, "second": how, **result}


def main():
    document = {
        "about": "see sift_reference.py; samples are [x, y, sigma in px, direction in rad]",
        "opencv": cv2.__version__,
        "contrast_min": CONTRAST,
        "near_px": NEAR_PX,
        "ratio_max": RATIO,
        "images": [report(name, read_image(DATA / name)) for name in IMAGES],
        "pairs": [pair(*parameters) for parameters in PAIRS],
    }
    text = json.dumps(document, indent=1)
    # One keypoint per line keeps the file readable.
    text = re.sub(r"\[\s+([-\d.e]+),\s+([-\d.e]+),\s+([-\d.e]+),\s+([-\d.e]+)\s+\]", r"[\1, \2, \3, \4]", text)
    text = re.sub(r"\[\s+(\d+),\s+(\d+)\s+\]", r"[\1, \2]", text)
    (HERE / "sift_reference.json").write_text(text + "\n")
    for path in sys.argv[1:]:
        report(path, read_image(path))


if __name__ == "__main__":
    main()
