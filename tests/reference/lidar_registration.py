"""The lidar pair registered by another program: point to plane with a k-d tree, all around and by quarters of the horizon.

    python tests/reference/lidar_registration.py FOLDER > tests/reference/lidar_registration.json

FOLDER holds source.ply, target.ply and T_target_source.txt of the data set lidar-pair-registration. Needs numpy and scipy.
Clouds are thinned to cubes of 25 cm; normals are those of 12 neighbours; weights are Cauchy's with the median's scale.
What is written are the distances from T: of the translation (mm) and of the attitude (mrad). By quarters they are far larger
than all around, because the scanner stood on a moving car: what a quarter shows was measured at another time.
"""

import json
import sys
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

FOLDER = Path(sys.argv[1])


def cloud(name):
    data = (FOLDER / name).read_bytes()
    start = data.index(b"end_header\n") + len(b"end_header\n")
    points = np.frombuffer(data[start:], dtype="<f4").reshape(-1, 4)[:, :3].astype(float)
    cell = np.unique(np.floor(points / 0.25).astype(int), axis=0, return_inverse=True)[1].ravel()
    count = np.bincount(cell)
    return np.stack([np.bincount(cell, points[:, k]) / count for k in range(3)], 1)


def register(source, target, normals, tree):
    motion = np.eye(4)
    for step in range(60):
        points = source @ motion[:3, :3].T + motion[:3, 3]
        distance, nearest = tree.query(points, distance_upper_bound=1.0 if step < 10 else 0.5)
        near = np.isfinite(distance)
        points, nearest = points[near], nearest[near]
        normal = normals[nearest]
        residual = ((points - target[nearest]) * normal).sum(1)
        scale = 1.4826 * np.median(abs(residual))
        weight = 1 / (1 + (residual / (2.385 * scale)) ** 2)
        gradient = np.hstack([normal, np.cross(points, normal)])
        weighted = gradient * weight[:, None]
        change = np.linalg.solve(weighted.T @ gradient, -weighted.T @ residual)
        update = np.eye(4)
        update[:3, :3] = Rotation.from_rotvec(change[3:]).as_matrix()
        update[:3, 3] = change[:3]
        motion = update @ motion
        if abs(change).max() < 1e-6:
            break
    return motion


source, target = cloud("source.ply"), cloud("target.ply")
truth = np.loadtxt(FOLDER / "T_target_source.txt")
tree = cKDTree(target)
around = target[tree.query(target, k=12)[1]]
around -= around.mean(1, keepdims=True)
normals = np.linalg.eigh(np.einsum("nki,nkj->nij", around, around))[1][:, :, 0]
azimuth = np.degrees(np.arctan2(source[:, 1], source[:, 0]))
rows = []
for centre in [None, 0, 90, 180, 270]:
    here = np.full(len(source), True) if centre is None else abs((azimuth - centre + 180) % 360 - 180) < 52
    found = register(source[here], target, normals, tree)
    turn = Rotation.from_matrix(truth[:3, :3].T @ found[:3, :3])
    rows.append(
        {
            "centre_deg": centre,
            "error_mm": round(float(np.linalg.norm(found[:3, 3] - truth[:3, 3]) * 1e3), 1),
            "error_mrad": round(float(turn.magnitude() * 1e3), 1),
        }
    )
print(json.dumps(rows, indent=1))
