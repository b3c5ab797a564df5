# SPDX-License-Identifier: Apache-2.0
"""Writes DIR/index.html from DIR/results.json of `shadowdag compare`, with the charts in DIR/charts.

Runs are drawn by the command charts, frames in sequence by the command figures; the interactive charts of the page need
neither.
"""
import os

from markupsafe import Markup

from ..explained import explained_share, null_rate
from ..explained import unexplained_count as unexplained
from ..intervals import CONFIDENCE, confidence_text, interval
from ..series import label_of, legend_of_names
from ..texels import equivalent_texels
from .compare_plot import compare_plots, row_id
from .lights import lights_data
from .page import (MEBI, Cell, count, cubed, decimal, declare, grouped, key_rows, number, percent, read_charts,
                   read_results, share_cell, text, to_point, wide, words, write_page)
from .sequence_table import sequence_table

WHAT = "a results file of compare"
# Pictures of other hybrids are folded away.
SHOWN_MODELS = ("oracle", "texels:96", "texels:32")


def pool_note(run):
    """Returns the effect of a full page pool on a run, "" if it was not full."""
    notes = []
    divisor = run.get("degrade_divisor", 1)
    wanted, fit = run.get("pages_wanted_count", 0), run.get("page_count", 0)
    if divisor > 1 or wanted > fit:
        notes.append(f"pool full: resolutions divided by {divisor:.2f}; wanted {wanted} pages, {fit} fit")
    if run.get("costs_degrade_divisor", 1) > 1:
        notes.append("pool full while costs were measured: single maps undivided, all together divided by "
                     f"{run['costs_degrade_divisor']:.2f}, so that routes match neither")
    return "; ".join(notes)


def settled(run):
    """Returns how many unexplained errors a shift aimed at the blocker finds, or the truth along the filter's own taps."""
    return run.get("settled_false_shadow_count", 0) + run.get("settled_false_light_count", 0)


def interval_cell(run, key="time_ms", decimals=2):
    low, high, confidence = interval(run, key)
    short = "" if confidence >= CONFIDENCE else f" ({confidence_text(confidence)})"
    return Cell(f"{low:.{decimals}f} to {high:.{decimals}f}{short}", low)


def over_embree_cell(run):
    """Returns the ratio of times in the same round, with its interval."""
    key = "time_over_embree"
    if key not in run:
        return words("")
    return Cell(f"{run[key]:.2f}: {interval_cell(run, key).shown}", run[key])


def pool_cell(run):
    note, divisor = pool_note(run), run.get("degrade_divisor", 1)
    shown = f"full, ÷\u2009{divisor:.2f}" if note else "fits" if run["page_count"] else ""
    return Cell(shown, divisor, note)


def wrong_cell(run, *keys):
    """Returns the share of pairs of these counts, with the counts over it."""
    wrong = sum(run[key] for key in keys)
    share = 100 * wrong / max(1, run["pair_count"])
    return Cell(number(share, 3), share, Markup("{} of {} pairs").format(grouped(wrong), grouped(run["pair_count"])))


def bytes_of(run):
    return run["dag_bytes"] + run.get("exact_bytes", 0) + run["map_bytes"]


COLUMNS = (  # heading, cell of a run
    ("Run", lambda r: words(cubed(text(label_of(r))))), ("Scene", lambda r: words(r["scene"])),
    ("Frame", lambda r: count(r["frame"])), ("Time, ms", lambda r: decimal(r["time_ms"], 2)),
    ("95 % interval", interval_cell), ("n", lambda r: count(r.get("repeat_count", 1))), ("Time over Embree's", over_embree_cell),
    ("Pool", pool_cell), ("Mean error", lambda r: decimal(r["mean_abs_visibility_error"], 5)),
    ("Wrong pairs, %", lambda r: wrong_cell(r, "false_shadow_count", "false_light_count")),
    ("False shadow, %", lambda r: wrong_cell(r, "false_shadow_count")),
    ("False light, %", lambda r: wrong_cell(r, "false_light_count")),
    ("Unexplained", lambda r: count(unexplained(r))), ("of these aimed", lambda r: count(settled(r))),
    ("Explained, %", lambda r: share_cell(explained_share(r))), ("Null rate, %", lambda r: share_cell(null_rate(r))),
    ("of all pairs", lambda r: share_cell(r.get("null_rate"))),
    ("Magnified", lambda r: count(r["magnified_count"])), ("Acne", lambda r: count(r["acne_count"])), ("Contact", lambda r: count(r["contact_count"])),
    ("RMSE", lambda r: decimal(r["rmse"], 4)), ("FLIP", lambda r: decimal(r["flip"], 4)),
    ("Traced lights", lambda r: count(r["traced_light_count"])), ("Mapped", lambda r: count(r["mapped_light_count"])),
    ("Rays", lambda r: count(r["ray_count"])), ("Pages", lambda r: count(r["page_count"])),
    ("Memory, MiB", lambda r: decimal(bytes_of(r) / MEBI, 2)),
    ("DAG, MiB", lambda r: decimal(r["dag_bytes"] / MEBI, 2)),
    ("Triangles and their hierarchy, MiB", lambda r: decimal(r.get("exact_bytes", 0) / MEBI, 2)),
    ("Pages, MiB", lambda r: decimal(r["map_bytes"] / MEBI, 2)),
)
# The cells that a chart shows beside a point.
FACTS = ("Time, ms", "95 % interval", "Time over Embree's", "Mean error", "Wrong pairs, %", "False shadow, %",
         "False light, %", "Pool", "Memory, MiB")


