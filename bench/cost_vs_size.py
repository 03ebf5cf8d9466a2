#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Cost against size: meshes the half ellipsoid with Gmsh, runs bench_cost_vs_size on each size, writes CSV and plot.

    bench/cost_vs_size.py DATA/meshes/breast.geo WORK [--bin build/bin] [--repeats 3] [--plot docs/images/cost_vs_size.png]
                          [--linear 1,3,10,30,100,300] [--quadratic 1,3,10,30]

Sizes are thousands of tetrahedra asked for. Needs gmsh, and python3-matplotlib for the plot; says so and stops with
code 0 where gmsh is absent. Each row is the run of median wall time out of --repeats whole processes.
"""

import argparse
import csv
import os
import pathlib
import shutil
import subprocess
import sys

ENVIRONMENT = {**os.environ, "OPENBLAS_NUM_THREADS": "1",
               "OPENBLAS_CORETYPE": os.environ.get("OPENBLAS_CORETYPE", "SkylakeX")}
LARGEST_INVERSE = 100  # thousand linear tetrahedra; the unsymmetric factors of more do not fit a small machine
QUADRATIC_INVERSE = 10


def mesh_of(arguments, thousands):
    file = arguments.work / f"breast_{thousands}k.vtk"
    if not file.exists():
        h = 0.0022 * (300 / thousands) ** (1 / 3)
        subprocess.run(["gmsh", "-3", "-setnumber", "h", f"{h:.6g}", "-format", "vtk", "-o", file, arguments.geometry],
                       check=True, stdout=subprocess.DEVNULL)
    return file


def measure(arguments, thousands, order):
    largest = LARGEST_INVERSE if order == 1 else QUADRATIC_INVERSE
    command = [arguments.bin / "bench_cost_vs_size", mesh_of(arguments, thousands), "--order", str(order), "--header"]
    if thousands > largest:
        command.append("--no-inverse")
    runs = []
    for _ in range(arguments.repeats):
        done = subprocess.run(command, env=ENVIRONMENT, stdout=subprocess.PIPE, universal_newlines=True, check=True)
        runs += csv.DictReader(done.stdout.splitlines())
    runs.sort(key=lambda row: float(row["wall_s"]))
    return runs[len(runs) // 2]


def plot(rows, file):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as pyplot
    figure, axes = pyplot.subplots(figsize=(7, 5))
    curves = [("forward_s", "forward solve", "-o"), ("inverse_s", "inverse solve", "-s"),
              ("cholesky_s", "one Cholesky factorisation", "--"), ("lu_s", "one LU factorisation", ":")]
    for order, colour in (("1", "tab:blue"), ("2", "tab:orange")):
        for key, label, style in curves:
            points = [(int(row["dofs"]), float(row[key])) for row in rows
                      if row["order"] == order and float(row[key]) > 0]
            if points:
                axes.loglog(*zip(*points), style, color=colour,
                            label=f"{'linear' if order == '1' else 'quadratic'}, {label}")
    axes.set_xlabel("degrees of freedom")
    axes.set_ylabel("seconds")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(fontsize=8)
    figure.tight_layout()
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=130)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("geometry", type=pathlib.Path, help="breast.geo")
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/bin"))
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--linear", default="1,3,10,30,100,300")
    parser.add_argument("--quadratic", default="1,3,10,30")
    parser.add_argument("--plot", type=pathlib.Path)
    arguments = parser.parse_args()
    if shutil.which("gmsh") is None:
        print("Gmsh is not installed (apt-get install gmsh): cost against size skipped")
        return 0
    arguments.work.mkdir(parents=True, exist_ok=True)
    rows = []
    with open(arguments.work / "cost_vs_size.csv", "w") as out:
        for order, sizes in ((1, arguments.linear), (2, arguments.quadratic)):
            for thousands in filter(None, sizes.split(",")):
                rows.append(measure(arguments, float(thousands), order))
                writer = csv.DictWriter(out, rows[0].keys())
                if len(rows) == 1:
                    writer.writeheader()
                writer.writerow(rows[-1])
                out.flush()
                print(rows[-1])
    print("\n| order | tetrahedra | dofs | forward s | Newton | one Cholesky s | inverse s | one LU s | peak MB |\n"
          "|---|---|---|---|---|---|---|---|---|")
    for row in rows:
        inverse = [row["inverse_s"], row["lu_s"]] if float(row["inverse_s"]) > 0 else ["–", "–"]
        print("| " + " | ".join([row["order"], row["tets"], row["dofs"], row["forward_s"], row["forward_newton"],
                                 row["cholesky_s"], *inverse, row["peak_mb"]]) + " |")
    if arguments.plot:
        plot(rows, arguments.plot)
    return 0


if __name__ == "__main__":
    sys.exit(main())
