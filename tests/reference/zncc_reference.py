#!/usr/bin/env python3
"""Reference scores of normalised cross-correlation on real images, by other people's code.

Scores come from OpenCV's `matchTemplate(TM_CCOEFF_NORMED)`; scikit-image's `match_template` must agree at every
position before anything is written, and K-Eq 11 written out in double precision must agree at the positions kept.

    python -m venv venv && venv/bin/pip install numpy opencv-python-headless scikit-image
    SIGHTLINE_DATA=../shared/data venv/bin/python tests/reference/zncc_reference.py

writes `zncc_reference.json` beside this file. The images themselves are not committed. A template is cut from one
image at `template_centre` (odd side) and compared with every position of `search_region` (x, y, width, height)
of another; each kept position is the pixel of the template's centre. Values are detector numbers, on which the
score does not depend.
"""

import json
import os
import re
from pathlib import Path

import cv2
import numpy as np
from skimage.feature import match_template

HERE = Path(__file__).resolve().parent
DATA = Path(os.environ.get("SIGHTLINE_DATA", HERE.parents[2] / "shared" / "data"))
MER = "mer1-navcam-sol4087-pair/1N491020376ILFCNY9P0706L0M1.IMG"
MER_SECOND = "mer1-navcam-sol4087-pair/1N491020519ILFCNY9P0706L0M1.IMG"
KITTI = "kitti-seq1-frames-0-19/image_0/000000.png"
KITTI_RIGHT = "kitti-seq1-frames-0-19/image_1/000000.png"
KITTI_NEXT = "kitti-seq1-frames-0-19/image_0/000001.png"

# name, template's image, template's centre, side, searched image, region (x, y, width, height)
CASES = [
    ("navcam_outcrop_in_the_second_pointing", MER, None, 21, MER_SECOND, None),
    ("navcam_soil_low_texture_elsewhere", MER, (300, 180), 21, MER, (420, 120, 161, 161)),
    ("kitti_left_in_right", KITTI, (620, 200), 21, KITTI_RIGHT, (520, 150, 161, 101)),
    ("kitti_next_frame_small_template", KITTI, (500, 180), 11, KITTI_NEXT, (440, 140, 121, 81)),
    ("kitti_next_frame_large_template", KITTI, (720, 210), 41, KITTI_NEXT, (640, 130, 161, 161)),
    ("kitti_sky_saturated", KITTI, (620, 200), 21, KITTI, None),
]


def read_image(name):
    """The pixels as float64 detector numbers."""
    path = DATA / name
    if path.suffix == ".png":
        return cv2.imread(str(path), cv2.IMREAD_UNCHANGED).astype(np.float64)
    raw = path.read_bytes()
    label = raw[: 64 * 1024].decode("latin-1")
    image_object = re.search(r"^OBJECT\s*=\s*IMAGE\s.*?^END_OBJECT\s*=\s*IMAGE\s", label, re.M | re.S).group(0)

    def number(key, text=label):
        return int(re.search(rf"^\s*{re.escape(key)}\s*=\s*(\d+)", text, re.M).group(1))

    start = (number("^IMAGE") - 1) * number("RECORD_BYTES")
    lines, samples = number("LINES", image_object), number("LINE_SAMPLES", image_object)
    assert number("SAMPLE_BITS", image_object) == 16
    pixels = np.frombuffer(raw, ">u2", lines * samples, start)
    return pixels.reshape(lines, samples).astype(np.float64)


def matched_pair():
    """A pixel of the first navcam image and its match in the second, from the data set's own list of matches."""
    table = np.genfromtxt(DATA / Path(MER).parent / "reference_matches.csv", delimiter=",", skip_header=1, names=True)
    inside = [
        row for row in table
        if all(60 < row[k] < 960 for k in ("u1", "v1")) and all(120 < row[k] < 900 for k in ("u2", "v2"))
    ]
    first, second = read_image(MER), read_image(MER_SECOND)

    def similarity(row):
        u1, v1, u2, v2 = (round(float(row[k])) for k in ("u1", "v1", "u2", "v2"))
        return exact(first[v1 - 10 : v1 + 11, u1 - 10 : u1 + 11], second[v2 - 10 : v2 + 11, u2 - 10 : u2 + 11])

    row = max(inside, key=similarity)
    return [round(float(row[k])) for k in ("u1", "v1", "u2", "v2")]


