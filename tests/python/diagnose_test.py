# SPDX-License-Identifier: AGPL-3.0-or-later
"""supine.diagnose against supine-diagnose, to the last digit."""

import unittest

import supine
from support import CASE, MESH, SmallCase, figures, tool


class Diagnose(SmallCase):
    def test_a_diagnosis_is_that_of_the_tool(self):
        out = self.folder / "tool"
        model = CASE / "model.toml"
        self.assertEqual(tool("supine-diagnose", CASE, MESH, "--model", model, "--refit", "1", "--no-other-meshes", "-o",
                              out)[0], 0)
        with self.assertWarnsRegex(supine.SupineWarning, "the mesh is taken to be exact"):
            found = supine.diagnose(self.case, self.mesh, self.model, refits=1, other_meshes=False)
        self.assertEqual(found.figures, figures(out / "diagnosis.json"))
        self.assertEqual(found.verdict, found.figures["verdict"])
        self.assertIn("the mesh is taken to be exact (--no-other-meshes)", found.warnings)
        with self.assertRaises(supine.InputError) as wrong:
            supine.diagnose(self.case, self.mesh, self.model, prior=[0.5, 0.3, 0.1, 0.05])
        self.tool_says(wrong.exception, "supine-diagnose", CASE, MESH, "--model", model, "--prior", "0.5,0.3,0.1,0.05",
                       "-o", out / "other")


if __name__ == "__main__":
    unittest.main()
