# SPDX-License-Identifier: Apache-2.0
"""Figures 15 to 17: triangles drawn, texels and lighting computations, and flicker."""
import numpy as np

from ..style import BLUE, COLUMN, GREY, ORANGE, VERMILION, plt
from .lines import (SPHERE, axes_over_frames, base_of, change, draw_lines, draw_panels, engineering, is_detail,
                    legend_above, logarithmic, maps_of, panels_of, percent, spread)


def figure_15(figures, sequence):
    chosen = [l for l in sequence.maps() if not is_detail(sequence.parts(l))]
    if not chosen:
        return "variants that draw maps"
    sphere = sequence.values(chosen[0], "triangle_sphere_count")
    columns = {SPHERE: sphere}
    columns |= {l: sequence.values(l, "triangle_draw_count") for l in chosen if l != "Sphere"}
    figure = draw_panels(sequence, {l: np.where(v > 0, v, np.nan) for l, v in columns.items()}, "triangles drawn",
                         lambda axes: logarithmic(axes, columns.values()))
    claims = []
    for label in ("PMC", "PMCD", "PMCD-EB", "PMCC-EB"):
        if label in columns:
            factor = sphere / np.maximum(columns[label], 1)
            claims.append((f"{label}: fewer triangles than sphere × six faces", "at least 6 times",
                           f"{np.min(factor):.1f} to {np.max(factor):.1f} times", bool(np.min(factor) >= 6)))
    if sequence.has("PMC", "PMCD"):
        claims.append(("maximum depth beyond projection maps", "not as significant",
                       spread(change(sequence, "PMC", "PMCD", "triangle_draw_count"), percent), None))
    if sequence.has("PMCD", "PMCD-EB"):
        cut = -change(sequence, "PMCD", "PMCD-EB", "triangle_draw_count")
        claims.append(("EB: triangles", "8 to 35 % fewer", spread(-cut, percent), bool(np.min(cut) >= 8)))
    for label, name in (("PMCD-EB-SO", "SO"), ("PMCD-EB-SOR", "SO, pages retained")):
        if sequence.has("PMCD-EB", label):
            led = sequence.led()
            peak = 100 * (np.max(columns[label][led]) / max(1, np.max(columns["PMCD-EB"][led])) - 1)
            claims.append((f"{name}: peak triangles after frame 0", "about 40 % fewer", percent(peak), bool(peak <= -40)))
    if sequence.has("PMCD-EB", "PMCD-EB-Nk3"):
        claims.append(("Nk3: triangles", "slightly fewer",
                       spread(change(sequence, "PMCD-EB", "PMCD-EB-Nk3", "triangle_draw_count"), percent), None))
    caption = "Triangles of the (batch, face) pairs that every variant draws; the uppermost line draws every batch in the " \
              "light's sphere into all six faces. The axis is logarithmic; frames without triangles leave a gap."
    figures.save(15, sequence, figure, "Triangles drawn", caption,
                 {f"{l} (triangles)": v for l, v in columns.items()}, claims)


