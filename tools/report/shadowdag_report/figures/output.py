# SPDX-License-Identifier: Apache-2.0
"""Writes a figure with its data, caption and claims, and lists it."""
import csv
import io
import json
import os
import re

from ..collection import Charts
from ..files import write_text
from ..style import slug

KINDS = ("svg", "png", "csv", "json", "txt")  # of every figure
MOST_IN_CAPTION = 4  # claims; the others are in .txt and .json


class Figures:
    """Writes figures with their data and captions, and lists them."""

    def __init__(self, directory, provenance, experiment):
        self.charts = Charts(directory)
        self.provenance, self.experiment = provenance, experiment
        self.slugs = {}  # by scene

    def slug(self, scene):
        """Returns a unique name of a scene for file names."""
        if scene not in self.slugs:
            name, taken = slug(scene), set(self.slugs.values())
            others = (f"{name}_{i}" for i in range(2, len(taken) + 3))
            self.slugs[scene] = name if name not in taken else next(o for o in others if o not in taken)
        return self.slugs[scene]

    def write(self, name, text):
        write_text(os.path.join(self.charts.directory, name), text)

    def save(self, number, sequence, figure, title, caption, columns, claims):
        """columns: {name: values over frames}; claims: [(what, the paper's, ours, holds or None)]."""
        stem = f"figure_{number}_{self.slug(sequence.scene)}"
        table = [dict(zip(("claim", "paper", "measured", "holds"), claim)) for claim in claims]
        sentence = " ".join(f"{c['claim']}: the paper {c['paper']}, here {c['measured']}." for c in table[:MOST_IN_CAPTION])
        full = f"{title}, {sequence.scene}"
        self.charts.save(figure, stem, full, caption + (" " + sentence if sentence else ""))
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["frame"] + list(columns))
        for i, frame in enumerate(sequence.frames):
            writer.writerow([frame] + [f"{values[i]:.10g}" for values in columns.values()])
        self.write(stem + ".csv", text.getvalue())
        data = {"figure": number, "scene": sequence.scene, "title": full, "caption": caption, "claims": table,
                "provenance": self.provenance, "experiment": self.experiment, "frames": sequence.frames,
                "series": {name: list(map(float, values)) for name, values in columns.items()}}
        self.write(stem + ".json", json.dumps(data, indent=1) + "\n")
        width = max([len(c["claim"]) for c in table] + [5])
        lines = [f"{c['claim']:<{width}} | {c['paper']:<28} | {c['measured']:<34} | "
                 + {True: "holds", False: "does not hold", None: "-"}[c["holds"]] for c in table]
        head = [f"{'claim':<{width}} | {'the paper':<28} | {'here':<34} |", "-" * (width + 80)] if lines else []
        self.write(stem + ".txt", "\n".join([f"{full}. {caption}", ""] + head + lines) + "\n")

    def finish(self, left_out):
        """Lists the figures, then removes those of an earlier run, which could be mistaken for these; if nothing was
        drawn they stay. A figure is known by its name and by having all its files."""
        self.charts.finish({"left_out": left_out})
        directory, drawn = self.charts.directory, {entry["file"] for entry in self.charts.entries}
        names = set(os.listdir(directory))
        for stem in {os.path.splitext(name)[0] for name in names if drawn}:
            files = [f"{stem}.{kind}" for kind in KINDS]
            if re.fullmatch(r"figure_\d+_\w+", stem) and stem not in drawn and names.issuperset(files):
                for file in files:
                    os.remove(os.path.join(directory, file))
