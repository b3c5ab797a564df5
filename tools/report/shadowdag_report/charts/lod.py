# SPDX-License-Identifier: Apache-2.0
"""Error against time over the level of detail of rays."""
import numpy as np

from ..series import rays_alone
from ..style import BLACK, BLUE, COLUMN, GREEN, GREY, PURPLE, VERMILION, place_labels, plt, slug
from .runs import bars_sentence, time_bars


def lod_of(run):
    """Returns (rule, footprint scale or level, coverage) of a run's level of detail."""
    value = run["parameters"].get("lod", 0)
    parts = str(value).split(":")
    if parts[0] == "footprint":
        return "footprint", float(parts[1]) if len(parts) > 1 else 1.0, None
    if parts[0] == "coverage":
        return "coverage", float(parts[2]) if len(parts) > 2 else 1.0, float(parts[1])
    return "fixed", float(value), None


def lod_chart(charts, scene, runs):
    """Error against time of method dag where an experiment sweeps the level of detail."""
    rays = rays_alone(runs, "all")
    if len({str(r["parameters"].get("lod", 0)) for r in rays}) < 2:
        return
    first = next((r for r in rays if lod_of(r)[:2] == ("fixed", 0.0)), rays[0])
    same = ("resolution", "offset")  # one series of each kind: those of the first resolution and offset
    rays = [r for r in rays if all(r["parameters"].get(k) == first["parameters"].get(k) for k in same)]
    wrong = lambda run: run["false_shadow"] + run["false_light"]
    groups = {}
    for run in rays:
        rule, size, share = lod_of(run)
        if rule == "coverage":  # shares at scale 1 are one series, scales at a share another
            if size == 1.0:
                groups.setdefault(("coverage", "share"), []).append((share, run))
            else:
                groups.setdefault(("coverage", share), []).append((size, run))
        else:
            groups.setdefault((rule, None), []).append((size, run))
    for key, members in groups.items():
        if key[0] == "coverage" and key[1] != "share":
            members += [(1.0, r) for r in rays if lod_of(r) == ("coverage", 1.0, key[1])]
        members.sort(key=lambda m: m[0])
    figure, (over_time, sides) = plt.subplots(1, 2, figsize=(2 * COLUMN, 2.6), gridspec_kw={"width_ratios": [1.15, 1]})
    styles = {("fixed", None): (BLACK, "o", "-", "fixed level"),
              ("footprint", None): (BLUE, "s", "--", "footprint × scale")}
    spare = [(VERMILION, "^", "-."), (PURPLE, "D", ":"), (GREEN, "v", "-.")]
    ordered = sorted(groups, key=lambda k: (["fixed", "footprint", "coverage"].index(k[0]), str(k[1]) != "share"))
    for i, key in enumerate(k for k in ordered if k[0] == "coverage"):
        name = "coverage ≥ share" if key[1] == "share" else f"coverage ≥ {key[1]:g}, footprint × scale"
        styles[key] = spare[i % len(spare)] + (name,)
    in_time, in_sides = [], []  # labels of points: placed after all points
    for key in ordered:
        color, marker, line, name = styles[key]
        xs, ys = [m[1]["time_ms"] for m in groups[key]], [wrong(m[1]) for m in groups[key]]
        over_time.plot(xs, ys, color=color, marker=marker, linestyle=line, linewidth=0.9, label=name,
                       markeredgecolor="white", markeredgewidth=0.4, markersize=4.6)
        time_bars(over_time, [m[1] for m in groups[key]], ys, color)
        sides.plot([m[1]["false_shadow"] for m in groups[key]], [m[1]["false_light"] for m in groups[key]],
                   color=color, marker=marker, linestyle=line, linewidth=0.9, markeredgecolor="white",
                   markeredgewidth=0.4, markersize=4.6)
        for size, run in groups[key]:
            text = f"{size:g}" if key[0] == "fixed" else f"×{size:g}" if key[1] != "share" else f"{100 * size:g} %"
            if key[1] not in (None, "share") and size == 1.0:
                continue  # stands in the series of shares
            look = {"fontsize": 5.8, "color": color}
            if key[1] != "share":  # shares differ by too little in time to be told apart there
                in_time.append((run["time_ms"], wrong(run), text, look))
            in_sides.append((run["false_shadow"], run["false_light"], text, look))
    spread = [abs(r["time_ms_max"] - r["time_ms_min"]) / r["time_ms"] for r in rays]
    embree = next((r for r in runs if r["method"] == "embree"), None)
    if embree:
        over_time.plot(embree["time_ms"], wrong(embree), linestyle="none", marker="o", color=GREY, markersize=4.6,
                       markeredgecolor="white", markeredgewidth=0.4, clip_on=False, zorder=4, label="Embree's frame")
        time_bars(over_time, [embree], [wrong(embree)], GREY)
    over_time.set_xlabel("frame time (ms)")
    over_time.set_ylabel("wrong pairs (%)")
    over_time.margins(0.12)
    over_time.set_ylim(bottom=0)
    sides.set_xlabel("false shadow (% of pairs)")
    sides.set_ylabel("false light (% of pairs)")
    sides.margins(0.12)
    sides.set_xlim(left=0)
    sides.set_ylim(bottom=0)
    over_time.legend(loc="lower left", bbox_to_anchor=(0, 1), ncol=2, columnspacing=1.2, borderaxespad=0.2)
    lines = [[run for _, run in groups[key]] for key in ordered]
    bars = [(x, wrong(r)) for r in rays for x in np.linspace(r["time_ms_low"], r["time_ms_high"], 9)]
    for axes, labels, marks, place in ((over_time, in_time, bars, lambda r: (r["time_ms"], wrong(r))),
                                       (sides, in_sides, [], lambda r: (r["false_shadow"], r["false_light"]))):
        places = [list(map(place, line)) for line in lines]
        place_labels(axes, labels, marks + sum(places, []), places)
    fastest = min(rays, key=lambda r: r["time_ms"])
    best = min((r for r in rays if lod_of(r)[0] != "fixed"), key=wrong, default=first)
    sentence = (f" Embree's rays need {embree['time_ms']:.0f} ms for the same frame, with {wrong(embree):.2f} % of the pairs "
                "wrong." if embree else "")
    charts.save(figure, f"lod_{slug(scene)}", f"Level of detail: error against time, {scene}",
                f"All lights traced at {first['parameters']['resolution']}³; down and left is better. Level 0 takes "
                f"{first['time_ms']:.0f} ms with {wrong(first):.2f} % of the pairs wrong; the fastest, lod "
                f"{fastest['parameters'].get('lod', 0)}, {fastest['time_ms']:.0f} ms with {wrong(fastest):.2f} %; of those that "
                f"follow the footprint the most exact, {best['parameters'].get('lod', 0)}, {best['time_ms']:.0f} ms with "
                f"{wrong(best):.2f} %. Marks name the level, the footprint's scale or the share of a cell's columns that "
                f"stops a ray; times of one run spread by {100 * max(spread):.0f} % at most." + bars_sentence(rays) + " Rays of level 0 are traced in streams, "
                "those of all others one by one." + sentence)
