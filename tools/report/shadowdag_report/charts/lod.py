# SPDX-License-Identifier: Apache-2.0
"""Time and error over the level of detail of rays.

Designed for both columns of a paper (17.8 cm).
"""
from ..series import rays_alone
from ..style import BLACK, BLUE, COLUMN, GREY, PURPLE, SKY, VERMILION, plt, slug
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


def row_name(run):
    """Returns the text of a run's row."""
    rule, size, share = lod_of(run)
    if rule == "fixed":
        return f"level {size:g}"
    return f"footprint × {size:g}" + (f", {100 * share:g} % covered" if rule == "coverage" else "")


def lod_chart(charts, scene, runs):
    """Time and error of method dag, a row a level of detail, where an experiment sweeps it."""
    rays = rays_alone(runs, "all")
    if len({str(r["parameters"].get("lod", 0)) for r in rays}) < 2:
        return
    first = next((r for r in rays if lod_of(r)[:2] == ("fixed", 0.0)), rays[0])
    same = ("resolution", "offset")  # one series: that of the first resolution and offset
    rays = [r for r in rays if all(r["parameters"].get(k) == first["parameters"].get(k) for k in same)]
    wrong = lambda run: run["false_shadow"] + run["false_light"]
    order = {"fixed": 0, "footprint": 1, "coverage": 2}
    rays.sort(key=lambda r: (order[lod_of(r)[0]], lod_of(r)[2] or 0, lod_of(r)[1]))
    embree = next((r for r in runs if r["method"] == "embree"), None)
    rows = ([embree] if embree else []) + rays
    names = ["Embree's frame"] * bool(embree) + [row_name(r) for r in rays]
    figure, (times, errors) = plt.subplots(1, 2, figsize=(2 * COLUMN, 0.75 + 0.17 * len(rows)), sharey=True)
    looks = {"fixed": (BLACK, "o"), "footprint": (BLUE, "s"), "coverage": (PURPLE, "D")}
    for y, run in enumerate(rows):
        color, marker = (GREY, "o") if run is embree else looks[lod_of(run)[0]]
        times.plot(run["time_ms"], y, color=color, marker=marker, markersize=4.6, markeredgecolor="white", markeredgewidth=0.4,
                   zorder=4)
        time_bars(times, [run], [y], color)
        errors.barh(y, run["false_shadow"], color=VERMILION, height=0.7, label="false shadow" if y == 0 else None)
        errors.barh(y, run["false_light"], left=run["false_shadow"], color=SKY, height=0.7,
                    label="false light" if y == 0 else None)
        errors.annotate(f"{wrong(run):.2f}", (wrong(run), y), xytext=(3, 0), textcoords="offset points", va="center", fontsize=5.8)
    times.set_yticks(range(len(rows)), names)
    times.invert_yaxis()
    times.set_xlim(left=0)
    times.set_xlabel("frame time (ms)")
    errors.set_xlabel("wrong pairs (%)")
    errors.margins(x=0.12)
    errors.tick_params(axis="y", length=0)
    errors.legend(loc="lower right", ncol=1)
    spread = [abs(r["time_ms_max"] - r["time_ms_min"]) / r["time_ms"] for r in rays]
    fastest = min(rays, key=lambda r: r["time_ms"])
    best = min((r for r in rays if lod_of(r)[0] != "fixed"), key=wrong, default=first)
    sentence = (f" Embree's rays need {embree['time_ms']:.0f} ms for the same frame, with {wrong(embree):.2f} % of the pairs "
                "wrong." if embree else "")
    charts.save(figure, f"lod_{slug(scene)}", f"Level of detail: time and error, {scene}",
                f"All lights traced at {first['parameters']['resolution']}³. Level 0 takes "
                f"{first['time_ms']:.0f} ms with {wrong(first):.2f} % of the pairs wrong; the fastest, lod "
                f"{fastest['parameters'].get('lod', 0)}, {fastest['time_ms']:.0f} ms with {wrong(fastest):.2f} %; of those that "
                f"follow the footprint the most exact, {best['parameters'].get('lod', 0)}, {best['time_ms']:.0f} ms with "
                f"{wrong(best):.2f} %. Rows name the level, the footprint's scale, and the share of a cell's columns that "
                f"stops a ray; times of one run spread by {100 * max(spread):.0f} % at most." + bars_sentence(rays) + " Rays of level 0 are traced in streams, "
                "those of all others one by one." + sentence)
