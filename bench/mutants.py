#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Do the tests notice? mutants.py BUILD FOLDER=TEST[:FILTER] ... [--count N] [--seed S] [--only FILE]

Makes N small changes of the sources of the folders, one at a time: a sign, a comparison, a constant, a step by one, a
condition that is never true, a call of min for max. Each is built in BUILD, and the test executable of its folder is
run. One line a change: caught (a test failed or crashed), not built (the compiler refuses it), hung, or SURVIVED. The source is
put back after each. The changes are drawn by the seed: the same each time from the same sources.
"""
import argparse
import os
import pathlib
import random
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
LONGEST_BUILD_S, LONGEST_TEST_S = 900, 900

# What is changed, and into what; \1 … are groups of the pattern.
CHANGES = [
    ("sign", r"(?<=[\w\)\]]) \+ (?=[\w\(])", " - "),
    ("sign", r"(?<=[\w\)\]]) - (?=[\w\(])", " + "),
    ("sign", r" \+= ", " -= "),
    ("sign", r" -= ", " += "),
    ("factor", r"(?<=[\w\)\]]) \* (?=[\w\(])", " / "),
    ("factor", r"(?<=[\w\)\]]) / (?=[\w\(])", " * "),
    ("comparison", r" < (?=[\w\(\-])", " >= "),
    ("comparison", r" > (?=[\w\(\-])", " <= "),
    ("border", r" < (?=[\w\(\-])", " <= "),
    ("border", r" <= ", " < "),
    ("border", r" >= ", " > "),
    ("comparison", r" == ", " != "),
    ("condition", r"\bif \((?!constexpr)", "if (false && "),
    ("condition", r" && ", " || "),
    ("condition", r" \|\| ", " && "),
    ("constant", r"(?<=[ (])0\.5(?=[ ,;)*])", "0.25"),
    ("constant", r"(?<=[ (])2(?= \*)", "3"),
    ("constant", r"(?<== )(\d+(?:\.\d+)?)(?=;)", r"2 * \1 + 1"),
    ("off by one", r"(?<== )0(?=; \w+ < )", "1"),
    ("extreme", r"std::min\(", "std::max("),
    ("extreme", r"std::max\(", "std::min("),
]
# Lines that only speak, check types or name things.
NOT_CHANGED = re.compile(r"^\s*(//|#|using|namespace|template|static_assert)|throw |fmt::|\"")


def possible(file):
    """(line number, start, end, kind, new text) of every change that this file allows."""
    found = []
    for number, line in enumerate(file.read_text().split("\n")):
        if NOT_CHANGED.search(line):
            continue
        code = line.split("//")[0]
        for kind, pattern, new in CHANGES:
            for match in re.finditer(pattern, code):
                found.append((number, match.start(), match.end(), kind, match.expand(new)))
    return found


def drawn(folders, count, only, generator):
    """The same number of every folder, as nearly as can be, and each file as likely as its changes are many."""
    chosen = []
    for at, (folder, test) in enumerate(folders):
        files = [f for f in sorted((ROOT / folder).rglob("*.cpp")) if only in str(f)]
        every = [(file, change, test) for file in files for change in possible(file)]
        share = (count + at) // len(folders)
        chosen += generator.sample(every, min(share, len(every)))
    return chosen


def run(words, longest, environment=None):
    """Exit code; None when it did not end."""
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment, start_new_session=True)
    try:
        return process.wait(longest)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, 9)
        process.wait()
        return None


def verdict(build, test):
    executable, _, wanted = test.partition(":")
    if run(["ninja", "-C", str(build), executable], LONGEST_BUILD_S) != 0:
        return "not built"
    words = [str(build / "bin" / executable), "--gtest_brief=1", "--gtest_fail_fast"] + ([f"--gtest_filter={wanted}"] if wanted else [])
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "GOMP_SPINCOUNT": "1000"}
    code = run(words, LONGEST_TEST_S, environment)
    return "hung" if code is None else "caught" if code != 0 else "SURVIVED"


def try_change(file, change, test, build):
    number, start, end, kind, new = change
    before = file.read_text()
    lines = before.split("\n")
    lines[number] = lines[number][:start] + new + lines[number][end:]
    file.write_text("\n".join(lines))
    try:
        answer = verdict(build, test)
    finally:
        file.write_text(before)
    print(f"{answer:<10}{kind:<12}{file.relative_to(ROOT)}:{number + 1}: {lines[number].strip()}", flush=True)
    return answer


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path, help="a configured build folder of this checkout")
    parser.add_argument("folders", nargs="+", help="FOLDER=TEST[:FILTER], for example calibration=test_calibration")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="files whose path holds this")
    given = parser.parse_args()
    if subprocess.run(["git", "-C", str(ROOT), "diff", "--quiet"]).returncode != 0:
        sys.exit("mutants.py changes sources and puts them back: commit first")
    folders = [tuple(one.split("=", 1)) for one in given.folders]
    build = given.build.resolve()
    for _, test in folders:
        if verdict(build, test) != "SURVIVED":
            sys.exit(f"{test} fails before anything is changed")
    answers = [try_change(file, change, test, build) for file, change, test in drawn(folders, given.count, given.only, random.Random(given.seed))]
    run(["ninja", "-C", str(build)] + [test.partition(":")[0] for _, test in folders], LONGEST_BUILD_S)
    built = [answer for answer in answers if answer != "not built"]
    caught = len([answer for answer in built if answer != "SURVIVED"])
    print(f"{caught} of {len(built)} changes that compile are caught" + (f", {100 * caught / len(built):.0f} %" if built else ""))
    return 0


if __name__ == "__main__":
    sys.exit(main())
