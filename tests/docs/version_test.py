#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""The version stands in CMakeLists.txt alone: version_test.py SOURCE BIN. Tools report it, CHANGELOG.md begins with it, CITATION.cff
names none."""

import pathlib
import re
import subprocess
import sys

source, binaries = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
version = re.search(r"project\(supine VERSION (\S+)", (source / "CMakeLists.txt").read_text()).group(1)
newest = re.search(r"(?m)^## (\S+)", (source / "CHANGELOG.md").read_text()).group(1)
said = subprocess.run([binaries / "supine-model", "--version"], stdout=subprocess.PIPE, text=True, check=True).stdout.split()[1]
wrong = []
if newest != version:
    wrong.append(f"CHANGELOG.md begins with {newest}, CMakeLists.txt says {version}")
if said != version:
    wrong.append(f"supine-model --version says {said}, CMakeLists.txt {version}")
if re.search(r"(?m)^(version|date-released):", (source / "CITATION.cff").read_text()):
    wrong.append("CITATION.cff names a version: it stands in CMakeLists.txt alone")
print("\n".join(wrong) or f"version {version}")
sys.exit(bool(wrong))
