#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Tables of docs/verification.md from the CSV files of bench_robustness.

    bench/robustness_table.py FOLDER
"""

import collections
import csv
import pathlib
import re
import sys


def rows_of(folder):
    for file in sorted(pathlib.Path(folder).glob("shape_*.csv")):
        with open(file) as text:
            yield from csv.DictReader(text)


def share(part, whole):
    return f"{part}/{whole} ({100 * part / whole:.1f} %)" if whole else "–"


def line(label, rows):
    exists = [row for row in rows if row["fine_found"] == "1"]
    found = [row for row in exists if row["found"] == "1"]
    certified = [row for row in found if row["certified"] == "1"]
    seconds = sorted(float(row["cpu_seconds"]) for row in rows)
    print(f"| {label} | {len(rows)} | {len(exists)} | {share(len(found), len(exists))} | "
          f"{share(len(certified), len(found))} | {sum(row['wrong'] == '1' for row in rows)} | "
          f"{seconds[len(seconds) // 2]:.2f} / {seconds[int(0.95 * (len(seconds) - 1))]:.2f} |")


def grouped(title, rows, key):
    print(f"\n| {title} | runs | have an equilibrium | found at default | of these the round trip closes | wrong without "
          "a word | CPU s, median / 95 % |\n|---|---|---|---|---|---|---|")
    groups = collections.defaultdict(list)
    for row in rows:
        groups[key(row)].append(row)
    for label in sorted(groups):
        line(label, groups[label])
    line("all", rows)


def load_class(row):
    value = float(row["load_number"])
    for bound in (0.25, 0.5, 1, 2, 4):
        if value < bound:
            return f"ρgH/E < {bound}"
    return "ρgH/E ≥ 4"


def failures(rows):
    names = collections.Counter()
    for row in rows:
        if row["words"]:
            name = re.sub(r"[-+]?[0-9][0-9.e+-]*", "#", row["words"].split("; smallest")[0].split(". A softer")[0])
            names[name] += 1
    print("\n| what was said | runs |\n|---|---|")
    for name, count in names.most_common():
        print(f"| {name[:160]} | {count} |")
    unnamed = [row for row in rows if row["found"] == "0" and not row["words"]]
    print(f"\nFailures without a word: {len(unnamed)}. CPU seconds in all, default options: "
          f"{sum(float(row['cpu_seconds']) for row in rows):.0f}.")


def main():
    rows = list(rows_of(sys.argv[1]))
    grouped("load number", rows, load_class)
    grouped("law", rows, lambda row: row["law"])
    failures(rows)
    for row in rows:
        if row["wrong"] == "1":
            print("WRONG", dict(row))


if __name__ == "__main__":
    main()
