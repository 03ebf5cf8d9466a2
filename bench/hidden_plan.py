# SPDX-License-Identifier: AGPL-3.0-or-later
"""Which cases a run of the blind benchmark has: the options of supine-phantom for each, from a seed."""

import hashlib
import itertools
import random

EFFECTS = ["adhesion", "ligament", "friction", "strain_stiffening", "fibre_anisotropy", "incompressibility",
           "gland_stiffness", "tumour_stiffness", "stiffness_gradient", "skin_prestretch", "skin_stiffening", "creep",
           "arm_traction", "chest_wall_motion", "gravity_tilt", "misregistration", "segmentation_offset"]
OUTSIDE = ["coil_contact", "scar", "skin_gradient"]
FOREIGN = OUTSIDE + ["gland_capsule", "sagging_support"]
# Named in five of six cases or more of the mixture, and with a range of sizes.
IN_SIGHT = ["adhesion", "arm_traction", "chest_wall_motion", "fibre_anisotropy", "friction", "gland_stiffness",
            "gravity_tilt", "ligament", "stiffness_gradient"]
DOSED, SIZES, BODIES = ["ligament", "gland_stiffness", "gravity_tilt"], [0, 0.5, 1], 5
PAIR_SIZE = 0.75
# One hand of the mixture: as many nulls as single effects, some with two, some from outside the catalogue.
KINDS = ["effect"] * 5 + ["null"] * 5 + ["two", "outside"]
REALISTIC_KINDS = ["effect"] * 4 + ["null"] * 4 + ["two", "two", "three", "outside"]


def deck(cards, seed, name, count):
    """The first `count` cards of shuffled decks laid one after the other: every prefix is close to balanced."""
    drawn, number = [], 0
    while len(drawn) < count:
        hand = list(cards)
        random.Random(f"{seed} {name} {number}").shuffle(hand)
        drawn += hand
        number += 1
    return drawn[:count]


def distinct(cards, number):
    """The next `number` cards that differ from each other."""
    drawn = []
    while len(drawn) < number:
        card = next(cards)
        if card not in drawn:
            drawn.append(card)
    return drawn


def effect_words(names):
    return [word for name in names for word in ("--effect", name)]


def seed_of(seed, name, number):
    """A phantom's seed of its own for each case of a set."""
    return int.from_bytes(hashlib.sha256(f"{seed} {name} {number}".encode()).digest()[:6], "big")


def mixture(count, seed):
    kinds = deck(KINDS, seed, "kind", count)
    singles = iter(deck(EFFECTS, seed, "single", count))
    pairs = iter(deck(EFFECTS, seed, "pair", 2 * count))
    others = iter(deck(OUTSIDE, seed, "outside", count))
    cases = []
    for number, kind in enumerate(kinds, 1):
        options = ["--seed", str(1000 * seed + number)]
        if kind == "effect":
            options += effect_words([next(singles)])
        elif kind == "two":
            first, second = next(pairs), next(pairs)
            while second == first:
                second = next(pairs)
            options += effect_words([first, second])
        elif kind == "outside":
            options += ["--outside", next(others)]
        else:
            options += ["--effect", "null"]
        cases.append(options)
    return cases


def realistic(count, seed):
    """As the mixture, with up to three effects. All tissue stiffens in them: strain_stiffening would say nothing."""
    kinds = deck(REALISTIC_KINDS, seed, "realistic kind", count)
    effects = [name for name in EFFECTS if name != "strain_stiffening"]
    singles = iter(deck(effects, seed, "realistic single", count))
    several = iter(deck(effects, seed, "realistic several", 6 * count))
    others = iter(deck(FOREIGN, seed, "realistic outside", count))
    words = {"effect": lambda: effect_words([next(singles)]), "null": lambda: ["--effect", "null"],
             "two": lambda: effect_words(distinct(several, 2)), "three": lambda: effect_words(distinct(several, 3)),
             "outside": lambda: ["--outside", next(others)]}
    return [["--seed", str(seed_of(seed, "realistic", number)), *words[kind]()]
            for number, kind in enumerate(kinds, 1)]


def prior(count, seed):
    return [["--seed", str(seed_of(seed, "prior", number)), "--prior"] for number in range(1, count + 1)]


def pairs(count, seed):
    """Two effects in sight, large ones; no pair twice before all have been."""
    chosen = deck(list(itertools.combinations(IN_SIGHT, 2)), seed, "pairs", count)
    return [["--seed", str(seed_of(seed, "pairs", number)), "--size", str(PAIR_SIZE), *effect_words(names)]
            for number, names in enumerate(chosen, 1)]


def foreign(count, seed):
    return [["--seed", str(seed_of(seed, "foreign", number)), "--outside", name]
            for number, name in enumerate(deck(FOREIGN, seed, "foreign", count), 1)]


def doses(count, seed):
    """Every body has every effect at every size, so that sizes are compared on the same breasts."""
    wanted = [(body, effect, size) for body in range(1, BODIES + 1) for effect in DOSED for size in SIZES]
    return [["--seed", str(seed_of(seed, "doses", body)), "--size", str(size), "--effect", effect]
            for body, effect, size in wanted[:count]]


def large(count, seed):
    """Breasts that move as far as volunteers': as many healthy ones as with one effect in sight."""
    healthy = deck([True, False], seed, "large healthy", count)
    singles = iter(deck(IN_SIGHT, seed, "large single", count))
    return [["--seed", str(seed_of(seed, "large", number)), "--population", "volunteers",
             *(effect_words(["null"]) if null else ["--size", str(PAIR_SIZE), *effect_words([next(singles)])])]
            for number, null in enumerate(healthy, 1)]


# Sets by name, each with the number of cases it has unless told otherwise.
SETS = {"mixture": (60, mixture), "realistic": (60, realistic), "prior": (120, prior), "pairs": (24, pairs),
        "foreign": (24, foreign), "doses": (len(DOSED) * len(SIZES) * BODIES, doses), "large": (24, large)}


def plan(name, count, seed, with_nuisances=False):
    """(name, options of supine-phantom) of each case. What has been made stays what it is when more are asked for."""
    cases = SETS[name][1](count, seed)
    more = ["--realistic"] if with_nuisances or name in ("realistic", "large") else []
    return [(f"case-{number:03d}", options + more) for number, options in enumerate(cases, 1)]


def quarter(cases, which):
    """Every fourth case from the given one on, 1 to 4: a run of its own, as mixed as the whole."""
    return cases[which - 1::4]
