#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Scores diagnoses against sealed answers: confusion matrix and rates with 95 % Wilson intervals.

    bench/hidden_score.py ANSWERS RESULTS [-o SCORE]
    bench/hidden_score.py SCORE.jsonl [MORE.jsonl ...] [-o SCORE]

ANSWERS/NAME.json is what supine-phantom sealed, RESULTS/NAME/diagnosis.json what any tool said (docs/hidden.md has the
keys it needs). Prints the tables; with -o writes SCORE.md, SCORE.csv (a row per case), SCORE.json and SCORE.jsonl (all
that is scored of each case). The second form scores cases that were scored before, so that runs can be put together.
"""

import argparse
import csv
import json
import pathlib
import statistics

SEEN = 0.9  # power from which an effect counts as one that the data can see
# The phantom's region has another shape or place than the catalogue's: its size is not quite the same quantity.
RESHAPED = ("arm_traction", "chest_wall_motion", "ligament")
VERDICTS = ("nothing_missing", "missing", "ambiguous", "unexplained", "failed")


def wilson(hits, count):
    """95 % interval of a rate (Wilson 1927)."""
    if count == 0:
        return (0.0, 1.0)
    z = statistics.NormalDist().inv_cdf(0.975)
    middle = (hits + z * z / 2) / (count + z * z)
    half = z / (count + z * z) * (hits * (count - hits) / count + z * z / 4) ** 0.5
    return (max(0.0, middle - half), min(1.0, middle + half))


def rate(hits, count):
    if count == 0:
        return "0/0"
    low, high = wilson(hits, count)
    return f"{hits}/{count} = {100 * hits / count:.0f} % [{100 * low:.0f}, {100 * high:.0f}]"


def powers(diagnosis):
    found = {row["effect"]: row["power"] for row in diagnosis.get("cannot_see", []) if "power" in row}
    for row in diagnosis.get("candidates", []):
        if row.get("power") is not None:
            found[row["effect"]] = row["power"]
    return found


def intervals(answer, diagnosis):
    """(parameter, truth, low, high) of what the answer and the named effect's refit both have."""
    truth = {cause["name"]: cause["parameters"] for cause in answer["causes"] if not cause["outside"]}
    found = []
    for candidate in diagnosis.get("candidates", []):
        if candidate["effect"] not in diagnosis["missing"]:
            continue
        for row in candidate.get("parameters", []):
            name = row["name"].removeprefix(candidate["effect"] + ".")
            value = truth.get(candidate["effect"], {}).get(name)
            bounds = row.get("interval95")
            if value is not None and bounds and None not in bounds:
                found.append((f"{candidate['effect']}.{name}", value, bounds[0], bounds[1]))
    return found


def kind_of(answer):
    causes = answer["causes"]
    if not causes:
        return "null"
    if any(cause["outside"] for cause in causes):
        return "outside"
    return "two" if len(causes) == 2 else "effect"


def read_case(answer_file, results):
    """What is scored of one case, or None where there is no result yet."""
    answer = json.loads(answer_file.read_text())
    folder = results / answer_file.stem
    failed = (folder / "failed").exists()
    if not failed and not (folder / "diagnosis.json").exists():
        return None
    diagnosis = {"verdict": "failed", "missing": []} if failed else json.loads((folder / "diagnosis.json").read_text())
    if diagnosis["verdict"] not in VERDICTS:
        raise SystemExit(f"{folder}/diagnosis.json: verdict '{diagnosis['verdict']}' is none of {', '.join(VERDICTS)}")
    causes = [cause["name"] for cause in answer["causes"]]
    known = powers(diagnosis)
    seconds = folder / "seconds.json"
    p_values = [row["p_value"] for row in diagnosis.get("candidates", []) if row.get("p_value") is not None]
    moduli = []
    calibration = folder / "calibration.json"
    if calibration.exists():
        for row in json.loads(calibration.read_text()).get("parameters", []):
            if row["name"] in answer["base"] and row.get("interval95"):
                moduli.append((row["name"], answer["base"][row["name"]], *row["interval95"]))
    return {"case": answer_file.stem, "seed": answer["seed"], "kind": kind_of(answer), "causes": causes,
            "verdict": diagnosis["verdict"], "missing": list(diagnosis["missing"]),
            # An effect that a tool gives no power for counts as one it claims to see.
            "power": min((known.get(name, 1.0) for name in causes), default=None),
            "intervals": intervals(answer, diagnosis) if diagnosis["verdict"] != "failed" else [],
            "moduli": moduli, "p": min(p_values, default=None),
            "seconds": json.loads(seconds.read_text()) if seconds.exists() else {}}


