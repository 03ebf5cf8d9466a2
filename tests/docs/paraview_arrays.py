#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Checks pipeline/paraview_case.py against the files of a finished case, without ParaView (Debian's cannot be installed
beside libvtk9-dev): every array it colours by is in the file, and the script runs against a stand-in for paraview.simple.

    paraview_arrays.py SOURCE CASE_OUT
"""

import importlib.util
import os
import pathlib
import sys
import types
from unittest import mock


def section(text, association):
    """The XML of cell or point arrays."""
    tag = "CellData" if association == "CELLS" else "PointData"
    return text[text.index(f"<{tag}"):text.index(f"</{tag}>")]


def main():
    source, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    spec = importlib.util.spec_from_file_location("paraview_case", source / "pipeline" / "paraview_case.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    found = 0
    if not (out / "comparison.vtp").exists() or 'Name="covered"' not in section((out / "comparison.vtp").read_bytes().decode("latin-1"), "POINTS"):
        print(f"{out}/comparison.vtp is not there or has no array covered")
        return 1
    for name, (association, array) in script.ARRAYS.items():
        if not (out / name).exists():
            continue
        found += 1
        if f'Name="{array}"' not in section((out / name).read_bytes().decode("latin-1"), association):
            print(f"{name} has no {association.lower()} array {array}")
            return 1
    if found < 5:
        print(f"{out} holds {found} of the files the script opens")
        return 1
    simple = mock.MagicMock()
    for reader in (simple.XMLUnstructuredGridReader, simple.XMLPolyDataReader):
        reader.return_value.GetDataInformation.return_value.GetBounds.return_value = (-80.0, 80.0, -40.0, 0.0, -80.0, 80.0)
    package = types.ModuleType("paraview")
    package.simple = simple
    os.environ["CASE_OUT"] = str(out)
    with mock.patch.dict(sys.modules, {"paraview": package, "paraview.simple": simple}), mock.patch.object(
            sys, "argv", ["paraview_case.py", "picture.png"]):
        script.main()
    opened = [call.kwargs["FileName"][0] for reader in (simple.XMLUnstructuredGridReader, simple.XMLPolyDataReader)
              for call in reader.call_args_list]
    missing = [path for path in opened if not os.path.exists(path)]
    coloured = {call.args[1] for call in simple.ColorBy.call_args_list if call.args[1]}
    print(f"{found} files, {len(opened)} opened")
    return 0 if not missing and coloured == {("CELLS", "region"), ("POINTS", "distance_mm")} else 1


if __name__ == "__main__":
    sys.exit(main())
