# SPDX-License-Identifier: Apache-2.0
"""Draws the loss of routing, frame by frame, relative to the oracle, whose routes were measured fastest: by model cost, by
texels:96, by the best single threshold and by either method alone, from results.json of `shadowdag compare` with models
oracle and cost. Writes regret.svg, regret.png and regret.json, and prints the sums.

    regret report/results.json [more.json ...] -o docs

Marks of a frame stand side by side: medians of the ratios in the same rounds, with their intervals where the results
have them; the grey band is the oracle's own noise. The single threshold of a frame is the one that is fastest on all other frames of its scene. Model cost is
held out if its calibration contained none of the frames; the caller is responsible for that. Time is that of whole frames.
"""
import os

from ..collection import save_figure
from ..files import expecting, read_json, write_json
from ..style import BLACK, BLUE, COLUMN, GREEN, GREY, ORANGE, SKY, VERMILION, plt
from .regret_analysis import analyse, load

LINES = {  # name: (colour, marker)
    "rays": (BLUE, "v"), "maps": (ORANGE, "^"), "texels:96": (SKY, "s"), "best threshold": (GREEN, "D"), "cost": (VERMILION, "o")}


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
    """Draws a scene: at each frame one mark per line, side by side, so that equal ones are all seen."""
    rows = scene["frames"]
    frames = [r["frame"] for r in rows]
    step = min((b - a for a, b in zip(frames, frames[1:])), default=10)
    axes.axhline(0, color=BLACK, linewidth=0.8, label="oracle" if is_first else None)
    noise = 100 * scene["sums"]["oracle_noise_ms"] / scene["sums"]["oracle_ms"]
    axes.axhspan(-noise, noise, color=GREY, alpha=0.3, linewidth=0, label="its noise" if is_first else None)
    for place, (name, (colour, marker)) in enumerate(LINES.items()):
        members = [r for r in rows if name in r["regret"]]
        xs = [r["frame"] + step * 0.14 * (place - (len(LINES) - 1) / 2) for r in members]
        ys = [100 * r["regret"][name] for r in members]
        ends = [r.get("regret_intervals", {}).get(name, (y / 100, y / 100)) for r, y in zip(members, ys)]
        axes.errorbar(xs, ys, yerr=[[max(0, y - 100 * e[0]) for y, e in zip(ys, ends)], [max(0, 100 * e[1] - y) for y, e in zip(ys, ends)]],
                      linestyle="none", marker=marker, color=colour, markersize=3.2, markeredgewidth=0.5, markeredgecolor=BLACK,
                      elinewidth=0.7, capsize=1.2, label=name if is_first else None)
    axes.set_yscale("symlog", linthresh=20)
    axes.set_yticks([-10, 0, 10, 20, 50, 100, 200])
    axes.yaxis.set_major_formatter(lambda y, _: f"{y:.0f}")
    axes.set_title(f"{scene['scene'].removeprefix('builtin:')}; best threshold {scene['best_threshold'][7:]}, "
                   f"worst frame {scene['worst_frame']['frame']}", fontsize=7.5, loc="left")
    axes.set_ylabel("time over the oracle's (%)", fontsize=7)
    axes.set_xticks(frames)
    axes.set_xlim(frames[0] - step / 2, frames[-1] + step / 2)
    axes.grid(axis="x", visible=False)


def loaded_scenes(paths):
    """Returns (scenes, provenance) of results of compare, or of one regret.json, which holds what was analysed."""
    if len(paths) == 1:
        with expecting(paths[0], "results of a compare, or a regret.json"):
            results = read_json(paths[0])
            if "runs" not in results:
                for scene in results["scenes"]:
                    scene["sums"]["oracle_ms"], scene["worst_frame"]["frame"], scene["best_threshold"]
                    for row in scene["frames"]:
                        row["frame"] + 0, row["regret"].items()
                return results["scenes"], results["provenance"]
    loaded, sums, provenance = load(paths)
    return [analyse(scene, frames, sums) for scene, frames in sorted(loaded.items())], provenance


def declare(parser):
    parser.add_argument("results", nargs="+", help="results.json files of compare, or one regret.json")
    parser.add_argument("-o", "--output", required=True, help="directory")


def run(arguments):
    scenes, provenance = loaded_scenes(arguments.results)
    figure, all_axes = plt.subplots(len(scenes), 1, figsize=(COLUMN, 1.7 * len(scenes) + 0.6), squeeze=False)
    for i, scene in enumerate(scenes):
        describe(scene)
        panel(all_axes[i][0], scene, i == 0)
    all_axes[-1][0].set_xlabel("frame")
    all_axes[0][0].legend(loc="lower center", bbox_to_anchor=(0.45, 1.12), ncol=3, columnspacing=1.0,
                          handletextpad=0.4)
    save_figure(figure, os.path.join(arguments.output, "regret"), bbox_inches="tight")
    write_json(os.path.join(arguments.output, "regret.json"), {"provenance": provenance, "scenes": scenes})
