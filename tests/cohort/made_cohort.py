# SPDX-License-Identifier: AGPL-3.0-or-later
"""Results of a cohort with a known population, as the tools write them: nothing is solved."""

import json
import math
import pathlib
import random

AREAS = ("nipple area", "upper outer", "lower outer", "upper inner", "lower inner")


def ln_normal(x, variance):
    return -0.5 * (x * x / variance + math.log(2 * math.pi * variance))


def posterior(seen, noise, mean, sd):
    information = 1 / noise**2 + 1 / sd**2
    return (seen / noise**2 + mean / sd**2) / information, 1 / math.sqrt(information)


def modulus(name, ln_seen, noise):
    at, sd = posterior(ln_seen, noise, math.log(0.5), 0.5)
    low, high = math.exp(at - 1.96 * sd), math.exp(at + 1.96 * sd)
    return ({"name": name, "value": math.exp(at), "unit": "kPa", "start": 0.5, "interval95": [low, high], "at_bound": False},
            {"name": name, "coordinate": "ln(value)", "at": at, "sd": sd, "prior_mean": math.log(0.5), "prior_sd": 0.5, "likelihood": {"mean": ln_seen, "sd": noise}})


def single(effect, seen, noise):
    mean, sd = posterior(seen, noise, 1.0, 0.5)
    factor = ln_normal(seen - 1, noise**2 + 0.25) - ln_normal(seen, noise**2)
    return {"effect": effect, "ln_bayes_factor": factor, "numbers": [
        {"name": effect + ".log_ratio", "mean": mean, "sd": sd, "prior_mean": 1.0, "prior_sd": 0.5, "usual": 1.0, "usual_moves_mm": 1.0}]}


def make(cohort, patients, share, seed=1, report=None, failed=0):
    """Writes `patients` cases into the folder `cohort`; `share` of them have the effect present, nobody the effect absent."""
    draw = random.Random(seed)
    for i in range(patients):
        case = pathlib.Path(cohort) / f"patient-{i:03d}"
        out = case / "out"
        out.mkdir(parents=True)
        (case / "case.toml").write_text(f'[case]\nname = "patient-{i:03d}"\n')
        if i < failed:
            (out / "failed.txt").write_text("segment: labels.nrrd: value 7 is in no tissue </script><b>\n")
            continue
        parameter, coordinate = modulus("breast.young_modulus_kpa", draw.gauss(math.log(0.8), 0.3) + draw.gauss(0, 0.2), 0.2)
        present = single("present", (draw.gauss(0.9, 0.2) if draw.random() < share else 0) + draw.gauss(0, 0.45), 0.45)
        absent = single("absent", draw.gauss(0, 0.45), 0.45)
        rms = draw.uniform(0.7, 3)
        write = lambda name, what: (out / name).write_text(json.dumps(what))
        write("comparison.json", {"rms_mm": rms * 1.5, "mae_study_mm": rms, "areas": [
            {"name": name, "area_cm2": 40, "mae_mm": 1, "mean_signed_mm": draw.gauss(0, 1.5)} for name in AREAS]})
        write("calibration.json", {"rms_mm": rms, "parameters": [parameter], "worth": {"coordinates": [coordinate]}})
        write("diagnosis.json", {"verdict": "nothing_missing", "missing": [], "unexplained_mm": 0.3, "unexplained95": [0.1, 0.6],
                                 "included": [{"effect": s["effect"], "probability": 0.3, "bayes_factor": 1} for s in (present, absent)],
                                 "singles": [present, absent]})
        if report:
            (out / "report.html").write_text(report)
