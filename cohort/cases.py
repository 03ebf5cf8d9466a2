#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""The cases of a cohort, checked before anything is run.

    cohort/cases.py COHORT        prints the folder name of every case, a line each

A cohort is a folder; a case is a folder directly in it that holds a case.toml. Refused, with one message and exit code 2:
a cohort without cases, two cases whose case.toml gives one name, a name that make cannot handle, a case or a file it names
that lies outside the cohort (another machine would not find it, and moving the folder would break it). Standard library only.
"""

import pathlib
import re
import subprocess
import sys

sys.dont_write_bytecode = True  # nothing is left in the source tree
HERE = pathlib.Path(__file__).resolve().parent
CASE_FILES = HERE.parent / "pipeline" / "case_files.awk"


class BadCohort(Exception):
    """One message for a person: what, where, what to do."""


def named_files(case):
    """(kind, path as case.toml gives it) of the files that a case names."""
    said = subprocess.run(["awk", "-f", CASE_FILES, case / "case.toml"], stdout=subprocess.PIPE, check=True, text=True).stdout
    pairs = [line.split("=", 1) for line in said.splitlines()]
    return [(kind, name) for kind, name in pairs if kind != "pose"]


def name_of(case):
    """What case.toml calls the case; the folder's name where it says nothing."""
    text = (case / "case.toml").read_text(errors="replace")
    section = re.search(r"(?ms)^[ \t]*\[case\][ \t]*(?:#.*)?$(.*?)(?=^[ \t]*\[|\Z)", text)
    name = re.search(r"""(?m)^[ \t]*name[ \t]*=[ \t]*["']([^"'\n]*)["']""", section.group(1)) if section else None
    return name.group(1) if name else case.name


def check_inside(cohort, case):
    root = cohort.resolve()
    if root not in case.resolve().parents:
        raise BadCohort(f"{case}: a link to {case.resolve()}, outside the cohort {cohort}; copy the case into it")
    files = [("case.toml", "case.toml"), ("model.toml", "model.toml"), *named_files(case)]
    for kind, name in files:
        place = (case / name).resolve()
        if root not in place.parents:
            raise BadCohort(f"{case}/case.toml: {kind} = \"{name}\" lies at {place}, outside the cohort {cohort}; copy it into the case")


def cases_of(cohort):
    """Folders of the cases, sorted by name. Raises BadCohort."""
    cohort = pathlib.Path(cohort)
    if not cohort.is_dir():
        raise BadCohort(f"{cohort} is not a folder; a cohort is a folder of cases")
    cases = sorted(entry for entry in cohort.iterdir() if (entry / "case.toml").exists())
    if not cases:
        raise BadCohort(f"{cohort} holds no case: none of its folders has a case.toml (docs/case-file.md)")
    by_name = {}
    for case in cases:
        if not re.fullmatch(r"[\w.+-]+", case.name):
            raise BadCohort(f"{case}: make and clusters cannot handle this name; use letters, digits, . _ + -")
        check_inside(cohort, case)
        name = name_of(case)
        if name in by_name:
            raise BadCohort(f"{by_name[name]} and {case} are both named \"{name}\" in [case]; every patient of a cohort needs its own name")
        by_name[name] = case
    return cases


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    try:
        print(*[case.name for case in cases_of(sys.argv[1])], sep="\n")
    except BadCohort as error:
        print(f"cohort: error: {error}", file=sys.stderr)
        sys.exit(2)
