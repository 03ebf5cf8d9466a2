#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Holds the displacements another solver printed against those of Supine.

    compare_displacements.py RESULT POSE_displacement.csv

RESULT has lines "node ux uy uz", blanks or commas between: CalculiX's .dat, FEBio's POSE_febio_u.csv. The last line of a
node counts. Standard library alone.
"""

import csv
import math
import sys


def last_rows(path):
    rows = {}
    with open(path) as text:
        for line in text:
            words = line.replace(",", " ").split()
            if len(words) == 4 and words[0].isdigit():
                rows[int(words[0])] = [float(word) for word in words[1:]]
    return rows


def main():
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    theirs = last_rows(sys.argv[1])
    with open(sys.argv[2]) as table:
        ours = {int(row["node"]): [float(row[key]) for key in ("ux_mm", "uy_mm", "uz_mm")] for row in csv.DictReader(table)}
    missing = [node for node in ours if node not in theirs]
    if missing:
        print(f"{sys.argv[1]}: no displacement of node {missing[0]} and {len(missing) - 1} others: did the solver converge?",
              file=sys.stderr)
        return 1
    distances = {node: math.dist(theirs[node], u) for node, u in ours.items()}
    worst = max(distances, key=distances.get)
    rms = math.sqrt(sum(d * d for d in distances.values()) / len(distances))
    print(f"{len(ours)} nodes, moved at most {max(math.hypot(*u) for u in ours.values()):.2f} mm: "
          f"differ by {distances[worst]:.2g} mm at most (node {worst}), {rms:.2g} mm RMS")
    return 0


if __name__ == "__main__":
    sys.exit(main())
