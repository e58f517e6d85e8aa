"""OpenCV's half of `cargo xtask bench --peers`; `core/benches/peer.rs` says the protocol.

One thread, no OpenCL: `matchTemplate(TM_CCOEFF_NORMED)` on the pixels that the other side reads too.
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


def run(image, size, left, top, repetitions):
    template = image[top : top + size, left : left + size].copy()
    quickest = float("inf")
    for _ in range(repetitions):
        start = time.perf_counter()
        scores = cv2.matchTemplate(image, template, cv2.TM_CCOEFF_NORMED)
        quickest = min(quickest, time.perf_counter() - start)
    return quickest, scores.ravel()[::97]


def main():
    cv2.setNumThreads(1)
    cv2.ocl.setUseOpenCL(False)
    images = read_images(sys.argv[1])
    for line in sys.stdin:
        _, image, size, left, top, repetitions = line.split()
        quickest, scores = run(images[int(image)], int(size), int(left), int(top), int(repetitions))
        print(f"{quickest:.9f}", *(f"{score:.7f}" for score in scores), flush=True)


main()
