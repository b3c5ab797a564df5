# SPDX-License-Identifier: Apache-2.0
"""The report's charts as matplotlib figures, by the same code."""
import contextlib
import importlib.util
import os
import sys

from ._native import UsageError
from .program import program
from .results import need


def report_package():
    """Returns the package shadowdag_report of the program; raises UsageError if it is missing there."""
    if "shadowdag_report" not in sys.modules:
        beside = os.path.dirname(program())
        for path in (os.path.join(beside, "shadowdag_report"),
                     os.path.join(beside, "..", "share", "shadowdag", "shadowdag_report")):
            if os.path.isfile(os.path.join(path, "__init__.py")):
                spec = importlib.util.spec_from_file_location(
                    "shadowdag_report", os.path.join(path, "__init__.py"), submodule_search_locations=[path])
                sys.modules["shadowdag_report"] = importlib.util.module_from_spec(spec)
                spec.loader.exec_module(sys.modules["shadowdag_report"])
                break
        else:
            raise UsageError(f"the package shadowdag_report is missing beside {beside}; install the program again")
    return sys.modules["shadowdag_report"]


@contextlib.contextmanager
def drawing():
    """Leaves the back end and the style of the caller's charts as they were."""
    matplotlib = need("matplotlib", "python3-matplotlib")
    with matplotlib.rc_context():
        backend = matplotlib.get_backend()
        try:
            report_package()
            from shadowdag_report import style
            matplotlib.rcParams.update(STYLE or {})
            STYLE.update({key: value for key, value in matplotlib.rcParams.items() if key != "backend"})
            yield style.plt
        finally:
            matplotlib.use(backend, force=False)  # one that cannot be loaded was only the default of matplotlibrc


STYLE = {}  # of the charts, kept since the package set it


class Figures:
    """Takes the place of the report's directory of charts: keeps figures instead of files."""

    def __init__(self):
        self.figures = {}

    def save(self, figure, name, title, caption, **_):
        figure.set_label(title)
        self.figures[name] = figure


def draw(results, only=None):
    """Returns the charts of a compare's results, all of which the report has that do: a dict of figures by name.

    only: the beginning of the names to return: "speed_accuracy", which needs the least, "threshold", "stages", "bytes" and so on.
    """
    runs = results.get("runs") or []
    if not runs or any("time_ms" not in run for run in runs):
        raise UsageError("charts need runs with times; measure with repeats of 1 or more")
    kept = Figures()
    with drawing() as plt:
        from shadowdag_report.charts import steps_of
        complete = [{"dag_bytes": 0, "map_bytes": 0, **run} for run in runs]
        for chart, *arguments in steps_of(complete, results.get("map_costs") or [], results["experiment"]):
            if only != "speed_accuracy" or chart.__name__ == only:
                chart(kept, *arguments)
        for figure in kept.figures.values():
            plt.close(figure)  # a notebook shows what a cell returns, not every figure
    return {name: figure for name, figure in kept.figures.items() if name.startswith(only or "")}
