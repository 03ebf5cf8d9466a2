#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Scores diagnoses against sealed answers: confusion matrix, rates with 95 % Wilson intervals, stated probabilities.

    bench/hidden_score.py ANSWERS RESULTS [-o SCORE]
    bench/hidden_score.py ROWS.jsonl [MORE.jsonl ...] [-o SCORE]

ANSWERS/NAME.json is what supine-phantom sealed, RESULTS/NAME/diagnosis.json what any tool said (docs/hidden.md has the
keys it needs). Prints the tables; with -o writes SCORE.md, SCORE.csv (a row per case), SCORE.json and SCORE.jsonl (all
that is scored of each case). The second form scores rows that bench/hidden.py or -o wrote; each set has its own tables.
"""

import argparse
import csv
import json
import pathlib
import statistics

import hidden_probability
from hidden_case import read_case
from hidden_rates import confusion, count, outcome, rate, rates, wilson


def matrix_text(rows):
    last = ["in set", "wrong set", "unexplained", "nothing_missing", "failed"]
    columns = sorted({said for row in rows.values() for said in row} - set(last)) + last
    lines = ["| truth | n | " + " | ".join(columns) + " |", "|---" * (len(columns) + 2) + "|"]
    order = sorted(rows, key=lambda truth: (truth == "nothing", truth.endswith("(outside)"),
                                            ("two effects", "three effects").index(truth) + 1
                                            if truth in ("two effects", "three effects") else 0, truth))
    for truth in order:
        row = rows[truth]
        cells = [f"**{row[c]}**" if c == truth and c in row else str(row.get(c, "")) for c in columns]
        lines.append(f"| {truth} | {sum(row.values())} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def seconds_text(cases):
    names = ("phantom", "mesh", "calibrate", "diagnose")
    columns = {name: [case["seconds"][name] for case in cases if name in case["seconds"]] for name in names}
    parts = [f"{name} {statistics.median(values):.0f}" for name, values in columns.items() if values]
    return "User seconds per case, median: " + ", ".join(parts) + "." if parts else ""


def program_text(cases):
    known = sorted({f"{case['version']} ({case['commit']})" for case in cases if case.get("version")})
    return f"Program: {', '.join(known)}." if known else ""


def set_text(cases):
    kinds = ", ".join(f"{number} {name}" for number, kind, name in
                      ((count(cases, lambda c, k=kind: c["kind"] == k), kind, name) for kind, name in
                       (("effect", "with one effect"), ("null", "without any"), ("two", "with two"),
                        ("three", "with three"), ("outside", "from outside the catalogue")))
                      if number or kind != "three")
    lines = [f"{len(cases)} cases: {kinds}.", "", matrix_text(confusion(cases)), "",
             "| rate | hits/cases = % [95 % Wilson interval] |", "|---|---|"]
    lines += [f"| {what} | {rate(hits, total)} |" for what, hits, total in rates(cases) if total]
    more = [hidden_probability.text_of(cases), seconds_text(cases), program_text(cases)]
    return "\n".join(lines + ["", *(f"{part}\n" for part in more if part)])


def by_set(cases):
    sets = {}
    for case in cases:
        sets.setdefault(case.get("set", "mixture"), []).append(case)
    return sets


def text_of(cases):
    sets = by_set(cases)
    if len(sets) == 1:
        return set_text(cases)
    return "\n".join(f"## {name}\n\n{set_text(rows)}" for name, rows in sets.items())


def score(answers, results):
    found = [read_case(file, results) for file in sorted(answers.glob("*.json"))]
    return [case for case in found if case is not None]


def write_csv(cases, file):
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(["set", "case", "seed", "kind", "truth", "verdict", "named", "outcome", "power", "p", "intervals"])
    for case in cases:
        spans = "; ".join(f"{name} {truth:.3g} in [{low:.3g}, {high:.3g}]" for name, truth, low, high in
                          case["intervals"])
        writer.writerow([case.get("set", "mixture"), case["case"], case["seed"], case["kind"], "+".join(case["causes"]),
                         case["verdict"], "+".join(case["missing"]), outcome(case), case["power"], case["p"], spans])


def document(cases):
    stated = hidden_probability.statements(cases)
    probabilities = {} if not stated else {
        "expected_calibration_error": hidden_probability.calibration_error(stated),
        "reliability": [dict(zip(("from", "to", "statements", "mean_stated", "was_there"), row))
                        for row in hidden_probability.reliability(stated)],
        "log_scores": {effect: row[2] for effect, row in hidden_probability.log_scores(stated).items()}}
    return {"cases": len(cases), "confusion": confusion(cases),
            "rates": [{"rate": what, "hits": hits, "of": total, "interval95": wilson(hits, total)}
                      for what, hits, total in rates(cases)], **probabilities}


def write(cases, target):
    with open(f"{target}.csv", "w", newline="", encoding="utf-8") as file:
        write_csv(cases, file)
    lines = "".join(json.dumps(case) + "\n" for case in cases)
    pathlib.Path(f"{target}.jsonl").write_text(lines, encoding="utf-8")
    sets = {name: document(rows) for name, rows in by_set(cases).items()}
    pathlib.Path(f"{target}.json").write_text(json.dumps(sets, indent=1) + "\n", encoding="utf-8")
    pathlib.Path(f"{target}.md").write_text(text_of(cases), encoding="utf-8")


def key_of(case):
    return case.get("set", "mixture"), case["seed"], case["case"]


def scored_before(files):
    """Rows of earlier runs; of a case in several the last."""
    cases = {}
    for file in files:
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
            try:
                case = json.loads(line)
                cases[key_of(case)] = case
            except (ValueError, KeyError, TypeError) as error:
                raise SystemExit(f"{file}:{number}: no row of the benchmark ({error!r}); delete the line") from error
    return [cases[key] for key in sorted(cases)]


def tell(cases, target):
    if target is not None:
        write(cases, target)
    print(text_of(cases))


def report(answers, results, target=None):
    cases = score(answers, results)
    if not cases:
        raise SystemExit(f"no diagnosis in {results} for any answer in {answers}")
    tell(cases, target)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("paths", type=pathlib.Path, nargs="+", metavar="PATH",
                        help="ANSWERS RESULTS, or ROWS.jsonl ...")
    parser.add_argument("-o", dest="target", type=pathlib.Path, help="write SCORE.md, .csv, .json and .jsonl")
    options = parser.parse_args()
    if all(path.is_file() for path in options.paths):
        tell(scored_before(options.paths), options.target)
    elif len(options.paths) == 2:
        report(*options.paths, options.target)
    else:
        parser.error("two folders, or files of rows")


if __name__ == "__main__":
    main()
