# SPDX-License-Identifier: AGPL-3.0-or-later
"""supine.diagnose against supine-diagnose, to the last digit."""

import unittest

import supine
import numpy as np
from support import CASE, MESH, SmallCase, figures, tool


class Diagnose(SmallCase):
    def test_a_diagnosis_is_that_of_the_tool(self):
        out = self.folder / "tool"
        model = CASE / "model.toml"
        self.assertEqual(tool("supine-diagnose", CASE, MESH, "--model", model, "--refit", "0", "--no-other-meshes", "-o",
                              out)[0], 0)
        with self.assertWarnsRegex(supine.SupineWarning, "the mesh is taken to be exact"):
            found = supine.diagnose(self.case, self.mesh, self.model, refits=0, other_meshes=False)
        self.assertEqual(found.figures, figures(out / "diagnosis.json"))
        self.assertEqual(found.verdict, found.figures["verdict"])
        self.assertIn("the mesh is taken to be exact (--no-other-meshes)", found.warnings)
        with self.assertRaises(supine.InputError) as wrong:
            supine.diagnose(self.case, self.mesh, self.model, prior=[0.5, 0.3, 0.1, 0.05])
        self.tool_says(wrong.exception, "supine-diagnose", CASE, MESH, "--model", model, "--prior", "0.5,0.3,0.1,0.05",
                       "-o", out / "other")

    def test_what_cannot_be_left_out_is_refused(self):
        with self.assertRaisesRegex(supine.InputError, "without = gravity: must be discrepancy"):
            supine.diagnose(self.case, self.mesh, self.model, without=["gravity"])

    def test_what_an_effect_raises_in_a_thread_of_the_diagnosis_comes_back(self):
        class Fragile(supine.Effect):
            name = "python_fragile"
            meaning = "stiffer skin, of sizes it does not like"
            parameters = [supine.Parameter("log_ratio", lower=0, upper=4, median=1.5, spread=0.7, one_sided=True)]

            def apply(self, scene, values):
                if abs(values["log_ratio"] - 1.5) < 1e-9:  # its usual size, which candidates are solved at side by side
                    raise LookupError("of mine")
                return {"ln_skin_modulus": np.full(len(scene.skin_faces), values["log_ratio"])}

            def derivative(self, scene, values):
                return {"log_ratio": {"ln_skin_modulus": np.ones(len(scene.skin_faces))}}

        supine.add_effect(Fragile())
        with self.says(LookupError, "of mine"):
            supine.diagnose(self.case, self.mesh, self.model, refits=0, other_meshes=False)


if __name__ == "__main__":
    unittest.main()
