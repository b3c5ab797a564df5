# SPDX-License-Identifier: Apache-2.0
"""Runs the cells of every notebook of examples/notebooks, in order, in a new process and an empty directory."""
import importlib.util
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

NOTEBOOKS = sorted((pathlib.Path(os.environ["SDAG_SOURCE"]) / "examples/notebooks").glob("*.ipynb"))


def code_of(notebook):
    """Returns the cells' code; the value of a cell's last expression is what a notebook would show."""
    cells = json.loads(notebook.read_text())["cells"]
    return ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]


RUN = """
import ast, json, sys
names = {"__name__": "__main__"}
for number, code in enumerate(json.load(sys.stdin), 1):
    tree = ast.parse(code, f"cell {number}")
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, f"cell {number}", "exec"), names)
    if last is not None:
        shown = eval(compile(ast.Expression(last.value), f"cell {number}", "eval"), names)
        if type(shown).__module__.startswith("shadowdag"):
            shows = [getattr(shown, name)() for name in ("_repr_png_", "_repr_html_") if hasattr(shown, name)]
            assert shows and all(shows), f"{shown} shows nothing"
        elif hasattr(shown, "savefig"):
            shown.savefig(f"{number}.png")
print("ran")
"""


class Notebooks(unittest.TestCase):
    def test_there_are_four(self):
        self.assertEqual([path.stem for path in NOTEBOOKS],
                         ["first_steps", "follow_an_error", "my_cost_model", "my_scene"])

    def test_they_are_committed_without_outputs(self):
        for path in NOTEBOOKS:
            for cell in json.loads(path.read_text())["cells"]:
                self.assertFalse(cell.get("outputs"), path.name)

    def test_their_cells_run(self):
        for path in NOTEBOOKS:
            with self.subTest(path.name), tempfile.TemporaryDirectory() as folder:
                if importlib.util.find_spec("pandas") is None:
                    self.skipTest("python3-pandas is not installed")
                done = subprocess.run([sys.executable, "-c", RUN], input=json.dumps(code_of(path)), text=True,
                                      capture_output=True, cwd=folder)
                self.assertEqual((done.returncode, done.stdout.splitlines()[-1:]), (0, ["ran"]), done.stderr)


if __name__ == "__main__":
    unittest.main()
