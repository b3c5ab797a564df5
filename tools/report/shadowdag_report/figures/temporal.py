# SPDX-License-Identifier: Apache-2.0
"""Figure 18: how differently pictures change from frame to frame, and where hybrids switch methods."""
import numpy as np

from ..style import BLACK, COLUMN, plt
from .lines import axes_over_frames, base_of, draw_lines, legend_above, logarithmic, style
from .sequence import Missing

MOST = 5


def figure_18(figures, sequence):
    hybrids = [l for l in sequence.labels if l.startswith("Hybrid")]
    base = base_of(sequence)
    chosen = list(dict.fromkeys(hybrids + [l for l in ("RT", base, "embree") if l and sequence.has(l)]))[:MOST]
    if all(label == "embree" for label in chosen):
        return "variants to compare"
    frames = [f for f in sequence.frames if all(sequence.rows[l, f].get("frame_difference_error") is not None for l in chosen)]
    if not frames:
        raise Missing(f'"frame_difference_error" of {chosen[0]}')
    part = sequence.over(frames)
    columns = {l: 100 * part.values(l, "frame_difference_error") for l in chosen}
    switched = {l: part.values(l, lambda row: row.get("flicker_method_switch_answer_count", 0)) > 0 for l in chosen}
    figure, axes = plt.subplots(figsize=(COLUMN, 2.4))
    draw_lines(part, axes, {l: np.where(v > 0, v, np.nan) for l, v in columns.items()})
    for i, label in enumerate(chosen):
        ringed = switched[label] & (columns[label] > 0)
        if ringed.any():
            axes.plot(np.array(frames)[ringed], columns[label][ringed], linestyle="none", marker="o", markersize=6.5, markerfacecolor="none",
                      markeredgecolor=style(label, i)["color"], markeredgewidth=0.6, zorder=4)
    axes.plot([], [], linestyle="none", marker="o", markersize=6.5, markerfacecolor="none", markeredgecolor=BLACK, markeredgewidth=0.6,
              label="a method switched")
    axes_over_frames(part, axes, "error of frame differences (%)")
    logarithmic(axes, columns.values())
    legend_above(axes, len(chosen) + 1)
    claims = []
    changed = np.max(list(columns.values()), axis=0) > 0  # not a frame that is led by itself
    for label in hybrids:
        without = ~switched[label] & changed if label in columns else changed
        if label in columns and switched[label].any() and without.any():
            at, other = np.mean(columns[label][switched[label]]), np.mean(columns[label][without])
            claims.append((f"{label}: frames with a switch against those without", "-", f"{at:.4f} % against {other:.4f} %", None))
    caption = ("The mean over pixels and channels of how differently a picture and the truth's change from the frame before, at one "
               "exposure; an error that stays gives none. Rings: frames in which answers changed between rays and maps. Frames without any "
               "difference leave a gap.")
    figures.save(18, part, figure, "Error of frame differences", caption, {f"{l} (%)": v for l, v in columns.items()}, claims)
