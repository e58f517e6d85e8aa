#!/usr/bin/env python3
"""Reference disparities, by OpenCV's StereoBM and StereoSGBM with their usual settings.

    python -m venv venv && venv/bin/pip install numpy opencv-python-headless
    mkdir pair && SIGHTLINE_STEREO_PAIR=$PWD/pair cargo test -p sightline-core a_rendered_pair
    SIGHTLINE_DATA=../shared/data venv/bin/python tests/reference/stereo_reference.py pair

writes `stereo_reference.json` beside this file; `core/vision/src/stereo/recorded_tests.rs` holds our disparities against it. The
images themselves are not committed.

Pairs: Middlebury's Motorcycle at a quarter of its size (grey is 0.299 R + 0.587 G + 0.114 B, rounded to 8 bits) and a
rendered pair with exact truth. A pixel counts where the truth is known; whether the right eye sees it does not matter.

    bad2      share without an answer, or off by more than 2 px
    rms_px    of those with an answer
    coverage  share with an answer

KITTI's street has no truth but the known motion of the car: points of the first frame are carried to the second one and set beside
the disparity that is found there (`street`: shares found, and within 1 px and 3 px of those that have a partner).
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


def street(name, count=96):
    """As `street_stereo_is_consistent_between_eyes_and_frames` does with ours."""
    folder, matcher = DATA / "kitti-seq1-frames-0-19", MATCHERS[name](count)
    lines = (line.split(":") for line in open(folder / "calib.txt"))
    cameras = {key: np.array(values.split(), float).reshape(3, 4) for key, values in lines}
    focal, centre = cameras["P0"][0, 0], cameras["P0"][:2, 2]
    along = -cameras["P1"][0, 3]
    poses = [np.vstack([pose.reshape(3, 4), [0, 0, 0, 1]]) for pose in np.loadtxt(folder / "poses.txt")[:2]]
    images = [[cv2.imread(str(folder / f"image_{eye}/{k:06d}.png"), 0) for eye in (0, 1)] for k in (0, 1)]
    before, after = (matcher.compute(*pair).astype(np.float64) / 16 for pair in images)
    y, x = np.nonzero(before > 0)
    depth = along / before[y, x]
    points = np.stack([(x - centre[0]) * depth / focal, (y - centre[1]) * depth / focal, depth, np.ones_like(depth)])
    points = points[:, np.linalg.norm(points[:3], axis=0) < 1000]
    carried = np.linalg.inv(poses[1]) @ poses[0] @ points
    carried = carried[:, carried[2] > 0.5]
    u, v = (np.round(focal * carried[i] / carried[2] + centre[i]).astype(int) for i in (0, 1))
    inside = (u >= 0) & (v >= 0) & (u < after.shape[1]) & (v < after.shape[0])
    there, expected = after[v[inside], u[inside]], along / carried[2][inside]
    off = np.abs(there - expected)[there > 0]
    shares = {"found": (before >= 0).mean(), "within_1": (off < 1).mean(), "within_3": (off < 3).mean()}
    result = {"matcher": name, "disparities": count} | {key: round(float(share), 4) for key, share in shares.items()}
    print(result)
    return result


def main():
    pairs = {"motorcycle": (motorcycle(), [64, 128])}
    if len(sys.argv) > 1:
        pairs["rendered"] = (rendered(Path(sys.argv[1])), [64])
    rows = []
    for pair, ((images, truth), counts) in pairs.items():
        rows += [row(pair, images, truth, name, count) for count in counts for name in MATCHERS]
    lines = lambda rows: ",\n".join("  " + json.dumps(row) for row in rows)
    streets = lines(street(name) for name in ("StereoBM", "StereoSGBM"))
    about = json.dumps("see stereo_reference.py")
    version = json.dumps(cv2.__version__)
    document = f'{{\n "about": {about},\n "opencv": {version},\n "rows": [\n{lines(rows)}\n ],\n "street": [\n{streets}\n ]\n}}\n'
    (HERE / "stereo_reference.json").write_text(document)


main()
