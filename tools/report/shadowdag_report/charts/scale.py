# SPDX-License-Identifier: Apache-2.0
"""Draws `shadowdag study scale`: time of a pair, bytes and build time over the number of triangles, as SVG and PNG.

    scale-chart scale.json -o DIR

writes DIR/scale_ROW.svg and DIR/scale_ROW.png for every row, at the width of a column. Both axes are logarithmic. Rings
are where a method becomes faster than Embree.
"""
import math

from ..collection import Charts
from ..files import Refused, expecting, read_json
from ..intervals import confidence_text, half_widths, least_confidence
from ..style import (BLACK, BLUE, COLUMN, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, log_axis, marks_of, place_labels, plt,
                     slug)

LOOKS = {  # colour, marker, dash; hollow marks are of warm maps
    "embree": (VERMILION, "s", "-"), "exact rays": (ORANGE, "D", "-"), "maps cold": (BLUE, "o", "--"), "maps warm": (BLUE, "o", ":")}
VOXELS = ((GREEN, "^", "-"), (SKY, "v", "--"), (PURPLE, "P", "-."), (GREY, "X", ":"))  # from coarse to fine, then again
PANELS = (("ns_per_pair", "time of a pair (ns)", 1), ("bytes", "memory (MiB)", 2.0 ** -20), ("build_s", "build time (s)", 1))
WARM = "maps warm"
LABEL = {"fontsize": 5.8, "bbox": {"facecolor": "white", "edgecolor": "none", "pad": 0.4, "alpha": 0.85}}
GROWTHS = {"tessellate": "triangles divided", "instance": "copies side by side", "leaves": "strewn with leaves"}


def count_text(count):
    """Returns a number of triangles as 325 k or 1.3 M."""
    return f"{count / 1e6:.3g} M" if count >= 1e6 else f"{count / 1e3:.0f} k" if count >= 1e4 else f"{count:.0f}"


def load(path):
    """Returns the cells by row, ascending in triangles, and the crossovers."""
    with expecting(path, "a result of study scale"):
        results = read_json(path)
        rows = {}
        for cell in results["cells"]:
            cell["ns_per_pair"] + cell["bytes"] + cell["build_s"] + cell["triangle_count"], cell["growth"], cell["resolution"]
            rows.setdefault(cell["row"], []).append(cell)
        for of in results["crossovers"]:
            of["row"], of["method"], of["text"], of["triangle_count"]
        for cells in rows.values():
            cells.sort(key=lambda cell: cell["triangle_count"])
    if not rows:
        raise Refused(f"{path}: no row was measured; run the study without --only")
    return rows, results["crossovers"]


def looks_of(cells):
    """Returns the looks of the methods of a row; voxels of each resolution have one."""
    finest = sorted({c["resolution"] for c in cells} - {0})
    voxels = {f"voxels {resolution}": VOXELS[i % len(VOXELS)] for i, resolution in enumerate(finest)}
    names = list(dict.fromkeys(c["method"] for c in cells))
    looks = marks_of({"embree": LOOKS["embree"], "exact rays": LOOKS["exact rays"]} | voxels | LOOKS, names, lambda name: (GREY, "*", "-"))
    return {name: look for name, look in looks.items() if name in names}


def at_of(cells, triangles):
    """Returns the time of a pair on the line of a method's cells, logarithmic in both."""
    for a, b in zip(cells, cells[1:]):
        if a["triangle_count"] <= triangles <= b["triangle_count"]:
            share = math.log(triangles / a["triangle_count"]) / math.log(b["triangle_count"] / a["triangle_count"])
            return a["ns_per_pair"] ** (1 - share) * b["ns_per_pair"] ** share
    return None


