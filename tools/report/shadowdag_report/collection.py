# SPDX-License-Identifier: Apache-2.0
"""The charts of one directory: each saved as SVG and PNG, listed in charts.json with title and caption."""
import os

from .files import write_json, written
from .style import plt


def save_figure(figure, base, **options):
    """Saves a figure as base.svg and base.png, and closes it. options: as savefig has them"""
    os.makedirs(os.path.dirname(base) or ".", exist_ok=True)
    for kind in ("svg", "png"):
        with written(f"{base}.{kind}") as part:
            figure.savefig(part, format=kind, metadata={"Date": None} if kind == "svg" else {}, **options)
    plt.close(figure)


class Charts:
    """Collects the charts of a directory; finish() lists them."""

    def __init__(self, directory):
        self.directory = directory
        self.entries = []
        os.makedirs(directory, exist_ok=True)

    def save(self, figure, name, title, caption, **more):
        """more: further keys of the entry in charts.json"""
        save_figure(figure, os.path.join(self.directory, name))
        self.entries.append({"file": name, "title": title, "caption": caption} | more)

    def finish(self, more=None):
        """more: further keys of charts.json"""
        write_json(os.path.join(self.directory, "charts.json"), {"charts": self.entries} | (more or {}))
