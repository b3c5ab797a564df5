# SPDX-License-Identifier: Apache-2.0
"""A wheel of this build is complete: installed by itself it renders, and its program is beside it."""
import importlib.util
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import zipfile

CHECK = """
import shadowdag as sd
assert sd.__file__.startswith(FOLDER), sd.__file__
frame = sd.load("builtin:fail-acne").frame(method="dag", size="16x16")
assert sd.program().startswith(FOLDER), sd.program()
assert sd.run_program("info", "builtin:fail-acne")
sd.run_program("voxelize", "builtin:fail-acne", "-o", "a.svdag", "--resolution", "64")
sd.run_program("export", "a.svdag", "-o", "a.vdb")  # by a module beside the program
from shadowdag.charts import report_package
assert report_package().__file__.startswith(FOLDER)
print("complete", len(frame.visibility))
"""


class Wheel(unittest.TestCase):
    def test_a_wheel_is_complete(self):
        for module in ("pip", "setuptools", "wheel"):
            if importlib.util.find_spec(module) is None:
                self.skipTest(f"python3-{module} is not installed")
        with tempfile.TemporaryDirectory() as folder:
            folder = os.path.realpath(folder)
            clean = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "SHADOWDAG_PROGRAM")}
            done = subprocess.run(
                [sys.executable, "-m", "pip", "wheel", os.environ["SDAG_SOURCE"], "--no-deps", "--no-build-isolation",
                 "--no-index", "-w", folder], capture_output=True, text=True,
                env=clean | {"SHADOWDAG_BUILD": os.environ["SDAG_BUILD"]})
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            wheels = list(pathlib.Path(folder).glob("*.whl"))
            self.assertEqual(len(wheels), 1)
            self.assertNotIn("none-any", wheels[0].name)  # it holds code of one Python and one processor
            names = zipfile.ZipFile(wheels[0]).namelist()
            for name in ("shadowdag/py.typed", "shadowdag/_native.pyi", "shadowdag/prefix/bin/shadowdag",
                         "shadowdag/prefix/lib/shadowdag/sdag_openvdb.so"):
                self.assertIn(name, names)
            target = os.path.join(folder, "site")
            subprocess.run([sys.executable, "-m", "pip", "install", "--no-deps", "--no-index", "-t", target, wheels[0]],
                           check=True, capture_output=True, env=clean)
            done = subprocess.run([sys.executable, "-c", f"FOLDER = {folder!r}\n" + CHECK], capture_output=True, text=True,
                                  cwd=folder, env=clean | {"PYTHONPATH": target})
            self.assertEqual((done.returncode, done.stdout[:8]), (0, "complete"), done.stderr)


if __name__ == "__main__":
    unittest.main()
