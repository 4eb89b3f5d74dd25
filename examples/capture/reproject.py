#!/usr/bin/env python3
"""Reads a capture and projects the depth of one frame into another.

    enfilade capture scene.glb path.txt --out DIR
    python3 reproject.py DIR [FIRST SECOND]

Prints how many pixels of FIRST are seen again in SECOND and how well their depths agree. Needs NumPy.
"""
import json
import pathlib
import sys

import numpy as np


def load(folder, frame):
    """Depth in metres (NaN: nothing), ids, world-from-camera and pixel-from-camera of a frame."""
    described = json.loads((folder / "transforms.json").read_text())
    shot = described["frames"][frame]
    lens = {key: shot.get(key, described.get(key)) for key in ("fl_x", "fl_y", "cx", "cy")}
    depth = np.load(folder / shot["depth_file_path"])
    ids = np.load(folder / shot["ids_file_path"])
    return depth, ids, np.array(shot["transform_matrix"]), lens


def world_points(depth, matrix, lens):
    """The world point of each pixel's centre, height x width x 3."""
    rows, columns = np.indices(depth.shape) + 0.5
    camera = np.stack([(columns - lens["cx"]) / lens["fl_x"] * depth,
                       -(rows - lens["cy"]) / lens["fl_y"] * depth, -depth, np.ones_like(depth)], -1)
    return (camera @ matrix.T)[..., :3]


def project(points, matrix, lens):
    """Column, row and z-distance of world points in a picture."""
    camera = (points - matrix[:3, 3]) @ matrix[:3, :3]
    z = -camera[..., 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        column = lens["fl_x"] * camera[..., 0] / z + lens["cx"]
        row = -lens["fl_y"] * camera[..., 1] / z + lens["cy"]
    return column, row, z


def plane_depth(depth, column, row):
    """Depth at places between pixel centres, by bilinear 1 / z, which is exact on a plane."""
    x, y = column - 0.5, row - 0.5
    x0 = np.clip(np.floor(x).astype(int), 0, depth.shape[1] - 2)
    y0 = np.clip(np.floor(y).astype(int), 0, depth.shape[0] - 2)
    fx, fy = x - x0, y - y0
    inverse = 1 / depth
    top = (1 - fx) * inverse[y0, x0] + fx * inverse[y0, x0 + 1]
    bottom = (1 - fx) * inverse[y0 + 1, x0] + fx * inverse[y0 + 1, x0 + 1]
    return 1 / ((1 - fy) * top + fy * bottom), (x0, y0)


def main():
    folder = pathlib.Path(sys.argv[1])
    first, second = (int(n) for n in sys.argv[2:4]) if len(sys.argv) > 3 else (0, 1)
    depth, ids, matrix, lens = load(folder, first)
    depth2, ids2, matrix2, lens2 = load(folder, second)
    column, row, z = project(world_points(depth, matrix, lens), matrix2, lens2)
    height, width = depth2.shape
    inside = (z > 0) & (column >= 1) & (column < width - 1) & (row >= 1) & (row < height - 1)
    column, row, z, ids = column[inside], row[inside], z[inside], ids[inside]
    there, (x0, y0) = plane_depth(depth2, column, row)
    # Of the same object at all four pixels around: neither hidden nor at an edge of it.
    same = np.ones(ids.shape, bool)
    for dy in (0, 1):
        for dx in (0, 1):
            same &= ids2[y0 + dy, x0 + dx] == ids
    error = np.abs(there[same] - z[same])
    print(json.dumps({"pixels": int(inside.size), "in_view": int(inside.sum()),
                      "seen_again": int(same.sum()), "median_mm": float(1e3 * np.median(error)),
                      "p99_mm": float(1e3 * np.percentile(error, 99)),
                      "within_2_mm": float(np.mean(error < 2e-3))}))


main()
