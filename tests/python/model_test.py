# SPDX-License-Identifier: AGPL-3.0-or-later
"""supine.Model: the text of a model file and what it says."""

import unittest

import supine
from support import CASE, SmallCase, tool

TEXT = """# what the clinic believes
[breast]
young_modulus_kpa = { value = 0.5, prior_sd = 0.3, lower = 0.1, upper = 5 }  # from the pilot
poisson_ratio = 0.45
"""


class Model(SmallCase):
    def test_a_number_is_read_and_set_and_comments_stay(self):
        model = supine.Model.from_text(TEXT)
        self.assertEqual(model["breast.young_modulus_kpa"], 0.5)
        model["breast.young_modulus_kpa"] = 1 / 3
        self.assertEqual(model["breast.young_modulus_kpa"], 1 / 3)
        self.assertEqual(model.text, TEXT.replace("0.5,", f"{1 / 3},"))
        self.assertEqual(model.free, ["breast.young_modulus_kpa"])
        self.assertEqual(model.setting("breast.young_modulus_kpa"),
                         {"value": 1 / 3, "unit": "kPa", "free": True, "prior_sd": 0.3, "lower": 0.1, "upper": 5})

    def test_what_is_refused_changes_nothing(self):
        model = supine.Model.from_text(TEXT, file="mine.toml")
        with self.says(supine.InputError, "mine.toml:3", "young_modulus_kpa", "7", "5"):
            model["breast.young_modulus_kpa"] = 7
        with self.says(supine.InputError, "young_modulus_kp", "did you mean breast.young_modulus_kpa?"):
            model["breast.young_modulus_kp"] = 1
        with self.says(supine.InputError, "skin.young_modulus_kpa", "write one"):
            model["skin.young_modulus_kpa"] = 30
        with self.says(supine.InputError, "mine.toml:3"):
            model.set({"breast.poisson_ratio": 0.3, "breast.young_modulus_kpa": 7})
        self.assertEqual(model.text, TEXT)
        self.assertEqual(model["breast.poisson_ratio"], 0.45)

    def test_messages_are_those_of_the_tool(self):
        file = self.folder / "model.toml"
        file.write_text(TEXT.replace("0.45", "0.5"))
        with self.assertRaises(supine.InputError) as wrong:
            supine.Model(file)
        self.tool_says(wrong.exception, "supine-model", "show", file)
        with self.says(supine.InputError, "2:", "not valid TOML"):
            supine.Model.from_text("[breast]\nlaw = \n")

    def test_effects_come_and_go_as_with_the_tool(self):
        file = self.folder / "model.toml"
        file.write_text(TEXT)
        model = supine.Model(file)
        model.add("ligament")
        self.assertEqual(tool("supine-model", "add", "ligament", file)[0], 0)
        self.assertEqual(model.text, file.read_text())
        self.assertEqual(model.effects, ["ligament"])
        self.assertIn("ligament.width_mm", model.names)
        with self.says(supine.InputError, "there already"):
            model.add("ligament")
        with self.says(supine.InputError, "did you mean creep?"):
            model.add("crep")
        model.remove("ligament")
        self.assertEqual(model.text, TEXT)

    def test_a_copy_is_another_model(self):
        model = supine.Model.from_text(TEXT)
        other = model.copy()
        other["breast.poisson_ratio"] = 0.3
        self.assertEqual(model["breast.poisson_ratio"], 0.45)

    def test_writing_replaces_nothing_unasked(self):
        self.model.write(self.folder / "model.toml")
        self.assertEqual((self.folder / "model.toml").read_text(), (CASE / "model.toml").read_text())
        with self.says(supine.InputError, "model.toml", "force"):
            self.model.write(self.folder / "model.toml")
        self.model.write(self.folder / "model.toml", force=True)


if __name__ == "__main__":
    unittest.main()
