# SPDX-License-Identifier: AGPL-3.0-or-later
"""What `import supine` sets before its libraries are loaded, and what it says when that comes too late."""

import os
import subprocess
import sys
import unittest


def python(code, **more):
    environment = {name: value for name, value in os.environ.items() if name not in ("GOMP_SPINCOUNT", "OMP_WAIT_POLICY")}
    return subprocess.run([sys.executable, "-c", code], env={**environment, **more}, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, universal_newlines=True)


class Import(unittest.TestCase):
    def test_sets_what_the_tools_set(self):
        done = python("import os, supine; print(os.environ['GOMP_SPINCOUNT'])")
        self.assertEqual(done.stdout, "1000\n")

    def test_leaves_what_the_user_has_set(self):
        self.assertEqual(python("import os, supine; print(os.environ['GOMP_SPINCOUNT'])", GOMP_SPINCOUNT="7").stdout, "7\n")
        self.assertEqual(python("import os, supine; print('GOMP_SPINCOUNT' in os.environ)", OMP_WAIT_POLICY="passive").stdout,
                         "False\n")

    def test_says_when_it_comes_too_late(self):
        late = "import ctypes; ctypes.CDLL('libgomp.so.1'); import supine; print(supine.__version__)"
        done = python(late)
        self.assertEqual(done.returncode, 0)
        self.assertIn("SupineWarning", done.stdout)
        self.assertIn("Import supine first, or start Python with GOMP_SPINCOUNT=1000", done.stdout)
        self.assertNotIn("Warning", python(late, GOMP_SPINCOUNT="1000").stdout)


if __name__ == "__main__":
    unittest.main()
