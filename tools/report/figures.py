#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Redraws the figures of the paper's evaluation from a sequence that `compare --sequence` measured.

    figures.py RESULTS.json... -o DIR [--figure N]... [--mixed-commits]

Source of the figures: Olsson, Billeter, Sintorn, Kaempe, Assarsson, More Efficient Virtual Shadow Maps for Many Lights,
TVCG 2015, sec. VII. Each figure is written as .svg and .png, its data as .csv and .json, its caption, with a table of
what the paper states beside what was measured, as .txt; charts.json lists them. Width is a paper's column, 3.4 inches;
a variant looks the same in all of them. What the results lack data for is left out, named on standard error and in
charts.json ("left_out"). Over 500 lines: one function a figure, of drawing and what the paper states.
Exit status 3: the results are not such, or do not hold what was asked for; 4: a figure cannot be written.
"""
import argparse
import csv
import io
import json
import os
import re
import signal
import sys

sys.dont_write_bytecode = True  # an installed program leaves no files beside itself
import charts as house
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import FuncFormatter, MaxNLocator

COLUMN = 3.4  # inches
REFUSED, UNWRITTEN = 3, 4
MOST = 1e18  # no time and no count of a frame is larger
MOST_IN_CAPTION = 4  # claims; the others stand in .txt and .json
SPHERE = "sphere × 6 faces"
# Okabe and Ito's and an olive; no two lines of a panel share a colour, and markers tell them apart without.
COLORS = [house.BLUE, house.VERMILION, house.GREEN, house.ORANGE, house.PURPLE, house.SKY, house.BLACK, "#8a7400"]
LINES = ["--", (0, (5, 1, 1, 1, 1, 1)), "-.", "-", ":"]
MARKERS = ["o", "s", "^", "D", "v", "P", "X", "*", "<", ">", "h", "p"]
# Variants as the paper has them and ours; by the part that tells them from their base.
LOOKS = {SPHERE: 6, "CFM": 0, "PMC": 1, "PMCD": 2, "PMCD-EB": 3, "Nk3": 4, "PMCC-EB": 5, "LP": 7, "SO": 0, "SOR": 1,
         "PLOD1": 4, "RT": 6, "Hybrid": 2, "Hybrid:texels:16": 5, "1SM": 0, "2SM": 1, "4SM": 3, "16SM": 2, "u2": 5,
         "u4": 7, "T1": 1, "RL": 2}
# What a stage is drawn as: the principal stages of the paper's figure 12. Others stand for themselves.
PRINCIPAL = {
    "batch boxes": "culling", "batch hierarchy": "culling", "culling masks": "culling", "culling query": "culling",
    "culling tests": "culling", "page commit": "page allocation", "page clear": "page allocation",
    "light assignment": "clusters, lights", "clusters": "clusters, lights", "pair pruning": "clusters, lights",
    "resolution": "clusters, lights", "routing": "clusters, lights", "embree rays": "rays",
}
STAGE_COLORS = {
    "scene update": house.GREY, "g-buffer": "#d5d9de", "clusters, lights": house.PURPLE, "page masks": house.SKY,
    "page allocation": house.BLACK, "geometry copy": "#7a4b2a", "culling": house.ORANGE,
    "rasterization": house.VERMILION, "shading": house.BLUE, "rays": house.GREEN,
}
# Steps of culling, in their order, and what they are called: figure 13. "culling" is all but the first three in
# results from before it was split.
CULLING_STEPS = {
    "resolution": "required resolution", "batch boxes": "update of batch boxes",
    "batch hierarchy": "update of their hierarchy", "page masks": "page masks, projection maps",
    "culling masks": "blocks of cell depths", "culling query": "hierarchy query", "culling tests": "tests of masks and depths",
    "culling": "query and tests",
}
SPARE = ["#66c2a5", "#a6761d", "#e78ac3"]


plt.rcParams["text.parse_math"] = False  # a name with $ is a name


class Missing(Exception):
    """The results lack what a figure is drawn from; the text says what."""


def end(status, message):
    print("figures.py: " + " ".join(message.splitlines()), file=sys.stderr)
    sys.exit(status)


def refuse(message):
    end(REFUSED, message)


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool) and 0 <= value <= MOST


def check_row(row, where):
    """Refuses a row whose names or times cannot be drawn; counts are checked where they are read."""
    if not isinstance(row, dict):
        refuse(f"{where} is no object; measure again with compare --sequence")
    names = {key: isinstance(row.get(key), str) and row[key] != "" for key in ("scene", "label", "method")}
    stages = row.get("stages_ms")
    right = names | {"label": names["label"] and row["label"][-1] != "-",
                     "frame": is_number(row.get("frame")) and isinstance(row["frame"], int),
                     "time_ms": is_number(row.get("time_ms")),
                     "stages_ms": isinstance(stages, dict) and all(map(is_number, stages.values()))}
    for key, is_right in right.items():
        if not is_right:
            refuse(f"{where}: \"{key}\" is {json.dumps(row.get(key))[:80]}, "
                   "not as compare writes it; measure again with compare --sequence")


def load(paths, mixed):
    """Returns the rows of all sequences by scene, and the provenance and experiment of the first file."""
    scenes, provenance, experiment, commits, lists = {}, None, None, {}, []
    for path in paths:
        try:
            with open(path) as file:
                results = json.load(file)
            commits.setdefault(results["provenance"]["commit"], path)
            lists.append((path, results.get("sequence_runs", [])))
            provenance = provenance or results["provenance"]
            experiment = experiment or results["experiment"]
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            refuse(f"{path}: not a results file of compare: {error!r}")
    if len(commits) > 1 and not mixed:
        refuse("lines of different commits: " + ", ".join(f"{c} in {p}" for c, p in commits.items())
               + "; measure again with one program, or pass --mixed-commits")
    for path, rows in lists:
        if not isinstance(rows, list):
            refuse(f"{path}: \"sequence_runs\" is no list; measure again with compare --sequence")
        for i, row in enumerate(rows):
            check_row(row, f"{path}: sequence_runs[{i}]")
            of_scene = scenes.setdefault(row["scene"], {})
            if (row["label"], row["frame"]) in of_scene:
                refuse(f"{path}: sequence_runs[{i}]: frame {row['frame']} of {row['label']} in {row['scene']} stands there "
                       "twice; give each measurement once")
            of_scene[row["label"], row["frame"]] = row
    if not scenes:
        refuse(f"{', '.join(paths)}: holds no frames in sequence; run compare --sequence --variants paper")
    return scenes, provenance, experiment


class Sequence:
    """The rows of one scene: by variant, over frames."""

    def __init__(self, scene, rows):
        """rows: {(label, frame): row}"""
        self.scene, self.rows = scene, rows
        self.frames = sorted({frame for _, frame in rows})
        self.labels = list(dict.fromkeys(label for label, _ in rows))
        for label in self.labels:
            for frame in self.frames:
                if (label, frame) not in rows:
                    refuse(f"{scene}: {label} lacks frame {frame}, which other variants have; measure all in one compare")

    def led(self):
        """Returns which frames follow another frame, all where none does: frame 0 is led in by itself, so that what is kept
        from frame to frame has nothing to do there."""
        led = np.array(self.frames) > 0
        return led if led.any() else ~led

    def has(self, *labels):
        return all(label in self.labels for label in labels)

    def values(self, label, key):
        """Returns a quantity over frames. key: of the row, or a function of the row."""
        def pick(row):
            value = key(row) if callable(key) else row.get(key)
            if value is None:
                raise Missing(f"\"{key}\" of {label}")
            if not is_number(value):
                refuse(f"{self.scene}: \"{key}\" of {label} at frame {row['frame']} is {json.dumps(value)[:80]}, not a count; "
                       "measure again with compare --sequence")
            return float(value)
        return np.array([pick(self.rows[label, frame]) for frame in self.frames])

    def stage(self, label, name):
        """Returns the time of a stage over frames, or of all that a principal stage holds."""
        return self.values(label, lambda row: sum(ms for n, ms in row["stages_ms"].items()
                                                  if n == name or PRINCIPAL.get(n) == name))

    def names(self, labels):
        """Returns the stages that any frame of the variants has."""
        return list(dict.fromkeys(n for l in labels for f in self.frames for n in self.rows[l, f]["stages_ms"]))

    def stages(self, labels):
        """Returns the principal stages that any frame of the variants has, in the order of the frame."""
        names = list(dict.fromkeys(PRINCIPAL.get(n, n) for n in self.names(labels)))
        order = list(STAGE_COLORS)
        return sorted(names, key=lambda n: order.index(n) if n in order else len(order) + names.index(n))

    def parts(self, label):
        return label.split("-")

    def maps(self):
        """Returns the variants that draw every map, without Embree, rays and hybrids."""
        return [l for l in self.labels if self.rows[l, self.frames[0]]["method"] == "maps"]


class Figures:
    """Writes figures with their data and captions, and lists them."""

    def __init__(self, directory, provenance, experiment):
        self.charts = house.Charts(directory)
        self.provenance, self.experiment = provenance, experiment
        self.slugs = {}  # by scene

    def slug(self, scene):
        """Returns what a scene is called in file names: different scenes differently."""
        if scene not in self.slugs:
            name, taken = house.slug(scene), set(self.slugs.values())
            others = (f"{name}_{i}" for i in range(2, len(taken) + 3))
            self.slugs[scene] = name if name not in taken else next(o for o in others if o not in taken)
        return self.slugs[scene]

    def write(self, name, text):
        with house.written(os.path.join(self.charts.directory, name)) as part, open(part, "w") as file:
            file.write(text)

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


def style(label, i):
    """Returns how a variant is drawn: as LOOKS has it, or by its place."""
    look = LOOKS.get(label, LOOKS.get(label.split("-")[-1], i))
    return {"color": COLORS[look % len(COLORS)], "linestyle": LINES[look % len(LINES)],
            "marker": MARKERS[look % len(MARKERS)], "markersize": 3.2, "linewidth": 0.9, "markeredgewidth": 0,
            "markevery": None, "clip_on": False, "zorder": 3}


def maps_of(part):
    """Returns n of a part nSM of a variant's name, 0 of others."""
    return int(part[:-2]) if re.fullmatch("[0-9]{1,3}SM", part) else 0


