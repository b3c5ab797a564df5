# SPDX-License-Identifier: Apache-2.0
"""Error over the DAG's resolution, and the histogram of visibility."""
import math

import numpy as np

from ..series import rays_alone, threshold_of
from ..style import BLACK, BLUE, COLUMN, GREEN, GREY, NullLocator, ORANGE, SKY, VERMILION, error_axis, log_axis, plt, slug
from ..texels import equivalent_texels
from .per_map import power_fit
from .runs import bar_label


def resolution_chart(charts, scene, runs):
    members = {}
    for run in rays_alone(runs, "all"):
        parameters = run["parameters"]
        members.setdefault((parameters.get("offset"), parameters.get("lod")), []).append(run)
    members = sorted(max(members.values(), key=len), key=lambda r: r["parameters"]["resolution"]) if members else []
    if len(members) < 2:
        return
    figure, axes = plt.subplots(figsize=(COLUMN, 2.4))
    xs = [r["parameters"]["resolution"] for r in members]
    total = [r["false_shadow"] + r["false_light"] for r in members]
    if not any(total):
        plt.close(figure)
        return
    positive = [r[key] for r in members for key in ("false_shadow", "false_light") if r[key] > 0]
    has_zero = len(positive) < 2 * len(members)
    floor = min(positive + [total[0] * xs[0] / xs[-1]]) / (2.5 if has_zero else 1.4)
    shown = list(positive)
    for key, color, marker, name in (("false_shadow", VERMILION, "s", "false shadow"),
                                     ("false_light", SKY, "^", "false light")):
        ys = [r[key] if r[key] > 0 else floor for r in members]
        axes.plot(xs, ys, color=color, marker=marker, label=name, clip_on=False)
    axes.plot(xs, total, color=BLACK, marker="o", label="wrong pairs")
    reference = [total[0] * xs[0] / x for x in xs]
    axes.plot(xs, reference, color=GREY, linestyle="--", linewidth=0.9, label="halving")
    shown += [t for t in total if t > 0] + reference
    axes.set_xscale("log", base=2)
    axes.set_xticks(xs)
    axes.set_xticklabels([str(x) for x in xs])
    axes.xaxis.set_minor_locator(NullLocator())
    error_axis(axes, floor, max(shown) * 1.4, 6.5, has_zero)
    axes.set_xlabel("voxels an axis")
    axes.set_ylabel("share of pairs (%)")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=4, borderaxespad=0.3, columnspacing=1.0)
    positive = [(x, t) for x, t in zip(xs, total) if t > 0]
    rate = -power_fit(*map(np.array, zip(*positive)))[1] if len(positive) > 1 else math.nan
    charts.save(figure, f"resolution_{slug(scene)}", f"Error over the DAG's resolution, {scene}",
                f"All lights by rays through voxels: wrong pairs fall from {total[0]:.2f} % at {xs[0]}³ to {total[-1]:.2f} % at {xs[-1]}³, "
                f"by a factor of {2 ** rate:.2f} per doubling (least squares of logarithms). "
                "The dashed line halves with each doubling, as an error proportional to the voxel would.")


def histogram_chart(charts, scene, runs, experiment):
    equivalent = equivalent_texels(experiment)
    hybrids = [r for r in runs if r["method"] == "hybrid" and threshold_of(r)]
    chosen = [r for r in runs if r["method"] == "maps"][:1]
    if hybrids:
        chosen.append(min(hybrids, key=lambda r: abs(math.log(threshold_of(r) / equivalent))))
    chosen += [r for r in runs if r["method"] == "dag"][:1]
    chosen = [r for r in chosen if r["histogram"] is not None and np.any(r["histogram"])]
    if not chosen:
        return
    figure, axes = plt.subplots(figsize=(COLUMN, 2.1))
    edges = np.linspace(0, 256, 33)
    shares = []
    for run, color, style in zip(chosen, (ORANGE, GREEN, BLUE), ("-", "--", ":")):
        counts = run["histogram"].reshape(32, 8).sum(axis=1)
        share = 100 * counts / max(1, counts.sum())
        shares += [s for s in share if s > 0]
        axes.stairs(np.where(share > 0, share, np.nan), edges / 256, color=color, linestyle=style, linewidth=1.1,
                    baseline=None, label=run["method"] if run["method"] != "hybrid" else f"hybrid {bar_label(run)}")
    log_axis(axes.yaxis, max(min(shares) / 1.5, 1e-5), 130, ticks=(1,))
    axes.set_xlim(0, 1)
    axes.axvline(0.5, color=GREY, linewidth=0.8, linestyle="--", zorder=1)
    axes.set_xlabel("visibility (dark under 0.5)")
    axes.set_ylabel("share of pairs (%)")
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncol=3, borderaxespad=0.2)
    fractional = [r for r in chosen if r["method"] == "maps"] or chosen
    counts = fractional[0]["histogram"]
    part = 100 * counts[1:-1].sum() / max(1, counts.sum())
    charts.save(figure, f"visibility_{slug(scene)}", f"Histogram of visibility, {scene}",
                f"Rays are lit or dark; filtered maps are in between for {part:.1f} % of the pairs ({fractional[0]['label']}). "
                "Bins are 1/32 wide and the axis is logarithmic.")
