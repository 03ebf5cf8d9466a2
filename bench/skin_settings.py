#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""What a mesh errs by with a number of [skin], fade_mm or bending_share: each model solved on the mesh of a case and on
that with every cell cut into eight (bench_split_mesh), and how far supine nodes of the first lie from there. Some
minutes a model. Needs the Python VTK (python3-vtk9)."""

import argparse
import os
import pathlib
import re
import shutil
import subprocess

import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy


def run(*command):
    done = subprocess.run([str(word) for word in command], env=dict(os.environ, OMP_NUM_THREADS="1"),
                          capture_output=True, text=True)
    if done.returncode not in (0, 1):
        raise RuntimeError(f"{command[0]}: {done.stderr[-500:]}")


def nodes(file):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(file))
    reader.Update()
    return vtk_to_numpy(reader.GetOutput().GetPoints().GetData()).astype(float)


def of_mesh(nodes_of_mesh, nodes_of_finer):
    """Rows of the finer mesh that are the nodes of the mesh: all of them are."""
    finer = {tuple(np.round(x, 3)): row for row, x in enumerate(nodes_of_finer)}
    return np.array([finer[tuple(np.round(x, 3))] for x in nodes_of_mesh])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("case", type=pathlib.Path)
    parser.add_argument("mesh", type=pathlib.Path)
    parser.add_argument("model", type=pathlib.Path)
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/bin"))
    parser.add_argument("--key", choices=["fade_mm", "bending_share"], default="bending_share")
    parser.add_argument("--values", type=float, nargs="+", default=[0, 1])
    asked = parser.parse_args()
    asked.work.mkdir(parents=True, exist_ok=True)
    finer = asked.work / "finer.vtu"
    run(asked.bin / "bench_split_mesh", asked.mesh, finer)
    rows = of_mesh(nodes(asked.mesh), nodes(finer))
    print(f"| {asked.key} | way, rms mm | off, rms mm | off along the way |\n|---|---|---|---|")
    for value in asked.values:
        model = asked.work / f"{asked.key}-{value:g}.toml"
        plain = re.sub(rf"(?m)^{asked.key} = .*\n", "", asked.model.read_text())
        text, found = re.subn(r"(?m)^\[skin\].*$", f"[skin]\n{asked.key} = {value:g}", plain)
        if found != 1:
            raise SystemExit(f"{asked.model}: one table [skin] is needed, there are {found}")
        model.write_text(text)
        way = {}
        for name, mesh in (("mesh", asked.mesh), ("finer", finer)):
            out = asked.work / f"{name}-{asked.key}-{value:g}"
            shutil.rmtree(out, ignore_errors=True)
            run(asked.bin / "supine-simulate", asked.case, mesh, "--pose", "supine", "--model", model, "-o", out,
                "--force")
            way[name] = nodes(out / "supine.vtu") - nodes(out / "prone.vtu")
        true = way["finer"][rows]
        off = way["mesh"] - true
        rms = [np.sqrt(np.mean(np.sum(x**2, axis=1))) for x in (true, off)]
        print(f"| {value:g} | {rms[0]:.1f} | {rms[1]:.2f} | {100 * np.sum(off * true) / np.sum(true * true):+.1f} % |",
              flush=True)


if __name__ == "__main__":
    main()
