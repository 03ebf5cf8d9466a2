#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Runs the Python of a page, block after block as a reader would: python_page.py PAGE CASE

CASE, a folder with a finished run, stands for `mycase`. Blocks that import what is not installed are left out by name."""

import importlib.util
import os
import pathlib
import re
import shutil
import sys
import tempfile

OPTIONAL = ("matplotlib", "vtkmodules")


def blocks(page):
    """(first line, code) of every block of Python."""
    text = page.read_text()
    for found in re.finditer(r"(?ms)^```python\n(.*?)^```$", text):
        yield text.count("\n", 0, found.start()) + 2, found.group(1)


def needs(code):
    named = [name for name in OPTIONAL if re.search(rf"\bimport {name}|\bfrom {name}", code)]
    return named + (["vtkmodules"] if "import supine.vtk" in code else [])


def main():
    page, case = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    os.environ.setdefault("MPLBACKEND", "Agg")
    ran, names = 0, {"__name__": "page"}
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(case, pathlib.Path(folder) / "mycase")
        os.chdir(folder)
        for line, code in blocks(page):
            absent = [name for name in needs(code) if importlib.util.find_spec(name) is None]
            if absent:
                print(f"{page.name}:{line}: not run, {absent[0]} is not installed")
                continue
            print(f"{page.name}:{line}", flush=True)
            exec(compile("\n" * (line - 1) + code, str(page), "exec"), names)
            ran += 1
        os.chdir("/")
    print(f"{ran} blocks run")
    return 0 if ran > 5 else 1


if __name__ == "__main__":
    sys.exit(main())
