#!/usr/bin/python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Draws error_map.csv (supine-calibrate --map) as a picture, with answers of calibration.json files on it.

    bench/study_ridge.py error_map.csv out.png truth.json [calibration.json ...]
"""
import csv
import json
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import FormatStrFormatter


def read_map(file):
    with open(file, newline="") as stream:
        rows = list(csv.DictReader(stream))
    names = list(rows[0])[:2]
    x = sorted({float(r[names[0]]) for r in rows})
    y = sorted({float(r[names[1]]) for r in rows})
    mae = np.full((len(y), len(x)), np.nan)
    for r in rows:
        if r["failed"] == "0":
            mae[y.index(float(r[names[1]])), x.index(float(r[names[0]]))] = float(r["mae_study_mm"])
    return x, y, mae


def read_json(file):
    with open(file) as stream:
        return json.load(stream)


def main(map_file, picture, truth_file, *answers):
    x, y, mae = read_map(map_file)
    figure, axes = plt.subplots(figsize=(6.4, 4.8), layout="constrained")
    levels = np.geomspace(np.nanmin(mae), np.nanmax(mae), 16)
    filled = axes.contourf(x, y, mae, levels=levels, cmap="viridis_r")
    figure.colorbar(filled, label="MAE model to scan, mm", format="%.2f")
    seen = set()
    for result in map(read_json, answers):
        fitted = [p["value"] for p in result["parameters"][:2]]
        cmaes = result["method"] == "cmaes"
        name = None if cmaes in seen else "CMA-ES, each start and seed" if cmaes else "least squares, each start"
        seen.add(cmaes)
        axes.plot(*fitted, "k." if cmaes else "r*", markersize=5 if cmaes else 11, label=name)
    truth = read_json(truth_file)["parameters"]
    axes.plot(truth["Eb"], truth["Es"], "w+", markersize=12, markeredgewidth=2, label="truth")
    axes.set(xscale="log", yscale="log", xlabel="E breast, kPa", ylabel="E skin, kPa", xlim=(x[0], x[-1]),
             ylim=(y[0], y[-1]))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FormatStrFormatter("%g"))
    legend = axes.legend(loc="upper right", facecolor="0.6")
    legend.get_frame().set_alpha(0.8)
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
