# SPDX-License-Identifier: Apache-2.0
"""Frames in sequence in the form of figures: checked row by row, by scene and variant over frames."""
import json

import numpy as np

from ..files import Refused, expecting, read_json
from ..intervals import CONFIDENCE, confidence_text, half_widths, least_confidence

KINDS = {dict: "object", list: "list"}
MOST = 1e18  # no time and no count of a frame is larger
# The principal stage of each stage in the paper's figure 12. Others are drawn separately.
PRINCIPAL = {
    "batch boxes": "culling", "batch hierarchy": "culling", "culling masks": "culling", "culling query": "culling",
    "culling tests": "culling", "page commit": "page allocation", "page clear": "page allocation",
    "light assignment": "clusters, lights", "clusters": "clusters, lights", "pair pruning": "clusters, lights",
    "resolution": "clusters, lights", "routing": "clusters, lights", "embree rays": "rays",
}
# Steps of culling, in their order, and what they are called: figure 13. "culling" is all but the first three in
# results from before it was split.
CULLING_STEPS = {
    "resolution": "required resolution", "batch boxes": "update of batch boxes",
    "batch hierarchy": "update of their hierarchy", "page masks": "page masks, projection maps",
    "culling masks": "blocks of cell depths", "culling query": "hierarchy query", "culling tests": "tests of masks and depths",
    "culling": "query and tests",
}


# Principal stages in the order of the frame.
STAGES = ("scene update", "g-buffer", "clusters, lights", "page masks", "page allocation", "geometry copy", "culling",
          "rasterization", "shading", "rays")


class Missing(Exception):
    """The results lack data of a figure; the text names them."""


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool) and 0 <= value <= MOST


def check_row(row, where):
    """Refuses a row whose names or times cannot be drawn; counts are checked where they are read."""
    if not isinstance(row, dict):
        raise Refused(f"{where} is no object; measure again with compare --sequence")
    names = {key: isinstance(row.get(key), str) and row[key] != "" for key in ("scene", "label", "method")}
    stages = row.get("stages_ms")
    right = names | {"label": names["label"] and row["label"][-1] != "-",
                     "frame": is_number(row.get("frame")) and isinstance(row["frame"], int),
                     "time_ms": is_number(row.get("time_ms")),
                     **{key: is_number(value) for key, value in row.items() if key.startswith("time_ms_")},
                     "stages_ms": isinstance(stages, dict) and all(map(is_number, stages.values()))}
    for key, is_right in right.items():
        if not is_right:
            raise Refused(f"{where}: \"{key}\" is {json.dumps(row.get(key))[:80]}, "
                   "not as compare writes it; measure again with compare --sequence")


def load(paths, mixed):
    """Returns the rows of all sequences by scene, the provenance and experiment of the first file, and the times over all
    frames and rounds by scene and variant."""
    scenes, provenance, experiment, commits, lists, summaries = {}, None, None, {}, [], {}
    for path in paths:
        with expecting(path, "a results file of compare"):
            results = read_json(path)
            if not isinstance(results, dict):
                raise Refused(f"{path}: not a results file of compare: no object; measure again with compare --sequence")
            for key, kind in (("provenance", dict), ("experiment", dict), ("sequence_runs", list), ("sequence_times", list)):
                if not isinstance(results.get(key, kind()), kind):
                    raise Refused(f"{path}: \"{key}\" is no {KINDS[kind]}; measure again with compare --sequence")
            commits.setdefault(results["provenance"]["commit"], path)
            lists.append((path, results.get("sequence_runs", [])))
            summaries |= {(t["scene"], t["label"]): t for t in results.get("sequence_times", [])}
            provenance = provenance or results["provenance"]
            experiment = experiment or results["experiment"]
    if len(commits) > 1 and not mixed:
        raise Refused("lines of different commits: " + ", ".join(f"{c} in {p}" for c, p in commits.items())
               + "; measure again with one program, or pass --mixed-commits")
    for path, rows in lists:
        for i, row in enumerate(rows):
            check_row(row, f"{path}: sequence_runs[{i}]")
            of_scene = scenes.setdefault(row["scene"], {})
            if (row["label"], row["frame"]) in of_scene:
                raise Refused(f"{path}: sequence_runs[{i}]: frame {row['frame']} of {row['label']} in {row['scene']} is listed "
                       "twice; give each measurement once")
            of_scene[row["label"], row["frame"]] = row
    if not scenes:
        raise Refused(f"{', '.join(paths)}: holds no frames in sequence; run compare --sequence --variants paper")
    return scenes, provenance, experiment, summaries


