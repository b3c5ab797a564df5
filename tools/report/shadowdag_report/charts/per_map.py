# SPDX-License-Identifier: Apache-2.0
"""Time of single maps by both methods, with fitted powers and where they cross."""
import math

import numpy as np

from ..style import BLACK, BLUE, COLUMN, GREY, ORANGE, log_axis, plt, slug


def power_fit(xs, ys):
    """Least squares of log y = a + b log x; returns (a, b)."""
    slope, offset = np.polyfit(np.log(xs), np.log(ys), 1)
    return offset, slope


def crossing(xs, rays, maps):
    """Returns where the fits cross, and its 95 % interval by 1000 seeded bootstraps over the maps; None without one."""
    def solve(indices):
        if len(set(xs[indices])) < 2:
            return math.nan
        (a, b), (c, d) = power_fit(xs[indices], rays[indices]), power_fit(xs[indices], maps[indices])
        return math.exp((c - a) / (b - d)) if abs(b - d) > 1e-9 and abs((c - a) / (b - d)) < 50 else math.nan
    everything = np.arange(len(xs))
    value = solve(everything)
    generator = np.random.default_rng(1)
    tries = np.array([solve(generator.choice(everything, len(xs))) for _ in range(1000)])
    good = tries[np.isfinite(tries)]
    if not math.isfinite(value) or len(good) < 950:
        return None
    least, greatest = float(np.percentile(good, 2.5)), float(np.percentile(good, 97.5))
    return (value, least, greatest) if greatest <= 100 * least else None  # an interval of two decades is useless


def per_map(charts, scene, costs, key, axis_name, file_name, title):
    usable = [c for c in costs if c["rays_ms"] > 0 and c["map_ms"] > 0 and c[key] > 0]
    if len(usable) < 5 or len({c[key] for c in usable}) < 3:
        return
    xs = np.array([c[key] for c in usable], float)
    rays = np.array([c["rays_ms"] for c in usable])
    maps = np.array([c["map_ms"] for c in usable])
    figure, axes = plt.subplots(figsize=(COLUMN, 2.5))
    axes.scatter(xs, rays, s=9, marker="o", facecolors="none", edgecolors=BLUE, linewidths=0.7, label="by rays")
    axes.scatter(xs, maps, s=9, marker="s", color=ORANGE, linewidths=0, alpha=0.8, label="by map")
    low, high = xs.min() / 1.3, xs.max() * 1.3
    line = np.geomspace(low, high, 50)
    slopes = []
    for ys, color, style in ((rays, BLUE, "-"), (maps, "#a06c00", "--")):
        offset, slope = power_fit(xs, ys)
        slopes.append(slope)
        axes.plot(line, np.exp(offset + slope * np.log(line)), color=color, linestyle=style, linewidth=1.1,
                  label=f"fit, power {slope:.2f}")
    found = crossing(xs, rays, maps)
    unit = " texels" if key == "texels" else " samples"
    if found and low <= found[0] <= high:
        axes.axvline(found[0], color=BLACK, linewidth=0.8, linestyle=":")
        axes.axvspan(max(found[1], low), min(found[2], high), color=GREY, alpha=0.18, linewidth=0)
        left = found[0] > math.sqrt(low * high)
        axes.annotate(f"{found[0]:,.0f}", (found[0], 1), xycoords=("data", "axes fraction"),
                      xytext=(-2 if left else 2, -2), textcoords="offset points", va="top",
                      ha="right" if left else "left", fontsize=6)
    if found:
        inside = "" if low <= found[0] <= high else ", outside what was measured"
        where = (f"the fitted lines cross at {found[0]:,.0f}{unit} (95 % interval {found[1]:,.0f} to "
                 f"{found[2]:,.0f}){inside}")
    else:
        where = "the fitted lines have no crossing that the data pin down"
    both = np.concatenate((rays, maps))
    log_axis(axes.xaxis, low, high)
    log_axis(axes.yaxis, both.min() / 1.5, both.max() * 1.5)
    axes.set_xlabel(axis_name)
    axes.set_ylabel("time of a map (ms)")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=2, borderaxespad=0.3)
    cheaper = int(np.sum(rays < maps))
    charts.save(figure, f"{file_name}_{slug(scene)}", f"{title}, {scene}",
                f"Each of {len(usable)} maps measured alone by both methods: rays are cheaper for {cheaper}, and {where}. "
                f"Time grows with power {slopes[0]:.2f} by rays and {slopes[1]:.2f} by map (least squares of logarithms).")
