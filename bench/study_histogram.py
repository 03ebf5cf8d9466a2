#!/usr/bin/python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Draws the errors of sensitivity.csv files (supine-sensitivity) as histograms over each other.

    bench/study_histogram.py out.png sensitivity.csv ...
"""
import csv
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np


def errors(file):
    with open(file, newline="") as stream:
        return [float(r["mae_study_mm"]) for r in csv.DictReader(stream) if r["failed"] == "0"]


def main(picture, *files):
    samples = {pathlib.Path(f).stem.removeprefix("sensitivity_"): errors(f) for f in files}
    bins = np.linspace(0, max(map(max, samples.values())), 41)
    figure, axes = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
    for name, sample in samples.items():
        axes.hist(sample, bins=bins, alpha=0.55, label=f"{name}: {np.mean(sample):.2f} ± {np.std(sample, ddof=1):.2f} mm")
    axes.set(xlabel="MAE model to scan, mm", ylabel="draws")
    axes.legend()
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
