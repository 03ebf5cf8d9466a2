#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Blind benchmark: makes cases with a sealed answer, diagnoses each from its case folder alone, scores.

    bench/hidden.py WORK --bin build/bin --cases 60 [--first 1] [--seed 1] [--jobs 2] [--no-tilt] [--only odd|even]
                    [--again]

WORK/cases/case-001 ... what the tools read; WORK/answers/case-001.json the answers; WORK/out/case-001 what the tools
wrote. A second call goes on where the first stopped. --again diagnoses the cases that are there once more into
WORK/out-LABEL (--label LABEL), with mesh and calibration as they are; with --no-tilt from WORK/cases-no-tilt, the same
cases without their tilted scan. Standard library only.
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True  # nothing is left in the source tree
import hidden_score  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
EFFECTS = ["adhesion", "ligament", "friction", "strain_stiffening", "fibre_anisotropy", "incompressibility",
           "gland_stiffness", "tumour_stiffness", "stiffness_gradient", "skin_prestretch", "skin_stiffening", "creep",
           "arm_traction", "chest_wall_motion", "gravity_tilt", "misregistration", "segmentation_offset"]
OUTSIDE = ["coil_contact", "scar", "skin_gradient"]
# One hand of the mixture: as many nulls as single effects, some with two, some from outside the catalogue.
KINDS = ["effect"] * 5 + ["null"] * 5 + ["two", "outside"]


def deck(cards, seed, name, count):
    """The first `count` cards of shuffled decks laid one after the other: every prefix is close to balanced."""
    drawn, number = [], 0
    while len(drawn) < count:
        hand = list(cards)
        random.Random(f"{seed} {name} {number}").shuffle(hand)
        drawn += hand
        number += 1
    return drawn[:count]


def plan(count, seed):
    """The options of supine-phantom for each case."""
    kinds = deck(KINDS, seed, "kind", count)
    singles = iter(deck(EFFECTS, seed, "single", count))
    pairs = iter(deck(EFFECTS, seed, "pair", 2 * count))
    others = iter(deck(OUTSIDE, seed, "outside", count))
    cases = []
    for number, kind in enumerate(kinds, 1):
        options = ["--seed", str(1000 * seed + number)]
        if kind == "effect":
            options += ["--effect", next(singles)]
        elif kind == "two":
            first, second = next(pairs), next(pairs)
            while second == first:
                second = next(pairs)
            options += ["--effect", first, "--effect", second]
        elif kind == "outside":
            options += ["--outside", next(others)]
        else:
            options += ["--effect", "null"]
        cases.append((f"case-{number:03d}", options))
    return cases


def run(command, log):
    """Runs to the end, output into log. Returns exit code and user seconds of the process and what it waited for."""
    with open(log, "ab") as file:
        process = subprocess.Popen([str(word) for word in command], stdout=file, stderr=file,
                                   env={**os.environ, "OMP_NUM_THREADS": "1"})
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, usage.ru_utime


def make_case(work, binaries, name, options):
    answer = work / "answers" / f"{name}.json"
    if answer.exists():
        return True, 0.0
    log = work / "logs" / f"{name}.phantom.txt"
    code, seconds = run([binaries / "supine-phantom", *options, "-o", work / "cases" / name, "--answer", answer,
                         "--threads", "1", "--force"], log)
    return code == 0, seconds


def note_seconds(out, seconds):
    """Adds to what earlier, interrupted calls have used."""
    file = out / "seconds.json"
    known = json.loads(file.read_text()) if file.exists() else {}
    for key, value in seconds.items():
        known[key] = known.get(key, 0) + value
    file.write_text(json.dumps(known) + "\n")


