#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Breasts that move as far as volunteers' do: how each chain ends, and how far the population moves.

    bench/population.py WORK [--cases N] [--seed N] [--bin build/bin] [--jobs 2] [--rings 11] [--order 2]
                        [--triangles 2500] [--chain-order 1] [--rows FILE] [--slow [--successes 40]] [--table]

Draws cases (supine-phantom --population volunteers), meshes them and runs supine-simulate at the true moduli. A row of
WORK/rows.jsonl (--rows) is written as soon as a chain has ended; a call goes on from the rows that are there, so that
the file alone takes a run to another machine. --slow runs every
failure and 40 certified chains (--successes) again, on a finer mesh and in small load steps, into WORK/slow.jsonl.
The tables are Markdown; --table prints them from the rows and runs nothing. Standard library only.
"""

import argparse
import concurrent.futures
import csv
import json
import math
import os
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
import threading

HERE = pathlib.Path(__file__).resolve().parent
FINER = 2  # times the triangles
LOAD_STEPS = 32
OUTCOMES = ("certificate", "several equilibria", "no equilibrium", "error")
# 63 volunteers: median, quartiles (github.com/JialiXu12/motion-landmarks).
VOLUNTEERS = {"nipple, prone to supine, mm": (96, 80, 118), "points inside, mm": (68, 52, 89),
              "the same relative to the nipple, mm": (34, 21, 51),
              "distance to the ribs or muscle, prone, mm": (27, 15, 53),
              "the same, supine, mm": (17, 12, 25), "distance to the skin, prone, mm": (24, 16, 33),
              "the same, supine, mm ": (25, 16, 34), "thickness there, supine over prone": (0.7, 0.6, 1.0)}


def run(command, log, limit_s):
    """Runs to the end, output into log. Returns exit code (None: stopped at the limit) and CPU seconds.
    @raise KeyboardInterrupt  stopped from outside: the next call goes on, no row is written"""
    stopped = threading.Event()
    with open(log, "ab") as file:
        process = subprocess.Popen([str(word) for word in command], stdout=file, stderr=file,
                                   env={**os.environ, "OMP_NUM_THREADS": "1"})
        timer = threading.Timer(limit_s, lambda: (stopped.set(), process.terminate()))
        timer.start()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        timer.cancel()
    seconds = usage.ru_utime + usage.ru_stime
    if process.returncode >= 0 and process.returncode != 130:
        return process.returncode, seconds
    if not stopped.is_set():
        raise KeyboardInterrupt
    return None, seconds


def draw(options, name, seed):
    answer = options.work / "answers" / f"{name}.json"
    if answer.exists():
        return 0, 0.0
    truth = ["--rings", options.rings, "--order", options.order, "--voxel-mm", options.voxel_mm]
    return run([options.bin / "supine-phantom", "--population", "volunteers", "--seed", seed, *truth, "-o",
                options.work / "cases" / name, "--answer", answer, "--threads", 1, "--force"],
               options.work / "logs" / f"{name}.phantom.txt", options.limit_s)


def write_true_model(case, answer, target):
    """The case's model with the moduli that its truth has."""
    text = (case / "model.toml").read_text()
    for section in ("breast", "skin"):
        value = answer["base"][f"{section}.young_modulus_kpa"]
        text = re.sub(rf"(\[{section}\][^\[]*?young_modulus_kpa = {{ value = )[\d.]+", rf"\g<1>{value:.9g}", text)
    target.write_text(text)


def marks(file):
    with open(file, encoding="utf-8") as text:
        return {row["name"]: [float(row[axis]) for axis in "xyz"] for row in csv.DictReader(text)}


def said_of(log):
    lines = [line for line in log.read_text(errors="replace").splitlines() if "error" in line or "warning" in line]
    return lines[-1].split(": ", 2)[-1] if lines else ""


def outcome_of(code, said):
    if code == 0:
        return "certificate"
    if code == 1 and ("equilibri" in said or "balanced" in said):
        return "several equilibria"
    return "no equilibrium" if code == 3 and "no equilibrium" in said else "error"


def chain(options, name, triangles, label):
    """Meshes the case and solves it at its true moduli. Returns what a row says of it."""
    case, out = options.work / "cases" / name, options.work / label / name
    answer = json.loads((options.work / "answers" / f"{name}.json").read_text())
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    log = options.work / "logs" / f"{name}.{label}.txt"
    log.unlink(missing_ok=True)
    code, mesh_s = run(["make", "-f", HERE.parent / "pipeline" / "Makefile", f"BIN={options.bin}", f"CASE={case}",
                        f"OUT={out}", f"TRIANGLES={triangles}", f"ORDER={options.chain_order}", "THREADS=1", "mesh"],
                       log, options.limit_s)
    if code != 0:
        return {"outcome": "error", "said": f"meshing: {said_of(log)}", "seconds": {"mesh": mesh_s}}
    write_true_model(case, answer, out / "truth.toml")
    code, simulate_s = run([options.bin / "supine-simulate", case, out / "mesh.vtu", "--model", out / "truth.toml",
                            "--pose", "supine", "-o", out, "--threads", 1, "--force"], log, options.limit_s)
    said = said_of(log) if code != 0 else ""
    found = {"outcome": outcome_of(code, said), "said": said if code is not None else "stopped at the limit of time",
             "seconds": {"mesh": mesh_s, "simulate": simulate_s}}
    if code in (0, 1):
        found |= solved(case, out)
    return found


