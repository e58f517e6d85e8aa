#!/usr/bin/env python3
"""Compare visual odometry with OpenCV on the same recorded frames.

    sightline-experiments real-motion --data DATA --method odometry --matches matches.json --frames frames
    python3 python/odometry_pnp.py matches.json frames OUT
    evo_rpe tum OUT/kitti_every_frame_truth.txt OUT/kitti_every_frame_ours.txt

For each pair of frames three motions of the left camera (x right, y down, z forward; from before to after) are found:

    pnp       cv2.solvePnP (ITERATIVE) and solvePnPRefineLM on the inliers of our odometry: 3-D points before, pixels after
    flow      OpenCV alone: goodFeaturesToTrack, calcOpticalFlowPyrLK forward and backward for stereo and for time,
              triangulatePoints, solvePnPRansac (1 px), solvePnPRefineLM
    sift      the same with mutual SIFT matches (ratio 0.8) in place of corners and flow

The differences of ours to each, and of all to the truth, are printed as median and largest: deg, and cm at the left camera.
OUT gets chained trajectories in TUM format for each set whose updates are all accepted. Refused updates are listed and left out
of the differences. PnP does not know how large the error of a point is, and flow and sift have their own matches: they are other
estimates of the motion, not references. Needs numpy and opencv-python-headless.
"""

import argparse
import json
from pathlib import Path

import cv2
import numpy as np

KINDS = ("ours", "pnp", "flow", "sift")
RNG_SEED = 1
CHAINED = ("kitti_every_frame", "euroc_pair", "euroc_still")  # pairs of neighbouring frames, each once
CORNERS, QUALITY, SPACING_PX = 1500, 0.005, 8
LK = dict(winSize=(21, 21), maxLevel=4, criteria=(cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 40, 0.003))
SIFT_RATIO = 0.8
BACK_PX = 0.3  # largest distance after forward and backward tracking
EPIPOLAR_PX = 1.0  # largest reprojection error of a triangulated point in either image
RANGE_MAX_BASELINES = 190.0  # KITTI: 100 m, as the settings of our odometry


def to_matrix(record):
    """A pose record (position, scalar-first quaternion) as a 4 x 4 matrix."""
    s, x, y, z = np.array(record["quaternion_sxyz"]) / np.linalg.norm(record["quaternion_sxyz"])
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - s * z), 2 * (x * z + s * y)],
        [2 * (x * y + s * z), 1 - 2 * (x * x + z * z), 2 * (y * z - s * x)],
        [2 * (x * z - s * y), 2 * (y * z + s * x), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, 3] = record["position_m"]
    return matrix


def camera_matrix(intrinsics):
    """K from fx, fy, cx, cy."""
    fx, fy, cx, cy = intrinsics
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def refined(points, pixels, k, rvec, tvec):
    """The motion after Levenberg-Marquardt, as a 4 x 4 matrix."""
    rvec, tvec = cv2.solvePnPRefineLM(points, pixels, k, None, rvec, tvec)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = cv2.Rodrigues(rvec)[0], tvec.ravel()
    return matrix


def pnp_on_inliers(pair):
    """The motion by PnP on the inliers of our odometry."""
    points = np.array([inlier["before_m"] for inlier in pair["inliers"]])
    pixels = np.array([inlier["after_px"] for inlier in pair["inliers"]])
    if len(points) < 6:
        return None
    k = camera_matrix(pair["intrinsics"][0])
    found, rvec, tvec = cv2.solvePnP(points, pixels, k, None, flags=cv2.SOLVEPNP_ITERATIVE)
    return refined(points, pixels, k, rvec, tvec) if found else None


def tracked(first, second, pixels):
    """Pixels of `first` in `second` by Lucas-Kanade, and which of them return to within BACK_PX."""
    there, seen, _ = cv2.calcOpticalFlowPyrLK(first, second, pixels, None, **LK)
    back, seen_back, _ = cv2.calcOpticalFlowPyrLK(second, first, there, None, **LK)
    near = np.linalg.norm(back - pixels, axis=-1).ravel() < BACK_PX
    return there, near & (seen.ravel() == 1) & (seen_back.ravel() == 1)


