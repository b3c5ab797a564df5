# SPDX-License-Identifier: Apache-2.0
"""Writes a made-up results.json of plausible shape: what charts are drawn from in tests, without rendering.

    make_results.py COMMIT > results.json
"""
import json
import random
import sys

random.seed(1)
THRESHOLDS = [0, 8, 16, 32, 64, 96, 192, "inf"]
PAIRS = 2_000_000
STAGES = ["g-buffer", "clusters", "light assignment", "resolution", "page masks", "page allocation", "culling",
          "rasterization", "shading"]


def run(frame, method, model, threshold, resolution, time, rays, error):
    parameters = {}
    if method != "maps":
        parameters |= {"resolution": resolution, "offset": 1, "lod": 0}
    if method != "dag":
        parameters |= {"undersample": 1, "page_size": 64, "pool_bytes": 1 << 28, "bias": 1, "taps": 9}
    if threshold is not None:
        parameters["threshold_texels"] = threshold
    stages = {name: 4.0 + i for i, name in enumerate(STAGES[:4])}
    if rays < 1:
        stages |= {"page masks": 6 * (1 - rays), "page allocation": 3 * (1 - rays), "culling": 12 * (1 - rays),
                   "rasterization": 160 * (1 - rays)}
    stages["shading"] = time - sum(stages.values())
    histogram = [0] * 256
    histogram[0], histogram[255] = PAIRS * 2 // 5, PAIRS // 2
    if rays < 1:
        for i in range(1, 255):
            histogram[i] = int(400 * (1 - rays))
    label = method + (f" {model}" if method == "hybrid" else "") + (f" {resolution}^3" if method != "maps" else "")
    return {"scene": "builtin:made-up", "frame": frame, "method": method, "model": model, "parameters": parameters,
            "label": label, "time_ms": time, "time_ms_min": time * 0.96, "time_ms_max": time * 1.09,
            "repeat_count": 5, "stages_ms": stages, "pair_count": PAIRS, "occluded_count": PAIRS * 2 // 5,
            "false_shadow_count": int(PAIRS * error * 0.8), "false_light_count": int(PAIRS * error * 0.2),
            "mean_abs_visibility_error": error * 1.1, "rmse": error, "flip": error, "dag_bytes": 6e6 * (method != "maps"),
            "map_bytes": 9e7 * (1 - rays), "visibility_histogram": histogram}


def main():
    runs, costs = [], []
    for frame in (0, 60):
        for i, threshold in enumerate(THRESHOLDS):
            rays = i / (len(THRESHOLDS) - 1)
            time = 290 + 900 * (rays - 0.35) ** 2
            error = 0.012 + 0.030 * (1 - rays) ** 2
            method = "maps" if threshold == 0 else "dag" if threshold == "inf" else "hybrid"
            runs.append(run(frame, method, f"texels:{threshold}", threshold, 2048, time, rays, error))
        for resolution in (512, 1024):
            runs.append(run(frame, "dag", "texels:inf", "inf", resolution, 500 + resolution / 20, 1.0, 24.6 / resolution))
        runs.append(run(frame, "hybrid", "oracle", None, 2048, 262, 0.5, 0.019))
        for light in range(65):
            texels = 2 ** random.uniform(2, 9.5)
            samples = int(texels ** 1.4 * 2 ** random.uniform(3, 5))
            costs.append({"scene": "builtin:made-up", "frame": frame, "light": light, "texels": texels,
                          "samples": samples, "rays_ms": samples / 4000 * 2 ** random.uniform(-0.5, 0.5),
                          "map_ms": (0.8 + texels ** 1.1 / 180) * 2 ** random.uniform(-0.7, 0.7)})
    json.dump({"provenance": {"commit": sys.argv[1]}, "experiment": {"title": "", "size": "640x360"}, "scenes": [],
               "runs": runs, "map_costs": costs, "truth_images": []}, sys.stdout)


main()
