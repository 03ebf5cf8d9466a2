#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""What stated probabilities would be if the scans counted for a share of what they say.

Of every effect the odds move from the prior's by ALPHA of what they did: ln odds = prior + ALPHA (stated - prior).
Log score per effect (clipped), stated probabilities against frequencies, and names at 0.95.

    bench/hidden_tempered.py docs/hidden-evidence-{8,9,10,11}.jsonl
"""

import argparse
import math
import pathlib

from hidden_plan import EFFECTS
from hidden_probability import log_score, reliability, statements
from hidden_score import scored_before

PRIOR = (0.3 + 2 * 0.15 + 3 * 0.05) / len(EFFECTS)  # of each effect, default --prior
EDGES = (0, 0.05, 0.2, 0.5, 0.8, 0.95, 1)


def logit(p):
    p = min(max(p, 1e-12), 1 - 1e-12)
    return math.log(p / (1 - p))


def tempered(p, alpha):
    return 1 / (1 + math.exp(-(logit(PRIOR) + alpha * (logit(p) - logit(PRIOR)))))


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("rows", nargs="+", type=pathlib.Path)
    options.add_argument("--alpha", type=float, nargs="+", default=[1, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3])
    asked = options.parse_args()
    stated = statements(scored_before(asked.rows))
    print(f"{len(stated)} statements")
    for alpha in asked.alpha:
        said = [(effect, tempered(p, alpha), true) for effect, p, true in stated]
        named = [true for _, p, true in said if p >= 0.95]
        score = sum(log_score(p, true) for _, p, true in said) / len(said)
        print(f"alpha {alpha:g}: log score {score:.3f}; named {len(named)}, of these true {sum(named)}")
        for low, high, number, mean, there in reliability(said, EDGES):
            print(f"    {low:4.2f} to {high:4.2f}: {number:5d} stated, {mean:.3f} in the mean, {there:.3f} true")


if __name__ == "__main__":
    main()
