# SPDX-License-Identifier: Apache-2.0
"""Times and errors of several configurations on one view, cost models written in Python among them."""
from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from . import _native
from ._native import Scene, UsageError
from .results import Results


def cost_model(counts: str | Sequence[str] | Callable[..., Any] | None = None, name: str | None = None) -> Callable[..., Any]:
    """Returns a decorator that says what a cost model reads.

    A cost model is a function that receives a structured array with a row for each shadow map: light, octave, texels
    (that equation 1 asks along a face's side), face_texels (those that it gets), samples, clusters, lights (of the
    frame), range (of the light, in the scene's unit), and what takes time to count: pages, triangles and batches, pairs,
    movers and mover_crossings (see hybrid/routing/cost_model.h). It returns one value for each row: bool, True to trace
    the map by rays, or the cost of drawing it over that of tracing it (rays above 1).
    counts: those of pages, triangles, pairs and movers that it reads; the others are not counted and not in the array.
    None: all are counted, within the frame's time, as for a function without this decorator. name: in labels and legends.
    Raises UsageError, when a frame asks the model, for a name that is not counted.
    """
    if callable(counts):  # @cost_model without brackets
        return cost_model()(counts)

    def mark(function):
        if counts is not None:
            function.counts = (counts,) if isinstance(counts, str) else tuple(counts)
        if name is not None:
            function.__name__ = name
        return function
    return mark


def measure(scene: Scene, runs: Sequence[Mapping[str, Any]] | Mapping[str, Mapping[str, Any]], *, repeats: int = 5,
            warmups: int = 1, progress: Callable[[str, float], Any] | None = None) -> Results:
    """Measures configurations on one view of a scene and returns Results.

    runs: dicts of settings as Scene.frame takes them, in a list, or in a dict by label. All need one size, camera and
    time, because errors and times of other views cannot be compared. First come the answers of each, judged against
    Embree; then `warmups` uncounted and `repeats` counted rounds, each of which renders every run once and begins with
    another one. repeats=0 measures no times.
    """
    named = dict(runs) if isinstance(runs, dict) else dict(enumerate(runs))
    if not named:
        raise UsageError("nothing to measure: give one run or more")
    views = {tuple(str(settings.get(key)) for key in ("size", "camera", "time", "exposure"))
             for settings in named.values()}
    if len(views) > 1:
        raise UsageError("the runs have several sizes, cameras, times or exposures; measure each view by itself")

    def tell(done, what):
        if progress is not None:
            progress(what, done / total)

    total = len(named) * (1 + warmups + repeats)
    rows, lights, answers = [], [], []
    for place, (label, settings) in enumerate(named.items()):
        tell(place, "answers")
        frame = scene.frame(settings)
        report = frame.judge()
        row = frame.run
        if isinstance(label, str):
            row["label"] = label
        if any(other["label"] == row["label"] for other in rows):
            raise UsageError(f"two runs are labelled {row['label']!r}; give a dict with a name for each")
        row.update(report["counts"])
        row["visibility_histogram"] = report["histogram"]
        rows.append(row)
        lights += [{"label": row["label"], **light} for light in report["per_light"] if light["pair_count"]]
        answers.append(frame)
    times = [[] for _ in named]
    settings = list(named.values())
    for turn in range(warmups + repeats):
        for i in range(len(settings)):
            place = (i + turn) % len(settings)
            tell(len(settings) * (1 + turn) + i, "times")
            stages = scene.frame(settings[place], record=False).stages
            if turn >= warmups:
                times[place].append(stages)
    if repeats:
        for row, of in zip(rows, times):
            row.update(_native.timing(of))
    experiment = {"size": "{}x{}".format(*answers[0].size), "scenes": [scene.argument], "frames": "0"}
    return Results({"runs": rows, "lights": lights, "experiment": experiment, "sequence_runs": [], "map_costs": [],
                    "provenance": {"commit": _native.__commit__, "program_version": _native.__version__}})
