# SPDX-License-Identifier: Apache-2.0
"""Bars by configuration: bytes, time by stage, and variants by name."""
import math

import numpy as np

from ..series import label_of
from ..style import COLUMN, ORANGE, SKY, STACK, VERMILION, labels_that_fit, plain, plt, slug
from .runs import bar_label, bar_runs, bars_sentence, time_bars


def bytes_chart(charts, scene, runs):
    members = bar_runs(runs)
    if not members:
        return
    mebi = 1024.0 * 1024.0
    figure, axes = plt.subplots(figsize=(COLUMN, 2.1))
    xs = np.arange(len(members))
    dag = np.array([r["dag_bytes"] / mebi for r in members])
    exact = np.array([r.get("exact_bytes", 0) / mebi for r in members])
    pages = np.array([r["map_bytes"] / mebi for r in members])
    axes.bar(xs, dag, 0.7, color=SKY, label="DAG", edgecolor="black", linewidth=0.4)
    if exact.any():
        axes.bar(xs, exact, 0.7, bottom=dag, color=VERMILION, label="triangles", edgecolor="black", linewidth=0.4,
                 hatch="....")
    axes.bar(xs, pages, 0.7, bottom=dag + exact, color=ORANGE, label="pages and tables", edgecolor="black", linewidth=0.4,
             hatch="////")
    for x, total in zip(xs, dag + exact + pages):
        axes.annotate(plain(total), (x, total), xytext=(0, 1.5), textcoords="offset points", ha="center", fontsize=5.6)
    axes.set_xticks(xs)
    axes.set_xticklabels([bar_label(r) for r in members])
    axes.set_ylim(0, max(1e-6, (dag + exact + pages).max()) * 1.15)
    axes.grid(axis="x", visible=False)
    axes.set_xlabel("threshold (texels) or model")
    axes.set_ylabel("memory (MiB)")
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncol=2, borderaxespad=0.2)
    if len(labels_that_fit(axes)) < len(members):
        axes.tick_params(axis="x", labelrotation=90)
    charts.save(figure, f"bytes_{slug(scene)}", f"Bytes of DAG and pages, {scene}",
                f"The memory of a frame's shadows: the DAG in its traced form ({plain(dag.max())} MiB) and the pages in "
                f"use with their tables (up to {plain(pages.max())} MiB)"
                + (f", and the triangles with what exact rays build over them (up to {plain(exact.max())} MiB)"
                   if exact.any() else "") + ". "
                "The DAG is built once for the static scene; pages depend on the view.")


def stages_chart(charts, scene, runs):
    members = bar_runs(runs)
    names = []
    for run in members:
        names += [n for n in run["stages"] if n not in names]
    if not names:
        return
    figure, axes = plt.subplots(figsize=(COLUMN, 0.9 + 0.17 * len(members) + 0.1 * math.ceil(len(names) / 3)))
    ys = np.arange(len(members))[::-1]
    left = np.zeros(len(members))
    for i, name in enumerate(names):
        widths = np.array([r["stages"].get(name, 0) for r in members])
        axes.barh(ys, widths, 0.72, left=left, color=STACK[i % len(STACK)], label=name, edgecolor="black",
                  linewidth=0.35, hatch=("", "////", "....")[i // len(STACK) % 3])
        left += widths
    time_bars(axes, members, ys, zorder=5)
    axes.set_yticks(ys)
    axes.set_yticklabels([bar_label(r) for r in members])
    axes.set_xlim(0, max(left.max(), *(r["time_ms_high"] for r in members)) * 1.04)
    axes.grid(axis="y", visible=False)
    axes.set_xlabel("time (ms)")
    axes.set_ylabel("threshold (texels) or model")
    axes.legend(loc="lower center", bbox_to_anchor=(0.45, 1.0), ncol=3, borderaxespad=0.3, columnspacing=1.0,
                handlelength=1.2)
    largest = max(names, key=lambda n: sum(r["stages"].get(n, 0) for r in members))
    share = sum(r["stages"].get(largest, 0) for r in members) / max(1e-9, left.sum())
    charts.save(figure, f"stages_{slug(scene)}", f"Where the time goes, {scene}",
                f"Medians of every stage, added up; “{largest}” takes {100 * share:.0f} % over all bars. "
                "From top to bottom more and more lights are traced instead of drawn." + bars_sentence(members))


def variants_chart(charts, scene, runs):
    """Time by stage and error of variants by name, one bar each."""
    if not runs:
        return
    names = []
    for run in runs:
        names += [n for n in run["stages"] if n not in names]
    figure, (times, errors) = plt.subplots(1, 2, figsize=(COLUMN * 1.25, 0.9 + 0.17 * len(runs) + 0.1 * math.ceil(len(names) / 4)),
                                           sharey=True, gridspec_kw={"width_ratios": [2.2, 1]})
    ys, left = np.arange(len(runs))[::-1], np.zeros(len(runs))
    for i, name in enumerate(names):
        widths = np.array([r["stages"].get(name, 0) for r in runs])
        times.barh(ys, widths, 0.72, left=left, color=STACK[i % len(STACK)], label=name, edgecolor="black",
                   linewidth=0.35, hatch=("", "////", "....")[i // len(STACK) % 3])
        left += widths
    errors.barh(ys, [r["false_shadow"] for r in runs], 0.72, color=VERMILION, edgecolor="black", linewidth=0.35,
                label="false shadow")
    errors.barh(ys, [r["false_light"] for r in runs], 0.72, left=[r["false_shadow"] for r in runs], color=SKY,
                edgecolor="black", linewidth=0.35, hatch="////", label="false light")
    time_bars(times, runs, ys, zorder=5)
    times.set_yticks(ys)
    times.set_yticklabels([label_of(r) for r in runs])
    for axes, label, columns in ((times, "time (ms)", 3), (errors, "pairs (%)", 1)):
        axes.grid(axis="y", visible=False)
        axes.set_xlim(left=0)
        axes.set_xlabel(label)
        axes.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0), ncol=columns, borderaxespad=0.3, columnspacing=0.9,
                    handlelength=1.0, fontsize=5.4)
    fastest = min(runs, key=lambda r: r["time_ms"])
    charts.save(figure, f"variants_{slug(scene)}", f"Variants, {scene}",
                f"Medians of every stage and the wrong pairs of every variant; the fastest is {label_of(fastest)} "
                f"({fastest['time_ms']:.1f} ms). Frames are independent, so static optimization has no effect." + bars_sentence(runs))
