#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""The scoring of the blind benchmark on made-up answers and verdicts, and its plan of cases."""

import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "bench"))
import hidden  # noqa: E402
import hidden_case  # noqa: E402
import hidden_plan  # noqa: E402
import hidden_pooled  # noqa: E402
import hidden_probability  # noqa: E402
import hidden_rates  # noqa: E402
import hidden_score  # noqa: E402


def answer(*causes, **more):
    return {"seed": 1, "base": {"breast.young_modulus_kpa": 0.6},
            "causes": [{"name": name, "outside": name in hidden_plan.FOREIGN, "parameters": {"size": 2.0}}
                       for name in causes], **more}


def said(verdict, *missing, interval=(1.0, 3.0), power=None, p=0.001):
    candidates = [{"effect": name, "p_value": p, "parameters": [{"name": f"{name}.size", "interval95": list(interval)}]}
                  for name in missing] or [{"effect": "creep", "p_value": p}]
    return {"verdict": verdict, "missing": list(missing), "candidates": candidates,
            "cannot_see": [{"effect": name, "power": value} for name, value in (power or {}).items()]}


CASES = [
    (answer("ligament"), said("missing", "ligament")),
    (answer("ligament"), said("missing", "adhesion")),
    (answer("ligament"), said("ambiguous", "adhesion", "ligament")),
    (answer("adhesion"), said("ambiguous", "friction", "ligament")),
    (answer("adhesion"), said("missing", "adhesion", interval=(2.5, 3.0))),
    (answer("creep"), said("nothing_missing", power={"creep": 0.06})),
    (answer(), said("nothing_missing", p=0.4)),
    (answer(), said("missing", "creep", p=0.02)),
    (answer(), said("unexplained", "creep", p=0.01)),
    (answer("creep", "ligament"), said("missing", "ligament")),
    (answer("creep", "ligament"), said("missing", "adhesion")),
    (answer("coil_contact"), said("unexplained", "arm_traction")),
    (answer("scar"), said("missing", "arm_traction")),
    (answer("friction"), None),
]


