# SPDX-License-Identifier: Apache-2.0
"""Frames in sequence as a table: one line per scene and configuration, over its frames."""
from .page import count, decimal, text, words

HEADINGS = ("Run", "Scene", "Frames", "Mean time, ms", "Worst frame", "its time, ms", "Peak triangles", "Peak texels",
            "Wrong pairs, %", "Flicker, %")


def sequence_table(rows):
    """Returns (headings, cells) of sequence_runs."""
    groups = {}
    for row in rows:
        groups.setdefault((text(row["label"]), text(row["scene"])), []).append(row)
    lines = []
    for (label, scene), members in groups.items():
        def total(key):
            return sum(row[key] for row in members)
        worst = max(members, key=lambda row: row["time_ms"])
        lines.append([words(label), words(scene), count(len(members)), decimal(total("time_ms") / len(members), 2),
                      count(worst["frame"]), decimal(worst["time_ms"], 2),
                      count(max(row["triangle_draw_count"] for row in members)),
                      count(max(row["texel_count"] for row in members)),
                      decimal(100 * (total("false_shadow_count") + total("false_light_count"))
                              / max(1, total("pair_count")), 3),
                      decimal(100 * total("flicker_count") / max(1, total("flicker_answer_count")), 4)])
    return HEADINGS, lines
