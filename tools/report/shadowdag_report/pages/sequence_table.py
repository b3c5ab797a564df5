# SPDX-License-Identifier: Apache-2.0
"""Frames in sequence as a table: one line per scene and configuration, over its frames."""
from ..intervals import CONFIDENCE, confidence_text
from .page import Cell, count, decimal, text, words

HEADINGS = ("Run", "Scene", "Frames", "Median time, ms", "95 % interval", "99th percentile, ms", "its interval", "n",
            "Over Embree's, same frame and round", "its interval",
            "Slowest frame", "its time, ms", "Peak triangles", "Peak texels", "Wrong pairs, %", "Flicker, %",
            "Difference error")


def interval_cell(times, key):
    """Returns the interval of a quantile, with its confidence where the values were too few for 95 %; nothing where it is unknown."""
    if f"{key}_low" not in times:
        return words("")
    low, high, confidence = (times[f"{key}_{end}"] for end in ("low", "high", "confidence"))
    short = "" if confidence >= CONFIDENCE else f" ({confidence_text(confidence)})"
    return Cell(f"{low:.2f} to {high:.2f}{short}", low)


def sequence_table(rows, summaries=()):
    """Returns (headings, cells) of sequence_runs. summaries: sequence_times, absent in older results"""
    groups, by_name = {}, {(text(times["label"]), text(times["scene"])): times for times in summaries}
    for row in rows:
        groups.setdefault((text(row["label"]), text(row["scene"])), []).append(row)
    lines = []
    for (label, scene), members in groups.items():
        def total(key):
            return sum(row[key] for row in members)
        worst = max(members, key=lambda row: row["time_ms"])
        ordered = sorted(row["time_ms"] for row in members)
        half = len(ordered) // 2
        times = by_name.get((label, scene), {})
        differences = [row["frame_difference_error"] for row in members if row.get("frame_difference_error") is not None]
        lines.append([words(label), words(scene), count(len(members)),
                      decimal(times.get("time_ms", 0.5 * (ordered[half] + ordered[-half - 1])), 2), interval_cell(times, "time_ms"),
                      decimal(times["time_ms_p99"], 2) if times else words(""), interval_cell(times, "time_ms_p99"),
                      count(times.get("value_count", len(members))),
                      decimal(times["time_over_embree"], 3) if "time_over_embree" in times else words(""),
                      interval_cell(times, "time_over_embree"),
                      count(worst["frame"]), decimal(worst["time_ms"], 2),
                      count(max(row["triangle_draw_count"] for row in members)),
                      count(max(row["texel_count"] for row in members)),
                      decimal(100 * (total("false_shadow_count") + total("false_light_count"))
                              / max(1, total("pair_count")), 3),
                      decimal(100 * total("flicker_count") / max(1, total("flicker_answer_count")), 4),
                      decimal(sum(differences) / len(differences), 5) if differences else words("")])
    return HEADINGS, lines
