# SPDX-License-Identifier: AGPL-3.0-or-later
"""Stated probabilities against what was there: reliability curve, expected calibration error, log score."""

import math

CLIP = 0.001  # stated probabilities are taken as no closer to 0 and 1 than this
EDGES = (0, 0.01, 0.03, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 1)


def statements(cases):
    """(effect, probability stated, whether it was drawn, however small) of all effects of all cases."""
    return [(effect, probability, effect in case["drawn"])
            for case in cases for effect, probability in case.get("included", {}).items()
            if effect not in case["neither"]]


def reliability(stated, edges=EDGES):
    """(from, to, number, mean probability stated, share that was there) of each bin that has any."""
    curve = []
    for low, high in zip(edges, edges[1:]):
        rows = [row for row in stated if low <= row[1] < high or row[1] == high == 1]
        if rows:
            curve.append((low, high, len(rows), sum(row[1] for row in rows) / len(rows),
                          sum(row[2] for row in rows) / len(rows)))
    return curve


def calibration_error(stated):
    """Mean over all statements of |mean stated - share that was there| of their bin."""
    return sum(number * abs(mean - share) for _, _, number, mean, share in reliability(stated)) / len(stated)


def log_score(probability, true):
    """-ln of the probability given to what is the case, clipped; 0 is best."""
    clipped = min(max(probability, CLIP), 1 - CLIP)
    return -math.log(clipped if true else 1 - clipped)


def log_scores(stated):
    """{effect: (number of statements, how often it was there, mean log score)}."""
    by_effect = {}
    for effect, probability, true in stated:
        by_effect.setdefault(effect, []).append((log_score(probability, true), true))
    return {effect: (len(rows), sum(true for _, true in rows), sum(score for score, _ in rows) / len(rows))
            for effect, rows in sorted(by_effect.items())}


def constant_score(stated):
    """Mean log score of saying for every effect how often effects were there at all: what has to be beaten."""
    share = sum(true for _, _, true in stated) / len(stated)
    return sum(log_score(share, true) for _, _, true in stated) / len(stated)


def set_score(cases):
    """(number, mean of -ln of the probability given to exactly the set that was drawn, clipped) or None."""
    given = [case["set_probability"] for case in cases if case.get("set_probability") is not None]
    return (len(given), sum(log_score(p, True) for p in given) / len(given)) if given else None


def text_of(cases):
    """The tables, or nothing where no probabilities are stated."""
    stated = statements(cases)
    if not stated:
        return ""
    mean = sum(log_score(p, true) for _, p, true in stated) / len(stated)
    lines = ["| stated | statements | mean stated | was there |", "|---|---|---|---|"]
    lines += [f"| {low:g} to {high:g} | {number} | {said:.3f} | {share:.3f} |"
              for low, high, number, said, share in reliability(stated)]
    lines += ["", f"Expected calibration error {calibration_error(stated):.4f}. Mean log score per effect {mean:.4f}; "
                  f"{constant_score(stated):.4f} by stating the mean share for all."]
    whole = set_score(cases)
    if whole:
        lines.append(f"Mean log score of the whole set {whole[1]:.3f} ({whole[0]} cases).")
    lines += ["", "| effect | statements | was there | mean log score |", "|---|---|---|---|"]
    lines += [f"| {effect} | {number} | {there} | {score:.4f} |"
              for effect, (number, there, score) in log_scores(stated).items()]
    return "\n".join(lines)
