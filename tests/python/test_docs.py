"""What is written about the package holds: docstrings, docs/python.md, stubs, examples."""
import ast
import doctest
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import rayrep
from rayrep import _errors, _physics, _rayrep, _runs, _settings
from solids import EXAMPLES, ROOT

OPTIONS = doctest.ELLIPSIS


class Doctests(unittest.TestCase):
    def test_docstrings(self):
        for module in (rayrep, _errors, _physics, _runs, _settings):
            failed, tried = doctest.testmod(module, optionflags=OPTIONS)
            self.assertEqual(failed, 0, module)
        runner = doctest.DocTestRunner(optionflags=OPTIONS)
        tests = doctest.DocTestFinder().find(_rayrep.Mesh, "Mesh", module=False)
        for test in tests:
            runner.run(test)
        self.assertGreater(runner.tries, 2)
        self.assertEqual(runner.failures, 0)

    def test_the_tutorial(self):
        here = os.getcwd()
        os.chdir(ROOT)
        try:
            failed, tried = doctest.testfile(str(ROOT / "docs" / "python.md"), module_relative=False, optionflags=OPTIONS)
        finally:
            os.chdir(here)
        self.assertEqual(failed, 0)
        self.assertGreater(tried, 20)

    def test_everything_public_is_described(self):
        for name in rayrep.__all__:
            thing = getattr(rayrep, name)
            if not callable(thing):
                continue
            self.assertTrue(thing.__doc__, name)
            self.assertEqual(thing.__module__, "rayrep", name)
            for member in vars(thing) if isinstance(thing, type) else ():
                value = getattr(thing, member)
                if not member.startswith("_") and (callable(value) or isinstance(value, property)):
                    self.assertTrue(value.__doc__, f"{name}.{member}")


class Stubs(unittest.TestCase):
    tree = ast.parse((ROOT / "python" / "rayrep" / "_rayrep.pyi").read_text())

    def test_the_stub_names_what_the_module_has(self):
        classes = {node.name: node for node in self.tree.body if isinstance(node, ast.ClassDef)}
        functions = {node.name: node for node in self.tree.body if isinstance(node, ast.FunctionDef)}
        has = {name for name in dir(_rayrep) if not name.startswith("_")}
        self.assertEqual(set(classes) | set(functions), has)
        for name, node in classes.items():
            members = {one.name for one in node.body if isinstance(one, ast.FunctionDef)} - {"__init__"}
            self.assertEqual(members, {one for one in vars(getattr(_rayrep, name)) if not one.startswith("_")}, name)
        for name, node in functions.items():
            said = getattr(_rayrep, name).__doc__.splitlines()[0]
            count = len(re.findall(r"arg\d+:", said))
            self.assertEqual(count, len(node.args.posonlyargs), said)

    def test_the_type_checker_agrees(self):
        try:
            import mypy  # noqa: F401
        except ImportError:
            self.skipTest("mypy is not installed")
        with tempfile.TemporaryDirectory() as folder:
            for tool in (["mypy", "--strict"], ["mypy.stubtest"]):
                what = ["-p", "rayrep"] if tool[0] == "mypy" else ["rayrep._rayrep", "--ignore-missing-stub", "--allowlist",
                                                                   str(Path(__file__).parent / "stubtest.txt")]
                done = subprocess.run([sys.executable, "-m", *tool, *what], cwd=folder, capture_output=True, text=True,
                                      env={**os.environ, "MYPYPATH": os.environ["PYTHONPATH"]})
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_nothing_else_is_exported(self):
        done = subprocess.run(["nm", "-D", "--defined-only", _rayrep.__file__], capture_output=True, text=True)
        if done.returncode != 0:
            self.skipTest("no nm")
        self.assertEqual([line.split()[-1] for line in done.stdout.splitlines()], ["PyInit__rayrep"])


class Examples(unittest.TestCase):
    def run_example(self, name, files):
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([sys.executable, str(EXAMPLES / "python" / name), folder], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(sorted(os.listdir(folder)), sorted(files))
            return done.stdout, {name: (Path(folder) / name).read_bytes() for name in files}

    def test_a_parameter_study(self):
        try:
            import matplotlib  # noqa: F401
        except ImportError:
            self.skipTest("no matplotlib")
        said, files = self.run_example("wall_study.py", ["wall_study.png"])
        self.assertTrue(files["wall_study.png"].startswith(b"\x89PNG"))
        self.assertEqual(len(said.splitlines()), 7)

    def test_a_link(self):
        import xml.etree.ElementTree as xml
        said, files = self.run_example("urdf_link.py", ["link.stl", "link.urdf"])
        link = xml.fromstring(files["link.urdf"]).find("link")
        self.assertAlmostEqual(float(link.find("inertial/mass").get("value")), 0.075, places=6)

    def test_ducks(self):
        sizes = (40, 60, 80, 100)
        said, files = self.run_example("ducks.py", ["ducks.csv"] + [f"duck_{n}.stl" for n in sizes])
        rows = files["ducks.csv"].decode().splitlines()
        self.assertEqual(len(rows), 5)
        self.assertEqual([row.split(",")[1] for row in rows[1:]], ["verified"] * 4)


if __name__ == "__main__":
    unittest.main()
