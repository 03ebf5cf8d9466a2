#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""How much of a coarse mesh's error half the edge at the skin's end shows: both against a fine mesh, at the points of
the supine scan. Needs the Python VTK (python3-vtk9)."""

import argparse
import os
import pathlib
import subprocess

import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

COARSE, FINE = "700", "4000"
PIPELINE = pathlib.Path(__file__).resolve().parent.parent / "pipeline" / "Makefile"
ONE_THREAD = dict(os.environ, OMP_NUM_THREADS="1")


def read(reader, file):
    reader.SetFileName(str(file))
    reader.Update()
    return reader.GetOutput()


def run(*command):
    done = subprocess.run([str(word) for word in command], env=ONE_THREAD, capture_output=True, text=True)
    if done.returncode > 1:
        raise RuntimeError(f"{command[0]}: {done.stderr[-500:]}")


def distances(mesh, points):
    """Signed distances of points to the surface of a mesh of curved cells."""
    surface = vtk.vtkDataSetSurfaceFilter()
    surface.SetInputData(read(vtk.vtkXMLUnstructuredGridReader(), mesh))
    surface.SetNonlinearSubdivisionLevel(2)
    surface.Update()
    distance = vtk.vtkImplicitPolyDataDistance()
    distance.SetInput(surface.GetOutput())
    return np.array([distance.EvaluateFunction(point) for point in points])


def mean_edge(file):
    surface = read(vtk.vtkXMLPolyDataReader(), file)
    points = vtk_to_numpy(surface.GetPoints().GetData())
    corners = vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return np.mean([np.linalg.norm(points[corners[:, i]] - points[corners[:, (i + 1) % 3]], axis=1) for i in range(3)])


def supine(bin_folder, case, model, folder, triangles, refined):
    """The solved supine mesh."""
    run("make", "-s", "-f", PIPELINE, f"BIN={bin_folder}", f"CASE={case}", f"OUT={folder}", f"TRIANGLES={triangles}",
        "THREADS=1", "mesh")
    mesh = folder / "mesh.vtu"
    if refined:
        mesh = folder / "refined.vtu"
        run(bin_folder / "supine-tetrahedralise", folder / "coarse.vtp", folder / "muscle.vtp", folder / "labels.vti",
            "--order", 2, "--fine", folder / "breast.vtp", "--skin-edge-mm",
            f"{mean_edge(folder / 'coarse.vtp') / 2:.2f}", "-o", mesh, "--force")
    out = folder / f"solved-{mesh.stem}"
    run(bin_folder / "supine-simulate", case, mesh, "--pose", "supine", "--model", model, "-o", out, "--force")
    return out / "supine.vtu"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/bin"))
    parser.add_argument("cases", nargs="+", help="CASE or CASE:MODEL.toml")
    asked = parser.parse_args()
    print("| case | off, rms mm | after what is taken away | true change over it | correlation |\n|---|---|---|---|---|")
    for text in asked.cases:
        case, _, model = text.partition(":")
        scan = vtk_to_numpy(read(vtk.vtkPLYReader(), f"{case}/supine.ply").GetPoints().GetData())[::15].astype(float)
        folder = asked.work / case.strip("/").replace("/", "_")
        given, refined, fine = (
            distances(supine(asked.bin.resolve(), case, model or f"{case}/model.toml", folder / triangles, triangles,
                             end), scan)
            for triangles, end in ((COARSE, False), (COARSE, True), (FINE, True)))
        near = abs(given) < 8  # mm: over the skin
        error, shown = (given - fine)[near], (given - refined)[near]
        print(f"| {case} | {np.sqrt(np.mean(error**2)):.2f} | {np.sqrt(np.mean((error - shown)**2)):.2f} | "
              f"{shown @ error / (shown @ shown):.2f} | {np.corrcoef(shown, error)[0, 1]:.2f} |", flush=True)


if __name__ == "__main__":
    main()
