# SPDX-License-Identifier: AGPL-3.0-or-later
"""The stubs name what the module has, with the same arguments and defaults; all of it is documented."""

import ast
import pathlib
import re
import unittest

import supine
from supine import _supine

STUB = ast.parse((pathlib.Path(supine.__file__).parent / "_supine.pyi").read_text())
# Python's own, or explained by the class.
PLAIN = {"__init__", "__doc__", "__module__", "__repr__", "__new__", "__copy__", "copy"}


def arguments(function):
    """{argument: default} of a stub, defaults as text."""
    a = function.args
    plain = dict(zip([x.arg for x in a.args][::-1], [ast.unparse(d) for d in a.defaults][::-1]))
    named = {x.arg: d and ast.unparse(d) for x, d in zip(a.kwonlyargs, a.kw_defaults)}
    return {**{x.arg: plain.get(x.arg) for x in a.args if x.arg != "self"}, **named}


def said_arguments(documentation):
    """The same of what pybind11 writes as the first line of a docstring."""
    inside = re.search(r"\((.*)\) ->", documentation.splitlines()[0]).group(1)
    found = {}
    for name, default in re.findall(r"(\w+): [\w.\[\], ]+?(?: = ([^,]+(?:\])?))?(?=, \w+:|, \*|$)", inside):
        if name not in ("self", "arg0"):
            found[name] = default or None
    return found


class Stubs(unittest.TestCase):
    def test_every_name_is_there_on_both_sides(self):
        stub = {node.name for node in STUB.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
        module = {name for name in dir(_supine) if not name.startswith("__")}
        self.assertEqual(stub, module)

    def test_members_are_the_same(self):
        for node in STUB.body:
            made = getattr(_supine, node.name, None) if isinstance(node, ast.ClassDef) else None
            if made is None or issubclass(made, (Exception, Warning)):
                continue
            stub = {f.name for f in node.body if isinstance(f, ast.FunctionDef)} - PLAIN
            real = {name for name in vars(made) if name not in PLAIN and not name.startswith("__") or name in ("__getitem__", "__setitem__")}
            self.assertEqual(stub, real, node.name)

    def test_arguments_of_functions_are_the_same(self):
        for node in STUB.body:
            if isinstance(node, ast.FunctionDef) and node.name != "_add_effect":
                self.assertEqual(set(arguments(node)), set(said_arguments(getattr(_supine, node.name).__doc__)), node.name)

    def test_functions_and_classes_are_documented(self):
        for name in dir(_supine):
            if not name.startswith("_"):
                self.assertGreater(len(getattr(_supine, name).__doc__ or ""), 20, name)


if __name__ == "__main__":
    unittest.main()
