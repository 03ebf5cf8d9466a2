# SPDX-License-Identifier: AGPL-3.0-or-later
"""How verdicts stand to the truth: outcomes, confusion matrix, rates with 95 % Wilson intervals."""

import statistics

SEEN = 0.9  # power from which an effect counts as one that the data can see
# The phantom's region has another shape or place than the catalogue's: its size is not quite the same quantity.
RESHAPED = ("arm_traction", "chest_wall_motion", "ligament")
SEVERAL = {"two": "two effects", "three": "three effects"}


def wilson(hits, count):
    """95 % interval of a rate (Wilson 1927)."""
    if count == 0:
        return (0.0, 1.0)
    z = statistics.NormalDist().inv_cdf(0.975)
    middle = (hits + z * z / 2) / (count + z * z)
    half = z / (count + z * z) * (hits * (count - hits) / count + z * z / 4) ** 0.5
    return (max(0.0, middle - half), min(1.0, middle + half))


def rate(hits, count):
    if count == 0:
        return "0/0"
    low, high = wilson(hits, count)
    return f"{hits}/{count} = {100 * hits / count:.0f} % [{100 * low:.0f}, {100 * high:.0f}]"


def named(case):
    """What was named, less what counts neither as right nor as wrong there."""
    neither = [name for name in case.get("neither", []) if name not in case["causes"] or name == "strain_stiffening"]
    return [name for name in case["missing"] if name not in neither]


def outcome(case):
    """How the verdict stands to the truth."""
    verdict, names, causes = case["verdict"], named(case), case["causes"]
    if verdict in ("nothing_missing", "failed", "unexplained"):
        return verdict
    if not names:
        return "neither"
    inside = [name for name in names if name in causes]
    if verdict == "missing":
        return "right" if len(inside) == len(names) else "wrong"
    return "in set" if inside else "wrong set"


def truth_of(case):
    name = {"null": "nothing", **SEVERAL}.get(case["kind"], "+".join(case["causes"]))
    if case.get("size") is not None and case["kind"] == "effect":
        name += f" (size {case['size']:g})"
    return name + (" (outside)" if case["kind"] == "outside" else "")


def confusion(cases):
    """Rows: truth; columns: what was named alone, then the other outcomes."""
    rows = {}
    for case in cases:
        said = "+".join(case["missing"]) if case["verdict"] == "missing" else outcome(case)
        row = rows.setdefault(truth_of(case), {})
        row[said] = row.get(said, 0) + 1
    return rows


def count(cases, wanted):
    return sum(1 for case in cases if wanted(case))


def is_outcome(*names):
    return lambda case: outcome(case) in names


def names_all(case):
    return set(case["causes"]) <= set(case["missing"])


def single_rates(effect):
    seen = [case for case in effect if case["power"] >= SEEN]
    sets = [case for case in effect if case["verdict"] == "ambiguous"]
    blamed = [case for case in effect if case["verdict"] in ("missing", "ambiguous")]
    wrong = is_outcome("wrong", "wrong set")
    return [("one effect: named alone, rightly (top-1)", count(effect, is_outcome("right")), len(effect)),
            ("one effect: named, or in the set", count(effect, is_outcome("right", "in set")), len(effect)),
            (f"same, effects seen with power >= {SEEN}: named alone", count(seen, is_outcome("right")), len(seen)),
            (f"same, effects seen with power >= {SEEN}: named, or in the set",
             count(seen, is_outcome("right", "in set")), len(seen)),
            ("one effect: wrong blame (truth not among the named)", count(effect, wrong), len(effect)),
            ("one effect: wrong, of those where something was named", count(blamed, wrong), len(blamed)),
            ("ambiguous sets that hold the truth", count(sets, is_outcome("in set")), len(sets))]


def null_rates(null):
    return [("null: false alarm (something named)", count(null, is_outcome("wrong", "wrong set")), len(null)),
            ("null: false alarm or unexplained",
             count(null, lambda c: outcome(c) not in ("nothing_missing", "neither")), len(null)),
            ("null: smallest p < 0.05", count(null, lambda c: c["p"] is not None and c["p"] < 0.05), len(null))]


def several_rates(cases, what, number):
    """Of cases with two or three effects."""
    return [(f"{what}: all that is named is there", count(cases, is_outcome("right", "in set")), len(cases)),
            (f"{what}: {number} named, and nothing else",
             count(cases, lambda c: outcome(c) == "right" and names_all(c)), len(cases)),
            (f"{what}: {number} named, or in the set",
             count(cases, lambda c: outcome(c) in ("right", "in set") and names_all(c)), len(cases)),
            (f"{what}: wrong blame", count(cases, is_outcome("wrong", "wrong set")), len(cases))]


def outside_rates(outside):
    return [("outside the catalogue: wrong blame (something named)",
             count(outside, is_outcome("wrong", "wrong set")), len(outside)),
            ("outside the catalogue: unexplained", count(outside, is_outcome("unexplained")), len(outside))]


def held(rows):
    return count(rows, lambda row: row[-2] <= row[-3] <= row[-1]), len(rows)


def upper_half(rows):
    """Whether the truth lies above the interval's geometric middle: half of the time, where it is not biased."""
    return count(rows, lambda row: row[1] > max(0.0, row[2] * row[3]) ** 0.5), len(rows)


def interval_rates(cases):
    effect = [case for case in cases if case["kind"] == "effect"]
    right = [row for case in effect if outcome(case) == "right" for row in case["intervals"]]
    moduli = [row for case in cases if case["kind"] == "null" for row in case["moduli"]]
    reshaped = [row for row in right if row[0].split(".")[0] in RESHAPED]
    same = [row for row in right if row[0].split(".")[0] not in RESHAPED]
    places = [row for case in cases for row in case.get("places", [])]
    rest = [case["unexplained"] for case in cases if case.get("unexplained")]
    sizes = "95 % intervals of rightly named effects that hold the truth"
    return [(sizes, *held(same)), (f"{sizes} ({', '.join(RESHAPED)}: shaped otherwise)", *held(reshaped)),
            ("95 % intervals of calibrated moduli of nulls that hold the truth", *held(moduli)),
            ("calibrated moduli of nulls: truth above the interval's geometric middle", *upper_half(moduli)),
            ("95 % intervals of the scans' place that hold the truth", *held(places)),
            ("95 % intervals of what is unexplained that hold the truth", *held(rest))]


def rates(cases):
    """The table of rates: (what, hits, of how many)."""
    of = {kind: [case for case in cases if case["kind"] == kind]
          for kind in ("effect", "null", "two", "three", "outside")}
    return (single_rates(of["effect"]) + null_rates(of["null"]) + several_rates(of["two"], "two effects", "both")
            + several_rates(of["three"], "three effects", "all three") + outside_rates(of["outside"])
            + interval_rates(cases))