def solved(case, out):
    figures = json.loads((out / "supine.json").read_text())
    prone, supine, truth = (marks(file) for file in (out / "prone_landmarks.csv", out / "supine_landmarks.csv",
                                                     case / "supine_landmarks.csv"))
    return {"round_trip_mm": figures["round_trip_max_mm"], "second_shape_mm": figures["second_shape_mm"],
            "newton": figures["newton_iterations"], "load_steps": figures["load_steps"],
            "min_det_f": figures["min_det_f"], "nodes": figures["nodes"], "nipple": supine["nipple"],
            "nipple_moved_mm": math.dist(prone["nipple"], supine["nipple"]),
            "landmarks_off_mm": math.sqrt(statistics.mean(math.dist(supine[n], truth[n]) ** 2 for n in truth))}


def one_case(options, seed):
    name = f"volunteer-{seed:03d}"
    code, seconds = draw(options, name, seed)
    if code != 0:
        log = options.work / "logs" / f"{name}.phantom.txt"
        said = said_of(log) if code is not None else "stopped at the limit of time"
        return {"seed": seed, "outcome": "error", "said": f"phantom: {said}", "seconds": {"phantom": seconds}}
    answer = json.loads((options.work / "answers" / f"{name}.json").read_text())
    row = {"seed": seed} | {key: answer[key] for key in ("base", "geometry", "volume_ml", "gave_way", "motion")}
    row |= chain(options, name, options.triangles, "out")
    row["commit"] = answer["provenance"]["commit"]
    row["chain"] = {"order": options.chain_order, "triangles": options.triangles}
    row["truth"] = {"order": options.order, "rings": options.rings, "voxel_mm": options.voxel_mm}
    return row


def slow_case(options, seed):
    """The same breast on a finer mesh, and on the same mesh in small load steps."""
    name = f"volunteer-{seed:03d}"
    out = options.work / "out" / name
    row = {"seed": seed, "finer": chain(options, name, FINER * options.triangles, "finer")}
    if (out / "mesh.vtu").exists():
        target = options.work / "logs" / f"{name}.steps.json"
        log = options.work / "logs" / f"{name}.steps.txt"
        code, seconds = run([options.bin / "bench_load_steps", options.work / "cases" / name, out / "mesh.vtu",
                             out / "truth.toml", target, "--steps", LOAD_STEPS, "--like", out], log, options.limit_s)
        row["steps"] = json.loads(target.read_text()) if code == 0 else {"outcome": "error", "said": said_of(log)}
        row["steps"]["seconds"] = seconds
    return row


def read_rows(file):
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


def run_all(work, jobs, seeds, file):
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        waiting = {pool.submit(work, seed): seed for seed in seeds}
        for done in concurrent.futures.as_completed(waiting):
            with open(file, "a", encoding="utf-8") as stream:
                stream.write(json.dumps(done.result()) + "\n")
            print(f"seed {waiting[done]} done", file=sys.stderr, flush=True)


def slow_seeds(rows, successes):
    certified = [row["seed"] for row in rows if row["outcome"] == "certificate"]
    failed = [row["seed"] for row in rows if row["outcome"] != "certificate" and "base" in row]
    return failed + certified[:successes]


def quartiles(values):
    low, middle, high = statistics.quantiles(values, n=4, method="inclusive")
    return middle, low, high


def population_table(rows):
    drawn = [row["motion"] for row in rows if "motion" in row]
    inside = [place for motion in drawn for place in motion["inside"]]
    thickness = [(p["muscle_mm"][1] + p["skin_mm"][1]) / (p["muscle_mm"][0] + p["skin_mm"][0]) for p in inside]
    ours = [[motion["nipple_moved_mm"] for motion in drawn], [p["moved_mm"] for p in inside],
            [p["from_nipple_mm"] for p in inside]]
    ours += [[p[to][pose] for p in inside] for to in ("muscle_mm", "skin_mm") for pose in (0, 1)] + [thickness]
    print(f"\n| | volunteers | {len(drawn)} computed breasts |\n|---|---|---|")
    for (label, theirs), values in zip(VOLUNTEERS.items(), ours):
        digits = 2 if label.startswith("thickness") else 0
        cells = ["{:.{d}f} ({:.{d}f} to {:.{d}f})".format(*three, d=digits) for three in (theirs, quartiles(values))]
        print(f"| {label.strip()} | {cells[0]} | {cells[1]} |")
    mean = [statistics.mean(motion["nipple_mm"][axis] for motion in drawn) for axis in range(3)]
    print(f"| nipple, mean vector outward, back, along the body, mm | 49, 84, 20 | {mean[0]:.0f}, {mean[1]:.0f}, "
          f"{mean[2]:.0f} |")


