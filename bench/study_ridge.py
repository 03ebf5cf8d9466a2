#!/usr/bin/python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Draws error_map.csv (supine-calibrate --map) as a picture, with the answers of calibration.json files on it.

    bench/study_ridge.py error_map.csv out.png [calibration.json ...]
"""
import csv
import json
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np


def main(map_file, picture, *answers):
    with open(map_file, newline="") as stream:
        rows = list(csv.DictReader(stream))
    names = list(rows[0])[:2]
    x = sorted({float(r[names[0]]) for r in rows})
    y = sorted({float(r[names[1]]) for r in rows})
    mae = np.full((len(y), len(x)), np.nan)
    for r in rows:
        if r["failed"] == "0":
            mae[y.index(float(r[names[1]])), x.index(float(r[names[0]]))] = float(r["mae_study_mm"])
    figure, axes = plt.subplots(figsize=(6, 5), layout="constrained")
    levels = np.geomspace(np.nanmin(mae), np.nanmax(mae), 16)
    filled = axes.contourf(x, y, mae, levels=levels, cmap="viridis_r")
    figure.colorbar(filled, label="MAE model to scan, mm", format="%.2f")
    for answer in answers:
        with open(answer) as stream:
            result = json.load(stream)
        mark = "k." if result["method"] == "cmaes" else "r*"
        axes.plot(*[p["value"] for p in result["parameters"][:2]], mark, markersize=5)
    axes.set(xscale="log", yscale="log", xlabel=names[0], ylabel=names[1])
    figure.savefig(picture, dpi=130)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
