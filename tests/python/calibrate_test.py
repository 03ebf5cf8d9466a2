# SPDX-License-Identifier: AGPL-3.0-or-later
"""supine.calibrate, sensitivities and draw against the tools' files, to the last digit."""

import csv
import unittest

import supine
import numpy as np
from support import CASE, MESH, SmallCase, figures, tool


class Calibrate(SmallCase):
    def test_model_figures_and_history_are_those_of_the_tool(self):
        out = self.folder / "tool"
        self.assertIn(tool("supine-calibrate", CASE, MESH, "-o", out, "--threads", "2",
                           "--method", "least-squares")[0], (0, 1))
        lines = []
        fit = supine.calibrate(self.case, self.mesh, self.model, method="least-squares", progress=lines.append)
        self.assertEqual(fit.model.text, (out / "model.toml").read_text())
        self.assertEqual(fit.figures, figures(out / "calibration.json"))
        self.assertTrue(any("RMS" in line for line in lines))
        with open(out / "history.csv") as stream:
            rows = list(csv.DictReader(stream))
        self.assertEqual([float(row["rms_mm"] or "nan") for row in rows], list(fit.history["rms_mm"]))
        self.assertEqual(fit.values, {name: fit.model[name] for name in fit.names})
        self.assertEqual(fit.jacobian.shape, (len(fit.residuals_mm), len(fit.names)))
        self.assertAlmostEqual(np.sqrt(np.mean(fit.residuals_mm ** 2)), fit.figures["rms_mm"], places=9)
        again = supine.simulate(self.case, self.mesh, fit.model, poses=["supine"])
        np.testing.assert_allclose(fit["supine"], again["supine"], atol=1e-5)

    def test_without_a_method_all_that_is_never_known_is_fitted_too(self):
        out = self.folder / "tool"
        self.assertIn(tool("supine-calibrate", CASE, MESH, "-o", out, "--threads", "2")[0], (0, 1))
        fit = supine.calibrate(self.case, self.mesh, self.model)
        self.assertEqual(fit.figures["method"], "joint")
        self.assertEqual(fit.model.text, (out / "model.toml").read_text())
        self.assertEqual(fit.figures, figures(out / "calibration.json"))
        self.assertEqual(len(fit.history["rms_mm"]), fit.figures["evaluations"])
        self.assertEqual(supine.calibrate(self.case, self.mesh, self.model, starts=2).figures["method"], "least-squares")

    def test_options_are_checked_as_the_tools_do(self):
        with self.assertRaises(supine.InputError) as both:
            supine.calibrate(self.case, self.mesh, self.model, method="joint", starts=3)
        self.tool_says(both.exception, "supine-calibrate", CASE, MESH, "--method", "joint", "--starts", "3", "-o",
                       self.folder)
        with self.says(supine.InputError, "method = newton", "least-squares"):
            supine.calibrate(self.case, self.mesh, self.model, method="newton")
        with self.says(supine.InputError, "robust_mm = 0", "must be"):
            supine.calibrate(self.case, self.mesh, self.model, robust_mm=0)

    def test_draws_are_those_of_the_tool(self):
        out = self.folder / "sensitivity.csv"
        self.assertEqual(tool("supine-sensitivity", CASE, MESH, "--samples", "12", "-o", out)[0], 0)
        draws = supine.draw(self.case, self.mesh, self.model, samples=12)
        draws.write(self.folder / "python.csv")
        self.assertEqual((self.folder / "python.csv").read_bytes(), out.read_bytes())
        self.assertEqual(draws.figures, figures(self.folder / "sensitivity.json"))
        self.assertEqual(draws.values.shape, (12, len(draws.names)))
        with self.says(supine.InputError, "law = uniform"):
            supine.draw(self.case, self.mesh, self.model, samples=2, law="uniform")

    def test_what_progress_raises_in_a_thread_ends_the_draws(self):
        def stop(line):
            if line.strip().startswith("run 2"):
                raise KeyError(line)

        with self.assertRaises(KeyError):
            supine.draw(self.case, self.mesh, self.model, samples=50, progress=stop)

    def test_derivatives_are_those_of_the_shapes(self):
        exact = supine.sensitivities(self.case, self.mesh, self.model, poses=["supine"])
        name, shapes = "breast.young_modulus_kpa", {}
        value = self.model[name]
        for sign in (-1, 1):
            model = self.model.copy()
            model[name] = value * (1 + sign * 1e-3)
            shapes[sign] = supine.simulate(self.case, self.mesh, model, poses=["supine"])["supine"]
        slope = (shapes[1] - shapes[-1]) / (2e-3 * value)
        derivative = exact.derivative(name, "supine")
        self.assertLess(np.abs(derivative - slope).max(), 1e-3 * np.abs(slope).max())
        # The adjoint of J = Σ x of the nipple's row gives the same number.
        J = np.zeros_like(derivative)
        J[self.mesh.nipple] = 1
        self.assertAlmostEqual(exact.gradient({"supine": J}, [name])[name], derivative[self.mesh.nipple].sum(), places=6)
        with self.says(supine.InputError, "breast.young_modulus"):
            exact.derivative("breast.young_modulus", "supine")
        with self.says(supine.InputError, "sitting", "supine"):
            exact.gradient({"sitting": J})


if __name__ == "__main__":
    unittest.main()
