#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""The half ellipsoid in CalculiX and in Supine, side by side on the same mesh files.

    bench/calculix.py DATA/meshes WORK [--bin build/bin] [--repeats 5] [--cases breast_3k:1:2,breast_3k:0.32:2,breast_30k:1:1]

A case is MESH:YOUNG_KPA:STAGES. Both programs run as whole processes, in turn, one thread each; times are medians. The
law is CalculiX's own neo-Hookean, without skin, Poisson ratio 0.45, gravity along -z, base fixed; stage 2 starts from the
shape of stage 1, taken as stress-free. CalculiX's tolerances and increments are its defaults, 0.1 at first.
Needs ccx (Debian: calculix-ccx); says so and stops with code 0 where it is absent.
"""

import argparse
import math
import os
import pathlib
import resource
import shutil
import statistics
import subprocess
import sys
import time

POISSON, DENSITY, GRAVITY = 0.45, 1000.0, 9.81
BENCH_ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1",
                     "OPENBLAS_CORETYPE": os.environ.get("OPENBLAS_CORETYPE", "SkylakeX")}


def read_mesh(path):
    """Points in metres and tetrahedra of a legacy ASCII VTK file."""
    words = iter(path.read_text().split())
    points, cells, types = [], [], []
    for word in words:
        if word == "POINTS":
            count = int(next(words))
            next(words)
            points = [[float(next(words)) for _ in range(3)] for _ in range(count)]
        elif word == "CELLS":
            count = int(next(words))
            next(words)
            cells = [[int(next(words)) for _ in range(int(next(words)))] for _ in range(count)]
        elif word == "CELL_TYPES":
            types = [int(next(words)) for _ in range(int(next(words)))]
    return points, [cell for cell, kind in zip(cells, types) if kind == 10]


def write_deck(path, points, cells, young_kpa, held):
    mu = 1000 * young_kpa / (2 * (1 + POISSON))
    bulk = 1000 * young_kpa / (3 * (1 - 2 * POISSON))
    with open(path, "w") as deck:
        deck.write("*NODE,NSET=ALL\n")
        for n, p in enumerate(points):
            deck.write(f"{n + 1},{p[0]:.12e},{p[1]:.12e},{p[2]:.12e}\n")
        deck.write("*ELEMENT,TYPE=C3D4,ELSET=BREAST\n")
        for e, cell in enumerate(cells):
            deck.write(f"{e + 1}," + ",".join(str(n + 1) for n in cell) + "\n")
        deck.write("*NSET,NSET=BASE\n" + "".join(f"{n + 1},\n" for n in held))
        deck.write(f"*MATERIAL,NAME=TISSUE\n*HYPERELASTIC,NEO HOOKE\n{mu / 2:.12e},{2 / bulk:.12e}\n")
        deck.write(f"*DENSITY\n{DENSITY}\n*SOLID SECTION,ELSET=BREAST,MATERIAL=TISSUE\n")
        deck.write("*BOUNDARY\nBASE,1,3,0.\n*STEP,NLGEOM,INC=1000\n*STATIC\n0.1,1.,1e-5,1.\n")
        deck.write(f"*DLOAD\nBREAST,GRAV,{GRAVITY},0.,0.,-1.\n*NODE PRINT,NSET=ALL,FREQUENCY=1000\nU\n*END STEP\n")


def last_displacements(path, count):
    """The last block of the .dat file, metres, one row per node."""
    rows = {}
    for line in path.read_text().splitlines():
        words = line.split()
        if len(words) == 4 and words[0].isdigit():
            rows[int(words[0]) - 1] = [float(w) for w in words[1:]]
    if len(rows) != count:
        raise RuntimeError(f"{path} has displacements of {len(rows)} nodes, {count} expected")
    return [rows[n] for n in range(count)]


def run(command, folder):
    """Wall and CPU seconds of a whole process."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(command, cwd=folder, env=BENCH_ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          universal_newlines=True)
    wall = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0 or "*ERROR" in done.stdout:
        raise RuntimeError(f"{' '.join(map(str, command))} failed:\n{done.stdout[-2000:]}")
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def run_calculix(work, mesh, young_kpa, stages):
    """Wall and CPU seconds over the stages, and the total displacement of every node (metres) after each."""
    points, cells = mesh
    held = [n for n, p in enumerate(points) if abs(p[2]) < 1e-9]
    wall, cpu, totals = 0.0, 0.0, []
    now = points
    for stage in range(1, stages + 1):
        write_deck(work / f"stage{stage}.inp", now, cells, young_kpa, held)
        seconds = run(["ccx", f"stage{stage}"], work)
        wall, cpu = wall + seconds[0], cpu + seconds[1]
        moved = last_displacements(work / f"stage{stage}.dat", len(points))
        now = [[a + b for a, b in zip(p, u)] for p, u in zip(now, moved)]
        totals.append([[1000 * (a - b) for a, b in zip(p, q)] for p, q in zip(now, points)])
    return wall, cpu, totals


