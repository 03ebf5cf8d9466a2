# SPDX-License-Identifier: AGPL-3.0-or-later
"""What is scored of one case: its sealed answer beside what a tool said. docs/hidden.md has the keys a tool writes."""

import json
import statistics

VERDICTS = ("nothing_missing", "missing", "ambiguous", "unexplained", "failed")
FAR_SIGMAS = 3  # of its nuisance, beyond which a cause counts as present
Z95 = statistics.NormalDist().inv_cdf(0.975)


def present(cause):
    """Whether a cause is there to be named: further from nothing than its nuisance goes (Mahalanobis distance)."""
    sigma = cause.get("nuisance_sigma")
    return not sigma or sum((cause["parameters"][name] / sigma[name]) ** 2 for name in sigma) > FAR_SIGMAS ** 2


def kind_of(causes):
    if any(cause["outside"] for cause in causes):
        return "outside"
    return ("null", "effect", "two", "three")[len(causes)]


def powers(diagnosis):
    found = {row["effect"]: row["power"] for row in diagnosis.get("cannot_see", []) if "power" in row}
    for row in diagnosis.get("candidates", []):
        if row.get("power") is not None:
            found[row["effect"]] = row["power"]
    return found


def sizes(answer, diagnosis):
    """(parameter, truth, low, high) of what the answer and the named effect's refit both have."""
    truth = {cause["name"]: cause["parameters"] for cause in answer["causes"] if not cause["outside"]}
    found = []
    for candidate in diagnosis.get("candidates", []):
        if candidate["effect"] not in diagnosis["missing"]:
            continue
        for row in candidate.get("parameters", []):
            name = row["name"].removeprefix(candidate["effect"] + ".")
            value = truth.get(candidate["effect"], {}).get(name)
            bounds = row.get("interval95")
            if value is not None and bounds and None not in bounds:
                found.append((f"{candidate['effect']}.{name}", value, bounds[0], bounds[1]))
    return found


def moduli(answer, calibration):
    return [(row["name"], answer["base"][row["name"]], *row["interval95"]) for row in calibration.get("parameters", [])
            if row["name"] in answer["base"] and row.get("interval95")]


def places(answer, diagnosis):
    """(pose.component, truth, low, high) of where the scans lie; mm and degrees."""
    found = []
    for row in diagnosis.get("registration", []):
        place = answer.get("scan_place", {}).get(row["pose"])
        if place is None:
            continue
        truth = place["shift_mm"] + [180 / 3.141592653589793 * turn for turn in place["turn_rad"]]
        for index, (value, sd) in enumerate(zip(row["shift_mm"] + row["turn_deg"], row["sd"])):
            name = ("shift_{}_mm" if index < 3 else "turn_{}_deg").format("xyz"[index % 3])
            found.append((f"{row['pose']}.{name}", truth[index], value - Z95 * sd, value + Z95 * sd))
    return found


def unexplained(answer, diagnosis):
    """(truth, low, high) of the RMS that no effect explains, mm, or None."""
    bounds = diagnosis.get("unexplained95")
    if bounds is None or "discrepancy" not in answer:
        return None
    squares = [rms ** 2 for rms in answer["discrepancy"]["rms_mm"].values()]
    return [statistics.mean(squares) ** 0.5, *bounds]


def inclusion(diagnosis):
    """Stated probability of every effect, or {} where the tool states none."""
    if "included" in diagnosis:
        return {row["effect"]: row["probability"] for row in diagnosis["included"]}
    found = {}
    for row in diagnosis.get("hypotheses", []):
        for effect in row["effects"]:
            found[effect] = found.get(effect, 0) + row["probability"]
    return found


def probability_of(drawn, diagnosis):
    """Stated probability of exactly the set that was drawn; 0 where it is not listed, None where none are stated."""
    if "hypotheses" not in diagnosis:
        return None
    return sum(row["probability"] for row in diagnosis["hypotheses"] if sorted(row["effects"]) == sorted(drawn))


def read_json(file, otherwise):
    return json.loads(file.read_text()) if file.exists() else otherwise


def read_case(answer_file, results):
    """What is scored of one case, or None where there is no result yet."""
    answer = json.loads(answer_file.read_text())
    folder = results / answer_file.stem
    failed = (folder / "failed").exists()
    if not failed and not (folder / "diagnosis.json").exists():
        return None
    diagnosis = {"verdict": "failed", "missing": []} if failed else json.loads((folder / "diagnosis.json").read_text())
    if diagnosis["verdict"] not in VERDICTS:
        raise SystemExit(f"{folder}/diagnosis.json: verdict '{diagnosis['verdict']}' is none of {', '.join(VERDICTS)}")
    causes = [cause for cause in answer["causes"] if present(cause)]
    names = [cause["name"] for cause in causes]
    drawn = [cause["name"] for cause in answer["causes"] if not cause["outside"]]
    known = powers(diagnosis)
    p_values = [row["p_value"] for row in diagnosis.get("candidates", []) if row.get("p_value") is not None]
    row = {"case": answer_file.stem, "seed": answer["seed"], "kind": kind_of(causes), "causes": names,
           "verdict": diagnosis["verdict"], "missing": list(diagnosis["missing"]),
           # An effect that a tool gives no power for counts as one it claims to see.
           "power": min((known.get(name, 1.0) for name in names), default=None),
           "intervals": [] if failed else sizes(answer, diagnosis),
           "moduli": moduli(answer, read_json(folder / "calibration.json", {})),
           "p": min(p_values, default=None), "seconds": read_json(folder / "seconds.json", {})}
    return row | {"drawn": drawn, "neither": answer.get("neither_right_nor_wrong", []), "size": answer.get("size"),
                  "places": places(answer, diagnosis), "unexplained": unexplained(answer, diagnosis),
                  "included": inclusion(diagnosis), "set_probability": probability_of(drawn, diagnosis)}
