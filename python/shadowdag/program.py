# SPDX-License-Identifier: Apache-2.0
"""The program `shadowdag`, run in a process of its own: compare, study, calibrate.

Frames are rendered in this process; whole measurements run in the program, which resumes, writes reports and takes its
times without an interpreter beside it.
"""
from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Union

from . import _native
from ._native import DefectError, DeviceError, Error, InputError, ResourceError, UsageError
from .results import Results, load_results

Path = Union[str, os.PathLike[str]]
Progress = Union[Callable[[str, float], Any], None]

PACKAGE = os.path.dirname(os.path.abspath(__file__))
PROGRESS = re.compile(r"(.*): (\d+) %, ")
REMARK = re.compile(r"((?:\S.*?: )?)warning: (.*)")  # after the name of a scene
CLASSES = {1: UsageError, 2: InputError, 3: ResourceError, 4: DeviceError, 6: DefectError}


def candidates():
    """Yields where the program may be: named, in the wheel, installed beside, in the build folder."""
    if os.environ.get("SHADOWDAG_PROGRAM"):
        yield os.environ["SHADOWDAG_PROGRAM"]
        return  # asked for by name: nothing else will do
    yield os.path.join(PACKAGE, "prefix", "bin", "shadowdag")
    yield os.path.join(PACKAGE, "..", "..", "..", "..", "bin", "shadowdag")
    yield os.path.join(PACKAGE, "..", "..", "tools", "shadowdag")
    found = shutil.which("shadowdag")
    if found:
        yield found


def program() -> str:
    """Returns the path of the program of this module's version.

    Raises UsageError if there is none, or if it is of another commit, whose results would be others.
    """
    for path in candidates():
        path = os.path.realpath(path)
        if not os.access(path, os.X_OK):
            continue
        said = subprocess.run([path, "--version"], capture_output=True, text=True).stdout.strip()
        wanted = f"shadowdag {_native.__version__} ({_native.__commit__})"
        if said != wanted:
            raise UsageError(f"{path}: is '{said}', and the module '{wanted}'; build and install both together, or "
                             "name the program in SHADOWDAG_PROGRAM")
        return path
    raise UsageError("the program shadowdag was not found beside the module, nor in PATH; install it, or name it in "
                     "SHADOWDAG_PROGRAM")


def run_program(*arguments: Path, progress: Progress = None) -> dict[str, Any]:
    """Runs `shadowdag ARGUMENT... --json` and returns its JSON object.

    progress: callable (text, fraction) that receives what is done and how far it is, from 0 to 1, about every second.
    Remarks, also those about scenes, become warnings. Raises the class of the program's error with its message; Ctrl-C
    ends the program, which leaves every file complete or absent.
    """
    command = [program(), *map(os.fspath, arguments), "--json"]
    with tempfile.TemporaryFile("w+") as output:
        child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.PIPE, text=True,
                                 errors="replace", start_new_session=True)
        message = []
        try:
            for line in child.stderr:
                line = line.rstrip("\n")
                if line.startswith("shadowdag: error: "):
                    message.append(line[len("shadowdag: error: "):])
                elif step := PROGRESS.match(line):
                    if progress is not None:
                        progress(step[1], int(step[2]) / 100)
                elif remark := REMARK.match(line):
                    warnings.warn(remark[1] + remark[2], _native.Warning, stacklevel=3)
            status = child.wait()
        except BaseException:
            child.send_signal(signal.SIGINT)
            child.wait()
            raise
        finally:
            child.stderr.close()
        output.seek(0)
        text = output.read()
    if status != 0 and not (status == 5 and text):  # 5: a study's bounds do not hold, which is a result
        raise CLASSES.get(status, Error)("\n".join(message) or f"shadowdag ended with status {status}")
    return json.loads(text)


def options_of(more):
    """Returns keyword arguments as options: page_size=64 as --page-size 64, a list joined by commas, True a flag."""
    options = []
    for key, value in more.items():
        option = "--" + key.replace("_", "-")
        if value is True:
            options.append(option)
        elif value is not False and value is not None:
            options += [option, ",".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)]
    return options


def compare(scenes: Path | Sequence[Path] = (), output: Path | None = None, *,
            experiment: Mapping[str, Any] | Path | None = None, charts: bool = True, progress: Progress = None,
            **options: Any) -> Results:
    """Runs `shadowdag compare` and returns its Results.

    scenes: one SCENE or several. output: directory of the report; None: a temporary one, which is removed.
    experiment: a dict in the form of experiment files, or a file, instead of scenes and options. charts: draw the
    report's charts into output; those of Results are drawn when asked for. options: those of the program, as
    size="320x180", methods="dag,maps", believe=["none", "all"].
    """
    scenes = [scenes] if isinstance(scenes, (str, os.PathLike)) else list(scenes)
    with tempfile.TemporaryDirectory(prefix="shadowdag") as temporary:
        directory = os.path.join(temporary, "report") if output is None else os.fspath(output)
        arguments = ["compare", *scenes, "-o", directory, *options_of(options)]
        if isinstance(experiment, Mapping):
            path = os.path.join(temporary, "experiment.json")
            with open(path, "w", encoding="utf-8") as file:
                json.dump(dict(experiment), file)
            arguments += ["--experiment", path]
        elif experiment is not None:
            arguments += ["--experiment", os.fspath(experiment)]
        if output is None or not charts:
            arguments.append("--no-charts")
        run_program(*arguments, progress=progress)
        results = load_results(directory)
        if output is None:
            results.data.setdefault("lights", read_lights(os.path.join(directory, "lights.csv")))
            results.directory = None
        return results


def read_lights(path):
    """Returns the rows of lights.csv with numbers as numbers."""
    import csv

    def number(text):
        try:
            return int(text)
        except ValueError:
            try:
                return float(text)
            except ValueError:
                return text
    with open(path, newline="", encoding="utf-8") as file:
        return [{key: number(value) for key, value in row.items()} for row in csv.DictReader(file)]


def study(name: Path, output: Path, *, charts: bool = True, progress: Progress = None, **options: Any) -> Results:
    """Runs `shadowdag study NAME -o OUTPUT` and returns its Results, also where its bounds do not hold.

    options: those of the program, as only="acne".
    """
    arguments = ["study", name, "-o", output, *options_of(options)]
    run_program(*arguments, *([] if charts else ["--no-charts"]), progress=progress)
    return load_results(output)


def calibrate(scenes: Path | Sequence[Path], output: Path, *, progress: Progress = None,
              **options: Any) -> dict[str, Any]:
    """Runs `shadowdag calibrate`, which fits the cost model `cost` to this machine, and returns its JSON object.

    output: the file that the setting costs takes. options: those of the program, as quick=True.
    """
    scenes = [scenes] if isinstance(scenes, (str, os.PathLike)) else list(scenes)
    return run_program("calibrate", *scenes, "-o", output, *options_of(options), progress=progress)
