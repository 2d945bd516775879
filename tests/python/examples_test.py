"""Examples and the notebook run and print what they say; the type stub has what the module has."""

import ast
import inspect
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import mantle
from mantle import _mantle
from support import SOURCE

EXAMPLES = SOURCE / "examples/python"


class Examples(unittest.TestCase):
    def test_every_example_prints_what_its_first_comment_says(self):
        for script in sorted(EXAMPLES.glob("*.py")):
            with self.subTest(script.name), tempfile.TemporaryDirectory() as work:
                expected = re.search(r"^# Prints: *(.*)$", script.read_text(), re.M).group(1)
                done = subprocess.run([sys.executable, script], cwd=work, capture_output=True, text=True)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertRegex(done.stdout, re.compile(expected, re.M))
                self.assertEqual(list(pathlib.Path(work).iterdir()), [])

    def test_the_notebook_runs_from_its_first_cell_to_its_last(self):
        try:
            import matplotlib  # noqa: F401
        except ImportError:
            self.skipTest("matplotlib is not installed")
        notebook = json.loads((EXAMPLES / "tour.ipynb").read_text())
        names = {}
        for cell in notebook["cells"]:
            if cell["cell_type"] == "code":
                self.assertEqual(cell["outputs"], [])
                exec("".join(cell["source"]), names)
        self.assertLess(names["loop"].trajectory["error"][-1], names["loop"].trajectory["error"].max())


class Stubs(unittest.TestCase):
    def test_the_stub_has_what_the_module_has(self):
        tree = ast.parse((pathlib.Path(mantle.__file__).parent / "_mantle.pyi").read_text())
        stub = {node.name: node for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
        public = {name for name in vars(_mantle) if not name.startswith("_")}
        self.assertEqual(set(stub), public)
        for name, node in stub.items():
            if not isinstance(node, ast.ClassDef):
                continue
            members = {m.name for m in node.body if isinstance(m, ast.FunctionDef)}
            members |= {m.target.id for m in node.body if isinstance(m, ast.AnnAssign)}
            here = {m for m in vars(getattr(_mantle, name)) if not m.startswith("_")}
            self.assertEqual({m for m in members if not m.startswith("_")}, here, name)
            self.assertIsNotNone(ast.get_docstring(node), name)

    def test_everything_public_is_described(self):
        self.assertTrue((pathlib.Path(mantle.__file__).parent / "py.typed").exists())
        for name in mantle.__all__:
            entry = getattr(mantle, name)
            if inspect.isfunction(entry) or (inspect.isclass(entry) and entry.__module__ != "mantle._mantle"):
                self.assertTrue(inspect.getdoc(entry), name)


if __name__ == "__main__":
    unittest.main()
