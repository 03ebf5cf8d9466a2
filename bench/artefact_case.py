#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Copies a case with something wrong in its measurement or model, for bench/artefact_trials.sh.

    artefact_case.py CASE COPY none|shift|outliers|dilated|stiff_poisson

shift      the supine scan moved by 3 mm along (1, 1, 1) and turned by 3 degrees about (1, -1, 1) through its centroid
outliers   every twentieth point of it moved by 5 mm along the direction from its centroid, in and out by turns
dilated    labels grown into the air by half a voxel (on a grid of half the spacing)
stiff_poisson   poisson_ratio = 0.49 in model.toml
"""

import gzip
import math
import pathlib
import re
import shutil
import sys


def rotated(p, axis, angle):
    c, s = math.cos(angle), math.sin(angle)
    dot = sum(a * b for a, b in zip(axis, p))
    cross = (axis[1] * p[2] - axis[2] * p[1], axis[2] * p[0] - axis[0] * p[2], axis[0] * p[1] - axis[1] * p[0])
    return [c * p[i] + s * cross[i] + (1 - c) * dot * axis[i] for i in range(3)]


def change_scan(file, change):
    """change(row, p, centroid) of every vertex of an ASCII PLY."""
    lines = file.read_text().split("\n")
    count = int(next(line for line in lines if line.startswith("element vertex")).split()[2])
    first = lines.index("end_header") + 1
    points = [[float(x) for x in line.split()[:3]] for line in lines[first:first + count]]
    centroid = [sum(p[i] for p in points) / count for i in range(3)]
    for row, p in enumerate(points):
        lines[first + row] = " ".join("%.4f" % x for x in change(row, p, centroid))
    file.write_text("\n".join(lines))


def shift(row, p, centroid):
    axis = [1 / math.sqrt(3), -1 / math.sqrt(3), 1 / math.sqrt(3)]
    turned = rotated([p[i] - centroid[i] for i in range(3)], axis, math.radians(3))
    return [centroid[i] + turned[i] + 3 / math.sqrt(3) for i in range(3)]


def outlier(row, p, centroid):
    if row % 20:
        return p
    away = [p[i] - centroid[i] for i in range(3)]
    size = 5 * (1 if row % 40 else -1) / math.sqrt(sum(a * a for a in away))
    return [p[i] + size * away[i] for i in range(3)]


def dilate(file):
    header, data = file.read_bytes().split(b"\n\n", 1)
    text = header.decode()
    sizes = [int(n) for n in re.search(r"sizes: (.*)", text).group(1).split()]
    nx, ny, nz = sizes
    voxels = gzip.decompress(data)
    step = float(re.search(r"space directions: \(([-0-9.]+)", text).group(1))
    origin = [float(x) for x in re.search(r"space origin: \((.*)\)", text).group(1).split(",")]
    fine = bytearray()
    for z in range(nz):
        plane = bytearray()
        for y in range(ny):
            row = voxels[(z * ny + y) * nx:(z * ny + y + 1) * nx]
            double = bytearray(2 * nx)
            double[0::2] = row
            double[1::2] = row
            plane += double + double
        fine += plane + plane
    grown = (1, 2, 4)  # adipose, gland, skin
    for z in range(1, nz - 1):
        for y in range(1, ny - 1):
            base = (z * ny + y) * nx
            for x in range(1, nx - 1):
                if voxels[base + x]:
                    continue
                for axis, stride in ((0, 1), (1, nx), (2, nx * ny)):
                    for side in (0, 1):
                        label = voxels[base + x + (stride if side else -stride)]
                        if label in grown:
                            for a in (0, 1):
                                for b in (0, 1):
                                    f = [2 * x + a, 2 * y + a, 2 * z + a]
                                    others = [k for k in (0, 1, 2) if k != axis]
                                    f[others[0]] = 2 * (x, y, z)[others[0]] + a
                                    f[others[1]] = 2 * (x, y, z)[others[1]] + b
                                    f[axis] = 2 * (x, y, z)[axis] + side
                                    fine[(f[2] * 2 * ny + f[1]) * 2 * nx + f[0]] = label
    half = step / 2
    text = re.sub(r"sizes: .*", "sizes: %d %d %d" % (2 * nx, 2 * ny, 2 * nz), text)
    text = re.sub(r"space directions: .*", "space directions: (%g,0,0) (0,%g,0) (0,0,%g)" % (half, half, half), text)
    text = re.sub(r"space origin: .*", "space origin: (%g,%g,%g)" % tuple(o - half / 2 for o in origin), text)
    file.write_bytes(text.encode() + b"\n\n" + gzip.compress(bytes(fine), 1))


def main():
    case, copy, kind = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    copy.mkdir(parents=True)
    for file in case.iterdir():
        if file.is_file():
            shutil.copyfile(file, copy / file.name)
    if kind == "shift":
        change_scan(copy / "supine.ply", shift)
    elif kind == "outliers":
        change_scan(copy / "supine.ply", outlier)
    elif kind == "dilated":
        dilate(copy / "labels.nrrd")
    elif kind == "stiff_poisson":
        model = copy / "model.toml"
        text, count = re.subn(r"poisson_ratio = [0-9.]+", "poisson_ratio = 0.49", model.read_text())
        if count != 1:
            sys.exit("%s has no plain poisson_ratio" % model)
        model.write_text(text)
    elif kind != "none":
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
