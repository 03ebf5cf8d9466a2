# SPDX-License-Identifier: AGPL-3.0-or-later
"""supine.simulate against supine-simulate, to the last byte; and what it refuses."""

import gc
import os
import signal
import threading
import unittest

import supine
import numpy as np
from support import CASE, MESH, SmallCase, figures, tool


TOO_SOFT = """[breast]
young_modulus_kpa = 0.01
poisson_ratio = 0.3
density_kg_m3 = 2000
[skin]
young_modulus_kpa = 0.1
compression_share = 0.01
[cut]
stiffness_kpa_per_mm = 0.001
[interface]
tangential_kpa_per_mm = 0.0001
normal_kpa_per_mm = 0.01
"""


class Simulate(SmallCase):
    def test_shapes_and_figures_are_those_of_the_tool(self):
        self.assertEqual(tool("supine-simulate", CASE, MESH, "-o", self.folder / "tool", "--threads", "2")[0], 0)
        found = supine.simulate(self.case, self.mesh, self.model)
        self.assertTrue(found.certain)
        self.assertEqual(found.shapes, ["prone", "undeformed", "supine"])
        for shape in found.shapes:
            found.write(shape, self.folder / f"{shape}.vtu")
            self.assertEqual((self.folder / f"{shape}.vtu").read_bytes(),
                             (self.folder / "tool" / f"{shape}.vtu").read_bytes(), shape)
            self.assertEqual(found.figures(shape), figures(self.folder / "tool" / f"{shape}.json"), shape)

    def test_a_changed_number_is_that_of_a_changed_file(self):
        self.model["breast.young_modulus_kpa"] = 1.5
        self.model.write(self.folder / "model.toml")
        self.assertEqual(tool("supine-simulate", CASE, MESH, "--model", self.folder / "model.toml", "-o",
                              self.folder / "tool", "--pose", "supine")[0], 0)
        found = supine.simulate(self.case, self.mesh, self.model, poses=["supine"])
        self.assertEqual(found.figures("supine"), figures(self.folder / "tool" / "supine.json"))
        stiffer = supine.simulate(self.case, self.mesh, supine.Model(CASE / "model.toml"))
        moved = [np.linalg.norm(shapes["supine"] - self.mesh.points, axis=1).max() for shapes in (stiffer, found)]
        self.assertLess(moved[0], moved[1])

    def test_shapes_are_views_that_outlive_their_names(self):
        shape = supine.simulate(self.case, self.mesh, self.model)["supine"]
        gc.collect()
        self.assertEqual(shape.shape, self.mesh.points.shape)
        self.assertEqual(shape.dtype, np.float64)
        self.assertTrue(np.isfinite(shape).all())
        with self.assertRaises(ValueError):
            shape[0, 0] = 0

    def test_points_are_carried_along(self):
        found = supine.simulate(self.case, self.mesh, self.model)
        nodes = [self.mesh.nipple, 0]
        np.testing.assert_allclose(found.carry(self.mesh.points[nodes], "supine"), found["supine"][nodes], atol=1e-9)
        with self.says(supine.InputError, "points", "4 by 2", "N by 3"):
            found.carry(np.zeros((4, 2)), "supine")

    def test_progress_is_told(self):
        lines = []
        supine.simulate(self.case, self.mesh, self.model, progress=lines.append)
        self.assertTrue(any("supine: load 100 %" in line for line in lines), lines[-3:])

    def test_what_progress_raises_ends_the_run(self):
        class Enough(Exception):
            pass

        def stop(line):
            raise Enough(line)

        with self.assertRaises(Enough):
            supine.simulate(self.case, self.mesh, self.model, progress=stop)
        self.assertTrue(supine.simulate(self.case, self.mesh, self.model).certain)

    def test_ctrl_c_ends_the_run(self):
        with self.assertRaises(KeyboardInterrupt):
            supine.simulate(self.case, self.mesh, self.model, progress=lambda line: os.kill(os.getpid(), signal.SIGINT))

    def test_other_threads_of_python_run_meanwhile(self):
        over, turns = threading.Event(), []

        def count():
            while not over.wait(0.001):
                turns.append(1)

        counting = threading.Thread(target=count)
        counting.start()
        before = len(turns)
        supine.simulate(self.case, self.mesh, self.model)
        during = len(turns) - before
        over.set()
        counting.join()
        self.assertGreater(during, 5)

    def test_the_number_of_threads_changes_no_result(self):
        self.addCleanup(supine.set_threads)
        self.assertEqual(supine.set_threads(1), 1)
        alone = supine.simulate(self.case, self.mesh, self.model)["supine"].copy()
        self.assertEqual(supine.set_threads(2), 2)
        np.testing.assert_array_equal(supine.simulate(self.case, self.mesh, self.model)["supine"], alone)
        with self.says(supine.InputError, "threads = -1", "1024"):
            supine.set_threads(-1)

    def test_refusals_are_those_of_the_tool(self):
        with self.assertRaises(supine.InputError) as wrong_pose:
            supine.simulate(self.case, self.mesh, self.model, poses=["sitting"])
        self.tool_says(wrong_pose.exception, "supine-simulate", CASE, MESH, "--pose", "sitting", "-o", self.folder)
        self.model = supine.Model.from_text(TOO_SOFT)
        self.model.write(self.folder / "soft.toml")
        with self.assertRaises(supine.NumericalFailure) as no_equilibrium:
            supine.simulate(self.case, self.mesh, self.model)
        self.tool_says(no_equilibrium.exception, "supine-simulate", CASE, MESH, "--model", self.folder / "soft.toml",
                       "-o", self.folder)
        with self.says(supine.InputError, "inverse = backwards", "newton"):
            supine.simulate(self.case, self.mesh, self.model, inverse="backwards")
        found = supine.simulate(self.case, self.mesh, self.model.from_text(""), poses=["supine"])
        with self.says(supine.InputError, "sitting", "prone, undeformed or supine"):
            found["sitting"]
        (self.folder / "there.vtu").touch()
        with self.says(supine.InputError, "there.vtu", "force"):
            found.write("supine", self.folder / "there.vtu")

    def test_case_and_mesh_are_checked_as_the_tools_do(self):
        with self.says(supine.InputError, "nowhere", "not there"):
            supine.Case("nowhere")
        with self.says(supine.InputError, "nowhere.vtu"):
            supine.Mesh("nowhere.vtu", self.case)
        with self.assertRaises(TypeError):
            supine.simulate(self.case, self.mesh, self.model, progress=3)


if __name__ == "__main__":
    unittest.main()
