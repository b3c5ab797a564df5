# SPDX-License-Identifier: Apache-2.0
"""What it costs to believe fewer voxels: error against time, and the share of rays that the triangles decide.

Designed for both columns of a paper (17.8 cm).
"""
import numpy as np

from ..series import believe_of, rays_alone
from ..style import BLACK, BLUE, COLUMN, SKY, error_axis, place_labels, plt, slug
from .runs import bars_sentence, time_bars


def setting_text(run):
    believe = believe_of(run)
    return believe if isinstance(believe, str) else f"{believe:g} px"


def joint_labels(swept, heights, width):
    """Returns labels for place_labels: settings whose points lie on each other share one, as in "0.5, 1, 2 px"."""
    groups = []  # lists of (x, y, text)
    for run, y in zip(swept, heights):
        group = next((g for g in groups if g[0][1] == y and abs(g[0][0] - run["time_ms"]) < width), None)
        if group is None:
            groups.append(group := [])
        group.append((run["time_ms"], y, setting_text(run)))
    return [(np.mean([x for x, _, _ in group]), group[0][1],
             ", ".join([text.removesuffix(" px") for _, _, text in group[:-1]] + [group[-1][2]]), {"fontsize": 6})
            for group in groups]


def believe_chart(charts, scene, runs):
    """Rays alone over --believe, at the resolution with the most settings; nothing where it is not swept."""
    members = {}
    for run in rays_alone(runs, "all") + rays_alone(runs, None):
        parameters = run["parameters"]
        members.setdefault((parameters["resolution"], parameters.get("offset"), parameters.get("lod")), []).append(run)
    if not members:
        return
    (resolution, *_), voxels = max(members.items(), key=lambda item: len(item[1]))
    swept = voxels + rays_alone(runs, "none")[:1]
    if len(swept) < 2:
        return
    order = lambda run: {"all": float("inf"), "none": 0.0}.get(believe_of(run), believe_of(run))
    swept.sort(key=order)
    wrong = [r["false_shadow"] + r["false_light"] for r in swept]
    share = [100 * r["exact_ray_count"] / max(1, r["ray_count"]) for r in swept]
    times = [r["time_ms"] for r in swept]
    figure, (over_time, shares) = plt.subplots(1, 2, figsize=(2 * COLUMN, 2.3))
    embree = next((r for r in runs if r["method"] == "embree"), None)
    of_embree = [embree["false_shadow"] + embree["false_light"]] if embree else []
    positive = [w for w in wrong + of_embree if w > 0] or [1.0]
    floor = min(positive) / 3
    heights = [max(w, floor) for w in wrong]
    over_time.plot(times, heights, color=BLUE, marker="d", linestyle=":", markeredgecolor="black", markeredgewidth=0.4,
                   markersize=4.6, clip_on=False, label=f"rays alone, {resolution}³ voxels")
    if embree:
        times = times + [embree["time_ms"]]
        over_time.plot(embree["time_ms"], max(of_embree[0], floor), linestyle="none",
                       marker="o", color=BLACK, markersize=4.6, clip_on=False, label="Embree's frame")
        time_bars(over_time, [embree], [max(of_embree[0], floor)])
    time_bars(over_time, swept, heights, BLUE)
    over_time.set_xlim(0, max(1.15 * max(times), 1.04 * max(r["time_ms_high"] for r in swept)))
    error_axis(over_time, floor, 1.6 * max(positive), 6.5, 0 in wrong + of_embree)
    over_time.set_xlabel("frame time (ms)")
    over_time.set_ylabel("wrong pairs (%)")
    over_time.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=2, borderaxespad=0.3)
    bars = [(x, y) for r, y in zip(swept, heights) for x in np.linspace(r["time_ms_low"], r["time_ms_high"], 9)]
    line = [(r["time_ms"], y) for r, y in zip(swept, heights)]
    place_labels(over_time, joint_labels(swept, heights, 0.05 * over_time.get_xlim()[1]), bars, [line])
    places = range(len(swept))
    shares.bar(places, share, color=SKY, edgecolor="black", linewidth=0.4, width=0.62)
    for x, value in zip(places, share):
        shares.annotate(f"{value:.3g}", (x, value), xytext=(0, 2), textcoords="offset points", ha="center", fontsize=6)
    shares.set_xticks(list(places))
    shares.set_xticklabels([setting_text(r) for r in swept])
    shares.set_ylim(0, 112)
    shares.set_xlabel("--believe: a shadow displaced by at most")
    shares.set_ylabel("rays left to the triangles (%)")
    exact, plain_rays = swept[0], swept[-1]
    charts.save(figure, f"believe_{slug(scene)}", f"Which voxels to believe, {scene}",
                f"With --believe {believe_of(plain_rays)} a frame takes {plain_rays['time_ms']:.1f} ms with {wrong[-1]:.2f} % "
                f"of pairs wrong, with --believe {believe_of(exact)} {exact['time_ms']:.1f} ms with {wrong[0]:.2f} %." + bars_sentence(swept))
