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

    def test_a_calibration_of_an_earlier_version_is_not_pooled_and_said(self):
        made_cohort.make(self.cohort, 4, 0)
        self.change("calibration.json", lambda c: c["worth"]["coordinates"][0].pop("likelihood"))
        said = pool(self.cohort)
        self.assertEqual(said.returncode, 0, said.stderr)
        self.assertIn("1 calibrations were made by an earlier version", said.stderr)
        found = json.loads((self.cohort / "cohort.json").read_text())
        self.assertEqual((found["numbers"][0]["patients"], found["calibrated_by_an_earlier_version"]), (3, 1))

    def test_the_prior_does_not_count_and_who_says_nothing_neither(self):
        made_cohort.make(self.cohort, 4, 0)
        self.assertEqual(pool(self.cohort).returncode, 0)
        before = json.loads((self.cohort / "cohort.json").read_text())["numbers"][0]
        for patient in range(4):
            self.change("calibration.json", lambda c: c["worth"]["coordinates"][0].update(prior_sd=1e-3, sd=1e-4), patient)
        self.assertEqual(pool(self.cohort, "--force").returncode, 0)
        self.assertEqual(json.loads((self.cohort / "cohort.json").read_text())["numbers"][0], before)
        self.change("calibration.json", lambda c: c["worth"]["coordinates"][0].update(likelihood=None), patient=3)
        self.assertEqual(pool(self.cohort, "--force").returncode, 0)
        self.assertEqual(json.loads((self.cohort / "cohort.json").read_text())["numbers"][0]["patients"], 3)

    def change(self, name, change, patient=1):
        file = self.cohort / f"patient-{patient:03d}/out" / name
        what = json.loads(file.read_text())
        change(what)
        file.write_text(json.dumps(what))

    def test_values_that_no_result_has_are_refused(self):
        parameter = lambda c: c["parameters"][0]
        coordinate = lambda c: c["worth"]["coordinates"][0]
        number = lambda d: d["singles"][0]["numbers"][0]
        wrong = {
            "calibration.json": [
                (lambda c: parameter(c).update(unit="Pa"), "breast.young_modulus_kpa unit is Pa: must be kPa"),
                (lambda c: parameter(c).update(value=-3), "breast.young_modulus_kpa value is -3: must be in its interval95"),
                (lambda c: parameter(c).update(value=-3, interval95=[-4, 5]), "breast.young_modulus_kpa value is -3: must be above 0"),
                (lambda c: parameter(c).update(value=1e3), "value is 1000.0: must be in its interval95"),
                (lambda c: parameter(c).update(interval95=[0.1, None]), "interval95 is [0.1,null]: must be two numbers"),
                (lambda c: parameter(c).update(interval95=[9, 0.1]), "interval95 is [9,0.1], its lower end above the upper"),
                (lambda c: coordinate(c).update(at=7), "at is 7: must be ln of the value"),
                (lambda c: coordinate(c).update(sd=0), "sd is 0: must be above 0"),
                (lambda c: coordinate(c)["likelihood"].update(sd=-1), "likelihood.sd is -1: must be above 0"),
                (lambda c: coordinate(c).update(name="skin.young_modulus_kpa"), "of no parameter"),
                (lambda c: c["parameters"].append(parameter(c)), "breast.young_modulus_kpa is there twice"),
            ],
            "diagnosis.json": [
                (lambda d: d["included"][0].update(probability=1.7), "included[] present probability is 1.7: must be 0 to 1"),
                (lambda d: d["singles"][0].update(ln_bayes_factor=1e308), "singles[] present ln_bayes_factor is 1e+308: must be"),
                (lambda d: number(d).update(sd=-1), "singles[] present present.log_ratio sd is -1: must be above 0"),
                (lambda d: number(d).update(sd=0), "present.log_ratio sd is 0: must be above 0"),
                (lambda d: number(d).update(prior_sd=0), "present.log_ratio prior_sd is 0: must be above 0"),
                (lambda d: number(d).update(name="absent.log_ratio"), "a number of another effect"),
                (lambda d: d["singles"].append(d["singles"][0]), "singles[] present is there twice"),
                (lambda d: d["singles"][0].update(effect="magic"), "singles[] magic is an effect that was not weighed: must be absent or present"),
                (lambda d: d.update(verdict="perhaps"), "verdict is perhaps: must be nothing_missing, missing, ambiguous or unexplained"),
                (lambda d: d.update(verdict="missing"), "missing is empty: must be what the verdict missing names"),
                (lambda d: d.update(verdict="missing", missing=["magic"]), "missing is magic: must be absent or present"),
                (lambda d: d.update(missing=["present"]), "must be empty, as the verdict is nothing_missing"),
                (lambda d: d.update(unexplained_mm=-1), "unexplained_mm is -1: must be at least 0"),
            ],
            "comparison.json": [(lambda c: c.update(rms_mm=-1), "rms_mm is -1: must be at least 0")],
        }
        for file, changes in wrong.items():
            for change, message in changes:
                shutil.rmtree(self.cohort)
                made_cohort.make(self.cohort, 2, 0)
                self.change(file, change)
                self.refused(message)
                self.refused(f"patient-001/out/{file}")

    def test_ends_of_ranges_are_no_errors(self):
        made_cohort.make(self.cohort, 2, 0)
        self.change("calibration.json", lambda c: c["parameters"][0].update(interval95=[c["parameters"][0]["value"], 20]))
        self.change("diagnosis.json", lambda d: d["singles"][0]["numbers"][0].update(sd=None))
        self.change("diagnosis.json", lambda d: d["singles"][1].update(ln_bayes_factor=None))
        self.change("diagnosis.json", lambda d: d.update(verdict="ambiguous"))
        said = pool(self.cohort)
        self.assertEqual(said.returncode, 0, said.stderr)

    def test_a_result_without_what_it_must_have_is_refused(self):
        made_cohort.make(self.cohort, 2, 0)
        file = self.cohort / "patient-001/out/diagnosis.json"
        file.write_text(file.read_text().replace('"prior_sd": 0.5', '"prior_sd": "wide"'))
        self.refused("patient-001/out/diagnosis.json")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
