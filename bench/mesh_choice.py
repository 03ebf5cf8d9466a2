#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Draws what bench/mesh_choice.sh measured: skin difference to the finest mesh against face count, one line per kind.

    bench/mesh_choice.py WORK/mesh_choice.csv PLOT.png        (needs python3-matplotlib)
"""

import csv
import sys

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt

NAMES = {"linear": "linear", "graded": "linear, short edges where the skin ends", "quadratic": "quadratic, bent",
         "by-error": "linear, sized by error", "both-half": "quadratic, bent, half edges where the skin ends"}


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.2), sharex=True)
    for kind, name in NAMES.items():
        some = [row for row in rows if row["kind"].startswith(kind) and float(row["surface_rms_mm"]) > 1e-6]
        some.sort(key=lambda row: int(row["triangles"]))
        if not some:
            continue
        faces = [int(row["triangles"]) for row in some]
        for axis, key in zip(axes, ("surface_rms_mm", "marks_rms_mm")):
            axis.loglog(faces, [float(row[key]) for row in some], "o-", label=name)
    for axis, title in zip(axes, ("supine skin, surface to surface", "marks on the skin")):
        axis.set_title(title)
        axis.set_xlabel("boundary triangles")
        axis.set_ylabel("RMS to the reference, mm")
        axis.grid(True, which="both", alpha=0.3)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncol=3)
    figure.tight_layout(rect=(0, 0.1, 1, 1))
    figure.savefig(sys.argv[2], dpi=120)


if __name__ == "__main__":
    main()