def finding(name, runs):
    """Returns the data of the sentence about one frame: the pure methods, the fastest hybrid, the pool, what is unexplained."""
    def wrong(run):
        return number(percent(run, "false_shadow_count") + percent(run, "false_light_count"), 2)

    def time(run):
        return f"{cubed(text(label_of(run)))} {run['time_ms']:.1f} ms"
    parts = [f"{time(r)} at {wrong(r)} % wrong pairs"
             for r in runs if r["method"] != "hybrid"]
    fastest = min((r for r in runs if r["method"] == "hybrid"), key=lambda r: r["time_ms"], default=None)
    if fastest is not None:
        parts.append(f"the fastest hybrid ({cubed(text(label_of(fastest)))}) {fastest['time_ms']:.1f} ms at {wrong(fastest)} %")
    full = [r for r in runs if pool_note(r)]
    worst = max(full, key=lambda r: r.get("degrade_divisor", 1), default=None)
    return {"name": name, "methods": "; ".join(parts), "run_count": len(runs), "full_count": len(full),
            "worst": worst and f"{cubed(text(label_of(worst)))}: {pool_note(worst)}",
            "unexplained": sum(map(unexplained, runs)), "settled": sum(map(settled, runs))}


def findings(runs):
    groups = {}
    for run in runs:
        groups.setdefault(f"{text(run['scene'])}, frame {run['frame']}", []).append(run)
    return [finding(name, members) for name, members in groups.items()]


def checked_images(images):
    """Returns the pictures of a run, or of the truth, if they are files of the report."""
    for file in images.values():
        if not file.startswith("images/"):
            raise ValueError(f"the picture {file} is not in images")
    return images


def picture_groups(results):
    """Returns, for each frame that has pictures, the runs shown at once and those folded away."""
    groups = []
    for number_of, truth in enumerate(results["truth_images"]):
        checked_images({"truth": truth["file"]})
        runs = [r | {"note": pool_note(r), "id": row_id(i), "images": checked_images(r["images"])}
                for i, r in enumerate(results["runs"])
                if r["scene"] == truth["scene"] and r["frame"] == truth["frame"] and "images" in r]
        shown = [r for r in runs if r["method"] != "hybrid" or r["model"] in SHOWN_MODELS]
        groups.append({"number": number_of, "truth": truth, "shown": shown,
                       "folded": [r for r in runs if r not in shown]})
    return groups


def scene_rows(scenes):
    line = Markup("{}, hash {}, {} triangles, {} lights, thresholds {}")
    return [[words("scene"), wide(line.format(text(s["scene"]), text(s["scene_hash"]), grouped(s["triangle_count"]),
                                              text(s["light_count"]), ", ".join(map(text, s.get("thresholds", ())))))]
            for s in scenes]


def run_row(index, run, plotted):
    """Returns the cells of a run; the first leads to its point in the chart, if it has one."""
    first, *rest = [cell(run) for _, cell in COLUMNS]
    return [to_point(row_id(index), first) if row_id(index) in plotted else first, *rest]


def content(directory, results, charts):
    """Returns what the template shows."""
    runs, sequence, plots = results["runs"], results.get("sequence_runs", []), compare_plots(results)
    plotted = {point["row"] for plot in plots for point in plot["points"]}
    lights, unlisted = lights_data(directory, results, row_id)
    return {
        "title": results["experiment"]["title"] or "Shadows by rays and by maps: time against error",
        "results": results, "runs": runs, "sequence": sequence, "charts": charts, "findings": findings(runs),
        "equivalent": equivalent_texels(results["experiment"]), "legend_of_names": legend_of_names(runs),
        "left_out": results["provenance"].get("left_out", []),
        "sequence_table": sequence_table(sequence, results.get("sequence_times", ())),
        "headings": [heading for heading, _ in COLUMNS], "rows": [run_row(i, r, plotted) for i, r in enumerate(runs)],
        "row_ids": [row_id(i) for i in range(len(runs))], "facts": FACTS, "plots": plots,
        "pictures": picture_groups(results), "data": {"lights": lights}, "unlisted": unlisted,
        "provenance": key_rows(results["provenance"]) + scene_rows(results["scenes"]) + key_rows(results["experiment"])}


def write(directory, results, charts):
    """Writes index.html. charts: entries of charts.json"""
    write_page(directory, "compare.html.j2", os.path.join(directory, "results.json"), WHAT,
               lambda: content(directory, results, charts))


def run(arguments):
    directory = arguments.directory
    results = read_results(directory, "results.json", WHAT)
    charts, path = [], os.path.join(directory, "results.json")
    if not arguments.no_charts and (results["runs"] or results.get("sequence_runs")):
        if results.get("sequence_runs"):
            from .. import figures as drawing
        else:
            from .. import charts as drawing
        drawing.draw([path], os.path.join(directory, "charts"))
        charts = read_charts(directory)
    write(directory, results, charts)
