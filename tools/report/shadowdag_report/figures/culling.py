# SPDX-License-Identifier: Apache-2.0
"""Figures 13 and 14: steps of culling, and shading."""
import numpy as np

from ..style import COLUMN, ORANGE, plt
from .lines import axes_over_frames, base_of, draw_lines, legend_above, percent, spread
from .sequence import CULLING_STEPS


def figure_13(figures, sequence):
    base = base_of(sequence)
    if base is None:
        return "variant PMCD-EB or PMCD"
    measured = sequence.names([base])
    if not any(n.startswith("culling") for n in measured):
        return f"maps drawn by {base}"
    names = [n for n in CULLING_STEPS if n in measured]
    steps = {n: sequence.values(base, lambda row: row["stages_ms"].get(n, 0)) for n in names}
    total = np.maximum(sum(steps.values()), 1e-12)
    share = {n: 100 * np.max(v / total) for n, v in steps.items()}
    mean = {n: 100 * np.sum(v) / np.sum(total) for n, v in steps.items()}
    longest = {n: np.max(v) for n, v in steps.items()}
    figure, axes = plt.subplots(figsize=(COLUMN, 0.6 + 0.2 * len(names)))
    ys = np.arange(len(names))[::-1]
    axes.barh(ys, [share[n] for n in names], 0.66, color=ORANGE, edgecolor="black", linewidth=0.4,
              label="largest in any frame")
    axes.plot([mean[n] for n in names], ys, linestyle="none", marker="D", color="black", markersize=2.8, clip_on=False,
              label="over all frames")
    for y, n in zip(ys, names):
        inside = share[n] > 50
        axes.annotate(f"{share[n]:.1f} %, {longest[n]:.2f} ms", (0 if inside else share[n], y),
                      xytext=(4 if inside else 6, 0), textcoords="offset points", va="center", fontsize=6)
    axes.set_yticks(ys)
    axes.set_yticklabels([CULLING_STEPS[n] for n in names])
    axes.set_xlim(0, 100)
    axes.set_ylim(-0.6, len(names) - 0.4)
    axes.set_xlabel("share of the time of culling (%)")
    axes.grid(axis="y", visible=False)
    axes.legend(loc="lower left", bbox_to_anchor=(-0.3, 1.0), ncol=2, borderaxespad=0.2, fontsize=6)
    update = [n for n in names if n in ("batch boxes", "batch hierarchy")]
    largest = max(mean, key=mean.get)
    claims = [("largest cost of culling", "boxes and hierarchy, rebuilt whole", CULLING_STEPS[largest],
               (largest in update) if update else None)]
    claims.append(("boxes and hierarchy, largest share", "49 % (of its largest step)",
                   f"{100 * np.max(sum(steps[n] for n in update) / total):.1f} %" if update else "not measured", None))
    claims.append(("required resolution, largest share", "a very small part", f"{share['resolution']:.1f} %",
                   bool(share["resolution"] < 10)))
    ladder = [l for l in ("Sphere", "CFM", "PMC", "PMCD", "PMCC") if sequence.has(l)]
    for a, b in zip(ladder, ladder[1:]):
        claims.append((f"culling of {b} beyond {a}", "very small cost" if b == "PMCD" else "-",
                       f"{np.mean(sequence.stage(b, 'culling') - sequence.stage(a, 'culling')):+.2f} ms per frame", None))
    caption = (f"{base}: each step's share of the sum of these steps, with its longest time. Boxes and hierarchy are updated "
               "only for moving batches; blocks contain depths if culling uses more than one per face; the query finds the batches "
               "in the light's sphere; the tests compare each of them with face mask, projection map and depths.")
    figures.save(13, sequence, figure, "Steps of culling", caption,
                 {f"{CULLING_STEPS[n]} (ms)": v for n, v in steps.items()}, claims)


def figure_14(figures, sequence):
    base = base_of(sequence)
    if base is None:
        return "variant PMCD-EB or PMCD"
    chosen = [l for l in sequence.maps() if l == base or (l.startswith(base + "-") and sequence.parts(l)[-1]
              and (sequence.parts(l)[-1][0] == "T" or sequence.parts(l)[-1] in ("RL", "Nk3")
                   or sequence.parts(l)[-1].startswith("Nk")))]
    if len(chosen) < 2:
        return f"variants {base} and some of {base}-T1, {base}-Nk3, {base}-RL"
    columns = {l: sequence.stage(l, "shading") for l in chosen}
    figure, axes = plt.subplots(figsize=(COLUMN, 2.2))
    draw_lines(sequence, axes, columns)
    axes_over_frames(sequence, axes, "shading (ms)")
    axes.set_ylim(bottom=0)
    legend_above(axes, len(columns), 2)
    claims = []
    whole = sequence.values(base, "time_ms")
    taps = {1: "one", 4: "four", 9: "nine"}.get(figures.experiment.get("taps", [0])[0], "several")
    one = f"{base}-T1"
    if one in columns:
        part = 100 * np.sum(columns[base] - columns[one]) / np.sum(whole)
        claims.append((f"{taps} taps instead of one, share of the frame", "a sizeable proportion", f"{part:.0f} %",
                       bool(part > 10)))
    for label, text, paper in ((f"{base}-Nk3", "Nk3: shading time", "less in parts, more with many maps"),
                               (f"{base}-RL", "reordered light lists: shading time", "some improvement")):
        if label in columns:
            difference = 100 * (columns[label] / np.maximum(columns[base], 1e-12) - 1)
            claims.append((text, paper, spread(difference, percent),
                           bool(np.mean(difference) < 0) if label.endswith("RL") else None))
    caption = f"Time of the shading pass alone: lookups with {taps} taps ({base}) and one (T1), by normal clusters (Nk3), with reordered " \
              "light lists (RL)."
    figures.save(14, sequence, figure, "Shading", caption, {f"{l} (ms)": v for l, v in columns.items()}, claims)
