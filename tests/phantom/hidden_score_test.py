#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""The scoring of the blind benchmark on made-up answers and verdicts, and its plan of cases."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "bench"))
import hidden  # noqa: E402
import hidden_score  # noqa: E402


def answer(*causes):
    return {"seed": 1, "base": {"breast.young_modulus_kpa": 0.6},
            "causes": [{"name": name, "outside": name in hidden.OUTSIDE, "parameters": {"size": 2.0}}
                       for name in causes]}


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
        return {what: (hits, total) for what, hits, total in hidden_score.rates(self.cases)}

    def test_matrix(self):
        rows = hidden_score.confusion(self.cases)
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

    def test_unknown_verdict_is_refused(self):
        (self.root / "out" / "case-000" / "diagnosis.json").write_text('{"verdict": "perhaps", "missing": []}')
        with self.assertRaisesRegex(SystemExit, "perhaps"):
            hidden_score.score(self.root / "answers", self.root / "out")


class Wilson(unittest.TestCase):
    def test_published_values(self):
        # Newcombe, Statistics in Medicine 17 (1998) 857-872, table I, method 3.
        for hits, count, low, high in ((81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0, 0.1611),
                                       (1, 29, 0.0061, 0.1718)):
            found = hidden_score.wilson(hits, count)
            self.assertAlmostEqual(found[0], low, delta=1e-4)
            self.assertAlmostEqual(found[1], high, delta=1e-4)


class Plan(unittest.TestCase):
    def test_mixture_and_prefix(self):
        cases = hidden.plan(240, 1)
        self.assertEqual(len({name for name, _ in cases}), 240)
        self.assertEqual(sum("null" in words for _, words in cases), 100)
        self.assertEqual(sum("--outside" in words for _, words in cases), 20)
        self.assertEqual(sum(words.count("--effect") == 2 for _, words in cases), 20)
        # What has been made stays what it is when more cases are asked for.
        self.assertEqual(hidden.plan(30, 1), cases[:30])
        self.assertNotEqual(hidden.plan(30, 2)[0][1][1], cases[0][1][1])


# Stands for every tool: notes how it was called and makes the files of its stage.
TOOL = r"""#!/bin/bash
tool=${0##*/supine-}
echo "$tool $*" >>"$CALLS"
for ((i = 1; i < $#; i++)); do
  j=$((i + 1))
  [ "${!i}" = -o ] && out=${!j}
  [ "${!i}" = --answer ] && answer=${!j}
done
case $tool in
  phantom)
    mkdir -p "$out" "${answer%/*}"
    printf '[case]\nname = "x"\n[image]\nfile = "l.nrrd"\n[pose.prone]\n[pose.supine]\nsurface = "s.ply"\n' >"$out/case.toml"
    touch "$out/model.toml" "$out/l.nrrd" "$out/s.ply"
    echo '{"seed": 1, "causes": [], "base": {}}' >"$answer" ;;
  reconstruct) touch "$out/breast.vtp" "$out/muscle.vtp" ;;
  calibrate) [[ $out == */case-002 ]] && exit 3; touch "$out/model.toml" "$out/history.csv"; echo '{}' >"$out/calibration.json" ;;
  diagnose) touch "$out/diagnosis.vtp"; echo '{"verdict": "nothing_missing", "missing": []}' >"$out/diagnosis.json" ;;
  model) ;;
  *) touch "$out" ;;
esac
exit 0
"""


class Driver(unittest.TestCase):
    def call(self, root, cases):
        command = [sys.executable, pathlib.Path(hidden.__file__), root / "work", "--bin", root / "bin", "--cases",
                   str(cases), "--jobs", "1"]
        return subprocess.run(command, capture_output=True, text=True, check=False,
                              env={**os.environ, "CALLS": str(root / "calls")})

    def test_reads_only_the_case_goes_on_and_notes_failures(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "bin").mkdir()
            for name in ("phantom", "segment", "reconstruct", "decimate", "tetrahedralise", "calibrate", "diagnose",
                         "model"):
                (root / "bin" / f"supine-{name}").write_text(TOOL)
                (root / "bin" / f"supine-{name}").chmod(0o755)
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


if __name__ == "__main__":
    unittest.main()