def is_detail(label_parts):
    """Returns whether a variant differs in maps a light, undersampling, taps or order alone: lines that figures of
    culling leave out."""
    return any(maps_of(p) or p[:1] in ("u", "T") and p[1:2].isdigit() or p == "RL" for p in label_parts)


def engineering(value, _=None):
    """12 400 000 as 12.4 M."""
    for limit, unit in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if abs(value) >= limit:
            return f"{value / limit:.3g} {unit}"
    return f"{value:.3g}"


def axes_over_frames(sequence, axes, label, height=None):
    axes.set_xlabel("frame")
    axes.set_ylabel(label)
    axes.xaxis.set_major_locator(MaxNLocator(7, integer=True))
    if len(sequence.frames) > 1:
        axes.set_xlim(sequence.frames[0], sequence.frames[-1])


def legend_above(axes, count, columns=3):
    axes.legend(loc="lower left", bbox_to_anchor=(-0.12, 1.0), ncol=min(columns, count), columnspacing=1.0,
                borderaxespad=0.2, handlelength=2.6, labelspacing=0.35, fontsize=6)


def draw_lines(sequence, axes, columns):
    every = max(1, len(sequence.frames) // 12)
    for i, (name, values) in enumerate(columns.items()):
        look = style(name, i)
        look["markevery"] = (i % every, every)
        axes.plot(sequence.frames, values, label=name, **look)


def is_of_culling(sequence, label):
    """Returns whether a line belongs to the upper panel: the steps of culling, each beyond the one before."""
    return label == SPHERE or (label in sequence.maps()
                               and not any(p in ("SO", "SOR") or p.startswith("PLOD") for p in sequence.parts(label)))


def draw_panels(sequence, columns, label, prepare):
    """Draws the lines in two panels with one scale: how culling tells on them; what reuse, levels of detail and rays do.
    One panel where few lines are asked. prepare(axes): its scale."""
    upper = {l: v for l, v in columns.items() if is_of_culling(sequence, l)}
    lower = {l: v for l, v in columns.items() if l not in upper}
    base = base_of(sequence)
    if base in upper and lower:
        lower = {base: upper[base]} | lower
    panels = [p for p in (upper, lower) if p] if len(columns) > 5 else [columns]
    heights = [1.35 + 0.12 * -(-len(p) // 3) for p in panels]
    figure, grid = plt.subplots(len(panels), 1, figsize=(COLUMN, 0.3 + sum(heights)), sharex=True, sharey=True,
                                squeeze=False, gridspec_kw={"height_ratios": heights})
    for axes, lines in zip(grid[:, 0], panels):
        draw_lines(sequence, axes, lines)
        axes_over_frames(sequence, axes, label)
        if axes is not grid[-1, 0]:
            axes.set_xlabel("")
        prepare(axes)
        legend_above(axes, len(lines))
    return figure


def percent(value):
    return f"{value:+.1f} %"


def logarithmic(axes, columns):
    """Gives an axis a logarithmic scale that holds all values above 0."""
    positive = [v for values in columns for v in values if v > 0]
    if positive:
        house.log_axis(axes.yaxis, min(positive) / 1.3, max(positive) * 1.3)
        axes.yaxis.set_major_formatter(FuncFormatter(engineering))


def change(sequence, a, b, key):
    """Returns the change from a to b in percent, frame by frame."""
    before, after = sequence.values(a, key), sequence.values(b, key)
    return 100 * (after - before) / np.maximum(before, 1e-12)


def spread(values, text):
    return f"{text(np.min(values))} to {text(np.max(values))}, mean {text(np.mean(values))}"


def base_of(sequence):
    """Returns the variant that the others are held against."""
    return next((l for l in ("PMCD-EB", "PMCD", "PMCC-EB") if sequence.has(l)), None)


def figure_10(figures, sequence):
    chosen = [l for l in sequence.labels
              if l not in ("embree", "Sphere") and not is_detail(sequence.parts(l))]
    if not chosen:
        return "variants to compare"
    columns = {l: sequence.values(l, "time_ms") for l in chosen}
    figure = draw_panels(sequence, columns, "frame time (ms)", lambda axes: axes.set_ylim(bottom=0))
    claims = []
    base = base_of(sequence)
    first = slice(0, max(1, len(sequence.frames) // 3))
    if base and sequence.has("RT"):
        rays, maps = columns["RT"], sequence.values(base, "time_ms")
        wins = int(np.sum(rays[first] < maps[first]))
        claims.append(("rays are faster early in the zoom (first third)", "in HOUSES and NECROPOLIS, consistently",
                       f"in {wins} of {len(rays[first])} frames", wins == len(rays[first])))
        later = slice(first.stop, None)
        wins = int(np.sum(maps[later] < rays[later]))
        claims.append(("maps are faster where many samples are needed (rest)", "generally",
                       f"in {wins} of {len(rays[later])} frames", 2 * wins > len(rays[later])))
    hybrid = next((l for l in sequence.labels if l.startswith("Hybrid")), None)
    if base and hybrid:
        maps, mixed = sequence.values(base, "time_ms"), sequence.values(hybrid, "time_ms")
        claims.append((f"{hybrid} against {base}: worst frame", "not improved",
                       f"{np.max(mixed):.1f} against {np.max(maps):.1f} ms", bool(np.max(mixed) >= 0.98 * np.max(maps))))
    if sequence.has("PMCD-EB", "PMCD-EB-SO"):
        both = change(sequence, "PMCD-EB", "PMCD-EB-SO", "time_ms")[sequence.led()]
        claims.append(("SO: frame time after frame 0", "substantially less", spread(both, percent), bool(np.mean(both) < 0)))
    caption = ("Median time of every frame by variant: everything that a frame does, following the moved instances "
               "included, loading and animating not.")
    figures.save(10, sequence, figure, "Frame times over the animation", caption,
                 {f"{l} (ms)": v for l, v in columns.items()}, claims)


def figure_11(figures, sequence):
    kept = [l for l in sequence.maps() if {"SO", "SOR"} & set(sequence.parts(l))]
    if not kept:
        return "a variant with SO or SOR"
    figure, (pages, times) = plt.subplots(2, 1, figsize=(COLUMN, 3.1), sharex=True,
                                          gridspec_kw={"height_ratios": [1.5, 1]})
    columns, claims = {}, []
    handles = []
    # Sparse textures: the driver's own commits. Otherwise pages are ours, and only clears cost.
    is_sparse = figures.provenance.get("gl_pages") == "sparse"
    stage = "page commit" if is_sparse else "page allocation"
    extent = "the driver's commits with their bookkeeping" if is_sparse else "all of page allocation"
    for i, label in enumerate(kept):
        look = style(label, i)
        committed, freed = (sequence.values(label, f"pages_{kind}_count") for kind in ("committed", "freed"))
        milliseconds = sequence.stage(label, stage)
        handles += pages.plot(sequence.frames, committed, label=f"{label}, committed", **look)
        look = dict(look, markerfacecolor="white", markeredgewidth=0.6, linestyle=":")
        handles += pages.plot(sequence.frames, -freed, label=f"{label}, freed", **look)
        times.plot(sequence.frames, milliseconds, label=label, **style(label, i))
        columns |= {f"{label} committed (pages)": committed, f"{label} freed (pages)": freed,
                    f"{label} {stage} (ms)": milliseconds}
        total = np.sum(committed)
        cost = 1000 * np.sum(milliseconds) / total if total else float("nan")
        claims.append((f"{label}: time a committed page", "7 us",
                       f"{cost:.2f} us ({extent})" if total else "none committed",
                       bool(cost <= 7) if total else None))
        claims.append((f"{label}: longest {stage} of a frame", "over 100 ms (spikes)",
                       f"{np.max(milliseconds):.2f} ms", None))
    pages.axhline(0, color="black", linewidth=0.5)
    pages.yaxis.set_major_formatter(FuncFormatter(lambda v, _: engineering(abs(v))))
    axes_over_frames(sequence, times, "commits (ms)" if is_sparse else "allocation (ms)")
    pages.set_ylabel("pages freed  |  committed")
    times.set_ylim(bottom=0)
    legend_above(pages, len(handles), 2)
    caption = ("Pages that got memory (up) and that lost it (down) from the frame shown before, and the time of "
               + ("the commits of sparse textures by the driver, with their bookkeeping. " if is_sparse
                  else "page allocation with its clears. ") + "Variants without static optimization allocate everything anew.")
    figures.save(11, sequence, figure, "Page commits and frees", caption, columns, claims)


def figure_12(figures, sequence):
    wanted = ["PMCD-EB", "RT", "Hybrid", "PMCD-EB-SO", "CFM", "PMC"]
    hybrids = [l for l in sequence.labels if l.startswith("Hybrid:")]
    chosen = [l for l in wanted + hybrids + sequence.labels if l in sequence.labels and l != "embree"]
    chosen = list(dict.fromkeys(chosen))[:6]
    if not chosen:
        return "variants to compare"
    rows = -(-len(chosen) // 2)
    names = sequence.stages(chosen)
    legend_height = 0.13 * -(-len(names) // 4) + 0.05
    figure = plt.figure(figsize=(COLUMN, 0.3 + legend_height + 1.15 * rows))
    cells = figure.add_gridspec(rows + 1, min(2, len(chosen)), height_ratios=[legend_height] + [1.15] * rows)
    head = figure.add_subplot(cells[0, :])
    head.set_axis_off()
    grid = np.empty((rows, cells.ncols), dtype=object)
    for at in np.ndindex(grid.shape):
        shared = grid[0, 0] if at != (0, 0) else None
        grid[at] = figure.add_subplot(cells[at[0] + 1, at[1]], sharex=shared, sharey=shared)
        grid[at].tick_params(labelbottom=at[0] == rows - 1, labelleft=at[1] == 0)
    columns, top = {}, 0
    for panel, label in zip(grid.flat, chosen):
        stack = [sequence.stage(label, name) for name in names]
        colors = [STAGE_COLORS.get(n, SPARE[i % len(SPARE)]) for i, n in enumerate(names)]
        panel.stackplot(sequence.frames, stack, colors=colors, labels=names, edgecolor="white", linewidth=0.2)
        panel.set_title(label, fontsize=6.5, pad=2)
        panel.grid(axis="x", visible=False)
        top = max(top, np.max(np.sum(stack, axis=0)))
        columns |= {f"{label}: {name} (ms)": values for name, values in zip(names, stack)}
    for panel in list(grid.flat)[len(chosen):]:
        panel.set_visible(False)
    for panel in grid[-1]:
        panel.set_xlabel("frame")
    for row in grid:
        row[0].set_ylabel("time (ms)")
        row[0].set_ylim(0, top * 1.03)
    if len(sequence.frames) > 1:
        grid[0][0].set_xlim(sequence.frames[0], sequence.frames[-1])
    grid[0][0].xaxis.set_major_locator(MaxNLocator(4, integer=True))
    handles, labels = grid[0][0].get_legend_handles_labels()
    head.legend(handles, labels, loc="center", ncol=4, columnspacing=0.9, handlelength=1.0, fontsize=5.6,
                borderaxespad=0)
    claims = []
    if sequence.has("PMCD-EB"):
        drawn, culled = sequence.stage("PMCD-EB", "rasterization"), sequence.stage("PMCD-EB", "culling")
        claims.append(("PMCD-EB: rasterizing costs more than culling", "yes",
                       f"{np.sum(drawn) / max(1e-9, np.sum(culled)):.1f} times as much", bool(np.sum(drawn) > np.sum(culled))))
    if sequence.has("PMCD-EB", "PMCD-EB-SO"):
        change_ = 100 * (np.sum(sequence.stage("PMCD-EB-SO", "rasterization"))
                         / max(1e-9, np.sum(sequence.stage("PMCD-EB", "rasterization"))) - 1)
        claims.append(("SO: time of drawing triangles", "large improvements overall", percent(change_), bool(change_ < 0)))
    if sequence.has("PMCD", "PMCD-EB"):
        ratio = np.sum(sequence.stage("PMCD-EB", "clusters")) / max(1e-9, np.sum(sequence.stage("PMCD", "clusters")))
        claims.append(("EB: cost of finding unique clusters", "roughly doubled", f"{ratio:.2f} times", None))
    caption = "Medians of every stage, one on the other, in the order of the frame; ray tracing is part of shading."
    figures.save(12, sequence, figure, "Where the time goes over the animation", caption, columns, claims)


def figure_13(figures, sequence):
    base = base_of(sequence)
    if base is None:
        return "variant PMCD-EB or PMCD"
    measured = sequence.names([base])
    if not any(n.startswith("culling") for n in measured):
        return f"maps drawn by {base}"
    names = [n for n in CULLING_STEPS if n in measured]
    steps = {n: sequence.values(base, lambda row: row["stages_ms"].get(n, 0)) for n in names}
    total = np.maximum(sum(steps.values()), 1e-12)
    share = {n: 100 * np.max(v / total) for n, v in steps.items()}
    mean = {n: 100 * np.sum(v) / np.sum(total) for n, v in steps.items()}
    longest = {n: np.max(v) for n, v in steps.items()}
    figure, axes = plt.subplots(figsize=(COLUMN, 0.6 + 0.2 * len(names)))
    ys = np.arange(len(names))[::-1]
    axes.barh(ys, [share[n] for n in names], 0.66, color=house.ORANGE, edgecolor="black", linewidth=0.4,
              label="largest in any frame")
    axes.plot([mean[n] for n in names], ys, linestyle="none", marker="D", color="black", markersize=2.8, clip_on=False,
              label="over all frames")
    for y, n in zip(ys, names):
        inside = share[n] > 50
        axes.annotate(f"{share[n]:.1f} %, {longest[n]:.2f} ms", (0 if inside else share[n], y),
                      xytext=(4 if inside else 6, 0), textcoords="offset points", va="center", fontsize=6)
    axes.set_yticks(ys)
    axes.set_yticklabels([CULLING_STEPS[n] for n in names])
    axes.set_xlim(0, 100)
    axes.set_ylim(-0.6, len(names) - 0.4)
    axes.set_xlabel("share of the time of culling (%)")
    axes.grid(axis="y", visible=False)
    axes.legend(loc="lower left", bbox_to_anchor=(-0.3, 1.0), ncol=2, borderaxespad=0.2, fontsize=6)
    update = [n for n in names if n in ("batch boxes", "batch hierarchy")]
    largest = max(mean, key=mean.get)
    claims = [("largest cost of culling", "boxes and hierarchy, rebuilt whole", CULLING_STEPS[largest],
               (largest in update) if update else None)]
    claims.append(("boxes and hierarchy, largest share", "49 % (of its largest step)",
                   f"{100 * np.max(sum(steps[n] for n in update) / total):.1f} %" if update else "not measured", None))
    claims.append(("required resolution, largest share", "a very small part", f"{share['resolution']:.1f} %",
                   bool(share["resolution"] < 10)))
    ladder = [l for l in ("Sphere", "CFM", "PMC", "PMCD", "PMCC") if sequence.has(l)]
    for a, b in zip(ladder, ladder[1:]):
        claims.append((f"culling of {b} beyond {a}", "very small cost" if b == "PMCD" else "-",
                       f"{np.mean(sequence.stage(b, 'culling') - sequence.stage(a, 'culling')):+.2f} ms a frame", None))
    caption = (f"{base}: each step's share of the sum of these steps, with its longest time. Boxes and hierarchy are updated "
               "for what moves alone; blocks hold depths where culling asks more than one a face; the query finds the batches "
               "in the light's sphere; the tests hold each of them against face mask, projection map and depths.")
    figures.save(13, sequence, figure, "Steps of culling", caption,
                 {f"{CULLING_STEPS[n]} (ms)": v for n, v in steps.items()}, claims)


def figure_14(figures, sequence):
    base = base_of(sequence)
    if base is None:
        return "variant PMCD-EB or PMCD"
    chosen = [l for l in sequence.maps() if l == base or (l.startswith(base + "-") and sequence.parts(l)[-1]
              and (sequence.parts(l)[-1][0] == "T" or sequence.parts(l)[-1] in ("RL", "Nk3")
                   or sequence.parts(l)[-1].startswith("Nk")))]
    if len(chosen) < 2:
        return f"variants {base} and some of {base}-T1, {base}-Nk3, {base}-RL"
    columns = {l: sequence.stage(l, "shading") for l in chosen}
    figure, axes = plt.subplots(figsize=(COLUMN, 2.2))
    draw_lines(sequence, axes, columns)
    axes_over_frames(sequence, axes, "shading (ms)")
    axes.set_ylim(bottom=0)
    legend_above(axes, len(columns), 2)
    claims = []
    whole = sequence.values(base, "time_ms")
    taps = {1: "one", 4: "four", 9: "nine"}.get(figures.experiment.get("taps", [0])[0], "several")
    one = f"{base}-T1"
    if one in columns:
        part = 100 * np.sum(columns[base] - columns[one]) / np.sum(whole)
        claims.append((f"{taps} taps instead of one, share of the frame", "a sizeable proportion", f"{part:.0f} %",
                       bool(part > 10)))
    for label, text, paper in ((f"{base}-Nk3", "Nk3: shading time", "less in parts, more with many maps"),
                               (f"{base}-RL", "reordered light lists: shading time", "some improvement")):
        if label in columns:
            difference = 100 * (columns[label] / np.maximum(columns[base], 1e-12) - 1)
            claims.append((text, paper, spread(difference, percent),
                           bool(np.mean(difference) < 0) if label.endswith("RL") else None))
    caption = f"Time of the shading pass alone: lookups with {taps} taps ({base}) and one (T1), by normal clusters (Nk3), with reordered " \
              "light lists (RL)."
    figures.save(14, sequence, figure, "Shading", caption, {f"{l} (ms)": v for l, v in columns.items()}, claims)


def figure_15(figures, sequence):
    chosen = [l for l in sequence.maps() if not is_detail(sequence.parts(l))]
    if not chosen:
        return "variants that draw maps"
    sphere = sequence.values(chosen[0], "triangle_sphere_count")
    columns = {SPHERE: sphere}
    columns |= {l: sequence.values(l, "triangle_draw_count") for l in chosen if l != "Sphere"}
    figure = draw_panels(sequence, {l: np.where(v > 0, v, np.nan) for l, v in columns.items()}, "triangles drawn",
                         lambda axes: logarithmic(axes, columns.values()))
    claims = []
    for label in ("PMC", "PMCD", "PMCD-EB", "PMCC-EB"):
        if label in columns:
            factor = sphere / np.maximum(columns[label], 1)
            claims.append((f"{label}: fewer triangles than sphere × six faces", "at least 6 times",
                           f"{np.min(factor):.1f} to {np.max(factor):.1f} times", bool(np.min(factor) >= 6)))
    if sequence.has("PMC", "PMCD"):
        claims.append(("maximum depth beyond projection maps", "not as significant",
                       spread(change(sequence, "PMC", "PMCD", "triangle_draw_count"), percent), None))
    if sequence.has("PMCD", "PMCD-EB"):
        cut = -change(sequence, "PMCD", "PMCD-EB", "triangle_draw_count")
        claims.append(("EB: triangles", "8 to 35 % fewer", spread(-cut, percent), bool(np.min(cut) >= 8)))
    for label, name in (("PMCD-EB-SO", "SO"), ("PMCD-EB-SOR", "SO, pages retained")):
        if sequence.has("PMCD-EB", label):
            led = sequence.led()
            peak = 100 * (np.max(columns[label][led]) / max(1, np.max(columns["PMCD-EB"][led])) - 1)
            claims.append((f"{name}: peak triangles after frame 0", "about 40 % fewer", percent(peak), bool(peak <= -40)))
    if sequence.has("PMCD-EB", "PMCD-EB-Nk3"):
        claims.append(("Nk3: triangles", "slightly fewer",
                       spread(change(sequence, "PMCD-EB", "PMCD-EB-Nk3", "triangle_draw_count"), percent), None))
    caption = "Triangles of the (batch, face) pairs that every variant draws; the uppermost line draws every batch in the " \
              "light's sphere into all six faces. The axis is logarithmic; frames without triangles leave a gap."
    figures.save(15, sequence, figure, "Triangles drawn", caption,
                 {f"{l} (triangles)": v for l, v in columns.items()}, claims)


def figure_16(figures, sequence):
    base = base_of(sequence)
    if base is None:
        return "variant PMCD-EB or PMCD"
    last = lambda l: sequence.parts(l)[-1]
    chosen = [l for l in sequence.maps()
              if l == base or (l.startswith(base + "-") and len(sequence.parts(l)) == len(sequence.parts(base)) + 1
                               and (maps_of(last(l)) or last(l)[0] == "u" or last(l).startswith("Nk")))]
    if len(chosen) < 2:
        return f"variants {base} and some of {base}-1SM, {base}-16SM, {base}-u2, {base}-u4"
    count = lambda l: maps_of(last(l)) or (4 if l == base else 100)
    chosen.sort(key=lambda l: (count(l), l))
    texels = {(f"{base}-4SM" if l == base else l): sequence.values(l, "texel_count") for l in chosen}
    computations = {l: sequence.values(l, "lighting_computation_count")
                    for l in chosen if l == base or last(l).startswith("Nk")}
    figure, axes = plt.subplots(figsize=(COLUMN, 2.2 + 0.12 * -(-(len(texels) + len(computations)) // 3)))
    draw_lines(sequence, axes, texels)
    for i, (label, values) in enumerate(computations.items()):
        axes.plot(sequence.frames, values, color=house.GREY, linewidth=2.4 - 0.9 * i, alpha=0.7,
                  linestyle="-" if i == 0 else "--", zorder=1,
                  label="computations" + ("" if label == base else f", {last(label)}"))
    axes_over_frames(sequence, axes, "texels; lighting computations")
    logarithmic(axes, list(texels.values()) + list(computations.values()))
    legend_above(axes, len(texels) + len(computations))
    claims = []
    peaks = {count(l): np.max(sequence.values(l, "texel_count")) for l in chosen if count(l) <= 16}
    if len(peaks) > 1:
        best = min(peaks, key=peaks.get)
        claims.append(("maps a light with the lowest peak of texels", "4 (above, texels rise again)",
                       f"{best}: " + ", ".join(f"{n}SM {engineering(v)}" for n, v in sorted(peaks.items())), best == 4))
    work = np.maximum(sequence.values(base, "lighting_computation_count"), 1)
    ratio = sequence.values(base, "texel_count") / work
    claims.append(("texels a lighting computation at 4SM", "roughly proportional",
                   f"{np.min(ratio):.2f} to {np.max(ratio):.2f}", bool(np.max(ratio) <= 2.5)))
    divided = sequence.values(base, lambda row: row.get("degrade_divisor", 1))
    claims.append(("frames whose resolutions a full pool divides, at 4SM", "-", f"{int(np.sum(divided > 1))}", None))
    for label in chosen:
        if last(label)[0] == "u":
            mean = 100 * (np.sum(sequence.values(label, "texel_count")) / np.sum(sequence.values(base, "texel_count")) - 1)
            claims.append((f"{last(label)}: texels", "lower peak memory", percent(mean), bool(mean < 0)))
    if sequence.has("PMCD", "PMCD-EB"):
        cut = change(sequence, "PMCD", "PMCD-EB", "texel_count")
        claims.append(("EB: texels", "8 to 35 % fewer", spread(cut, percent), bool(np.max(cut) <= -8)))
    nk = next((l for l in chosen if last(l).startswith("Nk")), None)
    if nk:
        claims.append((f"{last(nk)}: lighting computations", "substantially fewer",
                       spread(change(sequence, base, nk, "lighting_computation_count"), percent), None))
        claims.append((f"{last(nk)}: texels", "slightly fewer", spread(change(sequence, base, nk, "texel_count"), percent),
                       None))
    caption = ("Texels of all pages with memory, by maps a light and by undersampling; grey, on the same logarithmic axis, "
               "lighting computations: samples times lights of their clusters.")
    figures.save(16, sequence, figure, "Texels and lighting computations", caption,
                 {f"{l} (texels)": v for l, v in texels.items()}
                 | {f"{l} (lighting computations)": v for l, v in computations.items()}, claims)


def figure_17(figures, sequence):
    chosen = [l for l in sequence.labels if l != "embree"
              and np.sum(sequence.values(l, "flicker_answer_count")) > 0]
    if not chosen:
        return "flicker points"
    kinds = (("held", house.BLUE, ""), ("resolution_switch", house.ORANGE, "////"),
             ("method_switch", house.VERMILION, "...."))
    sums = {(l, k): np.sum(sequence.values(l, f"flicker_{k}_count")) for l in chosen for k, _, _ in kinds}
    answers = {l: np.sum(sequence.values(l, "flicker_answer_count")) for l in chosen}
    figure, axes = plt.subplots(figsize=(COLUMN, 0.75 + 0.14 * len(chosen)))
    ys, left = np.arange(len(chosen))[::-1], np.zeros(len(chosen))
    for kind, color, hatch in kinds:
        widths = np.array([1e4 * sums[l, kind] / max(1, answers[l]) for l in chosen])
        axes.barh(ys, widths, 0.7, left=left, color=color, hatch=hatch, edgecolor="black", linewidth=0.35,
                  label=kind.replace("_", " "))
        left += widths
    axes.set_yticks(ys)
    axes.set_yticklabels(chosen, fontsize=5.8)
    axes.set_xlabel("answers that flicker (of 10 000 a frame)")
    axes.set_xlim(0, max(1e-3, np.max(left)) * 1.04)
    axes.set_ylim(-0.6, len(chosen) - 0.4)
    for y, width in zip(ys, left):
        if width == 0:
            axes.annotate("0", (0, y), xytext=(3, 0), textcoords="offset points", va="center", fontsize=6)
    axes.grid(axis="y", visible=False)
    legend_above(axes, 3, 3)
    claims = []
    for label in chosen:
        held = sums[label, "held"]
        named = sum(np.sum(sequence.values(label, f"flicker_held_{k}_count")) for k in ("explained", "contact", "acne"))
        claims.append((f"{label}: flicker at held resolutions", "errors stable and consistent",
                       f"{int(held)} of {int(np.sum(sequence.values(label, 'flicker_held_answer_count')))}, "
                       f"{int(held - named)} unexplained", bool(held == named)))
    caption = ("Of the answers followed from each frame to the next, those that change where Embree's do not, over all frames: "
               "at maps of unchanged resolution or unchanged method, where a map's resolution was switched, where its method "
               "was. The paper judged this by eye.")
    figures.save(17, sequence, figure, "Flicker", caption,
                 {f"{l} {k} (answers)": sequence.values(l, f"flicker_{k}_count") for l in chosen for k, _, _ in kinds}, claims)


FIGURES = {10: figure_10, 11: figure_11, 12: figure_12, 13: figure_13, 14: figure_14, 15: figure_15, 16: figure_16,
           17: figure_17}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", nargs="+", help="results.json files of compare --sequence")
    parser.add_argument("-o", "--output", required=True, help="directory of the figures")
    parser.add_argument("--figure", type=int, action="append", choices=sorted(FIGURES), help="only this one")
    parser.add_argument("--mixed-commits", action="store_true", help="accept lines of different commits")
    arguments = parser.parse_args()
    scenes, provenance, experiment = load(arguments.results, arguments.mixed_commits)
    figures = Figures(arguments.output, provenance, experiment)
    left_out = []
    for scene, rows in scenes.items():
        sequence = Sequence(scene, rows)
        for number in sorted(set(arguments.figure or FIGURES)):
            try:
                missing = FIGURES[number](figures, sequence)
            except Missing as what:
                plt.close("all")
                missing = str(what)
            if missing and arguments.figure:
                refuse(f"figure {number} of {scene} needs {missing}, which the results lack; measure them with "
                       "compare --sequence --variants")
            if missing:
                left_out.append({"figure": number, "scene": scene, "needs": missing})
                print(f"figures.py: figure {number} of {scene} is left out: it needs {missing}", file=sys.stderr)
    figures.charts.finish({"left_out": left_out})


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))  # so that nothing half written stays
    try:
        main()
    except RecursionError:
        refuse("the results are nested too deep; measure again with compare --sequence")
    except OSError as error:
        end(UNWRITTEN, f"{error.filename or 'figures'}: cannot be written: {error.strerror or error}; "
            "free space there or name another directory")