def triangulated(pair, left_px, right_px):
    """Points in the left camera's frame, m, and which of them reproject well within the range limits."""
    left_k, right_k = map(camera_matrix, pair["intrinsics"])
    right_from_left = to_matrix(pair["right_from_left"])
    left_p, right_p = left_k @ np.eye(4)[:3], right_k @ right_from_left[:3]
    homogeneous = cv2.triangulatePoints(left_p, right_p, left_px.reshape(-1, 2).T, right_px.reshape(-1, 2).T)
    points = (homogeneous[:3] / homogeneous[3]).T.astype(float)
    limit_m = RANGE_MAX_BASELINES * np.linalg.norm(right_from_left[:3, 3])
    is_good = (points[:, 2] > 0.3) & (np.linalg.norm(points, axis=1) < limit_m)
    for p, pixels in ((left_p, left_px), (right_p, right_px)):
        seen = np.c_[points, np.ones(len(points))] @ p.T
        is_good &= np.linalg.norm(seen[:, :2] / seen[:, 2:] - pixels.reshape(-1, 2), axis=1) < EPIPOLAR_PX
    return points, is_good


def read_images(pair, frames):
    """The left and right image before and the left image after."""
    then, now = pair["frames"]
    names = (f"{then}_left.png", f"{then}_right.png", f"{now}_left.png")
    return [cv2.imread(str(frames / name), cv2.IMREAD_GRAYSCALE) for name in names]


def solved(points, pixels, k):
    """The motion by RANSAC and Levenberg-Marquardt on its inliers, and their number."""
    if len(points) < 6:
        return None, 0
    cv2.setRNGSeed(RNG_SEED)
    found, rvec, tvec, inliers = cv2.solvePnPRansac(
        points, pixels, k, None, iterationsCount=2000, reprojectionError=1.0, confidence=0.9999
    )
    if not found:
        return None, 0
    inliers = inliers.ravel()
    return refined(points[inliers], pixels[inliers], k, rvec, tvec), len(inliers)


def by_flow(pair, frames):
    """The motion by corners and optical flow, and its number of inliers."""
    before, right, after = read_images(pair, frames)
    # Pixels without a value after the removal of distortion are 0.
    mask = cv2.morphologyEx((before > 0).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((9, 9), np.uint8))
    mask = cv2.erode(mask, np.ones((7, 7), np.uint8))
    corners = cv2.goodFeaturesToTrack(before, CORNERS, QUALITY, SPACING_PX, mask=mask)
    corners = cv2.cornerSubPix(before, corners, (3, 3), (-1, -1), LK["criteria"])
    in_right, has_stereo = tracked(before, right, corners)
    in_after, has_match = tracked(before, after, corners)
    points, is_good = triangulated(pair, corners, in_right)
    use = has_stereo & has_match & is_good
    pixels = in_after[use].reshape(-1, 2).astype(float)
    return solved(points[use], pixels, camera_matrix(pair["intrinsics"][0]))


def mutual(first, second):
    """Matches of descriptors that pass the ratio test one way and are each other's best: a dictionary of numbers."""
    matcher = cv2.BFMatcher()
    back = {match.queryIdx: match.trainIdx for match in matcher.match(second, first)}
    pairs = matcher.knnMatch(first, second, k=2)
    good = [best for best, other in pairs if best.distance < SIFT_RATIO * other.distance]
    return {match.queryIdx: match.trainIdx for match in good if back.get(match.trainIdx) == match.queryIdx}


def by_sift(pair, frames):
    """The motion by SIFT, and its number of inliers."""
    found = [cv2.SIFT_create().detectAndCompute(image, None) for image in read_images(pair, frames)]
    before, right, after = [np.array([point.pt for point in points]) for points, _ in found]
    in_right, in_after = mutual(found[0][1], found[1][1]), mutual(found[0][1], found[2][1])
    both = [number for number in in_right if number in in_after]
    points, is_good = triangulated(pair, before[both], right[[in_right[number] for number in both]])
    pixels = after[[in_after[number] for number in both]]
    return solved(points[is_good], pixels[is_good], camera_matrix(pair["intrinsics"][0]))


