#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""What stated probabilities would be if the scans counted for a share of what they say.

Of every effect the odds move from the prior's by ALPHA of what they did: ln odds = prior + ALPHA (stated - prior).
Log score per effect (clipped at 0.001), stated probabilities against frequencies, and names at 0.95.

    bench/hidden_tempered.py docs/hidden-evidence-{8,9,10,11}.jsonl
"""

import argparse
import json
import math

EFFECTS = 17
PRIOR = (0.3 + 2 * 0.15 + 3 * 0.05) / EFFECTS  # of each effect, default --prior
EDGES = (0, 0.05, 0.2, 0.5, 0.8, 0.95, 1.001)


def logit(p):
    p = min(max(p, 1e-12), 1 - 1e-12)
    return math.log(p / (1 - p))


def tempered(p, alpha):
    return 1 / (1 + math.exp(-(logit(PRIOR) + alpha * (logit(p) - logit(PRIOR)))))


def statements(files):
    """(probability, whether it was drawn) of every effect that counts."""
    found = []
    for file in files:
        with open(file, encoding="utf-8") as lines:
            rows = [json.loads(line) for line in lines]
        for row in rows:
            drawn = set(row.get("drawn") or row["causes"])
            found += [(p, effect in drawn) for effect, p in (row.get("included") or {}).items()
                      if effect not in row.get("neither", [])]
    return found


def log_score(said):
    clipped = [(min(max(p, 0.001), 0.999), true) for p, true in said]
    return -sum(math.log(p if true else 1 - p) for p, true in clipped) / len(clipped)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("rows", nargs="+")
    options.add_argument("--alpha", type=float, nargs="+", default=[1, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3])
    asked = options.parse_args()
    stated = statements(asked.rows)
    print(f"{len(stated)} statements")
    for alpha in asked.alpha:
        said = [(tempered(p, alpha), true) for p, true in stated]
        named = [true for p, true in said if p >= 0.95]
        print(f"alpha {alpha:g}: log score {log_score(said):.3f}; named {len(named)}, of these true {sum(named)}")
        for low, high in zip(EDGES, EDGES[1:]):
            there = [(p, true) for p, true in said if low <= p < high]
            if there:
                print(f"    {low:4.2f} to {min(high, 1):4.2f}: {len(there):5d} stated, "
                      f"{sum(p for p, _ in there) / len(there):.3f} in the mean, "
                      f"{sum(t for _, t in there) / len(there):.3f} true")


if __name__ == "__main__":
    main()
