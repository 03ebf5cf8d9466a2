#!/usr/bin/env python3
# SPDX-License-Identifier: AGPL-3.0-or-later
"""Cohorts of the small case: cohort_test.py SOURCE BIN SMALL_RUN. Through make, and through Snakemake where there is one."""

import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE, BIN, SMALL = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
SETTINGS = "ORDER=1 TRIANGLES=800 MAX_DISTANCE_MM=3 SAMPLES=10"


def run(command):
    clean = {key: value for key, value in os.environ.items() if not key.startswith("MAKE")}
    return subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          cwd=SOURCE, env=clean)


def make_cohort(cohort, *settings):
    return run(["make", "--no-print-directory", "-f", "cohort/Makefile", f"COHORT={cohort}", f"BIN={BIN}", "THREADS=1", *settings])


def snakemake(cohort, out, folder, *settings):
    return run(["snakemake", "-q", "-s", "cohort/Snakefile", "-c", "1", "-k", "--directory", folder, "--config", f"cohort={cohort}",
                f"out={out}", f"bin={BIN}", *settings])


def figures(file):
    whole = json.loads(file.read_text())
    whole.pop("timing")
    return whole


class Cohort(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.work = pathlib.Path(self.folder.name)
        self.cohort = self.work / "cohort"
        for name in ("anna", "berta", "clara"):
            self.add(name)

    def add(self, name):
        case = self.cohort / name
        shutil.copytree(SMALL, case, ignore=shutil.ignore_patterns("out"))
        text = (case / "case.toml").read_text()
        (case / "case.toml").write_text(text.replace('name = "small"', f'name = "{name}"'))
        self.assertIn(f'name = "{name}"', (case / "case.toml").read_text())
        return case

    def break_case(self, name):
        model = self.cohort / name / "model.toml"
        model.write_text(model.read_text().replace("[skin]", "[skim]"))

    def test_make_sets_a_failed_case_aside_and_runs_nothing_twice(self):
        self.break_case("berta")
        first = make_cohort(self.cohort, "TARGET=sensitivity", *SETTINGS.split())
        self.assertIn("2 of 3 cases done, 1 set aside", first.stdout)
        self.assertIn("skim", first.stdout)
        self.assertNotEqual(first.returncode, 0)
        table = self.cohort / "anna/out/sensitivity.csv"
        self.assertEqual(len(table.read_text().splitlines()), 11)
        before = table.stat().st_mtime_ns
        model = self.cohort / "berta/model.toml"
        model.write_text(model.read_text().replace("[skim]", "[skin]"))
        second = make_cohort(self.cohort, "TARGET=sensitivity", *SETTINGS.split())
        self.assertEqual(second.returncode, 0, second.stdout)
        self.assertIn("3 of 3 cases done", second.stdout)
        self.assertFalse((self.cohort / "berta/out/failed.txt").exists())
        self.assertEqual(table.stat().st_mtime_ns, before)

    @unittest.skipUnless(shutil.which("snakemake"), "no snakemake")
    def test_snakemake_in_parts_gives_the_bytes_of_make(self):
        shutil.rmtree(self.cohort / "clara")
        self.break_case("berta")
        make_cohort(self.cohort, "TARGET=sensitivity", *SETTINGS.split())
        said = snakemake(self.cohort, self.work / "out", self.work, "target=sensitivity", f"make={SETTINGS} PARTS=2")
        self.assertIn("1 of 2 cases done, 1 set aside", said.stdout)
        alone, here = self.cohort / "anna/out", self.work / "out/anna"
        for file in ("labels.vti", "mesh.vtu", "sensitivity.csv"):
            self.assertEqual((alone / file).read_bytes(), (here / file).read_bytes(), file)
        self.assertEqual(figures(alone / "sensitivity.json"), figures(here / "sensitivity.json"))
        self.assertTrue((here / "draws/0-5.csv").exists() and (here / "draws/5-10.csv").exists())
        self.assertIn("skim", (self.work / "out/berta/failed.txt").read_text())
        self.parts_that_do_not_fit_are_refused(here)

    def parts_that_do_not_fit_are_refused(self, out):
        merge = [BIN / "supine-sensitivity", self.cohort / "anna", out / "mesh.vtu", "--threads", "1", "-o", self.work / "merged.csv"]
        first, second = out / "draws/0-5.csv", out / "draws/5-10.csv"
        for words, message in (
            (["--samples", "10", "--merge", second], "draw 0 is in no part, of 10 that --samples asks for; make it with --draws 0:5"),
            (["--samples", "10", "--merge", first, first, second], "draw 0 is in another part too"),
            (["--samples", "11", "--merge", first, second], "draw 10 is in no part, of 11"),
            (["--samples", "10", "--seed", "2", "--merge", first, second], "sample 1 is not what --seed and --law draw"),
            (["--draws", "7:7"], "--draws 7:7: must be A:B"),
        ):
            said = run([*merge, *words])
            self.assertEqual(said.returncode, 2, said.stdout)
            self.assertIn(message, said.stdout)
        self.assertFalse((self.work / "merged.csv").exists())

    def refused(self, *words):
        said = make_cohort(self.cohort, "TARGET=mesh")
        self.assertNotEqual(said.returncode, 0)
        for word in words:
            self.assertIn(word, said.stdout)
        self.assertEqual(said.stdout.count("error:"), 1, said.stdout)
        self.assertFalse(list(self.cohort.glob("*/out")), "something was run")

    def test_a_cohort_without_cases_is_refused(self):
        shutil.rmtree(self.cohort)
        self.cohort.mkdir()
        self.refused("holds no case")

    def test_two_cases_of_one_name_are_refused(self):
        case = self.cohort / "clara/case.toml"
        case.write_text(case.read_text().replace('"clara"', '"anna"'))
        self.refused("anna", "clara", 'both named "anna"')

    def test_a_case_that_is_a_link_to_outside_is_refused(self):
        shutil.move(self.cohort / "clara", self.work / "elsewhere")
        (self.cohort / "clara").symlink_to(self.work / "elsewhere")
        self.refused("clara", "outside the cohort")

    def test_a_file_that_lies_outside_is_refused(self):
        shutil.move(self.cohort / "clara/supine.ply", self.work / "supine.ply")
        (self.cohort / "clara/supine.ply").symlink_to(self.work / "supine.ply")
        self.refused("clara", "surface.supine", "outside the cohort")

    def test_a_name_that_make_cannot_handle_is_refused(self):
        (self.cohort / "clara").rename(self.cohort / "clara two")
        self.refused("clara two", "cannot handle")

    @unittest.skipUnless(shutil.which("snakemake"), "no snakemake")
    def test_a_cluster_that_does_not_answer_is_refused_before_anything_is_submitted(self):
        said = run(["snakemake", "-s", "cohort/Snakefile", "--profile", SOURCE / "cohort/slurm", "--directory", self.work, "--config",
                    f"cohort={self.cohort}", f"out={self.work / 'out'}", f"bin={BIN}"])
        self.assertNotEqual(said.returncode, 0)
        self.assertIn("does not answer, nothing was submitted", said.stdout)
        self.assertFalse((self.work / "out").exists())


class PriorsOfAPopulation(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.work = pathlib.Path(folder.name)
        self.case = self.work / "anna"
        shutil.copytree(SMALL, self.case)

    def calibrate(self, priors, name="anna"):
        case = self.case.rename(self.work / name)
        (self.work / "priors.json").write_text(json.dumps(priors))
        if "[priors]" not in (case / "case.toml").read_text():
            with (case / "case.toml").open("a") as file:
                file.write('\n[priors]\ncohort = "../priors.json"\n')
        said = run([BIN / "supine-calibrate", case, case / "out/mesh.vtu", "-o", self.work / "fit", "--threads", "1", "--force"])
        case.rename(self.case)
        return said

    def told(self, median=2.5):
        return {"numbers": [{"name": "breast.young_modulus_kpa", "patients": 3, "of_new": {"median": 3.0, "log_sd": 0.2},
                             "left_out": [{"patient": "anna", "median": median, "log_sd": 0.1}]}]}

    def prior(self):
        coordinates = json.loads((self.work / "fit/calibration.json").read_text())["worth"]["coordinates"]
        return next((c["prior_mean"], c["prior_sd"]) for c in coordinates if c["name"] == "breast.young_modulus_kpa")

    def test_who_is_in_the_cohort_gets_what_the_others_say_and_another_what_all_do(self):
        said = self.calibrate(self.told())
        self.assertIn(said.returncode, (0, 1), said.stdout)
        self.assertIn("this patient is left out", said.stdout)
        mean, sd = self.prior()
        self.assertAlmostEqual(mean, math.log(2.5), places=12)
        self.assertAlmostEqual(sd, 0.1, places=12)
        said = self.calibrate(self.told(), "berta")
        self.assertIn("of which this patient is none", said.stdout)
        self.assertAlmostEqual(self.prior()[0], math.log(3), places=12)

    def test_what_is_no_cohort_or_says_nothing_of_the_model_is_refused(self):
        for priors, message in (({"numbers": 3}, "is no cohort.json"), ({"numbers": []}, "says nothing of the free numbers"),
                                (self.told(1e9), "has the median 1000000000"), (self.told(-1), "has the median -1")):
            said = self.calibrate(priors)
            self.assertEqual(said.returncode, 2, said.stdout)
            self.assertIn(message, said.stdout)
            self.assertIn("priors.json", said.stdout)
        self.assertFalse((self.work / "fit/calibration.json").exists())


class PooledCalibrations(unittest.TestCase):
    """Three patients of about one modulus: what is pooled is theirs, whatever was believed of it before."""

    def pooled(self, work, prior, *options):
        patients = []
        for i in range(3):
            case = work / f"cohort/P{i}"
            (case / "out").mkdir(parents=True)
            shutil.copy(SMALL / "case.toml", case)
            model = work / f"model{i}.toml"
            text = (SMALL / "model.toml").read_text().replace("poisson_ratio = 0.45", f"poisson_ratio = 0.44{i + 1}")
            model.write_text(text.replace("value = 2.0, prior_sd = 1.0", prior))
            said = run([BIN / "supine-calibrate", SMALL, SMALL / "out/mesh.vtu", "--model", model, "-o", case / "out", "--threads", "1",
                        "--method", "least-squares", *options])
            self.assertIn(said.returncode, (0, 1), said.stdout)
            patients.append(json.loads((case / "out/calibration.json").read_text()))
        said = run([BIN / "supine-cohort", work / "cohort"])
        self.assertEqual(said.returncode, 0, said.stdout)
        return patients, json.loads((work / "cohort/cohort.json").read_text())["numbers"][0]

    def test_what_was_believed_before_does_not_move_the_population(self):
        alone = None
        for prior, options in (("value = 2.0, prior_sd = 1.0", ["--no-priors"]), ("value = 2.0, prior_sd = 1.0", []),
                               ("value = 2.0, prior_sd = 1e9", []), ("value = 2.0, prior_sd = 0.02", [])):
            with tempfile.TemporaryDirectory() as folder:
                patients, found = self.pooled(pathlib.Path(folder), prior, *options)
            if alone is None:
                alone = sum(math.log(one["parameters"][0]["value"]) for one in patients) / 3
                self.assertIsNone(patients[0]["worth"]["coordinates"][0]["prior_mean"])
                self.assertIsNone(patients[0]["worth"]["coordinates"][0]["prior_sd"])
            self.assertAlmostEqual(math.log(found["median"]["value"]), alone, delta=0.05, msg=prior)
            low, high = (math.log(end) for end in found["median"]["interval95"])
            self.assertTrue(low < alone < high and high - low < 2.5, (prior, low, high))  # the scan may lie elsewhere


class StagesOnTheWay(unittest.TestCase):
    def test_after_the_stages_on_the_way_make_has_only_the_target_left(self):
        with tempfile.TemporaryDirectory() as folder:
            case = pathlib.Path(folder) / "case"
            shutil.copytree(SMALL, case, ignore=shutil.ignore_patterns("out"))
            make = ["make", "-s", "-f", "pipeline/Makefile", f"CASE={case}", f"BIN={BIN}", "THREADS=1", *SETTINGS.split()]
            way = run([*make, "TARGET=compare", "way"]).stdout.split()
            self.assertEqual(way[-1], "compare")
            for stage in way:
                said = run([*make, stage]).stdout
                self.assertEqual(said.count("== "), 1, f"{stage} is not one step after those before it:\n{said}")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
