#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""One line for each group of rows that bench/hidden.py wrote: what was named, rightly and wrongly, and what held.

    bench/hidden_pooled.py --group "from the priors" docs/hidden-evidence-1[2345].jsonl [--group NAME ROWS.jsonl ...]
"""

import argparse
import pathlib
import statistics

from hidden_probability import constant_score, log_score, statements
from hidden_rates import count, held, is_outcome, rate
from hidden_score import by_set, scored_before

COLUMNS = ("cases", "**with a cause**", "named, rightly", "in the set", "wrong name", "wrong set", "no name",
           "no answer", "**without**", "wrong name", "wrong set", "no name", "no answer", "places held, %",
           "log score (mean shares)", "seconds")


def of_causes(cases):
    return [len(cases), count(cases, is_outcome("right")), count(cases, is_outcome("in set")), *of_nulls(cases)[1:]]


def of_nulls(cases):
    quiet = ("unexplained", "nothing_missing", "neither")
    return [len(cases), *(count(cases, is_outcome(*outcomes))
                          for outcomes in (("wrong",), ("wrong set",), quiet, ("failed",)))]


def share(rows):
    """Of intervals that hold the truth."""
    hits, total = held(rows)
    return rate(hits, total).split("= ")[-1].replace(" %", "") if total else ""


def line_of(cases):
    nulls = [case for case in cases if case["kind"] == "null"]
    places = [row for case in cases for row in case.get("places", [])]
    stated = statements(cases)
    score = statistics.mean(log_score(p, there) for _, p, there in stated) if stated else None
    seconds = [case["seconds"]["diagnose"] for case in cases if "diagnose" in case["seconds"]]
    return [len(cases), *of_causes([case for case in cases if case["kind"] != "null"]), *of_nulls(nulls), share(places),
            f"{score:.3f} ({constant_score(stated):.3f})" if stated else "",
            f"{statistics.median(seconds):.0f}" if seconds else ""]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--group", nargs="+", action="append", required=True, metavar=("NAME", "ROWS.jsonl"),
                        help="a name, and files of rows")
    groups = parser.parse_args().group
    for name, *files in groups:
        if not files:
            parser.error(f"--group {name}: no file of rows")
    print("| | " + " | ".join(COLUMNS) + " |\n|" + "---|" * (len(COLUMNS) + 1))
    for name, *files in groups:
        sets = by_set(scored_before([pathlib.Path(file) for file in files]))
        for kind, cases in sets.items():
            label = name if len(sets) == 1 else f"{name}, {kind}"
            print(f"| {label} | " + " | ".join(str(cell) if cell != 0 else "" for cell in line_of(cases)) + " |")


if __name__ == "__main__":
    main()