class Sequence:
    """The rows of one scene: by variant, over frames."""

    def __init__(self, scene, rows, summaries=None):
        """rows: {(label, frame): row}; summaries: {(scene, label): entry of sequence_times}"""
        self.scene, self.rows, self.summaries = scene, rows, summaries or {}
        self.frames = sorted({frame for _, frame in rows})
        self.labels = list(dict.fromkeys(label for label, _ in rows))
        for label in self.labels:
            for frame in self.frames:
                if (label, frame) not in rows:
                    raise Refused(f"{scene}: {label} lacks frame {frame}, which other variants have; measure all in one compare")

    def led(self):
        """Returns which frames follow another frame, all where none does: frame 0 is led in by itself, so that what is kept
        from frame to frame has nothing to do there."""
        led = np.array(self.frames) > 0
        return led if led.any() else ~led

    def over(self, frames):
        """Returns the same variants over these frames alone."""
        return Sequence(self.scene, {(l, f): row for (l, f), row in self.rows.items() if f in set(frames)}, self.summaries)

    def has(self, *labels):
        return all(label in self.labels for label in labels)

    def values(self, label, key):
        """Returns a quantity over frames. key: of the row, or a function of the row."""
        def pick(row):
            value = key(row) if callable(key) else row.get(key)
            if value is None:
                raise Missing(f"\"{key}\" of {label}")
            if not is_number(value):
                raise Refused(f"{self.scene}: \"{key}\" of {label} at frame {row['frame']} is {json.dumps(value)[:80]}, not a count; "
                       "measure again with compare --sequence")
            return float(value)
        return np.array([pick(self.rows[label, frame]) for frame in self.frames])

    def is_frame(self, label):
        """Returns whether a method's times are of whole frames; Embree's, in older results, are of its rays alone."""
        return all("g-buffer" in self.rows[label, frame]["stages_ms"] for frame in self.frames)

    def intervals(self, label):
        """Returns how far the intervals of the frames' times reach below and above them."""
        return np.array([half_widths(self.rows[label, frame]) for frame in self.frames]).T

    def bars_text(self, labels):
        """Returns what bars of these times are, "" without any: intervals of medians, or, of fewer values than such an interval needs,
        no more than their range."""
        rows = [self.rows[label, frame] for label in labels for frame in self.frames]
        counts = sorted({row.get("repeat_count", 1) for row in rows})
        if counts[-1] == 1:
            return ""
        repeats = str(counts[0]) if counts[0] == counts[-1] else f"{counts[0]} to {counts[-1]}"
        return ("95 % interval of the median of" if least_confidence(rows) >= CONFIDENCE else "range of") + f" {repeats} repeats"

    def worst_text(self, label):
        """Returns the 99th percentile of the times of all frames and rounds with its interval; in older results, which lack
        the rounds, the slowest frame of how many."""
        times = self.summaries.get((self.scene, label))
        if times is None:
            return f"{np.max(self.values(label, 'time_ms')):.1f} ms (slowest of {len(self.frames)} medians)"
        return (f"{times['time_ms_p99']:.1f} ms (99 %, {confidence_text(times['time_ms_p99_confidence'])} interval "
                f"{times['time_ms_p99_low']:.1f} to {times['time_ms_p99_high']:.1f})")

    def stage(self, label, name):
        """Returns the time of a stage over frames, or of all stages of a principal stage."""
        return self.values(label, lambda row: sum(ms for n, ms in row["stages_ms"].items()
                                                  if n == name or PRINCIPAL.get(n) == name))

    def names(self, labels):
        """Returns the stages that any frame of the variants has."""
        return list(dict.fromkeys(n for l in labels for f in self.frames for n in self.rows[l, f]["stages_ms"]))

    def stages(self, labels):
        """Returns the principal stages that any frame of the variants has, in the order of the frame."""
        names = list(dict.fromkeys(PRINCIPAL.get(n, n) for n in self.names(labels)))
        order = list(STAGES)
        return sorted(names, key=lambda n: order.index(n) if n in order else len(order) + names.index(n))

    def parts(self, label):
        return label.split("-")

    def maps(self):
        """Returns the variants that draw every map, without Embree, rays and hybrids."""
        return [l for l in self.labels if self.rows[l, self.frames[0]]["method"] == "maps"]
