#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""supine-cohort on made results: pooled_test.py BIN."""

import csv
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
import made_cohort  # noqa: E402

BIN = pathlib.Path(sys.argv[1]).resolve()


def pool(*words):
    return subprocess.run([BIN / "supine-cohort", *[str(word) for word in words]], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


class Pooled(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.cohort = pathlib.Path(folder.name) / "cohort"
        self.cohort.mkdir()

    def test_a_weak_effect_is_found_in_the_population_and_the_absent_one_is_not(self):
        made_cohort.make(self.cohort, 31, 0.6, failed=1)
        said = pool(self.cohort)
        self.assertEqual(said.returncode, 0, said.stderr)
        found = json.loads((self.cohort / "cohort.json").read_text())
        self.assertEqual((found["patients"], found["diagnosed"]), (31, 30))
        self.assertEqual([one["patient"] for one in found["set_aside"]], ["patient-000"])
        effects = {one["effect"]: one for one in found["effects"]}
        self.assertGreater(effects["present"]["probability"], 0.95)
        self.assertLess(effects["absent"]["probability"], 0.5)
        low, high = effects["present"]["share"]["interval95"]
        self.assertTrue(low < 0.6 < high, (low, high))
        self.assertIsNotNone(effects["present"]["shared_error"])
        modulus = found["numbers"][0]
        low, high = modulus["median"]["interval95"]
        self.assertTrue(low < 0.8 < high, (low, high))
        # What is told of the others does not hold the patient himself.
        left_out = {one["patient"]: one["median"] for one in modulus["left_out"]}
        self.assertEqual(len(left_out), 30)
        self.assertEqual(len(set(left_out.values())), 30)

    def test_who_is_left_out_is_not_in_it(self):
        made_cohort.make(self.cohort, 6, 0)
        self.assertEqual(pool(self.cohort).returncode, 0)
        before = json.loads((self.cohort / "cohort.json").read_text())["numbers"][0]["left_out"][5]
        shutil.rmtree(self.cohort / "patient-005")
        self.assertEqual(pool(self.cohort, "--force").returncode, 0)
        without = json.loads((self.cohort / "cohort.json").read_text())["numbers"][0]["of_new"]
        self.assertEqual(before["patient"], "patient-005")
        self.assertAlmostEqual(before["median"], without["median"], places=12)
        self.assertAlmostEqual(before["log_sd"], without["log_sd"], places=12)

    def test_the_table_has_a_row_a_patient(self):
        made_cohort.make(self.cohort, 4, 0.5, failed=1)
        self.assertEqual(pool(self.cohort).returncode, 0)
        rows = list(csv.DictReader((self.cohort / "cohort.csv").read_text().splitlines()))
        self.assertEqual([row["patient"] for row in rows], [f"patient-{i:03d}" for i in range(4)])
        self.assertIn("in no tissue", rows[0]["failed"])
        calibration = json.loads((self.cohort / "patient-002/out/calibration.json").read_text())
        self.assertEqual(float(rows[2]["breast.young_modulus_kpa"]), calibration["parameters"][0]["value"])
        self.assertEqual(float(rows[2]["p present"]), 0.3)

    def refused(self, message):
        said = pool(self.cohort)
        self.assertEqual(said.returncode, 2)
        self.assertIn(message, said.stderr)
        self.assertFalse((self.cohort / "cohort.csv").exists() or (self.cohort / "cohort.json").exists() or (self.cohort / "cohort.html").exists())

    def test_a_cohort_without_cases_is_refused(self):
        self.refused("holds no case")

    def test_a_cohort_without_results_is_refused(self):
        made_cohort.make(self.cohort, 2, 0, failed=2)
        self.refused("none of the 2 cases")

    def test_a_result_that_is_cut_off_is_refused(self):
        made_cohort.make(self.cohort, 2, 0)
        file = self.cohort / "patient-001/out/diagnosis.json"
        file.write_text(file.read_text()[:50])
        self.refused("patient-001/out/diagnosis.json is no JSON")

    def test_a_result_without_what_it_must_have_is_refused(self):
        made_cohort.make(self.cohort, 2, 0)
        file = self.cohort / "patient-001/out/diagnosis.json"
        file.write_text(file.read_text().replace('"prior_sd": 0.5', '"prior_sd": "wide"'))
        self.refused("patient-001/out/diagnosis.json")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
