# SPDX-License-Identifier: AGPL-3.0-or-later
"""What the tests of `import supine` share: the run of the small case, and the tools beside it."""

import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import supine

BIN = pathlib.Path(os.environ["SUPINE_BIN"])
CASE = pathlib.Path(os.environ["SUPINE_SMALL_RUN"])
MESH = CASE / "out" / "mesh.vtu"


def tool(name, *arguments):
    """Runs a tool; gives its exit code and what it said on standard error."""
    done = subprocess.run([BIN / name, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          universal_newlines=True)
    return done.returncode, done.stderr


def figures(file):
    """A sidecar without what differs from run to run."""
    said = json.loads(pathlib.Path(file).read_text())
    for key in ("warnings", "provenance", "timing"):
        said.pop(key)
    return said


class SmallCase(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.case = supine.Case(CASE)
        cls.mesh = supine.Mesh(MESH, cls.case)

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.model = supine.Model(CASE / "model.toml")

    def says(self, kind, *words):
        """That the block raises `kind` with all of the words in its message."""
        test = self

        class Checked:
            def __enter__(self):
                return self

            def __exit__(self, raised, error, _):
                test.assertIs(raised, kind)
                for word in words:
                    test.assertIn(word, str(error))
                return True

        return Checked()

    def tool_says(self, error, name, *arguments):
        """That the tool ends with the message of the error and its exit code."""
        code, said = tool(name, *arguments)
        self.assertEqual(code, 2 if isinstance(error, supine.InputError) else 3)
        self.assertIn(f"{name}: error: {error}\n", said)
