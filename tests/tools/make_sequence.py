# SPDX-License-Identifier: Apache-2.0
"""Writes a made-up results.json with frames in sequence: what figures are drawn from in tests, without rendering.

    make_sequence.py COMMIT [VARIANT...] > results.json
"""
import json
import math
import sys

FRAMES = range(0, 301, 20)
VARIANTS = ["Sphere", "CFM", "PMC", "PMCD", "PMCD-EB", "PMCD-EB-SO", "PMCD-EB-SOR", "PMCC-EB", "PMCD-EB-1SM",
            "PMCD-EB-16SM", "PMCD-EB-u2", "PMCD-EB-u4", "PMCD-EB-Nk3", "PMCD-EB-PLOD1", "PMCD-EB-T1", "PMCD-EB-RL", "RT",
            "Hybrid"]
DRAWN = {"Sphere": 1, "CFM": 0.5, "PMC": 0.14, "PMCD": 0.13}


def row(frame, label):
    zoom = frame / 300
    parts = label.split("-")
    sphere = int(8e6 + 4e6 * math.sin(3 * zoom))
    is_rays, is_hybrid = label == "RT", label == "Hybrid"
    drawn = 0 if is_rays else int(sphere * DRAWN.get(label, 0.1) * (0.5 if {"SO", "SOR"} & set(parts) else 1))
    texels = 0 if is_rays else int((6e6 + 9e6 * zoom) * {"1SM": 3, "16SM": 1.2, "u2": 0.3, "u4": 0.1}.get(parts[-1], 1))
    stages = {"batch boxes": 0.6, "batch hierarchy": 0.2, "scene update": 2.2, "g-buffer": 6.0, "clusters": 2.0,
              "light assignment": 1.0, "resolution": 0.4, "routing": 0.2}
    if not is_rays:
        stages |= {"page masks": 1.5, "page commit": 0.5, "page clear": 0.3, "culling masks": 0.5, "culling query": 0.8,
                   "culling tests": 4.0 + zoom, "rasterization": drawn / 5e4}
    stages["shading"] = (20 + 90 * zoom if is_rays else 25 + 20 * zoom) * (0.6 if parts[-1] == "T1" else 1)
    kept = {"SO", "SOR"} & set(parts)
    pages = texels // 4096
    flicker = {}
    for kind, share in (("held", 0), ("resolution_switch", 12), ("method_switch", 5 if is_hybrid and frame % 40 == 0 else 0)):
        flicker |= {f"flicker_{kind}_answer_count": 1000 if share else 80000 if kind == "held" else 0, f"flicker_{kind}_count": share,
                    f"flicker_{kind}_explained_count": share, f"flicker_{kind}_contact_count": 0,
                    f"flicker_{kind}_acne_count": 0}
    return {"scene": "builtin:made-up", "frame": frame, "method": "dag" if is_rays else "hybrid" if is_hybrid else "maps",
            "model": "texels:0", "parameters": {"variant": label}, "label": label, "time_ms": sum(stages.values()),
            "time_ms_min": 1, "time_ms_max": 2, "repeat_count": 3, "stages_ms": stages, "pair_count": 2000000,
            "triangle_draw_count": drawn, "triangle_sphere_count": sphere, "texel_count": texels,
            "pages_committed_count": pages // 8 if kept else pages, "pages_freed_count": pages // 9 if kept else pages,
            "lighting_computation_count": int((4e6 + 4e6 * zoom) * (0.7 if parts[-1] == "Nk3" else 1)),
            "degrade_divisor": 1, "frame_difference_error": 1e-4 * (1 + zoom) if is_rays else 1e-3 * (2 - zoom),
            "flicker_answer_count": 82000,
            "flicker_count": sum(flicker[f"flicker_{k}_count"] for k in ("held", "resolution_switch", "method_switch"))} | flicker


def main():
    variants = sys.argv[2:] or VARIANTS
    json.dump({"provenance": {"commit": sys.argv[1]}, "experiment": {"size": "320x180", "taps": [9]},
               "sequence_runs": [row(frame, label) for frame in FRAMES for label in variants]}, sys.stdout)


if __name__ == "__main__":
    main()
