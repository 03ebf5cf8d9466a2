#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Blind benchmark: makes cases with a sealed answer, diagnoses each from its case folder alone, scores.

    bench/hidden.py WORK --bin build/bin [--realistic | --prior | --set pairs|foreign|doses|large [--realistic]]
                    [--cases N] [--seed N | --seed-from TAG] [--quarter 1..4] [--rows FILE] [--first 1] [--jobs 2]
                    [--registration-mm MM] [--no-tilt] [--only odd|even] [--again [--label LABEL] [--without WHAT]]

WORK/cases/case-001 ... what the tools read; WORK/answers/case-001.json the answers; WORK/out/case-001 what the tools
wrote. What is scored of a case is a row of WORK/rows.jsonl (--rows), written as soon as the case is done. A call goes
on from the rows that are there, so that the file alone takes a run to another machine. --again diagnoses the cases that
are there once more into WORK/out-LABEL (--label LABEL), with mesh and calibration as they are; with --no-tilt from
WORK/cases-no-tilt, the same cases without their tilted scan; with --without as if there were none of WHAT
(supine-diagnose --without). Standard library only.
"""

import argparse
import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True  # nothing is left in the source tree
import hidden_case  # noqa: E402
import hidden_plan  # noqa: E402
import hidden_score  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent


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


def state_registration(case, registration_mm):
    """Scans of the mixture lie where they are said to; the case tells the tools how well that is known."""
    file = case / "case.toml"
    silent = re.sub(r"(?m)^registration_mm = .*\n", "", file.read_text())
    file.write_text(re.sub(r"(?m)^surface = .*$", rf"\g<0>\nregistration_mm = {registration_mm}", silent))


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


def diagnose_again(work, binaries, name, label, tilt=True, without=None):
    source, out = work / "out" / name, work / f"out-{label}" / name
    if not (source / "model.toml").exists() or (out / "diagnosis.json").exists() or (out / "failed").exists():
        return
    out.mkdir(parents=True, exist_ok=True)
    case = work / "cases" / name if tilt else without_tilt(work, name)
    code, seconds = run([binaries / "supine-diagnose", case, source / "mesh.vtu", "--model", source / "model.toml",
                         "-o", out, "--threads", "1", "--force", *(["--without", without] if without else [])],
                        work / "logs" / f"{name}.{label}.txt")
    note_seconds(out, {"diagnose": seconds})
    if code == 0 or code == 1:
        shutil.copy(source / "calibration.json", out)
    elif code > 0 and code != 130:
        (out / "failed").write_text(f"diagnose ended with {code}\n")


def one_case(work, options, name, words):
    """The row of the case, or None where there is no result."""
    out = work / (f"out-{options.label}" if options.again else "out")
    if options.again:
        diagnose_again(work, options.bin, name, options.label, not options.no_tilt, options.without)
    else:
        words = words + ([] if options.no_tilt else ["--tilt"])
        made, seconds = make_case(work, options.bin, name, words)
        if made and options.registration_mm is not None:
            state_registration(work / "cases" / name, options.registration_mm)
        if made:
            (out / name).mkdir(parents=True, exist_ok=True)
            if seconds:
                note_seconds(out / name, {"phantom": seconds})
            diagnose_case(work, options.bin, name)
    answer = work / "answers" / f"{name}.json"
    return hidden_case.read_case(answer, out) if answer.exists() else None


def program(binaries):
    """Version and commit that supine-diagnose was built from, as it says."""
    said = subprocess.run([binaries / "supine-diagnose", "--version"], capture_output=True, text=True, check=False)
    found = re.match(r"\S+ (\S+) \((\S+)\)", said.stdout)
    return {"version": found[1], "commit": found[2]} if said.returncode == 0 and found else {}


class Rows:
    """What has been scored, one line of JSON a case; appended to, never written anew."""

    def __init__(self, file):
        self.file = file
        self.known = {hidden_score.key_of(row) for row in self.read()}

    def read(self):
        return hidden_score.scored_before([self.file]) if self.file.exists() else []

    def add(self, row):
        self.file.parent.mkdir(parents=True, exist_ok=True)
        with open(self.file, "a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
            file.flush()
            os.fsync(file.fileno())
        self.known.add(hidden_score.key_of(row))


def seed_from(tag):
    """A seed that nobody has chosen: the hash of the commit that the tag stands at."""
    found = subprocess.run(["git", "-C", HERE, "rev-parse", "--verify", "--quiet", f"{tag}^{{commit}}"],
                           capture_output=True, text=True, check=False)
    if found.returncode != 0:
        raise SystemExit(f"--seed-from {tag}: there is no such tag or commit")
    return int.from_bytes(hashlib.sha256(found.stdout.strip().encode()).digest()[:5], "big")


def parser():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/bin"))
    parser.add_argument("--realistic", action="store_true", help="with what patients bring; also with --set")
    parser.add_argument("--prior", action="store_true", help="cases from the priors")
    parser.add_argument("--set", choices=["pairs", "foreign", "doses", "large"], help="a designed set")
    parser.add_argument("--cases", type=int, help="default: as many as the set has, 60 of a mixture")
    parser.add_argument("--first", type=int, default=1, help="number of the first case to run, up to --cases")
    parser.add_argument("--quarter", type=int, choices=[1, 2, 3, 4], help="every fourth case alone")
    parser.add_argument("--seed", type=int, help="default 1")
    parser.add_argument("--seed-from", metavar="TAG", help="the seed is a hash of this tag's commit")
    parser.add_argument("--rows", type=pathlib.Path, help="default WORK/rows.jsonl")
    parser.add_argument("--jobs", type=int, default=2, help="cases side by side, one thread each")
    parser.add_argument("--registration-mm", type=float, metavar="MM",
                        help="each case states that its scans lie in place within this, 1 sigma")
    parser.add_argument("--no-tilt", action="store_true", help="the supine scan alone")
    parser.add_argument("--only", choices=["odd", "even"], help="cases with such a seed")
    parser.add_argument("--again", action="store_true", help="diagnose once more, into WORK/out-LABEL")
    parser.add_argument("--label", default="again")
    parser.add_argument("--without", metavar="WHAT", help="with --again: supine-diagnose --without WHAT")
    return parser


def arguments(words=None):
    options = parser().parse_args(words)
    for both, what in ((options.prior and options.set, "--prior excludes --set: it draws the effects itself"),
                       (options.prior and options.realistic,
                        "--prior excludes --realistic: each says how nuisances are drawn"),
                       (options.seed is not None and options.seed_from, "--seed excludes --seed-from"),
                       (options.registration_mm is not None and options.again,
                        "--registration-mm excludes --again: the cases are there and say what they say"),
                       (options.without and not options.again, "--without needs --again: cases are diagnosed whole first"),
                       (options.first < 1, f"--first {options.first}: cases are counted from 1")):
        if both:
            raise SystemExit(what)
    name = "prior" if options.prior else options.set or ("realistic" if options.realistic else "mixture")
    options.name = f"{name}-realistic" if options.set and options.realistic else name
    options.cases = options.cases or hidden_plan.SETS[name][0]
    options.seed = seed_from(options.seed_from) if options.seed_from else options.seed or 1
    options.planned = hidden_plan.plan(name, options.cases, options.seed, options.realistic)
    return options


def wanted(options):
    cases = options.planned[options.first - 1:]
    if options.quarter:
        cases = hidden_plan.quarter(cases, options.quarter)
    return [(name, words) for name, words in cases
            if options.only is None or int(words[1]) % 2 == (options.only == "odd")]


def run_all(work, options, rows, cases):
    """@return names of those without a result"""
    stamp = {"set": options.name, **program(options.bin)}
    if options.registration_mm is not None:
        stamp["registration_mm"] = options.registration_mm
    if options.without:
        stamp["without"] = options.without
    empty = []
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        waiting = {pool.submit(one_case, work, options, name, words): name for name, words in cases}
        try:
            for number, done in enumerate(concurrent.futures.as_completed(waiting), 1):
                row = done.result()
                if row is None:
                    empty.append(waiting[done])
                else:
                    rows.add(row | stamp)
                print(f"{waiting[done]} done, {number} of {len(cases)}", file=sys.stderr, flush=True)
        except KeyboardInterrupt:
            pool.shutdown(wait=True, cancel_futures=True)  # the tools have had the signal as well and end by themselves
            print("Stopped; the same command goes on from here.", file=sys.stderr)
            raise SystemExit(130)
    return empty


def main():
    options = arguments()
    work = options.work.resolve()
    options.bin = options.bin.resolve()
    for folder in ("cases", "answers", "out", "logs"):
        (work / folder).mkdir(parents=True, exist_ok=True)
    score = f"score-{options.label}" if options.again else "score"
    rows = Rows(options.rows or work / f"{score.replace('score', 'rows')}.jsonl")
    cases = [(name, words) for name, words in wanted(options)
             if (options.name, int(words[1]), name) not in rows.known]
    empty = run_all(work, options, rows, cases)
    if empty:
        print(f"No result, see {work / 'logs'}: {', '.join(sorted(empty))}", file=sys.stderr)
    if not rows.known:
        raise SystemExit("no case has a result")
    hidden_score.tell(rows.read(), work / score)


if __name__ == "__main__":
    main()
