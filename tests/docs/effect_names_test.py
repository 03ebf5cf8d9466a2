#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""An effect's name stands in its own file: everything else asks the catalogue and the effect's traits (simulation/effect.h).

    effect_names_test.py SOURCE BIN
"""
import pathlib
import re
import subprocess
import sys

source, binaries = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
listing = subprocess.run([binaries / "supine-model", "list"], capture_output=True, text=True, check=True).stdout
names = set(re.findall(r"^  ([a-z_]+): ", listing[listing.index("\nEffects"):], re.M))
if len(names) < 15:
    sys.exit(f"only {len(names)} effects in the list of supine-model: {sorted(names)}")
# Two columns of the fields are called as the effects that set them.
columns = set(re.findall(r'{"(\w+)", *&Fields', (source / "simulation/fields.h").read_text()))
folders = ["simulation", "calibration", "diagnosis", "pipeline"]  # those that can see the catalogue
files = [f for folder in folders for end in ("*.h", "*.cpp") for f in (source / folder).rglob(end)]
if len(files) < 150:
    sys.exit(f"only {len(files)} files read below {source}")
found = []
for file in sorted(files):
    if "effects" in file.parts:
        continue
    for number, line in enumerate(file.read_text().splitlines(), 1):
        for name in re.findall(r'"([a-z_]+)"', line):
            if name in names and not (name in columns and file.name in ("fields.h", "model_fields.cpp")):
                found.append(f"{file.relative_to(source)}:{number}: {name}")
if found:
    sys.exit("effects known by name outside simulation/effects; ask their traits:\n" + "\n".join(found))