def outcome_table(rows):
    print("\n| how the chain ends | breasts | CPU s of supine-simulate, median / most |\n|---|---|---|")
    for outcome in OUTCOMES:
        seconds = [row["seconds"].get("simulate", 0) for row in rows if row["outcome"] == outcome]
        times = f"{statistics.median(seconds):.1f} / {max(seconds):.1f}" if seconds else "–"
        print(f"| {outcome} | {len(seconds)} | {times} |")


def failure_table(rows):
    print("\n| seed | foot radius, height mm | E, skin kPa | nipple mm | what was said |\n|---|---|---|---|---|")
    for row in sorted(rows, key=lambda row: row["seed"]):
        if row["outcome"] == "certificate":
            continue
        said = row["said"].split(". A softer")[0]
        if "base" not in row:
            print(f"| {row['seed']} | – | – | – | {said} |")
            continue
        shape, base = row["geometry"], row["base"]
        print(f"| {row['seed']} | {shape['foot_radius_mm']:.0f}, {shape['height_mm']:.0f} | "
              f"{base['breast.young_modulus_kpa']:.2f}, {base['skin.young_modulus_kpa']:.0f} | "
              f"{row['motion']['nipple_moved_mm']:.0f} | {said} |")


def slow_table(rows, slow):
    known = {row["seed"]: row for row in rows}
    print("\n| seed | default | finer mesh | nipple apart, mm | small load steps | nodes apart, most, mm |\n"
          "|---|---|---|---|---|---|")
    for row in sorted(slow, key=lambda row: row["seed"]):
        default, finer, steps = known[row["seed"]], row["finer"], row.get("steps", {})
        both = "nipple" in default and "nipple" in finer
        apart = f"{math.dist(default['nipple'], finer['nipple']):.1f}" if both else "–"
        nodes = f"{steps['apart_mm']:.1e}" if steps.get("apart_mm") is not None else "–"
        cells = [row["seed"], default["outcome"], finer["outcome"], apart, steps.get("outcome", "–"), nodes]
        print("| " + " | ".join(map(str, cells)) + " |")


def tell(rows, slow):
    print(f"{len(rows)} breasts; of {sum(bool(row.get('gave_way')) for row in rows)} the moduli drawn were not carried "
          "at once.")
    outcome_table(rows)
    if sum("motion" in row for row in rows) > 1:
        population_table(rows)
    off = [row["landmarks_off_mm"] for row in rows if "landmarks_off_mm" in row and row["outcome"] == "certificate"]
    if len(off) > 1:
        print("\nCertified chains: landmarks off the truth, RMS, median (quartiles) "
              "{:.1f} ({:.1f} to {:.1f}) mm.".format(*quartiles(off)))
    failure_table(rows)
    if slow:
        slow_table(rows, slow)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--cases", type=int, default=400)
    parser.add_argument("--seed", type=int, default=1, help="of the first case; the others follow")
    parser.add_argument("--bin", type=pathlib.Path, default=pathlib.Path("build/bin"))
    parser.add_argument("--jobs", type=int, default=2, help="cases side by side, one thread each")
    parser.add_argument("--rings", type=int, default=11, help="fineness of the truth")
    parser.add_argument("--order", type=int, default=2, help="of the truth's elements")
    parser.add_argument("--voxel-mm", type=float, default=1.5)
    parser.add_argument("--triangles", type=int, default=2500, help="of the chain's mesh")
    parser.add_argument("--chain-order", type=int, default=1, help="of the chain's elements")
    parser.add_argument("--limit-s", type=float, default=1800, help="of every program, wall clock")
    parser.add_argument("--slow", action="store_true", help="failures and successes again, finer and in small steps")
    parser.add_argument("--successes", type=int, default=40, help="how many of them --slow runs")
    parser.add_argument("--rows", type=pathlib.Path, help="default WORK/rows.jsonl")
    parser.add_argument("--table", action="store_true", help="only print the tables")
    options = parser.parse_args()
    options.work, options.bin = options.work.resolve(), options.bin.resolve()
    return options


def main():
    options = arguments()
    for folder in ("cases", "answers", "out", "logs"):
        (options.work / folder).mkdir(parents=True, exist_ok=True)
    file, slow_file = options.rows or options.work / "rows.jsonl", options.work / "slow.jsonl"
    if not options.table:
        known = {row["seed"] for row in read_rows(file)}
        wanted = range(options.seed, options.seed + options.cases)
        run_all(lambda seed: one_case(options, seed), options.jobs, [s for s in wanted if s not in known], file)
        if options.slow:
            known = {row["seed"] for row in read_rows(slow_file)}
            wanted = [seed for seed in slow_seeds(read_rows(file), options.successes) if seed not in known]
            run_all(lambda seed: slow_case(options, seed), options.jobs, wanted, slow_file)
    tell(read_rows(file), read_rows(slow_file))


if __name__ == "__main__":
    main()
