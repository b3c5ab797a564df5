# SPDX-License-Identifier: Apache-2.0
"""Builds the wheel by CMake: the package with its extension, and the program with the reports' package beside it.

SHADOWDAG_BUILD names a finished build folder to install from, of any preset with the module; without it, the preset
release is configured and built.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from setuptools import Distribution, setup
from setuptools.command.build_py import build_py

ROOT = pathlib.Path(__file__).resolve().parent


def run(*command):
    subprocess.run([str(part) for part in command], cwd=ROOT, check=True)


def jobs():
    return os.environ.get("SDAG_JOBS", str(os.cpu_count() or 1))


def built():
    """Returns a build folder with the module and the program."""
    if os.environ.get("SHADOWDAG_BUILD"):
        return pathlib.Path(os.environ["SHADOWDAG_BUILD"]).resolve()
    run("cmake", "--preset", "release", "-DSDAG_PYTHON_MODULE=ON", f"-DPython3_EXECUTABLE={sys.executable}",
        "-DSDAG_TESTS=OFF", "-DSDAG_BENCHES=OFF")
    run("cmake", "--build", "--preset", "release", "--parallel", jobs(), "--target", "sdag_python", "shadowdag")
    return ROOT / "build" / "release"


class Build(build_py):
    """Installs CMake's components into the wheel's folder."""

    def run(self):
        folder = built()
        target = pathlib.Path(self.build_lib).resolve()
        shutil.rmtree(target / "shadowdag", ignore_errors=True)  # of an earlier wheel
        with tempfile.TemporaryDirectory() as stage:
            run("cmake", "--install", folder, "--prefix", stage, "--component", "python")
            found = list(pathlib.Path(stage).rglob("shadowdag/__init__.py"))
            if len(found) != 1:
                sys.exit(f"{folder} has no Python module; configure it with -DSDAG_PYTHON_MODULE=ON and build it")
            self.copy_tree(str(found[0].parent), str(target / "shadowdag"))
        run("cmake", "--install", folder, "--prefix", target / "shadowdag" / "prefix", "--component", "program")


class Binary(Distribution):
    """A distribution for one Python and one processor."""

    def has_ext_modules(self):
        return True


version = re.search(r"project\(ShadowDAG VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
(ROOT / "build").mkdir(exist_ok=True)
setup(version=version, packages=["shadowdag"], package_dir={"shadowdag": "python/shadowdag"}, ext_modules=[],
      cmdclass={"build_py": Build}, distclass=Binary, options={"egg_info": {"egg_base": "build"}})