def mark_crossovers(axes, cells, crossovers, looks):
    """Rings where methods become faster than Embree, on Embree's line, with the number of triangles."""
    embree = [c for c in cells if c["method"] == "embree"]
    places = [(of, at_of(embree, of["triangle_count"])) for of in crossovers if of["kind"] == "from"]
    labels = []
    for of, y in ((of, y) for of, y in places if y is not None and of["method"] in looks):
        x = of["triangle_count"]
        axes.plot([x], [y], linestyle="none", marker="o", markersize=7.5, markerfacecolor="none", markeredgecolor=BLACK, markeredgewidth=0.7, zorder=6)
        labels.append((x, y, f"{of['method']}: {count_text(x)}", LABEL))
    if labels:
        lines = [[(c["triangle_count"], c["ns_per_pair"]) for c in cells if c["method"] == name] for name in looks]
        place_labels(axes, labels, [point for line in lines for point in line], lines)


def panel(axes, cells, key, scale, looks):
    """Draws a quantity of all methods that have it. Returns the values, for the limits."""
    values = []
    for name, (colour, marker, dash) in looks.items():
        drawn = [c for c in cells if c["method"] == name and c[key] > 0]
        if not drawn or (key == "bytes" and name == WARM):  # of the same maps
            continue
        ys = [c[key] * scale for c in drawn]
        values += ys
        if key == "ns_per_pair":
            widths = [half_widths(c, key) for c in drawn]
            axes.errorbar([c["triangle_count"] for c in drawn], ys, yerr=list(zip(*widths)), fmt="none", ecolor=colour,
                          elinewidth=0.7, capsize=1.5, capthick=0.6, zorder=3)
            values += [y - low for y, (low, _) in zip(ys, widths) if y > low] + [y + high for y, (_, high) in zip(ys, widths)]
        axes.plot([c["triangle_count"] for c in drawn], ys, color=colour, marker=marker, linestyle=dash, markersize=3.4,
                  markerfacecolor="white" if name == WARM else colour, markeredgecolor=colour if name == WARM else BLACK,
                  markeredgewidth=0.8 if name == WARM else 0.4, zorder=4, label=name.replace("voxels ", "voxels, ") + ("³" if name.startswith("voxels") else ""))
    return values


def draw_row(charts, row, cells, crossovers):
    looks = looks_of(cells)
    figure, panels = plt.subplots(len(PANELS), 1, figsize=(COLUMN, 5.6), sharex=True, height_ratios=(1.5, 1, 1))
    counts = [c["triangle_count"] for c in cells]
    for axes, (key, title, scale) in zip(panels, PANELS):
        values = panel(axes, cells, key, scale, looks) or [1.0]
        log_axis(axes.yaxis, min(values) / 1.4, max(values) * 1.4, near=(1, 2, 3, 5))
        axes.set_ylabel(title)
    log_axis(panels[-1].xaxis, min(counts) / 1.25, max(counts) * 1.25, near=(1, 2, 3, 5))
    panels[-1].xaxis.set_major_formatter(lambda x, _: count_text(x))
    panels[-1].set_xlabel("triangles")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=3)
    mark_crossovers(panels[0], cells, crossovers, looks)
    few = confidence_text(least_confidence(cells, "ns_per_pair"))
    repeats = min(c["repeat_count"] for c in cells)
    charts.save(figure, f"scale_{slug(row)}", f"{row}: {GROWTHS.get(cells[0]['growth'], cells[0]['growth'])}",
                f"The time that shadows take in a frame, by pair, with {few} intervals of medians of {repeats}; the memory of what "
                "each method reads; the time to build that. Maps are drawn in each frame and have nothing to build. "
                "Rings: where a method becomes faster than Embree. "
                + " ".join(f"{of['method']}: {of['text']}." for of in crossovers), row=row)


def draw(path, directory):
    rows, crossovers = load(path)
    charts = Charts(directory, bbox_inches="tight")
    charts.expect(len(rows))
    for row, cells in rows.items():
        draw_row(charts, row, cells, [of for of in crossovers if of["row"] == row])
        charts.step()
    charts.finish()


def declare(parser):
    parser.add_argument("results", help="scale.json")
    parser.add_argument("-o", "--output", required=True, help="directory of the charts")


def run(arguments):
    draw(arguments.results, arguments.output)
