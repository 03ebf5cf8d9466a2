# SPDX-License-Identifier: AGPL-3.0-or-later
"""Effects and residuals of one's own: what they do, and that wrong derivatives are refused."""

import unittest

import supine
import numpy as np
from support import SmallCase


class Scar(supine.Effect):
    name = "python_scar"
    meaning = "a patch of stiffer skin"
    parameters = [supine.Parameter("log_ratio", lower=0, upper=4, median=1.5, spread=0.7, one_sided=True)]
    slope = 1

    def weight(self, scene):
        r = np.linalg.norm(scene.skin_q - [0.35, -0.35], axis=1) / 0.4
        return np.where(r < 1, (1 - r ** 2) ** 2, 0)

    def apply(self, scene, values):
        return {"ln_skin_modulus": values["log_ratio"] * self.weight(scene)}

    def derivative(self, scene, values):
        return {"log_ratio": {"ln_skin_modulus": self.slope * self.weight(scene)}}


class Offset(Scar):
    """Curved in its parameter, so that its Taylor test has a remainder."""
    name = "python_offset"

    def apply(self, scene, values):
        return {"ln_skin_modulus": np.expm1(values["log_ratio"]) * self.weight(scene)}

    def derivative(self, scene, values):
        return {"log_ratio": {"ln_skin_modulus": self.slope * np.exp(values["log_ratio"]) * self.weight(scene)}}


class NippleDistance(supine.Residual):
    """How far the nipple is from a point, over its sigma."""
    name = "nipple distance"

    def __init__(self, row, place, sigma, slope=1.0):
        self.row, self.place, self.sigma, self.slope = row, np.asarray(place), sigma, slope

    def value(self, shapes):
        return [np.linalg.norm(shapes["supine"][self.row] - self.place) / self.sigma]

    def derivative(self, shapes, moves):
        away = shapes["supine"][self.row] - self.place
        return [self.slope * away @ moves["supine"][self.row] / np.linalg.norm(away) / self.sigma]


class Own(SmallCase):
    def with_effect(self, effect, value):
        supine.add_effect(effect)
        self.model.add(effect.name)
        self.model[f"{effect.name}.log_ratio"] = value
        return supine.simulate(self.case, self.mesh, self.model, poses=["supine"])

    def test_an_effect_is_simulated_and_differentiated(self):
        plain = supine.simulate(self.case, self.mesh, self.model, poses=["supine"])["supine"].copy()
        np.testing.assert_array_equal(self.with_effect(Scar(), 0)["supine"], plain)
        exact = supine.sensitivities(self.case, self.mesh, self.model, poses=["supine"])
        derivative = exact.derivative("python_scar.log_ratio", "supine")
        self.model["python_scar.log_ratio"] = 0.01
        moved = supine.simulate(self.case, self.mesh, self.model, poses=["supine"])["supine"] - plain
        self.assertGreater(np.abs(moved).max(), 1e-4)
        np.testing.assert_allclose(derivative * 0.01, moved, atol=0.02 * np.abs(moved).max())

    def test_an_effect_is_fitted(self):
        supine.add_effect(Scar())
        self.model.add("python_scar")
        fit = supine.calibrate(self.case, self.mesh, self.model)
        self.assertIn("python_scar.log_ratio", fit.names)
        self.assertNotEqual(fit.values["python_scar.log_ratio"], 1.5)

    def test_a_wrong_derivative_is_refused(self):
        right = Offset()
        self.with_effect(right, 0.1)
        wrong = Offset()
        wrong.slope = 1.2
        supine.add_effect(wrong)
        with self.says(supine.InputError, "effect python_offset, parameter log_ratio", "falls with order", "1.9"):
            supine.simulate(self.case, self.mesh, self.model, poses=["supine"])
        supine.add_effect(right)
        supine.simulate(self.case, self.mesh, self.model, poses=["supine"])

    def test_an_effect_that_is_there_at_null_is_refused(self):
        class Always(Scar):
            name = "python_always"

            def apply(self, scene, values):
                return {"ln_skin_modulus": (1 + values["log_ratio"]) * self.weight(scene)}

        with self.says(supine.InputError, "python_always", "null", "ln_skin_modulus"):
            self.with_effect(Always(), 0.1)

    def test_what_an_effect_raises_comes_back(self):
        class Broken(Scar):
            name = "python_broken"

            def apply(self, scene, values):
                raise ZeroDivisionError("of mine")

        with self.says(ZeroDivisionError, "of mine"):
            self.with_effect(Broken(), 0.1)

    def test_wrong_fields_sizes_and_rows_are_named(self):
        class Unknown(Scar):
            name = "python_unknown"

            def apply(self, scene, values):
                return {"softness": values["log_ratio"] * self.weight(scene)}

            def derivative(self, scene, values):
                return {"log_ratio": {"softness": self.weight(scene)}}

        class Short(Scar):
            name = "python_short"

            def weight(self, scene):
                return np.ones(3)

        with self.says(supine.InputError, "python_unknown", "softness", "ln_young"):
            self.with_effect(Unknown(), 0.1)
        self.model.remove("python_unknown")
        with self.says(supine.InputError, "python_short", "3 numbers", "ln_skin_modulus"):
            self.with_effect(Short(), 0.1)
        with self.says(supine.InputError, "parameter x", "lower = 2"):
            supine.Parameter("x", lower=2, upper=1, spread=1)

    def test_a_name_of_the_catalogue_is_refused(self):
        class Ligament(Scar):
            name = "ligament"

        with self.says(supine.InputError, "ligament"):
            supine.add_effect(Ligament())

    def test_a_scene_ends_with_its_call(self):
        kept = []

        class Keeper(Scar):
            name = "python_keeper"

            def weight(self, scene):
                kept.append(scene)
                return super().weight(scene)

        self.with_effect(Keeper(), 0.1)
        with self.says(supine.InputError, "scene", "copy"):
            kept[0].skin_q

    def test_a_residual_pulls_the_fit(self):
        before = supine.calibrate(self.case, self.mesh, self.model, method="least-squares")
        row = self.mesh.nipple
        wanted = before["supine"][row] + [0, -4.0, 0]
        weak = supine.calibrate(self.case, self.mesh, self.model, residuals=[NippleDistance(row, wanted, 1e6)])
        self.assertEqual(weak.values.keys(), before.values.keys())
        for name, value in before.values.items():
            self.assertAlmostEqual(weak.values[name] / value, 1, places=2)
        strong = supine.calibrate(self.case, self.mesh, self.model, residuals=[NippleDistance(row, wanted, 0.01)])
        self.assertLess(np.linalg.norm(strong["supine"][row] - wanted),
                        0.9 * np.linalg.norm(before["supine"][row] - wanted))
        self.assertLess(np.trace(strong.covariance), np.trace(before.covariance))

    def test_a_residual_with_a_wrong_derivative_is_refused(self):
        wrong = NippleDistance(self.mesh.nipple, [0, 0, 0], 1, slope=1.1)
        with self.says(supine.InputError, "residual nipple distance", "falls with order"):
            supine.calibrate(self.case, self.mesh, self.model, residuals=[wrong])
        with self.says(supine.InputError, "value()"):
            supine.calibrate(self.case, self.mesh, self.model, residuals=[object()])
        right = NippleDistance(self.mesh.nipple, [0, 0, 0], 1)
        with self.says(supine.InputError, "own residuals", "cmaes"):
            supine.calibrate(self.case, self.mesh, self.model, residuals=[right], method="cmaes")


if __name__ == "__main__":
    unittest.main()
