# SPDX-License-Identifier: Apache-2.0
"""The charts of one directory: each saved as SVG and PNG, listed in charts.json with title and caption."""
import os

from .files import write_json, written
from .stamp import metadata
from .style import plt

STAMP = ""  # of the charts that are drawn: the command line sets it before a command runs
ONLY = None  # {name: kinds} of the charts to save, such as {"frame": "svg png"}; None: all in both kinds


def save_figure(figure, base, **options):
    """Saves a figure as base.svg and base.png, or as ONLY says, and closes it. options: as savefig has them"""
    os.makedirs(os.path.dirname(base) or ".", exist_ok=True)
    kinds = ("svg", "png") if ONLY is None else ONLY.get(os.path.basename(base), "").split()
    for kind in kinds:
        with written(f"{base}.{kind}") as part:
            figure.savefig(part, format=kind, metadata=metadata(kind, STAMP), **options)
    plt.close(figure)


class Charts:
    """Collects the charts of a directory; finish() lists them."""

    def __init__(self, directory, **options):
        """options: as savefig has them, of all charts"""
        self.directory, self.options = directory, options
        self.entries = []
        self.done = self.total = 0
        os.makedirs(directory, exist_ok=True)

    def expect(self, count):
        """Says how many steps there are; each is ended by step()."""
        self.done, self.total = -1, count
        self.step()

    def step(self):
        """Tells the program that started this how far it is, if it asks for that."""
        self.done += 1
        if os.environ.get("SHADOWDAG_PROGRESS"):
            print(f"\x1e{self.done / max(1, self.total):.4f}", flush=True)

    def save(self, figure, name, title, caption, **more):
        """more: further keys of the entry in charts.json"""
        save_figure(figure, os.path.join(self.directory, name), **self.options)
        self.entries.append({"file": name, "title": title, "caption": caption} | more)

    def finish(self, more=None):
        """more: further keys of charts.json"""
        write_json(os.path.join(self.directory, "charts.json"), {"charts": self.entries} | (more or {}))
