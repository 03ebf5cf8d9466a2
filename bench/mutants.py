#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Do the tests notice? mutants.py BUILD ROWS.jsonl [--count N] [--seed S] [--minutes M] [--only FILE]
mutants.py --table ROWS.jsonl

Makes small changes of the sources of simulation/, calibration/ and diagnosis/, one at a time: a sign, a comparison, a constant, a step by
one, a condition that is never true, a call of min for max. Each is built in BUILD, a folder of this checkout, and the tests of its folder
are run: those of the test file that is named after the source or includes its header first, those of its own subfolder, then the rest from
the shortest on, until one fails or LONGEST_TESTS_S seconds of the processor are spent. One row of ROWS.jsonl a change: caught (a test failed, crashed or did not
end), SURVIVED, or not built (the compiler refuses it; not counted). The source is put back after each.

The changes are drawn by the seed, the same from the same sources, the folders in turn. A later call goes on where ROWS.jsonl ends. --table
prints the share caught of each folder with its 95 % interval (Wilson); changes that change nothing (EQUIVALENT, judged by hand) are left
out of it.
"""
import argparse
import json
import math
import os
import pathlib
import random
import re
import resource
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
EQUIVALENT = ROOT / "bench" / "mutants_equivalent.txt"
LONGEST_BUILD_S, LONGEST_TESTS_S = 1200, 150
FOLDERS = {
    "simulation": ["test_simulation", "test_export", "test_verification"],
    "calibration": ["test_calibration", "test_fitting"],
    "diagnosis": ["test_diagnosis"],
}
ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}

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
    ("condition", r"\bif \((?!constexpr)(?=[^=;]*\))", "if (false && "),
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
    """Every change that this file allows: line number, columns, kind, new text."""
    found = []
    for number, line in enumerate(file.read_text().split("\n")):
        if NOT_CHANGED.search(line):
            continue
        code = line.split("//")[0]
        for kind, pattern, new in CHANGES:
            for match in re.finditer(pattern, code):
                found.append((number, match.start(), match.end(), kind, match.expand(new)))
    return found


def drawn(only, seed):
    """All changes, the folders in turn, each file as likely as its changes are many."""
    orders = []
    for folder in FOLDERS:
        files = [f for f in sorted((ROOT / folder).rglob("*.cpp")) if only in str(f)]
        every = [(folder, file, change) for file in files for change in possible(file)]
        random.Random(f"{seed} {folder}").shuffle(every)
        orders.append(every)
    for turn in range(max(map(len, orders))):
        yield from (order[turn] for order in orders if turn < len(order))


def run(words, longest_s, **more):
    """Exit code; None when it did not end within that much of the processor, or twenty times that by the clock."""
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True, **more)
    try:
        return process.wait(20 * longest_s)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, 9)
        process.wait()
        return None


def used_s():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


class Tests:
    """The tests of a folder and the seconds each takes in the sources as they are (kept in BUILD/mutants_NAME.json)."""

    def __init__(self, build, folder):
        self.build, self.folder, self.seconds = build, folder, {}
        for name in FOLDERS[folder]:
            kept = build / f"mutants_{name}.json"
            if not kept.exists():
                if run(["ninja", "-C", str(build), name], LONGEST_BUILD_S) != 0:
                    sys.exit(f"{name} cannot be built")
                if run([str(build / "bin" / name), "--gtest_brief=1", f"--gtest_output=json:{kept}"], 1800, env=ENVIRONMENT) != 0:
                    kept.unlink(missing_ok=True)
                    sys.exit(f"{name} fails before anything is changed")
            for suite in json.loads(kept.read_text())["testsuites"]:
                for test in suite["testsuite"]:
                    if test["result"] == "COMPLETED":
                        self.seconds[name, f"{suite['name']}.{test['name']}"] = float(test["time"].rstrip("s"))

    def near(self, file):
        """Suites of the test files that are named after the source or include its header, and of those in the folder of its own name."""
        source = file.relative_to(ROOT)
        header, near, beside = f'"{source.with_suffix(".h")}"', set(), set()
        for test in (ROOT / "tests" / self.folder).rglob("*_test.cpp"):
            text = test.read_text()
            suites = set(re.findall(r"^TEST(?:_F|_P)?\((\w+),", text, re.M))
            if test.name == f"{file.stem}_test.cpp" or header in text:
                near |= suites
            elif test.parent == ROOT / "tests" / source.parent and source.parent.name != self.folder:
                beside |= suites
        return near, beside

    def batches(self, file):
        """(executable, names of tests) to run one after the other: near ones, those beside them, then the rest by their length."""
        rest, mine = [], {}
        for executable in FOLDERS[self.folder]:
            mine[executable] = sorted((s, name) for (where, name), s in self.seconds.items() if where == executable)
        for suites in self.near(file):
            for executable, others in mine.items():
                close = [(s, name) for s, name in others if suites & {name.split(".")[0].split("/")[-1], name.split("/")[0]}]
                mine[executable] = [pair for pair in others if pair not in close]
                if close:
                    yield executable, sum(s for s, _ in close), [name for _, name in close]
        for executable, others in mine.items():
            for low, high in ((0, 0.3), (0.3, 2), (2, 10), (10, math.inf)):
                part = [(s, name) for s, name in others if low <= s < high]
                if part:
                    rest.append((low, executable, sum(s for s, _ in part), [name for _, name in part]))
        for _, executable, seconds, names in sorted(rest):
            yield executable, seconds, names

    def verdict(self, file):
        """Verdict, the executable that noticed, seconds of the tests."""
        if any(run(["ninja", "-C", str(self.build), name], LONGEST_BUILD_S) != 0 for name in FOLDERS[self.folder]):
            return "not built", "", 0
        began = used_s()
        for executable, usual_s, names in self.batches(file):
            left = LONGEST_TESTS_S - (used_s() - began)
            if left < 1:
                break
            longest = int(5 * usual_s + 20)  # twice what is left at most: what is cut off there proves nothing
            limit = min(longest, int(left) + 1)
            code = run([str(self.build / "bin" / executable), "--gtest_brief=1", "--gtest_fail_fast", f"--gtest_filter={':'.join(names)}"], limit,
                       env=ENVIRONMENT, preexec_fn=lambda cpu=limit: resource.setrlimit(resource.RLIMIT_CPU, (cpu, cpu + 5)))
            if code is None or code in (-24, -9):  # out of its seconds
                if limit == longest:
                    return "caught", executable + " (does not end)", used_s() - began
                break
            if code != 0:
                return "caught", executable, used_s() - began
        return "SURVIVED", "", used_s() - began


def try_change(tests, file, change):
    number, start, end, kind, new = change
    before = file.read_text()
    lines = before.split("\n")
    old = lines[number].strip()
    lines[number] = lines[number][:start] + new + lines[number][end:]
    file.write_text("\n".join(lines))
    try:
        verdict, by, seconds = tests.verdict(file)
    finally:
        file.write_text(before)
    return {"file": str(file.relative_to(ROOT)), "line": number + 1, "kind": kind, "before": old, "after": lines[number].strip(), "verdict": verdict,
            "by": by, "test_s": round(seconds, 1)}


def rows_of(file):
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


def key(row):
    return row["file"], row["before"], row["after"]


def equivalent():
    """(file, before, after) of each line of EQUIVALENT: four cells parted by ' | ', the last one the reason."""
    lines = EQUIVALENT.read_text().splitlines() if EQUIVALENT.exists() else []
    return {tuple(cell.strip() for cell in line.split(" | ")[:3]) for line in lines if line.strip() and not line.startswith("#")}


def wilson(caught, count, z=1.959964):
    middle, spread = caught + z * z / 2, z * math.sqrt(caught * (count - caught) / count + z * z / 4)
    return [100 * (middle + sign * spread) / (count + z * z) for sign in (-1, 1)]


def print_table(rows):
    same = equivalent()
    print("| folder | changes | change nothing | caught | share | 95 % |\n|---|---|---|---|---|---|")
    for folder in [*FOLDERS, ""]:
        built = [row for row in rows if row["verdict"] != "not built" and row["file"].startswith(folder)]
        counted = [row for row in built if not (row["verdict"] == "SURVIVED" and key(row) in same)]
        caught = sum(row["verdict"] == "caught" for row in counted)
        if counted:
            low, high = wilson(caught, len(counted))
            print(f"| {folder or 'all'} | {len(built)} | {len(built) - len(counted)} | {caught} | {100 * caught / len(counted):.0f} % | {low:.0f} to {high:.0f} % |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path, nargs="?", help="a configured build folder of this checkout")
    parser.add_argument("rows", type=pathlib.Path)
    parser.add_argument("--count", type=int, default=200, help="changes that compile, with those of earlier calls")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=math.inf, help="no change is begun after that many")
    parser.add_argument("--only", default="", help="files whose path holds this")
    parser.add_argument("--table", action="store_true")
    given = parser.parse_args()
    rows = rows_of(given.rows)
    if given.table:
        return print_table(rows)
    if given.build is None:
        parser.error("which build folder?")
    if subprocess.run(["git", "-C", str(ROOT), "diff", "--quiet"], check=False).returncode != 0:
        sys.exit("mutants.py changes sources and puts them back: commit first")
    began, known, tests = time.monotonic(), {key(row) for row in rows}, {}
    built = sum(row["verdict"] != "not built" for row in rows)
    for folder, file, change in drawn(given.only, given.seed):
        if built >= given.count or time.monotonic() - began > 60 * given.minutes:
            break
        line = file.read_text().split("\n")[change[0]]
        if (str(file.relative_to(ROOT)), line.strip(), (line[:change[1]] + change[4] + line[change[2]:]).strip()) in known:
            continue
        if folder not in tests:
            tests[folder] = Tests(given.build.resolve(), folder)
        row = try_change(tests[folder], file, change)
        with given.rows.open("a") as out:
            out.write(json.dumps(row, ensure_ascii=False) + "\n")
        print(f"{row['verdict']:<10}{row['kind']:<12}{row['file']}:{row['line']}: {row['after']}", flush=True)
        rows.append(row)
        built += row["verdict"] != "not built"
    for folder in tests:
        run(["ninja", "-C", str(given.build)] + FOLDERS[folder], LONGEST_BUILD_S)
    print_table(rows)


if __name__ == "__main__":
    sys.exit(main())