def difference(a, b):
    """Angle (deg) and distance (cm) between two motions from before to after, at the left camera before."""
    turn = a[:3, :3].T @ b[:3, :3]
    sine = np.linalg.norm([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    angle = np.degrees(np.arctan2(sine, (np.trace(turn) - 1) / 2))
    return angle, 100 * np.linalg.norm(a[:3, 3] - b[:3, 3])


def write_tum(path, motions):
    """The chain of motions from before to after as poses of the left camera, one a second."""
    pose, lines = np.eye(4), []
    for time, motion in enumerate([np.eye(4), *motions]):
        pose = pose @ np.linalg.inv(motion)
        rotation = cv2.Rodrigues(pose[:3, :3])[0].ravel()
        angle = np.linalg.norm(rotation)
        x, y, z = rotation / angle * np.sin(angle / 2) if angle > 0 else (0.0, 0.0, 0.0)
        values = [time, *pose[:3, 3], x, y, z, np.cos(angle / 2)]
        lines.append(" ".join(f"{value:.9f}" for value in values))
    path.write_text("\n".join(lines) + "\n")


def report(name, pairs, out):
    """Prints the differences of one set and writes its trajectories."""
    used = [p for p in pairs if p["accepted"] and all(p[kind] is not None for kind in KINDS)]
    print(f"{name}: {len(used)} of {len(pairs)} pairs compared")
    for label, a, b in (
        ("ours - pnp on our matches", "ours", "pnp"),
        ("ours - OpenCV by flow", "ours", "flow"),
        ("ours - OpenCV by SIFT", "ours", "sift"),
        ("ours - truth", "ours", "truth"),
        ("pnp on our matches - truth", "pnp", "truth"),
        ("OpenCV by flow - truth", "flow", "truth"),
        ("OpenCV by SIFT - truth", "sift", "truth"),
        ("OpenCV by flow - by SIFT", "flow", "sift"),
    ):
        if used:
            values = np.array([difference(p[a], p[b]) for p in used])
            (deg, cm), (deg_max, cm_max) = np.median(values, axis=0), values.max(axis=0)
            print(f"  {label:30} median {deg:.4f} deg {cm:.3f} cm, largest {deg_max:.4f} deg {cm_max:.3f} cm")
    if name in CHAINED and len(used) == len(pairs):
        for kind in (*KINDS, "truth"):
            write_tum(out / f"{name}_{kind}.txt", [p[kind] for p in pairs])


def main():
    """Reads the matches, finds both motions of each pair and reports by set."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("matches", type=Path, help="the JSON file of --matches")
    parser.add_argument("frames", type=Path, help="the folder of --frames")
    parser.add_argument("out", type=Path, help="a folder for the trajectories")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    sets = {}
    for pair in json.loads(arguments.matches.read_text()):
        pair["truth"] = to_matrix(pair["true_after_from_before"])
        pair["ours"] = to_matrix(pair["after_from_before"]) if pair["after_from_before"] else None
        pair["pnp"] = pnp_on_inliers(pair)
        pair["flow"], flow = by_flow(pair, arguments.frames)
        pair["sift"], sift = by_sift(pair, arguments.frames)
        sets.setdefault(pair["set"], []).append(pair)
        words = f"{pair['set']:18} {pair['pair']:>8}  inliers {len(pair['inliers'])}, flow {flow}, sift {sift}"
        for other in (*KINDS[1:], "truth"):
            if pair["ours"] is not None and pair[other] is not None:
                deg, cm = difference(pair["ours"], pair[other])
                words += f"  {other} {deg:.4f} deg {cm:.3f} cm"
        print(words if pair["accepted"] else words + "  refused")
    sets["all pairs of neighbouring frames"] = [pair for name in CHAINED for pair in sets[name]]
    for name, pairs in sets.items():
        report(name, pairs, arguments.out)


if __name__ == "__main__":
    main()