def figure_16(figures, sequence):
    base = base_of(sequence)
    if base is None:
        return "variant PMCD-EB or PMCD"
    last = lambda l: sequence.parts(l)[-1]
    chosen = [l for l in sequence.maps()
              if l == base or (l.startswith(base + "-") and len(sequence.parts(l)) == len(sequence.parts(base)) + 1
                               and (maps_of(last(l)) or last(l)[0] == "u" or last(l).startswith("Nk")))]
    if len(chosen) < 2:
        return f"variants {base} and some of {base}-1SM, {base}-16SM, {base}-u2, {base}-u4"
    count = lambda l: maps_of(last(l)) or (4 if l == base else 100)
    chosen.sort(key=lambda l: (count(l), l))
    texels = {(f"{base}-4SM" if l == base else l): sequence.values(l, "texel_count") for l in chosen}
    computations = {l: sequence.values(l, "lighting_computation_count")
                    for l in chosen if l == base or last(l).startswith("Nk")}
    work = {"computations" + ("" if l == base else f", {last(l)}"): v for l, v in computations.items()}
    by_maps = {l: v for l, v in texels.items() if l == f"{base}-4SM" or maps_of(last(l))}
    others = {l: v for l, v in texels.items() if l not in by_maps}
    panels = [by_maps] + ([{f"{base}-4SM": texels[f"{base}-4SM"]} | others] if others else [])
    panels = [part for lines in panels for part in panels_of(lines | dict(list(work.items())[:1] if lines is by_maps else list(work.items())[1:]),
                                                             f"{base}-4SM")]
    figure, grid = plt.subplots(len(panels), 1, figsize=(COLUMN, 0.3 + 1.75 * len(panels)), sharex=True, sharey=True, squeeze=False)
    for axes, lines in zip(grid[:, 0], panels):
        draw_lines(sequence, axes, lines)
        axes_over_frames(sequence, axes, "texels; computations")
        logarithmic(axes, list(texels.values()) + list(computations.values()))
        legend_above(axes, len(lines), 2)
        if axes is not grid[-1, 0]:
            axes.set_xlabel("")
    claims = []
    peaks = {count(l): np.max(sequence.values(l, "texel_count")) for l in chosen if count(l) <= 16}
    if len(peaks) > 1:
        best = min(peaks, key=peaks.get)
        claims.append(("maps a light with the lowest peak of texels", "4 (above, texels rise again)",
                       f"{best}: " + ", ".join(f"{n}SM {engineering(v)}" for n, v in sorted(peaks.items())), best == 4))
    work = np.maximum(sequence.values(base, "lighting_computation_count"), 1)
    ratio = sequence.values(base, "texel_count") / work
    claims.append(("texels a lighting computation at 4SM", "roughly proportional",
                   f"{np.min(ratio):.2f} to {np.max(ratio):.2f}", bool(np.max(ratio) <= 2.5)))
    divided = sequence.values(base, lambda row: row.get("degrade_divisor", 1))
    claims.append(("frames whose resolutions a full pool divides, at 4SM", "-", f"{int(np.sum(divided > 1))}", None))
    for label in chosen:
        if last(label)[0] == "u":
            mean = 100 * (np.sum(sequence.values(label, "texel_count")) / np.sum(sequence.values(base, "texel_count")) - 1)
            claims.append((f"{last(label)}: texels", "lower peak memory", percent(mean), bool(mean < 0)))
    if sequence.has("PMCD", "PMCD-EB"):
        cut = change(sequence, "PMCD", "PMCD-EB", "texel_count")
        claims.append(("EB: texels", "8 to 35 % fewer", spread(cut, percent), bool(np.max(cut) <= -8)))
    nk = next((l for l in chosen if last(l).startswith("Nk")), None)
    if nk:
        claims.append((f"{last(nk)}: lighting computations", "substantially fewer",
                       spread(change(sequence, base, nk, "lighting_computation_count"), percent), None))
        claims.append((f"{last(nk)}: texels", "slightly fewer", spread(change(sequence, base, nk, "texel_count"), percent),
                       None))
    caption = ("Texels of all pages with memory, by maps a light and by undersampling and culling; on the same logarithmic axis, "
               "lighting computations: samples times lights of their clusters.")
    figures.save(16, sequence, figure, "Texels and lighting computations", caption,
                 {f"{l} (texels)": v for l, v in texels.items()}
                 | {f"{l} (lighting computations)": v for l, v in computations.items()}, claims)


def figure_17(figures, sequence):
    chosen = [l for l in sequence.labels if l != "embree"
              and np.sum(sequence.values(l, "flicker_answer_count")) > 0]
    if not chosen:
        return "flicker points"
    kinds = (("held", BLUE, ""), ("resolution_switch", ORANGE, "////"),
             ("method_switch", VERMILION, "...."))
    sums = {(l, k): np.sum(sequence.values(l, f"flicker_{k}_count")) for l in chosen for k, _, _ in kinds}
    answers = {l: np.sum(sequence.values(l, "flicker_answer_count")) for l in chosen}
    figure, axes = plt.subplots(figsize=(COLUMN, 0.75 + 0.14 * len(chosen)))
    ys, left = np.arange(len(chosen))[::-1], np.zeros(len(chosen))
    for kind, color, hatch in kinds:
        widths = np.array([1e4 * sums[l, kind] / max(1, answers[l]) for l in chosen])
        axes.barh(ys, widths, 0.7, left=left, color=color, hatch=hatch, edgecolor="black", linewidth=0.35,
                  label=kind.replace("_", " "))
        left += widths
    axes.set_yticks(ys)
    axes.set_yticklabels(chosen, fontsize=5.8)
    axes.set_xlabel("answers that flicker (of 10 000 a frame)")
    axes.set_xlim(0, max(1e-3, np.max(left)) * 1.04)
    axes.set_ylim(-0.6, len(chosen) - 0.4)
    for y, width in zip(ys, left):
        if width == 0:
            axes.annotate("0", (0, y), xytext=(3, 0), textcoords="offset points", va="center", fontsize=6)
    axes.grid(axis="y", visible=False)
    legend_above(axes, 3, 3)
    claims = []
    for label in chosen:
        held = sums[label, "held"]
        named = sum(np.sum(sequence.values(label, f"flicker_held_{k}_count")) for k in ("explained", "contact", "acne"))
        named += np.sum(sequence.values(label, lambda row: row.get("flicker_held_magnified_count", 0)))  # older results lack it
        claims.append((f"{label}: flicker at held resolutions", "errors stable and consistent",
                       f"{int(held)} of {int(np.sum(sequence.values(label, 'flicker_held_answer_count')))}, "
                       f"{int(held - named)} unexplained", bool(held == named)))
    caption = ("Of the results followed from each frame to the next, those that change while Embree's do not, over all frames: "
               "with unchanged resolution and method, with a changed resolution, with a changed method. "
               "The paper judged this by eye.")
    figures.save(17, sequence, figure, "Flicker", caption,
                 {f"{l} {k} (answers)": sequence.values(l, f"flicker_{k}_count") for l in chosen for k, _, _ in kinds}, claims)