def flattest_region(image, width, height):
    """The region with the most windows of one single value: saturated sky, if there is any."""
    size = 21
    box = lambda a: cv2.boxFilter(a, cv2.CV_64F, (size, size), normalize=True)
    flat = (box(image * image) - box(image) ** 2 < 1e-6).astype(np.float64)
    count = cv2.boxFilter(flat, cv2.CV_64F, (width, height), normalize=False)
    half_h, half_w = height // 2, width // 2
    inner = count[half_h : image.shape[0] - half_h, half_w : image.shape[1] - half_w]
    y, x = np.unravel_index(np.argmax(inner), inner.shape)
    return (int(x), int(y), width, height)


def exact(template, window):
    """K-Eq 11 in double precision."""
    t, w = template - template.mean(), window - window.mean()
    norm = np.sqrt((t * t).sum() * (w * w).sum())
    return float((t * w).sum() / norm) if norm > 0 else 0.0


def case(name, source, centre, size, searched, region):
    if centre is None:
        x1, y1, x2, y2 = matched_pair()
        centre, region = (x1, y1), (x2 - 80, y2 - 80, 161, 161)
    half = size // 2
    template = read_image(source)[centre[1] - half :, centre[0] - half :][:size, :size]
    image = read_image(searched)
    if region is None:
        region = flattest_region(image, 101, 81)
    x0, y0, width, height = region
    image = image[y0 : y0 + height, x0 : x0 + width]
    assert image.shape == (height, width) and template.shape == (size, size), name

    # OpenCV sums in single precision; taking the level away first, which no score depends on, keeps its digits.
    level = image.mean()
    shifted = [(pixels - level).astype(np.float32) for pixels in (image, template)]
    scores = cv2.matchTemplate(*shifted, cv2.TM_CCOEFF_NORMED)
    second = match_template(image, template)
    windows = np.lib.stride_tricks.sliding_window_view(image, (size, size))
    deviation = windows.std(axis=(2, 3))
    # Where a window has next to no contrast the libraries lose digits or fall back on conventions of their own
    # (ours is 0, R66): there only the formula in double precision counts.
    flat, textured = deviation < 1e-9, deviation > 2.0
    disagreement = float(np.abs(scores - second)[textured].max())

    grid = np.linspace(0, scores.size - 1, 200).astype(int)
    every = np.array([[exact(template, window) for window in row] for row in windows])
    best = np.unravel_index(np.argmax(every), scores.shape)
    positions, worst = [], 0.0
    for iy, ix in [tuple(map(int, np.unravel_index(i, scores.shape))) for i in grid]:
        truth, score = float(every[iy, ix]), None
        if textured[iy, ix]:
            worst = max(worst, abs(truth - float(scores[iy, ix])))
            score = round(float(scores[iy, ix]), 7)
        positions.append([x0 + ix + half, y0 + iy + half, score, round(truth, 9)])
    peak = [x0 + int(best[1]) + half, y0 + int(best[0]) + half]
    print(
        f"{name}: maximum {every[best]:.4f} at {peak}; template std {template.std():.2f} DN; "
        f"OpenCV - scikit-image {disagreement:.1e}, OpenCV - double {worst:.1e}; "
        f"{int(flat.sum())} windows without contrast"
    )
    assert disagreement < 1e-4 and worst < 1e-4, "the references disagree"
    return {
        "name": name,
        "template_source": source,
        "template_centre": list(centre),
        "template_size": size,
        "searched_source": searched,
        "search_region": list(region),
        "maximum": {"pixel": peak, "score": round(float(every[best]), 9)},
        "flat_positions": int(flat.sum()),
        "positions": positions,
    }


def main():
    document = {
        "about": "see zncc_reference.py; positions are [x, y, score by OpenCV or null, score by K-Eq 11 in double precision]",
        "opencv": cv2.__version__,
        "cases": [case(*parameters) for parameters in CASES],
    }
    text = json.dumps(document, indent=1)
    # One position per line keeps the file readable.
    text = re.sub(r"\[\s+([-\d.e]+),\s+([-\d.e]+),\s+([-\d.e]+|null),\s+([-\d.e]+)\s+\]", r"[\1, \2, \3, \4]", text)
    (HERE / "zncc_reference.json").write_text(text + "\n")


if __name__ == "__main__":
    main()