def outcome(case):
    """How the verdict stands to the truth."""
    verdict, named, causes = case["verdict"], case["missing"], case["causes"]
    if verdict in ("nothing_missing", "failed", "unexplained"):
        return verdict
    inside = [name for name in named if name in causes]
    if verdict == "missing":
        return "right" if inside and len(inside) == len(named) else "wrong"
    return "in set" if inside else "wrong set"


def confusion(cases):
    """Rows: truth; columns: what was named alone, then the other outcomes."""
    rows = {}
    for case in cases:
        truth = {"null": "nothing", "two": "two effects"}.get(case["kind"], "".join(case["causes"]))
        if case["kind"] == "outside":
            truth += " (outside)"
        if case["verdict"] == "missing":
            said = "+".join(case["missing"])
        else:
            said = outcome(case)
        rows.setdefault(truth, {}).setdefault(said, 0)
        rows[truth][said] += 1
    return rows


def matrix_text(rows):
    last = ["in set", "wrong set", "unexplained", "nothing_missing", "failed"]
    columns = sorted({said for row in rows.values() for said in row} - set(last)) + last
    lines = ["| truth | n | " + " | ".join(columns) + " |", "|---" * (len(columns) + 2) + "|"]
    order = sorted(rows, key=lambda truth: (truth == "nothing", truth.endswith("(outside)"), truth == "two effects",
                                            truth))
    for truth in order:
        row = rows[truth]
        cells = [f"**{row[c]}**" if c == truth and c in row else str(row.get(c, "")) for c in columns]
        lines.append(f"| {truth} | {sum(row.values())} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def count(cases, wanted):
    return sum(1 for case in cases if wanted(case))


def rates(cases):
    """The table of rates: (what, hits, of how many)."""
    of = {kind: [case for case in cases if case["kind"] == kind] for kind in ("effect", "null", "two", "outside")}
    effect, null, two, outside = of["effect"], of["null"], of["two"], of["outside"]
    seen = [case for case in effect if case["power"] >= SEEN]
    sets = [case for case in effect if case["verdict"] == "ambiguous"]
    blamed = [case for case in effect if case["verdict"] in ("missing", "ambiguous")]
    is_outcome = lambda *names: lambda case: outcome(case) in names
    table = [("one effect: named alone, rightly (top-1)", count(effect, is_outcome("right")), len(effect)),
             ("one effect: named, or in the set", count(effect, is_outcome("right", "in set")), len(effect)),
             (f"same, effects seen with power >= {SEEN}: named alone", count(seen, is_outcome("right")), len(seen)),
             (f"same, effects seen with power >= {SEEN}: named, or in the set",
              count(seen, is_outcome("right", "in set")), len(seen)),
             ("one effect: wrong blame (truth not among the named)", count(effect, is_outcome("wrong", "wrong set")),
              len(effect)),
             ("one effect: wrong, of those where something was named", count(blamed, is_outcome("wrong", "wrong set")),
              len(blamed)),
             ("ambiguous sets that hold the truth", count(sets, is_outcome("in set")), len(sets)),
             ("null: false alarm (something named)", count(null, lambda c: c["verdict"] in ("missing", "ambiguous")),
              len(null)),
             ("null: false alarm or unexplained", count(null, lambda c: c["verdict"] != "nothing_missing"), len(null)),
             ("null: smallest p < 0.05", count(null, lambda c: c["p"] is not None and c["p"] < 0.05), len(null)),
             ("two effects: all that is named is there", count(two, is_outcome("right", "in set")), len(two)),
             ("two effects: wrong blame", count(two, is_outcome("wrong", "wrong set")), len(two)),
             ("outside the catalogue: wrong blame (something named)",
              count(outside, lambda c: c["verdict"] in ("missing", "ambiguous")), len(outside)),
             ("outside the catalogue: unexplained", count(outside, is_outcome("unexplained")), len(outside))]
    right = [row for case in effect if outcome(case) == "right" for row in case["intervals"]]
    moduli = [row for case in null for row in case["moduli"]]
    reshaped = [row for row in right if row[0].split(".")[0] in RESHAPED]
    same = [row for row in right if row[0].split(".")[0] not in RESHAPED]
    for what, rows in (("", same), (f" ({', '.join(RESHAPED)}: shaped otherwise)", reshaped)):
        table.append((f"95 % intervals of rightly named effects that hold the truth{what}",
                      count(rows, lambda r: r[2] <= r[1] <= r[3]), len(rows)))
    table.append(("95 % intervals of calibrated moduli of nulls that hold the truth",
                  count(moduli, lambda r: r[2] <= r[1] <= r[3]), len(moduli)))
    return table


def seconds_text(cases):
    names = ("phantom", "mesh", "calibrate", "diagnose")
    columns = {name: [case["seconds"][name] for case in cases if name in case["seconds"]] for name in names}
    parts = [f"{name} {statistics.median(values):.0f}" for name, values in columns.items() if values]
    return "User seconds per case, median: " + ", ".join(parts) + "." if parts else ""


def text_of(cases):
    kinds = ", ".join(f"{count(cases, lambda c, k=kind: c['kind'] == k)} {name}" for kind, name in
                      (("effect", "with one effect"), ("null", "without any"), ("two", "with two"),
                       ("outside", "from outside the catalogue")))
    lines = [f"{len(cases)} cases: {kinds}.", "", matrix_text(confusion(cases)), "",
             "| rate | hits/cases = % [95 % Wilson interval] |", "|---|---|"]
    lines += [f"| {what} | {rate(hits, total)} |" for what, hits, total in rates(cases)]
    return "\n".join(lines + ["", seconds_text(cases), ""])


def score(answers, results):
    found = [read_case(file, results) for file in sorted(answers.glob("*.json"))]
    return [case for case in found if case is not None]


def write(cases, target):
    with open(f"{target}.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["case", "seed", "kind", "truth", "verdict", "named", "outcome", "power", "p", "intervals"])
        for case in cases:
            spans = "; ".join(f"{name} {truth:.3g} in [{low:.3g}, {high:.3g}]" for name, truth, low, high in
                              case["intervals"])
            writer.writerow([case["case"], case["seed"], case["kind"], "+".join(case["causes"]), case["verdict"],
                             "+".join(case["missing"]), outcome(case), case["power"], case["p"], spans])
    lines = "".join(json.dumps(case) + "\n" for case in cases)
    pathlib.Path(f"{target}.jsonl").write_text(lines, encoding="utf-8")
    document = {"cases": len(cases), "confusion": confusion(cases),
                "rates": [{"rate": what, "hits": hits, "of": total, "interval95": wilson(hits, total)}
                          for what, hits, total in rates(cases)]}
    pathlib.Path(f"{target}.json").write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    pathlib.Path(f"{target}.md").write_text(text_of(cases), encoding="utf-8")


def scored_before(files):
    """Cases of earlier scores; of a case in several the last."""
    cases = {}
    for file in files:
        for line in file.read_text(encoding="utf-8").splitlines():
            case = json.loads(line)
            cases[case["seed"], case["case"]] = case
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
                        help="ANSWERS RESULTS, or SCORE.jsonl ...")
    parser.add_argument("-o", dest="target", type=pathlib.Path, help="write SCORE.md, .csv, .json and .jsonl")
    options = parser.parse_args()
    if all(path.is_file() for path in options.paths):
        tell(scored_before(options.paths), options.target)
    elif len(options.paths) == 2:
        report(*options.paths, options.target)
    else:
        parser.error("two folders, or files that -o wrote")


if __name__ == "__main__":
    main()
