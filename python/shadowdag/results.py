# SPDX-License-Identifier: Apache-2.0
"""Results of measure, compare and study as pandas frames and matplotlib figures."""
from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

from ._native import InputError

if TYPE_CHECKING:
    import matplotlib.figure
    import pandas


def need(module, package):
    """Returns an optional module; raises ImportError that names the package of Debian."""
    import importlib
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise ImportError(f"this needs the Python module {module}: apt-get install {package}") from error


class Results:
    """The results of measure(), compare() or study(): `data` has the form of results.json or the study's file."""

    def __init__(self, data: dict[str, Any], directory: str | None = None) -> None:
        """data: a dict. directory: of the report, or None."""
        self.data, self.directory = data, directory

    def table(self, name: str) -> pandas.DataFrame:
        """Returns a list of the data as a pandas frame: dicts become columns named "outer.inner"; lists stay.

        Raises KeyError for a name that the data do not have as a list.
        """
        pandas = need("pandas", "python3-pandas")
        rows = self.data[name]
        if not isinstance(rows, list):
            raise KeyError(f"{name!r} is not a list of the data; the lists are {', '.join(self.tables)}")
        return pandas.json_normalize(rows)

    @property
    def tables(self) -> list[str]:
        """The names of the lists of the data, which table() takes."""
        return [name for name, value in self.data.items()
                if isinstance(value, list) and value and isinstance(value[0], dict)]

    @property
    def runs(self) -> pandas.DataFrame:
        """One row for each scene, frame and configuration: label, method, time_ms, errors, counts and parameters."""
        return self.table("runs")

    @property
    def lights(self) -> pandas.DataFrame:
        """One row for each configuration and light, with its errors."""
        if "lights" in self.data:
            return self.table("lights")
        pandas = need("pandas", "python3-pandas")
        return pandas.read_csv(os.path.join(self.directory, "lights.csv"))

    def charts(self, name: str | None = None) -> dict[str, matplotlib.figure.Figure]:
        """Returns the charts of the runs as a dict of matplotlib figures by file name, as the report names them.

        name: the beginning of the names to return, as "speed_accuracy"; None: all that the report has of such runs.
        Raises UsageError where runs have no times.
        """
        from .charts import draw
        return draw(self.data, name)

    def chart(self) -> matplotlib.figure.Figure:
        """Returns the chart of time against error of the first scene, a matplotlib figure."""
        figures = self.charts("speed_accuracy")
        return next(iter(figures.values()))

    def _repr_html_(self):
        """The runs as a table, in notebooks."""
        if "runs" not in self.tables:
            return f"<p>Results with {', '.join(self.tables)}</p>"
        columns = [c for c in ("label", "time_ms", "mean_abs_visibility_error", "pair_count", "false_shadow_count",
                               "false_light_count", "ray_count", "page_count") if c in self.data["runs"][0]]
        return self.runs[columns].to_html(index=False)

    def __repr__(self):
        return f"<Results: {', '.join(f'{len(self.data[name])} {name}' for name in self.tables)}>"


def load_results(path: str | os.PathLike[str]) -> Results:
    """Returns the Results of a directory that compare or study wrote, or of one of its JSON files.

    Raises InputError naming the file that is missing, or no results.
    """
    directory = path if os.path.isdir(path) else os.path.dirname(path) or "."
    if os.path.isdir(path):
        names = [n for n in ("results.json", "failures.json", "ablation.json", "stability.json", "real.json",
                             "mutants.json", "adjudication.json", "scale.json") if os.path.isfile(os.path.join(path, n))]
        if not names:
            raise InputError(f"{path}: contains no results of compare or study")
        path = os.path.join(path, names[0])
    if os.path.exists(path) and not os.path.isfile(path):
        raise InputError(f"{path}: is not a regular file; give results.json or its directory")  # a pipe may never end
    try:
        with open(path, encoding="utf-8-sig") as file:
            results = Results(json.load(file), directory)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise InputError(f"{path}: is not JSON: {error}") from error
    except RecursionError as error:
        raise InputError(f"{path}: nests too deep for results") from error
    if not isinstance(results.data, dict) or not results.tables:
        raise InputError(f"{path}: contains no results of compare or study")
    return results
