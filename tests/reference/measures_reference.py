#!/usr/bin/env python3
"""Reference numbers of the matcher's other measures and of gradient descent, by other people's code (R216-R219, R222).

The image is a formula (16 waves), so that nothing but numbers is committed. Squared differences come from OpenCV's
`matchTemplate(TM_SQDIFF)`, absolute ones from SciPy's `cdist`, the sign of the difference of Gaussians from SciPy's
`gaussian_filter`, optical flow from OpenCV's `calcOpticalFlowPyrLK` (8-bit pixels) and an affine map from OpenCV's
`findTransformECC`, which allows for gain and level.

    python -m venv venv && venv/bin/pip install numpy scipy opencv-python-headless
    venv/bin/python tests/reference/measures_reference.py

writes `measures_reference.json` beside this file.
"""

import json
from pathlib import Path

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.spatial.distance import cdist

HERE = Path(__file__).resolve().parent
WIDTH, HEIGHT, SIZE = 96, 80, 21


def texture(x, y):
    """16 waves of 7 to 48 px; `x` and `y` in px."""
    value = np.full(np.broadcast(x, y).shape, 0.5)
    for i in range(16):
        direction, wavelength = i * 2.399963, 48.0 * 0.88**i
        along = x * np.cos(direction) + y * np.sin(direction)
        value += 0.03 * np.sin(2.0 * np.pi * along / wavelength + i * i)
    return value


def image(warp=lambda x, y: (x, y), gain=1.0, level=0.0):
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float64)
    return (gain * texture(*warp(x, y)) + level).astype(np.float32)


def rounded(values):
    return [round(float(v), 9) for v in values]


def surfaces():
    """Scores of the template about (40, 33) of the plain image in a brighter, moved image."""
    template = image()[33 - 10 : 33 + 11, 40 - 10 : 40 + 11].astype(np.float64)
    searched = image(lambda x, y: (x - 3.0, y + 2.0), gain=1.1, level=0.02)
    windows = np.lib.stride_tricks.sliding_window_view(searched.astype(np.float64), (SIZE, SIZE))
    flat = windows.reshape(-1, SIZE * SIZE)
    sad = -cdist(flat, template.reshape(1, -1), "cityblock").ravel() / SIZE**2
    ssd = -cv2.matchTemplate(searched, template.astype(np.float32), cv2.TM_SQDIFF).ravel().astype(np.float64) / SIZE**2
    assert np.abs(ssd + cdist(flat, template.reshape(1, -1), "sqeuclidean").ravel() / SIZE**2).max() < 1e-6

    def signs(pixels):
        narrow = gaussian_filter(pixels.astype(np.float64), 1.5, radius=5)
        return narrow - gaussian_filter(pixels.astype(np.float64), 1.5 * 1.6, radius=8) >= 0.0

    bits = signs(image())[33 - 10 : 33 + 11, 40 - 10 : 40 + 11]
    there = np.lib.stride_tricks.sliding_window_view(signs(searched), (SIZE, SIZE))
    sdog = 2.0 * (there == bits).mean(axis=(2, 3)).ravel() - 1.0
    columns = WIDTH - SIZE + 1
    # Away from the border, where the libraries continue an image in different ways.
    kept = [i for i in range(0, sad.size, 37) if 8 <= i % columns < columns - 8 and 8 <= i // columns < HEIGHT - SIZE - 7]
    positions = [[i % columns + 10, i // columns + 10] for i in kept]
    return {"positions": positions, "sad": rounded(sad[kept]), "ssd": rounded(ssd[kept]), "sdog": rounded(sdog[kept])}


def flows():
    """Where OpenCV's pyramidal Lucas-Kanade finds (45, 38) of the plain image in moved ones."""
    eight = lambda pixels: np.round(pixels * 255.0).astype(np.uint8)
    found = []
    for dx, dy in [(0.37, -0.81), (2.4, 1.3), (-4.6, 3.2)]:
        moved = image(lambda x, y: (x - dx, y - dy))
        criteria = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 30, 0.01)
        point = np.array([[[45.0, 38.0]]], np.float32)
        at, status, _ = cv2.calcOpticalFlowPyrLK(
            eight(image()), eight(moved), point, None, winSize=(SIZE, SIZE), maxLevel=2, criteria=criteria)
        assert status[0, 0] == 1
        found.append({"moved": [dx, dy], "found": rounded(at[0, 0])})
    return found


def affine():
    """The map that OpenCV's ECC finds between the window about (45, 38) and an affinely changed, brighter image."""
    a = np.array([[1.06, 0.03], [-0.04, 0.97]])
    centre, moved_to = np.array([45.0, 38.0]), np.array([46.3, 37.2])
    inverse = np.linalg.inv(a)
    warp = lambda x, y: (
        centre[0] + inverse[0, 0] * (x - moved_to[0]) + inverse[0, 1] * (y - moved_to[1]),
        centre[1] + inverse[1, 0] * (x - moved_to[0]) + inverse[1, 1] * (y - moved_to[1]))
    there = image(warp, gain=0.9, level=0.05)
    window = image()[38 - 10 : 38 + 11, 45 - 10 : 45 + 11]
    start = np.array([[1, 0, 36.0], [0, 1, 27.0]], np.float32)
    criteria = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 200, 1e-9)
    _, found = cv2.findTransformECC(window, there, start, cv2.MOTION_AFFINE, criteria, None, 1)
    place = found @ np.array([10.0, 10.0, 1.0])
    return {"map": rounded(a.ravel()), "moved_to": rounded(moved_to), "found_map": rounded(found[:, :2].ravel()), "found": rounded(place)}


def main():
    document = {"about": "see measures_reference.py", "opencv": cv2.__version__, "surfaces": surfaces(), "flows": flows(), "affine": affine()}
    print(document["flows"], document["affine"], len(document["surfaces"]["positions"]))
    (HERE / "measures_reference.json").write_text(json.dumps(document) + "\n")


if __name__ == "__main__":
    main()