def diagnose_case(work, binaries, name):
    out = work / "out" / name
    if (out / "diagnosis.json").exists() or (out / "failed").exists():
        return
    out.mkdir(parents=True, exist_ok=True)
    log = work / "logs" / f"{name}.txt"
    make = ["make", "-f", HERE.parent / "pipeline" / "Makefile", f"BIN={binaries}", f"CASE={work / 'cases' / name}",
            f"OUT={out}", "THREADS=1"]
    for stage, target in (("mesh", "mesh"), ("calibrate", out / "model.toml"), ("diagnose", "diagnose")):
        code, seconds = run([*make, target], log)
        note_seconds(out, {stage: seconds})
        if code < 0 or code == 130:
            return  # stopped from outside: the next call goes on
        if code != 0:
            (out / "failed").write_text(f"{stage} ended with {code}, see {log.name}\n")
            return


def without_tilt(work, name):
    """The case with the supine scan alone: what another pose measured is not there."""
    case = work / "cases-no-tilt" / name
    if not case.exists():
        shutil.copytree(work / "cases" / name, case, ignore=shutil.ignore_patterns("tilt*"))
        sections = re.split(r"(?m)^(?=\[)", (case / "case.toml").read_text())
        (case / "case.toml").write_text("".join(s for s in sections if not s.startswith("[pose.tilt")))
    return case


def diagnose_again(work, binaries, name, label, tilt=True):
    source, out = work / "out" / name, work / f"out-{label}" / name
    if not (source / "model.toml").exists() or (out / "diagnosis.json").exists() or (out / "failed").exists():
        return
    out.mkdir(parents=True, exist_ok=True)
    case = work / "cases" / name if tilt else without_tilt(work, name)
    code, seconds = run([binaries / "supine-diagnose", case, source / "mesh.vtu", "--model", source / "model.toml",
                         "-o", out, "--threads", "1", "--force"],
                        work / "logs" / f"{name}.{label}.txt")
    note_seconds(out, {"diagnose": seconds})
    if code == 0 or code == 1:
        shutil.copy(source / "calibration.json", out)
    elif code > 0 and code != 130:
        (out / "failed").write_text(f"diagnose ended with {code}\n")


def one_case(work, options, name, words):
    if options.again:
        diagnose_again(work, options.bin, name, options.label, not options.no_tilt)
        return name
    words = words + ([] if options.no_tilt else ["--tilt"])
    made, seconds = make_case(work, options.bin, name, words)
    if made:
        (work / "out" / name).mkdir(parents=True, exist_ok=True)
        if seconds:
            note_seconds(work / "out" / name, {"phantom": seconds})
        diagnose_case(work, options.bin, name)
    return name


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/bin"))
    parser.add_argument("--cases", type=int, default=60)
    parser.add_argument("--first", type=int, default=1, help="number of the first case to run, up to --cases")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2, help="cases side by side, one thread each")
    parser.add_argument("--no-tilt", action="store_true", help="the supine scan alone")
    parser.add_argument("--only", choices=["odd", "even"], help="cases with such a seed")
    parser.add_argument("--again", action="store_true", help="diagnose once more, into WORK/out-LABEL")
    parser.add_argument("--label", default="again")
    return parser.parse_args()


def main():
    options = arguments()
    if options.first < 1:
        raise SystemExit(f"--first {options.first}: cases are counted from 1")
    work = options.work.resolve()
    options.bin = options.bin.resolve()
    for folder in ("cases", "answers", "out", "logs"):
        (work / folder).mkdir(parents=True, exist_ok=True)
    cases = [(name, words) for name, words in plan(options.cases, options.seed)[options.first - 1:]
             if options.only is None or int(words[1]) % 2 == (options.only == "odd")]
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        waiting = [pool.submit(one_case, work, options, name, words) for name, words in cases]
        try:
            for number, done in enumerate(concurrent.futures.as_completed(waiting), 1):
                print(f"{done.result()} done, {number} of {len(cases)}", file=sys.stderr, flush=True)
        except KeyboardInterrupt:
            pool.shutdown(wait=True, cancel_futures=True)  # the tools have had the signal as well and end by themselves
            print("Stopped; the same command goes on from here.", file=sys.stderr)
            raise SystemExit(130)
    out = work / (f"out-{options.label}" if options.again else "out")
    hidden_score.report(work / "answers", out, out.with_name(out.name.replace("out", "score", 1)))


if __name__ == "__main__":
    main()
