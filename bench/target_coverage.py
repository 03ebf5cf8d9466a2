#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""How often the 95 % regions of supine-targets hold the truth: target_coverage.py CASES WORK [BIN] [--only WORDS] [--diagnose | --runs OUT] [--score]

CASES holds case folders and answers/NAME.json (or those lie beside it, as bench/hidden.py has them). Where the answer has `targets`
(supine-phantom), those places are asked for; landmarks that were measured in the pose are held against where all else expects them, in every case.
Meshes and answers of the tool go to WORK and are kept: what is there is not made again. --diagnose climbs the ladder first, from the case's own model, and asks with the model at its end for regions over the
sets that supine-diagnose finds, in place of straight lines at a fit of a model that lacks them. --runs takes meshes, calibrated models and diagnoses
from OUT/NAME, as bench/hidden.py leaves them: what `make targets` does after `make diagnose`. --score makes nothing and counts what is there.
"""
import argparse
import csv
import json
import math
import pathlib
import subprocess
import sys

QUANTILE_3 = 7.814727903251178  # of chi squared with 3 degrees, 0.95
POSE = "supine"
ROOT = pathlib.Path(__file__).resolve().parent.parent


def run(binaries, tool, *words):
    done = subprocess.run([str(binaries / f"supine-{tool}"), *map(str, words), "--force", "--quiet", "--threads", "1"], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        raise RuntimeError(f"supine-{tool}: {done.stderr.strip()}")


def points_asked(answer, out):
    if "targets" not in answer:
        return []
    with open(out / "asked.csv", "w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(["name", "x", "y", "z"])
        table.writerows([t["name"], *t["prone_mm"]] for t in answer["targets"])
    return ["--points", out / "asked.csv"]


def ask_of_run(binaries, case, answer, out, finished):
    """Regions of a case that was meshed, calibrated and diagnosed."""
    if not (finished / "diagnosis.json").exists():
        raise RuntimeError(f"{finished} has no diagnosis")
    out.mkdir(parents=True, exist_ok=True)
    run(binaries, "targets", case, finished / "mesh.vtu", *points_asked(answer, out), "--model", finished / "model.toml", "--diagnosis",
        finished / "diagnosis.json", "--pose", POSE, "--no-further-scans", "-o", out / "targets")


def make(binaries, case, answer, out, diagnose):
    """Mesh and regions of a case."""
    out.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(["make", "-f", str(ROOT / "pipeline" / "Makefile"), f"BIN={binaries}", f"CASE={case}", f"OUT={out}", "THREADS=1", "mesh"],
                          capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"make mesh: {done.stderr.strip()[-300:]}")
    asked = points_asked(answer, out)
    if diagnose:
        ladder = out / "ladder"
        run(binaries, "diagnose", case, out / "mesh.vtu", "--model", case / "model.toml", "--ladder", "-o", ladder)
        asked += ["--model", ladder / "model.toml", "--diagnosis", ladder / "diagnosis.json"]
    run(binaries, "targets", case, out / "mesh.vtu", *asked, "--pose", POSE, "--no-further-scans", "-o", out / "targets")


def solve(matrix, right):
    """Gauss with pivots."""
    rows = [list(row) + [b] for row, b in zip(matrix, right)]
    n = len(rows)
    for k in range(n):
        best = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[best] = rows[best], rows[k]
        for i in range(k + 1, n):
            factor = rows[i][k] / rows[k][k]
            rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k])]
    x = [0.0] * n
    for k in reversed(range(n)):
        x[k] = (rows[k][n] - sum(rows[k][j] * x[j] for j in range(k + 1, n))) / rows[k][k]
    return x


def square(off, covariance):
    return sum(a * b for a, b in zip(off, solve(covariance, off)))


def in_region(off, point):
    """Square of the way to the border of the 95 % ellipsoid, scaled so that the border has QUANTILE_3."""
    along = [sum(a * b for a, b in zip(axis, off)) / half for axis, half in zip(point["axes"], point["half_axes_mm"])]
    return QUANTILE_3 * sum(x * x for x in along)


def measured_landmarks(case):
    with open(case / f"{POSE}_landmarks.csv", encoding="utf-8") as stream:
        return {row["name"]: [float(row[axis]) for axis in "xyz"] for row in csv.DictReader(stream)}


def score(case, answer, found):
    """Rows of (kind of point, name, error, sd, square)."""
    rows = []
    truth = {t["name"]: t[f"{POSE}_mm"] for t in answer.get("targets", [])}
    for point in found["points"]:
        if point["name"] in truth:
            off = [a - b for a, b in zip(truth[point["name"]], point["place_mm"])]
            kind = "tumour" if point["name"] == "tumour" else "inside"
            rows.append((kind, point["name"], math.hypot(*off), point["sigma_mm"], in_region(off, point)))
            nothing = point.get("if_nothing_missing")
            if nothing and nothing["half_axes_mm"][0] > 0:
                off = [a - b for a, b in zip(truth[point["name"]], nothing["place_mm"])]
                sd = math.sqrt(sum(nothing["covariance_mm2"][k][k] for k in range(3)) / 3)
                rows.append((kind + ", as if nothing were missing", point["name"], math.hypot(*off), sd, square(off, nothing["covariance_mm2"])))
    expected, places = found["landmarks"], measured_landmarks(case)
    for i, name in enumerate(expected["names"] if expected else []):
        off = [a - b for a, b in zip(places[name], expected["expected_mm"][i])]
        block = [row[3 * i:3 * i + 3] for row in expected["covariance_mm2"][3 * i:3 * i + 3]]
        sd = math.sqrt(sum(block[k][k] for k in range(3)) / 3)
        rows.append(("landmark", name, math.hypot(*off), sd, square(off, block)))
    return rows


def binomial_bounds(count, share=0.95, outside=0.025):
    """Least and largest number of hits that are not unlikely."""
    chances = [math.comb(count, k) * share**k * (1 - share)**(count - k) for k in range(count + 1)]
    low = next(k for k in range(count + 1) if sum(chances[:k + 1]) > outside)
    high = next(k for k in reversed(range(count + 1)) if sum(chances[k:]) > outside)
    return low, high


def table(group, scored):
    print(f"{group}: {len(scored)} cases")
    kinds = ("tumour", "inside", "landmark")
    for kind in [name for kind in kinds for name in (kind, kind + ", as if nothing were missing")]:
        rows = [row for _, found, _ in scored for row in found if row[0] == kind]
        if not rows:
            continue
        hits = sum(row[4] <= QUANTILE_3 for row in rows)
        error = math.sqrt(sum(row[2]**2 for row in rows) / len(rows) / 3)
        sd = math.sqrt(sum(row[3]**2 for row in rows) / len(rows))
        low, high = binomial_bounds(len(rows))
        print(f"  {kind:<36} {hits:>4} of {len(rows):<4} in the 95 % region ({100 * hits / len(rows):5.1f} %; {low} to {high} if each were by itself), "
              f"error {error:.2f} mm per axis, stated {sd:.2f}, square / 3 {sum(row[4] for row in rows) / len(rows) / 3:.2f}")
    p_values = sorted(p for _, _, p in scored if p is not None)
    if p_values:
        print(f"  landmark test: p < 0.05 in {sum(p < 0.05 for p in p_values)} of {len(p_values)}, median p {p_values[len(p_values) // 2]:.2f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", type=pathlib.Path)
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("bin", type=pathlib.Path, nargs="?", default=pathlib.Path("build/bin"))
    parser.add_argument("--only", default="")
    parser.add_argument("--diagnose", action="store_true")
    parser.add_argument("--runs", type=pathlib.Path)
    parser.add_argument("--score", action="store_true")
    given = parser.parse_args()
    groups = {}
    for case in sorted(path.parent for path in given.cases.glob("*/case.toml") if given.only in path.parent.name):
        answers = given.cases / "answers"
        answer = json.loads(((answers if answers.exists() else given.cases.parent / "answers") / f"{case.name}.json").read_text())
        out = given.work / case.name
        told = out / "targets" / f"{POSE}_landmarks.json"
        if not told.exists() and given.score:
            continue
        try:
            if not told.exists() and given.runs:
                ask_of_run(given.bin.resolve(), case, answer, out, given.runs / case.name)
            elif not told.exists():
                make(given.bin.resolve(), case, answer, out, given.diagnose)
        except RuntimeError as why:
            print(f"{case.name}: {why}", file=sys.stderr)
            continue
        found = json.loads(told.read_text())
        rows = score(case, answer, found)
        causes = "null" if "null" in case.name or answer.get("causes") == [] or answer.get("effect") == "null" else "with a cause"
        groups.setdefault(causes, []).append((case.name, rows, (found["landmarks"] or {}).get("p_value")))
        outside = [f"{name} ({math.sqrt(s):.1f})" for kind, name, _, _, s in rows if s > QUANTILE_3 and "," not in kind]
        print(f"{case.name:<22} unexplained {found['unexplained_mm']:.2f} mm; outside: {', '.join(outside) or '-'}", flush=True)
    for group, scored in groups.items():
        table(group, scored)


if __name__ == "__main__":
    main()
