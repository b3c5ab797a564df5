# SPDX-License-Identifier: Apache-2.0
"""The table of animations in docs/results.md, from animations.json (`shadowdag compare --experiment
scenes/experiments/animations.json`): times over all frames and rounds, and the time over Embree's frame by frame. The command
claims writes it."""
import statistics

from .intervals import CONFIDENCE, LEAST_ROUNDS, interval_text, median_interval, paired_ratios

BEGIN, END = "<!-- animations:begin -->", "<!-- animations:end -->"
RATIO = "time_over_embree"
NAMES = {"embree": "Embree's frame", "dag believe none": "exact rays", "dag 4096^3 believe all": "voxel rays"}


def ratio_of(times, rows):
    """Returns the median over frames and rounds of the time over Embree's of the same frame and round, with its interval, as
    results state it; of older ones, which do not, it is computed from their rounds. None without Embree in every frame.

    times: a row of sequence_times; rows: sequence_runs
    """
    if RATIO in times:
        return {key: times[key] for key in times if key.startswith(RATIO)}
    of_scene = [row for row in rows if row["scene"] == times["scene"]]
    embree = {row["frame"]: row for row in reversed(of_scene) if row["method"] == "embree"}  # of two the first
    ratios = sorted(ratio for row in of_scene if row["label"] == times["label"] and row["frame"] in embree
                    for ratio in paired_ratios(row, embree[row["frame"]]))
    if len(ratios) != times["value_count"]:
        return None
    low, high = median_interval(ratios)
    held = CONFIDENCE if len(ratios) >= LEAST_ROUNDS else 1 - 2.0 ** (1 - len(ratios))
    return {RATIO: statistics.median(ratios), f"{RATIO}_low": low, f"{RATIO}_high": high, f"{RATIO}_confidence": held}


def adjudicated(rows):
    """Returns what the adjudicator says of the wrong pairs of a configuration's frames; "–" where it was not asked."""
    if not all("adjudicated_count" in row for row in rows):
        return "–"
    asked, ambiguous, proven = (sum(row[key] for row in rows) for key in ("adjudicated_count", "ambiguous_count", "proven_wrong_count"))
    return "{}, {} of {}".format(*(f"{count:,}".replace(",", " ") for count in (ambiguous, proven, asked))) if asked else "none"


def table(results):
    """Returns everything between the markers: one row for each scene and configuration."""
    lines = ["", "| scene | run | mean, ms | 99th percentile | over Embree's of the same frame and round, median (95 % interval) | n "
             "| wrong pairs | of those that triangles decided: ambiguous, proven wrong |", "|---|---|---:|---:|---:|---:|---:|---|"]
    for times in results["sequence_times"]:
        rows = [row for row in results["sequence_runs"] if (row["scene"], row["label"]) == (times["scene"], times["label"])]
        wrong = sum(row["false_shadow_count"] + row["false_light_count"] for row in rows)
        ratio = ratio_of(times, results["sequence_runs"])
        lines.append("| {} | {} | {:.0f} | {time_ms_p99:.0f} ({time_ms_p99_low:.0f} to {time_ms_p99_high:.0f}) | {} | {} | {} of {:.0f} M | {} |".format(
            times["scene"].removeprefix("builtin:"), NAMES.get(times["label"], times["label"]), times["time_ms_mean"],
            interval_text(ratio, RATIO, 2) if ratio else "–", times["value_count"], f"{wrong:,}".replace(",", " "),
            sum(row["pair_count"] for row in rows) / 1e6, adjudicated(rows), **times))
    return "\n".join(lines) + "\n"
