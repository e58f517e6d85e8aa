#!/usr/bin/env python3
"""Reference disparities, by OpenCV's StereoBM and StereoSGBM with their usual settings.

    python -m venv venv && venv/bin/pip install numpy opencv-python-headless
    mkdir pair && SIGHTLINE_STEREO_PAIR=$PWD/pair cargo test -p sightline-core a_rendered_pair
    SIGHTLINE_DATA=../shared/data venv/bin/python tests/reference/stereo_reference.py pair

writes `stereo_reference.json` beside this file; `core/src/stereo/recorded_tests.rs` holds our disparities against it. The
images themselves are not committed.

Pairs: Middlebury's Motorcycle at a quarter of its size (grey is 0.299 R + 0.587 G + 0.114 B, rounded to 8 bits) and a
rendered pair with exact truth. A pixel counts where the truth is known; whether the right eye sees it does not matter.

    bad2      share without an answer, or off by more than 2 px
    rms_px    of those with an answer
    coverage  share with an answer
"""

import json
import os
import sys
from pathlib import Path

import cv2
import numpy as np

HERE = Path(__file__).resolve().parent
DATA = Path(os.environ.get("SIGHTLINE_DATA", HERE.parents[2] / "shared" / "data"))


def block_matcher(count):
    matcher = cv2.StereoBM_create(count, 15)
    matcher.setUniquenessRatio(10)
    matcher.setTextureThreshold(10)
    matcher.setSpeckleWindowSize(100)
    matcher.setSpeckleRange(2)
    matcher.setDisp12MaxDiff(1)
    return matcher


def block_matcher_wide(count):
    """The wider speckle range of many examples, and no check from the right."""
    matcher = cv2.StereoBM_create(count, 15)
    matcher.setUniquenessRatio(10)
    matcher.setTextureThreshold(10)
    matcher.setSpeckleWindowSize(100)
    matcher.setSpeckleRange(32)
    return matcher


def semi_global(count, speckle_range=2, mode=cv2.STEREO_SGBM_MODE_SGBM):
    return cv2.StereoSGBM_create(0, count, 5, 8 * 25, 32 * 25, 1, 63, 10, 100, speckle_range, mode)


MATCHERS = {
    "StereoBM": block_matcher,
    "StereoBM, speckles 32": block_matcher_wide,
    "StereoSGBM": semi_global,
    "StereoSGBM, speckles 32": lambda count: semi_global(count, 32),
    "StereoSGBM, 8 paths": lambda count: semi_global(count, 2, cv2.STEREO_SGBM_MODE_HH),
}


def grey(path):
    blue, green, red = (channel.astype(np.float64) for channel in cv2.split(cv2.imread(str(path))))
    return np.floor(0.299 * red + 0.587 * green + 0.114 * blue + 0.5).astype(np.uint8)


def floatmap(path):
    with open(path, "rb") as file:
        assert file.readline() == b"Pf\n"
        width, height = map(int, file.readline().split())
        assert float(file.readline()) < 0
        return np.flipud(np.frombuffer(file.read(), "<f4").reshape(height, width))


def motorcycle():
    folder = DATA / "middlebury-motorcycle"
    images = [grey(folder / f"motorcycle_{eye}.png") for eye in ("left", "right")]
    return images, floatmap(folder / "motorcycle_disp.pfm")


def rendered(folder):
    images = [cv2.imread(str(folder / f"{eye}.png"), cv2.IMREAD_GRAYSCALE) for eye in ("left", "right")]
    return images, np.fromfile(folder / "disparity.f32", "<f4").reshape(images[0].shape)


def row(pair, images, truth, name, count):
    matcher = MATCHERS[name](count)
    found = matcher.compute(*images).astype(np.float64) / 16
    known = np.isfinite(truth)
    answered = (found >= matcher.getMinDisparity()) & known
    off = np.abs(found - np.where(known, truth, 0))
    bad = known & ~(answered & (off <= 2))
    result = {
        "pair": pair,
        "matcher": name,
        "disparities": count,
        "bad2": round(float(bad.sum() / known.sum()), 5),
        "rms_px": round(float(np.sqrt((off[answered] ** 2).mean())), 4),
        "coverage": round(float(answered.sum() / known.sum()), 5),
    }
    print(result)
    return result


def main():
    pairs = {"motorcycle": (motorcycle(), [64, 128])}
    if len(sys.argv) > 1:
        pairs["rendered"] = (rendered(Path(sys.argv[1])), [64])
    rows = []
    for pair, ((images, truth), counts) in pairs.items():
        rows += [row(pair, images, truth, name, count) for count in counts for name in MATCHERS]
    text = ",\n".join("  " + json.dumps(row) for row in rows)
    about = json.dumps("see stereo_reference.py")
    version = json.dumps(cv2.__version__)
    document = f'{{\n "about": {about},\n "opencv": {version},\n "rows": [\n{text}\n ]\n}}\n'
    (HERE / "stereo_reference.json").write_text(document)


main()
