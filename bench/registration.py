#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Table of what bench_registration measured (docs/verification.md).

    bench/registration.py RESULTS.jsonl ...
"""
import json
import sys
from statistics import median

WHAT = {"landmarks": "landmarks on the skin, model", "skin": "model alone", "support": "landmarks, model, support seen",
        "rigid": "four bony landmarks, model"}


def row(name, draws):
    found = [d for d in draws if "refused" not in d]
    if not found:
        return f"| {name} | 0 | | | | | {len(draws)} |"
    errors = sorted(d["error_mm"] for d in found)
    inside = sum(d["inside"] for d in found)
    within = sum(e <= 2 for e in errors)
    return (f"| {name} | {len(found)} | {median(errors):.1f} | {errors[-1]:.1f} | {within} | {inside} "
            f"({100 * inside / len(found):.0f} %) | {len(draws) - len(found)} |")


def main():
    if len(sys.argv) < 2:
        print(__doc__, file=sys.stderr)
        return 2
    draws = [json.loads(line) for file in sys.argv[1:] for line in open(file)]
    print("| | draws | error, median mm | largest | ≤ 2 mm | in the 95 % region | refused |\n|---|---|---|---|---|---|---|")
    for kind, name in WHAT.items():
        print(row(name, [d for d in draws if d["kind"] == kind]))
    print("\n| case | draws | error, median mm | largest | ≤ 2 mm | in the 95 % region | refused |\n|---|---|---|---|---|---|---|")
    for case in sorted({d["case"] for d in draws}):
        print(row(case, [d for d in draws if d["case"] == case]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