class Scored(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        (self.root / "answers").mkdir()
        for number, (truth, verdict) in enumerate(CASES):
            (self.root / "answers" / f"case-{number:03d}.json").write_text(json.dumps(truth))
            result = self.root / "out" / f"case-{number:03d}"
            result.mkdir(parents=True)
            if verdict is None:
                (result / "failed").write_text("no equilibrium\n")
            else:
                (result / "diagnosis.json").write_text(json.dumps(verdict))
        self.cases = hidden_score.score(self.root / "answers", self.root / "out")

    def rates(self):
        return {what: (hits, total) for what, hits, total in hidden_rates.rates(self.cases)}

    def test_matrix(self):
        rows = hidden_rates.confusion(self.cases)
        self.assertEqual(rows["ligament"], {"ligament": 1, "adhesion": 1, "in set": 1})
        self.assertEqual(rows["adhesion"], {"adhesion": 1, "wrong set": 1})
        self.assertEqual(rows["creep"], {"nothing_missing": 1})
        self.assertEqual(rows["nothing"], {"nothing_missing": 1, "creep": 1, "unexplained": 1})
        self.assertEqual(rows["two effects"], {"ligament": 1, "adhesion": 1})
        self.assertEqual(rows["coil_contact (outside)"], {"unexplained": 1})
        self.assertEqual(rows["scar (outside)"], {"arm_traction": 1})
        self.assertEqual(rows["friction"], {"failed": 1})

    def test_rates(self):
        rates = self.rates()
        self.assertEqual(rates["one effect: named alone, rightly (top-1)"], (2, 7))
        self.assertEqual(rates["one effect: named, or in the set"], (3, 7))
        # creep is said not to be seen and leaves the effects that are.
        self.assertEqual(rates["same, effects seen with power >= 0.9: named alone"], (2, 6))
        self.assertEqual(rates["one effect: wrong blame (truth not among the named)"], (2, 7))
        self.assertEqual(rates["ambiguous sets that hold the truth"], (1, 2))
        self.assertEqual(rates["null: false alarm (something named)"], (1, 3))
        self.assertEqual(rates["null: false alarm or unexplained"], (2, 3))
        self.assertEqual(rates["null: smallest p < 0.05"], (2, 3))
        self.assertEqual(rates["two effects: all that is named is there"], (1, 2))
        self.assertEqual(rates["two effects: both named, and nothing else"], (0, 2))
        self.assertEqual(rates["two effects: wrong blame"], (1, 2))
        self.assertEqual(rates["outside the catalogue: wrong blame (something named)"], (1, 2))
        # 2.0 lies in [1, 3] of the first ligament, not in [2.5, 3] of adhesion.
        spans = "95 % intervals of rightly named effects that hold the truth"
        self.assertEqual(rates[spans], (0, 1))
        self.assertEqual(rates[spans + " (arm_traction, chest_wall_motion, ligament: shaped otherwise)"], (1, 1))

    def test_written_table_is_the_printed_one(self):
        hidden_score.write(self.cases, self.root / "score")
        text = (self.root / "score.md").read_text()
        self.assertIn("| ligament | 3 |", text)
        self.assertIn("2/7 = 29 % [8, 64]", text)
        self.assertEqual(len((self.root / "score.csv").read_text().splitlines()), len(CASES) + 1)

    def test_scores_are_put_together(self):
        hidden_score.write(self.cases[:4], self.root / "first")
        hidden_score.write(self.cases[3:], self.root / "second")
        again = hidden_score.scored_before([self.root / "first.jsonl", self.root / "second.jsonl"])
        self.assertEqual(hidden_score.text_of(again), hidden_score.text_of(self.cases))

    def test_parts_of_machines_give_the_bytes_of_one(self):
        rows = [json.dumps(case) + "\n" for case in self.cases]
        (self.root / "one.jsonl").write_text("".join(rows))
        (self.root / "a.jsonl").write_text("".join(rows[:0:-2]))  # in the order in which cases end, not that of numbers
        (self.root / "b.jsonl").write_text("".join(row for row in rows if row not in rows[:0:-2]))
        for name, parts in (("whole", ["one"]), ("merged", ["b", "a"])):
            hidden_score.write(hidden_score.scored_before([self.root / f"{part}.jsonl" for part in parts]), self.root / name)
        for end in ("md", "csv", "json", "jsonl"):
            self.assertEqual((self.root / f"merged.{end}").read_bytes(), (self.root / f"whole.{end}").read_bytes(), end)

    def test_pooled_line(self):
        line = dict(enumerate(hidden_pooled.line_of(self.cases)))
        total, causes, nulls = line[0], [line[i] for i in range(1, 8)], [line[i] for i in range(8, 13)]
        self.assertEqual(total, len(CASES))
        # Of eleven with a cause: right, in the set, a wrong name, a wrong set, no name, no answer.
        self.assertEqual(causes, [11, 3, 1, 3, 1, 2, 1])
        self.assertEqual(nulls, [3, 1, 0, 2, 0])
        self.assertEqual(len(line), len(hidden_pooled.COLUMNS))

    def test_a_group_without_rows_is_refused(self):
        script = pathlib.Path(hidden_pooled.__file__)
        refused = subprocess.run([sys.executable, script, "--group", "pairs"], capture_output=True, text=True, check=False)
        self.assertEqual(refused.returncode, 2)
        self.assertIn("--group pairs: no file of rows", refused.stderr)

    def test_unknown_verdict_is_refused(self):
        (self.root / "out" / "case-000" / "diagnosis.json").write_text('{"verdict": "perhaps", "missing": []}')
        with self.assertRaisesRegex(SystemExit, "perhaps"):
            hidden_score.score(self.root / "answers", self.root / "out")


class Wilson(unittest.TestCase):
    def test_published_values(self):
        # Newcombe, Statistics in Medicine 17 (1998) 857-872, table I, method 3.
        for hits, count, low, high in ((81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0, 0.1611),
                                       (1, 29, 0.0061, 0.1718)):
            found = hidden_rates.wilson(hits, count)
            self.assertAlmostEqual(found[0], low, delta=1e-4)
            self.assertAlmostEqual(found[1], high, delta=1e-4)


def row(causes, verdict, missing, **more):
    kind = ("null", "effect", "two", "three")[len(causes)]
    return {"case": "case-001", "seed": 1, "kind": kind, "causes": list(causes), "drawn": list(causes),
            "verdict": verdict, "missing": list(missing), "power": 1.0, "p": None, "intervals": [], "moduli": [],
            "neither": [], "seconds": {}, **more}


class Several(unittest.TestCase):
    def test_three_effects_count_as_three(self):
        three = ("creep", "friction", "ligament")
        cases = [row(three, "missing", three), row(three, "missing", three[:2]), row(three, "missing", ["adhesion"]),
                 row(three, "ambiguous", (*three, "adhesion")), row(three, "nothing_missing", [])]
        rates = {what: (hits, total) for what, hits, total in hidden_rates.rates(cases)}
        self.assertEqual(rates["three effects: all that is named is there"], (3, 5))
        self.assertEqual(rates["three effects: all three named, and nothing else"], (1, 5))
        self.assertEqual(rates["three effects: all three named, or in the set"], (2, 5))
        self.assertEqual(rates["three effects: wrong blame"], (1, 5))
        self.assertEqual(rates["two effects: wrong blame"], (0, 0))
        self.assertEqual(sum(hidden_rates.confusion(cases)["three effects"].values()), 5)

    def test_both_of_two(self):
        two = ("creep", "friction")
        cases = [row(two, "missing", ("friction", "creep")), row(two, "missing", ["creep"]),
                 row(two, "ambiguous", (*two, "ligament"))]
        rates = {what: (hits, total) for what, hits, total in hidden_rates.rates(cases)}
        self.assertEqual(rates["two effects: both named, and nothing else"], (1, 3))
        self.assertEqual(rates["two effects: both named, or in the set"], (2, 3))


class Neither(unittest.TestCase):
    def test_counts_neither_as_right_nor_as_wrong(self):
        stiffening = {"neither": ["strain_stiffening"]}
        self.assertEqual(hidden_rates.outcome(row([], "missing", ["strain_stiffening"], **stiffening)), "neither")
        beside = row(["creep"], "missing", ["strain_stiffening"], **stiffening)
        self.assertEqual(hidden_rates.outcome(beside), "neither")
        both = row(["creep"], "missing", ["creep", "strain_stiffening"], **stiffening)
        self.assertEqual(hidden_rates.outcome(both), "right")
        other = row(["creep"], "missing", ["adhesion", "strain_stiffening"], **stiffening)
        self.assertEqual(hidden_rates.outcome(other), "wrong")
        null = [row([], "missing", ["strain_stiffening"], **stiffening)]
        rates = {what: (hits, total) for what, hits, total in hidden_rates.rates(null)}
        self.assertEqual(rates["null: false alarm (something named)"], (0, 1))
        # Without that it is a false alarm.
        self.assertEqual(hidden_rates.outcome(row([], "missing", ["strain_stiffening"])), "wrong")

    def test_a_wide_nuisance_does_not_hide_a_cause_that_was_drawn(self):
        case = row(["misregistration"], "missing", ["misregistration"], neither=["misregistration"])
        self.assertEqual(hidden_rates.outcome(case), "right")

    def test_is_left_out_of_the_probabilities(self):
        case = row([], "nothing_missing", [], neither=["creep"], included={"creep": 0.6, "friction": 0.1})
        self.assertEqual(hidden_probability.statements([case]), [("friction", 0.1, False)])


class Present(unittest.TestCase):
    def cause(self, roll, pitch):
        return {"name": "gravity_tilt", "outside": False, "parameters": {"roll_rad": roll, "pitch_rad": pitch},
                "nuisance_sigma": {"roll_rad": 0.035, "pitch_rad": 0.035}}

    def test_beyond_three_sigma_of_its_nuisance(self):
        self.assertFalse(hidden_case.present(self.cause(0.07, 0.07)))  # 2.83
        self.assertTrue(hidden_case.present(self.cause(0.08, 0.08)))  # 3.23
        self.assertTrue(hidden_case.present(self.cause(0, -0.11)))
        self.assertTrue(hidden_case.present({"name": "ligament", "outside": False, "parameters": {}}))

    def test_small_cause_is_no_name_but_was_drawn(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "case-001").mkdir()
            truth = {"seed": 1, "base": {}, "causes": [self.cause(0.02, 0.01)]}
            (root / "case-001.json").write_text(json.dumps(truth))
            said_so = {"verdict": "nothing_missing", "missing": [],
                       "included": [{"effect": "gravity_tilt", "probability": 0.2}]}
            (root / "case-001" / "diagnosis.json").write_text(json.dumps(said_so))
            case = hidden_case.read_case(root / "case-001.json", root)
            self.assertEqual((case["kind"], case["causes"], case["drawn"]), ("null", [], ["gravity_tilt"]))
            self.assertEqual(hidden_probability.statements([case]), [("gravity_tilt", 0.2, True)])


class Read(unittest.TestCase):
    TRUTH = {"seed": 4, "base": {}, "causes": [{"name": "creep", "outside": False, "parameters": {"size": 1}}],
             "scan_place": {"supine": {"shift_mm": [1.0, -2.0, 0.0], "turn_rad": [0.0, 0.0, math.radians(1)]}},
             "discrepancy": {"size_mm": 0.3, "rms_mm": {"supine": 0.3, "tilt45": 0.4}}}
    SAID = {"verdict": "missing", "missing": ["creep"], "unexplained95": [0.2, 0.5],
            "registration": [{"pose": "supine", "shift_mm": [0.5, 0, 0], "turn_deg": [0, 0, 1.5],
                              "sd": [0.5, 0.5, 0.5, 0.1, 0.1, 0.2]}],
            "hypotheses": [{"effects": ["creep"], "probability": 0.7}, {"effects": [], "probability": 0.1},
                           {"effects": ["creep", "friction"], "probability": 0.2}]}

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        root = pathlib.Path(folder.name)
        (root / "case-001").mkdir()
        (root / "case-001.json").write_text(json.dumps(self.TRUTH))
        (root / "case-001" / "diagnosis.json").write_text(json.dumps(self.SAID))
        self.case = hidden_case.read_case(root / "case-001.json", root)
        self.rates = {what: (hits, total) for what, hits, total in hidden_rates.rates([self.case])}

    def test_place_of_the_scan(self):
        # Off by 1 sigma, 4, 0; 0, 0, 2.5.
        self.assertEqual(self.rates["95 % intervals of the scans' place that hold the truth"], (4, 6))
        self.assertEqual(self.case["places"][5][0], "supine.turn_z_deg")
        self.assertAlmostEqual(self.case["places"][5][1], 1)
        self.assertAlmostEqual(self.case["places"][0][3], 0.5 + 1.96 * 0.5, delta=1e-3)

    def test_unexplained(self):
        self.assertEqual(self.rates["95 % intervals of what is unexplained that hold the truth"], (1, 1))
        self.assertAlmostEqual(self.case["unexplained"][0], math.sqrt(0.125))

    def test_inclusion_follows_from_hypotheses(self):
        self.assertAlmostEqual(self.case["included"]["creep"], 0.9)
        self.assertAlmostEqual(self.case["included"]["friction"], 0.2)
        self.assertAlmostEqual(self.case["set_probability"], 0.7)


class Probability(unittest.TestCase):
    CASES = [row(["creep"], "nothing_missing", [], included={"creep": 0.8, "friction": 0.02}),
             row([], "nothing_missing", [], included={"creep": 0.8, "friction": 0.02}),
             row([], "nothing_missing", [], included={"creep": 0.0, "friction": 1.0})]

    def test_curve_and_expected_calibration_error(self):
        stated = hidden_probability.statements(self.CASES)
        curve = hidden_probability.reliability(stated)
        self.assertEqual([(low, high, number) for low, high, number, _, _ in curve],
                         [(0, 0.01, 1), (0.01, 0.03, 2), (0.7, 0.9, 2), (0.97, 1, 1)])
        self.assertEqual([share for *_, share in curve], [0, 0, 0.5, 0])
        self.assertAlmostEqual(hidden_probability.calibration_error(stated), (2 * 0.02 + 2 * 0.3 + 1) / 6)

    def test_log_score_is_clipped(self):
        self.assertAlmostEqual(hidden_probability.log_score(1.0, False), -math.log(0.001))
        self.assertAlmostEqual(hidden_probability.log_score(0.0, True), -math.log(0.001))
        self.assertAlmostEqual(hidden_probability.log_score(0.25, True), math.log(4))
        self.assertAlmostEqual(hidden_probability.log_score(0.25, False), -math.log(0.75))
        scores = hidden_probability.log_scores(hidden_probability.statements(self.CASES))
        self.assertEqual(scores["creep"][:2], (3, 1))
        self.assertAlmostEqual(scores["creep"][2], (-math.log(0.8) - math.log(0.2) - math.log(0.999)) / 3)

    def test_true_probabilities_beat_others(self):
        """Statements that are true on the average: no error of calibration, and a better score than a constant."""
        stated = [("creep", p, k < 100 * p) for p in (0.02, 0.2, 0.6, 0.95) for k in range(100)]
        self.assertAlmostEqual(hidden_probability.calibration_error(stated), 0)
        mean = sum(hidden_probability.log_score(p, true) for _, p, true in stated) / len(stated)
        self.assertLess(mean, hidden_probability.constant_score(stated) - 0.1)

    def test_no_probabilities_no_table(self):
        self.assertEqual(hidden_probability.text_of([row([], "nothing_missing", [])]), "")
        self.assertIn("Expected calibration error", hidden_score.text_of(self.CASES))


class Plan(unittest.TestCase):
    def test_mixture_and_prefix(self):
        cases = hidden_plan.plan("mixture", 240, 1)
        self.assertEqual(len({name for name, _ in cases}), 240)
        self.assertEqual(sum("null" in words for _, words in cases), 100)
        self.assertEqual(sum("--outside" in words for _, words in cases), 20)
        self.assertEqual(sum(words.count("--effect") == 2 for _, words in cases), 20)
        # What has been made stays what it is when more cases are asked for.
        self.assertEqual(hidden_plan.plan("mixture", 30, 1), cases[:30])
        self.assertNotEqual(hidden_plan.plan("mixture", 30, 2)[0][1][1], cases[0][1][1])

    def test_seed_three_is_still_the_published_one(self):
        rows = hidden_score.scored_before([pathlib.Path(__file__).resolve().parents[2] / "docs" / "hidden-cases.jsonl"])
        for published, (name, words) in zip(rows, hidden_plan.plan("mixture", 240, 3)):
            self.assertEqual((published["case"], str(published["seed"])), (name, words[1]))
            self.assertEqual(published["causes"] or ["null"], [word for word in words[2:] if not word.startswith("--")])

    def test_every_set_keeps_its_prefix_and_its_seeds(self):
        for name, (count, _) in hidden_plan.SETS.items():
            cases = hidden_plan.plan(name, count, 7)
            self.assertEqual(len(cases), count, name)
            self.assertEqual(hidden_plan.plan(name, count - 5, 7), cases[:count - 5])
            self.assertNotEqual(hidden_plan.plan(name, count, 8)[0][1], cases[0][1])

    def test_realistic_cases(self):
        cases = hidden_plan.plan("realistic", 60, 1)
        effects = [words.count("--effect") - words.count("null") for _, words in cases]
        self.assertEqual([sum(n == k for n in effects) for k in range(4)], [25, 20, 10, 5])
        self.assertTrue(all("--realistic" in words and "strain_stiffening" not in words for _, words in cases))
        for _, words in cases:
            names = [word for word in words if word in hidden_plan.EFFECTS]
            self.assertEqual(len(set(names)), len(names))

    def test_prior_says_nothing_of_effects(self):
        for _, words in hidden_plan.plan("prior", 120, 1):
            self.assertEqual((words[0], words[2:]), ("--seed", ["--prior"]))

    def test_designed_sets(self):
        pairs = [tuple(w for w in words if w in hidden_plan.EFFECTS) for _, words in hidden_plan.plan("pairs", 24, 1)]
        self.assertEqual(len(set(pairs)), 24)
        self.assertTrue(all(len(set(pair)) == 2 for pair in pairs))
        foreign = [words[3] for _, words in hidden_plan.plan("foreign", 24, 1)]
        self.assertEqual({foreign.count(name) for name in hidden_plan.FOREIGN}, {4, 5})
        doses = [tuple(words[1:]) for _, words in hidden_plan.plan("doses", 45, 1)]
        self.assertEqual(len(set(doses)), 45)
        self.assertEqual(len({words[0] for words in doses}), 5)
        self.assertIn("--realistic", hidden_plan.plan("pairs", 24, 1, True)[0][1])

    def test_large_breasts_bring_what_patients_bring(self):
        cases = hidden_plan.plan("large", 24, 1)
        self.assertTrue(all(words.count("--realistic") == 1 and "volunteers" in words for _, words in cases))
        self.assertEqual(sum("null" in words for _, words in cases), 12)
        self.assertEqual({word for _, words in cases for word in words if word in hidden_plan.EFFECTS},
                         set(hidden_plan.IN_SIGHT))

    def test_quarters_are_disjoint_and_mixed(self):
        cases = hidden_plan.plan("doses", 45, 1)
        quarters = [hidden_plan.quarter(cases, which) for which in (1, 2, 3, 4)]
        self.assertEqual(sorted(sum(quarters, [])), sorted(cases))
        for some in quarters:
            self.assertEqual({words[5] for _, words in some}, set(hidden_plan.DOSED))
            self.assertEqual({words[3] for _, words in some}, {str(size) for size in hidden_plan.SIZES})


class Arguments(unittest.TestCase):
    def test_wishes_that_exclude_each_other(self):
        for words, says in ((["--prior", "--realistic"], "--prior excludes --realistic"),
                            (["--prior", "--set", "pairs"], "--prior excludes --set"),
                            (["--seed", "3", "--seed-from", "v1"], "--seed excludes --seed-from"),
                            (["--seed-from", "no-such-tag"], "there is no such tag"),
                            (["--without", "landmarks"], "--without needs --again"),
                            (["--first", "0"], "counted from 1")):
            with self.assertRaisesRegex(SystemExit, says):
                hidden.arguments(["work", *words])

    def test_sets_and_their_sizes(self):
        for words, name, count in ((["--prior"], "prior", 120), (["--set", "pairs"], "pairs", 24),
                                   (["--set", "doses", "--realistic"], "doses-realistic", 45), ([], "mixture", 60),
                                   (["--realistic", "--cases", "8"], "realistic", 8)):
            options = hidden.arguments(["work", *words])
            self.assertEqual((options.name, len(options.planned)), (name, count))
        self.assertEqual(len(hidden.wanted(hidden.arguments(["work", "--prior", "--quarter", "4"]))), 30)

    def test_seed_is_the_hash_of_the_tags_commit(self):
        with tempfile.TemporaryDirectory() as folder:
            git = ["git", "-C", folder, "-c", "user.name=a", "-c", "user.email=a@b"]
            subprocess.run(["git", "init", "-q", folder], check=True)
            subprocess.run([*git, "commit", "-q", "--allow-empty", "-m", "one"], check=True)
            subprocess.run([*git, "tag", "-a", "frozen", "-m", "x"], check=True)
            here, hidden.HERE = hidden.HERE, pathlib.Path(folder)
            self.addCleanup(setattr, hidden, "HERE", here)
            first = hidden.seed_from("frozen")
            self.assertEqual(hidden.seed_from("frozen"), first)
            subprocess.run([*git, "commit", "-q", "--allow-empty", "-m", "two"], check=True)
            subprocess.run([*git, "tag", "later"], check=True)
            self.assertNotEqual(hidden.seed_from("later"), first)


# Stands for every tool: notes how it was called and makes the files of its stage.
TOOL = r"""#!/bin/bash
tool=${0##*/supine-}
[ "$1" = --version ] && { echo "supine-$tool 9.9.9 (abc123)"; exit; }
echo "$tool $*" >>"$CALLS"
for ((i = 1; i < $#; i++)); do
  j=$((i + 1))
  [ "${!i}" = -o ] && out=${!j}
  [ "${!i}" = --answer ] && answer=${!j}
  [ "${!i}" = --seed ] && seed=${!j}
done
case $tool in
  phantom)
    mkdir -p "$out" "${answer%/*}"
    printf '[case]\nname = "x"\n[image]\nfile = "l.nrrd"\n[pose.prone]\n[pose.supine]\nsurface = "s.ply"\n' >"$out/case.toml"
    touch "$out/model.toml" "$out/l.nrrd" "$out/s.ply"
    echo "{\"seed\": $seed, \"causes\": [], \"base\": {}}" >"$answer" ;;
  reconstruct) touch "$out/breast.vtp" "$out/muscle.vtp" ;;
  calibrate) [[ $out == */case-002 ]] && exit 3; touch "$out/model.toml" "$out/history.csv"; echo '{}' >"$out/calibration.json" ;;
  diagnose) touch "$out/diagnosis.vtp"; echo '{"verdict": "nothing_missing", "missing": []}' >"$out/diagnosis.json" ;;
  model) ;;
  *) touch "$out" ;;
esac
exit 0
"""


class Driver(unittest.TestCase):
    def call(self, root, cases, *more):
        command = [sys.executable, pathlib.Path(hidden.__file__), root / "work", "--bin", root / "bin", "--cases",
                   str(cases), "--jobs", "1", *more]
        return subprocess.run(command, capture_output=True, text=True, check=False,
                              env={**os.environ, "CALLS": str(root / "calls")})

    @staticmethod
    def make_tools(root):
        (root / "bin").mkdir()
        for name in ("phantom", "segment", "reconstruct", "decimate", "tetrahedralise", "calibrate", "diagnose",
                     "model"):
            (root / "bin" / f"supine-{name}").write_text(TOOL)
            (root / "bin" / f"supine-{name}").chmod(0o755)

    def test_rows_are_written_and_take_a_run_to_another_machine(self):
        with tempfile.TemporaryDirectory() as here, tempfile.TemporaryDirectory() as there:
            first, second = pathlib.Path(here), pathlib.Path(there)
            for root in (first, second):
                self.make_tools(root)
            rows = first / "kept" / "rows.jsonl"
            done = self.call(first, 8, "--prior", "--quarter", "2", "--rows", str(rows))
            self.assertEqual(done.returncode, 0, done.stderr)
            written = [json.loads(line) for line in rows.read_text().splitlines()]
            self.assertEqual(sorted(row["case"] for row in written), ["case-002", "case-006"])
            for row in written:
                self.assertEqual((row["set"], row["version"], row["commit"]), ("prior", "9.9.9", "abc123"))
                self.assertIn("mesh", row["seconds"])
            carried = self.call(second, 8, "--prior", "--rows", str(rows))
            self.assertEqual(carried.returncode, 0, carried.stderr)
            made = [line for line in (second / "calls").read_text().splitlines() if line.startswith("phantom")]
            self.assertEqual(len(made), 6)
            self.assertFalse(any("case-002" in line or "case-006" in line for line in made))
            self.assertEqual(len(rows.read_text().splitlines()), 8)
            self.assertIn("8 cases: 0 with one effect, 8 without any", carried.stdout)
            rows.write_text(rows.read_text() + '{"case": "case-0')
            broken = self.call(second, 8, "--prior", "--rows", str(rows))
            self.assertEqual(broken.returncode, 1)
            self.assertIn("rows.jsonl:9", broken.stderr)

    def test_reads_only_the_case_goes_on_and_notes_failures(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            self.make_tools(root)
            first = self.call(root, 2)
            self.assertEqual(first.returncode, 0, first.stderr)
            calls = (root / "calls").read_text().splitlines()
            for call in calls:
                self.assertEqual("answers" in call, call.startswith("phantom"), call)
            self.assertEqual(sum(call.startswith("diagnose") for call in calls), 1)
            self.assertIn("calibrate ended with", (root / "work/out/case-002/failed").read_text())
            self.assertIn("2 cases: 0 with one effect, 2 without any", first.stdout)
            # What is there is not made again.
            second = self.call(root, 3)
            self.assertEqual(second.returncode, 0, second.stderr)
            new = (root / "calls").read_text().splitlines()[len(calls):]
            self.assertTrue(new and all("case-003" in call for call in new), new)


CASE = """[case]
name = "case-001"

[pose.prone]
gravity = [0, -1, 0]

[pose.supine]
gravity = [0, 1, 0]
surface = "supine.ply"

[pose.tilt45]
gravity = [0, 0.7, -0.7]
surface = "tilt45.ply"

[landmarks]
prone = "prone_landmarks.csv"
"""


class WithoutTilt(unittest.TestCase):
    def test_nothing_of_the_tilted_scan_is_left_and_nothing_else_is_lost(self):
        with tempfile.TemporaryDirectory() as folder:
            work = pathlib.Path(folder)
            given = work / "cases" / "case-001"
            given.mkdir(parents=True)
            (given / "case.toml").write_text(CASE)
            for name in ("supine.ply", "tilt45.ply", "tilt45_landmarks.csv", "prone_landmarks.csv", "labels.nrrd"):
                (given / name).write_text(name)
            case = hidden.without_tilt(work, "case-001")
            self.assertEqual(sorted(file.name for file in case.iterdir()),
                             ["case.toml", "labels.nrrd", "prone_landmarks.csv", "supine.ply"])
            left = (case / "case.toml").read_text()
            self.assertNotIn("tilt", left)
            for kept in ("[case]", "[pose.prone]", "[pose.supine]", "supine.ply", "[landmarks]", "prone_landmarks.csv"):
                self.assertIn(kept, left)
            self.assertEqual((given / "case.toml").read_text(), CASE)
            self.assertTrue((given / "tilt45.ply").exists())
            self.assertEqual(hidden.without_tilt(work, "case-001"), case)  # a second call finds it made


class StatedRegistration(unittest.TestCase):
    def test_every_scan_and_nothing_else_states_it(self):
        with tempfile.TemporaryDirectory() as folder:
            case = pathlib.Path(folder)
            (case / "case.toml").write_text(CASE)
            for value in (2, 0.3):  # a call that goes on states it again
                hidden.state_registration(case, value)
            stated = (case / "case.toml").read_text()
            self.assertEqual(stated.replace("registration_mm = 0.3\n", ""), CASE)
            poses = stated.split("[pose.")[1:]
            self.assertEqual([pose.count("registration_mm = 0.3") for pose in poses],
                             [pose.count("surface = ") for pose in poses])
            self.assertGreater(stated.count("registration_mm = 0.3"), 1)


if __name__ == "__main__":
    unittest.main()
