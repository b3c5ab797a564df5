# SPDX-License-Identifier: Apache-2.0
"""Draws the loss of routing, frame by frame, relative to model oracle: by model cost, by texels:96, by the best single
threshold and by either method alone, from results.json of `shadowdag compare` with models oracle and cost. Writes
regret.svg, regret.png and regret.json, and prints the sums.

    regret report/results.json [more.json ...] -o docs

The single threshold of a frame is the one that is fastest on all other frames of its scene. Model cost is held out
if its calibration contained none of the frames; the caller is responsible for that. Time is that of whole frames.
"""
import os

from ..collection import save_figure
from ..files import write_json
from ..style import BLACK, BLUE, COLUMN, GREEN, GREY, ORANGE, VERMILION, plt
from .regret_analysis import analyse, load

LINES = {  # name: (colour, marker, dashes)
    "rays": (BLUE, "v", (4, 2)), "maps": (ORANGE, "^", (4, 2)), "texels:96": (GREY, "s", (1, 1)),
    "best threshold": (GREEN, "D", (3, 1, 1, 1)), "cost": (VERMILION, "o", ())}


def describe(scene):
    held, worst = scene["sums"], scene["worst_frame"]
    realised = held["realised"]
    ninety_six = held["texels_96_ms"]
    print(f"{scene['scene']}: {held['frame_count']} frames, ms per frame: "
          + ", ".join(f"{n} {held[k] / held['frame_count']:.1f}" for n, k in (
              ("oracle", "oracle_ms"), ("cost", "cost_ms"), (scene["best_threshold"] + " (best)", "best_threshold_ms"),
              ("better single method", "better_single_ms")))
          + (f", texels:96 {ninety_six / held['frame_count']:.1f}" if ninety_six is not None else "")
          + "; of the oracle's gain cost realises "
          + (f"{100 * realised:.0f} %" if realised is not None else "nothing to speak of: the oracle gains "
             f"{held['oracle_gain_ms'] / held['frame_count']:.1f} ms per frame, noise {held['oracle_noise_ms'] / held['frame_count']:.1f}")
          + (f"; the oracle's maps take {held['oracle_serving_over_cost_sum']:.2f} of what their costs add up to"
             if held["oracle_serving_over_cost_sum"] else "")
          + f"; slower than the better method by over 5 % + noise: {scene['slower_frames'] or 'no frame'}"
          + f"; worst frame {worst['frame']}: {worst['cost_ms']:.1f} ms, {worst['traced_map_count']} maps traced, "
          f"{worst['drawn_map_count']} drawn, {100 * worst['ray_share']:.0f} % of the pairs by rays")


def panel(axes, scene, is_first):
    rows = scene["frames"]
    xs = [r["frame"] for r in rows]
    axes.axhline(0, color=BLACK, linewidth=0.8, label="oracle" if is_first else None)
    for name, (colour, marker, dashes) in LINES.items():
        members = [r for r in rows if name in r["regret"]]
        line, = axes.plot([r["frame"] for r in members], [100 * r["regret"][name] for r in members], marker=marker,
                          color=colour, markersize=3, linewidth=1, markeredgewidth=0.6, markerfacecolor="white",
                          label=name if is_first else None)
        if dashes:
            line.set_dashes(dashes)
    axes.set_yscale("symlog", linthresh=20)
    axes.set_yticks([-10, 0, 10, 20, 50, 100, 200])
    axes.yaxis.set_major_formatter(lambda y, _: f"{y:.0f}")
    worst = scene["worst_frame"]["frame"]
    axes.axvline(worst, color=GREY, linewidth=0.5, zorder=0)
    axes.set_title(f"{scene['scene'].removeprefix('builtin:')}; best threshold {scene['best_threshold'][7:]}, "
                   f"worst frame {worst}", fontsize=7.5, loc="left")
    axes.set_ylabel("over oracle (%)")
    if len(xs) == 1:
        axes.set_xticks(xs)


def declare(parser):
    parser.add_argument("results", nargs="+", help="results.json files of compare")
    parser.add_argument("-o", "--output", required=True, help="directory")


def run(arguments):
    loaded, sums, commit = load(arguments.results)
    scenes = [analyse(scene, frames, sums) for scene, frames in sorted(loaded.items())]
    figure, all_axes = plt.subplots(len(scenes), 1, figsize=(COLUMN, 1.7 * len(scenes) + 0.6), squeeze=False)
    for i, scene in enumerate(scenes):
        describe(scene)
        panel(all_axes[i][0], scene, i == 0)
    all_axes[-1][0].set_xlabel("frame")
    all_axes[0][0].legend(loc="lower center", bbox_to_anchor=(0.45, 1.12), ncol=3, columnspacing=1.0,
                          handletextpad=0.4)
    save_figure(figure, os.path.join(arguments.output, "regret"), bbox_inches="tight")
    write_json(os.path.join(arguments.output, "regret.json"), {"commit": commit, "scenes": scenes})