def run_supine(program, work, data, name, young_kpa, stages):
    nodes = work / "supine.csv"
    command = [program, data / f"{name}.vtk", data / f"{name}_skin.vtk", str(young_kpa), "neo_hookean_calculix", "0",
               "--stages", str(stages), "--nodes", nodes]
    wall, cpu = run(command, work)
    totals = [[] for _ in range(stages)]
    for line in nodes.read_text().splitlines()[1:]:
        words = line.split(",")
        totals[int(words[0]) - 1].append([float(w) for w in words[2:5]])
    return wall, cpu, totals


def largest_difference(a, b):
    return max(math.dist(p, q) for p, q in zip(a, b))


def compare(arguments, name, young_kpa, stages):
    mesh = read_mesh(arguments.data / f"{name}.vtk")
    work = arguments.work / f"{name}_{young_kpa}"
    work.mkdir(parents=True, exist_ok=True)
    theirs, ours = [], []
    program = arguments.bin.resolve() / "bench_half_ellipsoid"
    for _ in range(arguments.repeats):
        theirs.append(run_calculix(work, mesh, young_kpa, stages))
        ours.append(run_supine(program, work, arguments.data.resolve(), name, young_kpa, stages))
    median = lambda runs, i: statistics.median(r[i] for r in runs)
    for stage in range(stages):
        reference, result = theirs[-1][2][stage], ours[-1][2][stage]
        largest = max(math.hypot(*u) for u in reference)
        difference = largest_difference(reference, result)
        print(f"| {name} | {young_kpa} | {stage + 1} | {reference[0][2]:.4f} | {result[0][2]:.4f} | {difference:.2e} | "
              f"{difference / largest:.1e} |")
    arguments.times.append(f"| {name}, E {young_kpa}, {stages} stage{'s' if stages > 1 else ''} | "
                           f"{median(theirs, 0):.3f} / {median(theirs, 1):.3f} | {median(ours, 0):.3f} / "
                           f"{median(ours, 1):.3f} | {median(theirs, 0) / median(ours, 0):.1f} / "
                           f"{median(theirs, 1) / median(ours, 1):.1f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=pathlib.Path, help="folder with breast_3k.vtk, breast_3k_skin.vtk, …")
    parser.add_argument("work", type=pathlib.Path, help="folder for decks and results")
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/bin"))
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--cases", default="breast_3k:1:2,breast_3k:0.32:2,breast_30k:1:1")
    arguments = parser.parse_args()
    if shutil.which("ccx") is None:
        print("CalculiX is not installed (apt-get install calculix-ccx): comparison skipped")
        return 0
    arguments.times = []
    print("| mesh | E kPa | stage | CalculiX tip mm | Supine tip mm | largest nodal difference mm | of the largest "
          "displacement |\n|---|---|---|---|---|---|---|")
    for case in arguments.cases.split(","):
        name, young_kpa, stages = case.split(":")
        compare(arguments, name, float(young_kpa), int(stages))
    print(f"\nMedians of {arguments.repeats}, run in turn, wall / user+system seconds of whole processes:\n\n"
          "| run | CalculiX | Supine | ratio |\n|---|---|---|---|")
    print("\n".join(arguments.times))
    return 0


if __name__ == "__main__":
    sys.exit(main())
