# SPDX-License-Identifier: Apache-2.0
"""Makes reports of committed results with made-up pictures and lights, for the tests of pages."""
import copy
import json
import pathlib
import struct
import subprocess
import sys
import zlib

HOSTILE = "</script><script>window.hit=1</script><img src=x onerror=window.hit=1> \"'`${x}{{y}} &amp; 100^3"


def png(color, width=32, height=18):
    """Returns a picture of one colour with a corner of another, so that zoom and pan are seen."""
    rows = b"".join(b"\0" + b"".join(bytes(color if x > 4 or y > 4 else (255, 255, 255)) for x in range(width))
                    for y in range(height))

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def run_package(source, *arguments):
    """Runs the reports' package; ends the test when it fails."""
    done = subprocess.run(["/usr/bin/python3", str(source / "tools/report/shadowdag_report"), *map(str, arguments)],
                          capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{arguments[0]} ended with {done.returncode}: {done.stdout}{done.stderr}")


def committed(source, name):
    return json.loads((source / "tests/bench/results" / name).read_text())


def two_frames(results):
    """Returns results with a second frame of the first four runs, without pictures."""
    results = copy.deepcopy(results)
    results["runs"] += [{key: value for key, value in run.items() if key != "images"}
                        | {"frame": 60, "time_ms": run["time_ms"] + 1} for run in results["runs"][:4]]
    return results


def write_compare(source, directory, results, light_count=5):
    """Writes a report of compare with pictures and lights of all runs that have pictures."""
    directory = pathlib.Path(directory)
    (directory / "images").mkdir(parents=True)
    lines = ["scene,frame,label,light,map_count,drawn_map_count,route,texels,face_texels,pages,pair_count,"
             "occluded_count,false_shadow_count,false_light_count,mean_abs_visibility_error"]

    def quoted(text):
        return '"' + text.replace('"', '""') + '"'
    for number, run in enumerate(results["runs"]):
        if "images" not in run:
            continue
        run["images"] = {kind: f"images/r{number}_{kind}.png" for kind in ("color", "error", "method")}
        colors = {"color": (90, 10 * number % 250, 60), "error": (213, 94, 0), "method": (86, 180, 233)}
        for kind, color in colors.items():
            (directory / run["images"][kind]).write_bytes(png(color))
        lines += [f"{quoted(run['scene'])},{run['frame']},{quoted(run['label'])},{light},1,1,map,{100.5 + light},128,"
                  f"{light * 3},{1000 + light},400,{light},{2 * light},0.0{light}" for light in range(light_count)]
    for truth in results["truth_images"]:
        truth["file"] = "images/truth.png"
        # Of the last light no place is known: it is behind the camera.
        truth["lights"] = [{"light": light, "x": 64.0 * (light + 1), "y": 36.0 * (light + 1)}
                           for light in range(light_count - 1)]
    (directory / "images/truth.png").write_bytes(png((40, 40, 200)))
    (directory / "lights.csv").write_text("\n".join(lines) + "\n")
    (directory / "results.json").write_text(json.dumps(results))
    run_package(source, "compare", directory, "--no-charts")
    return directory / "index.html"


def made_fit(label="dag 64^3", metric="false", minimise="bytes"):
    """Returns a result of fit: two models that keep the bound, one that breaks it, one that is ruled out."""
    def model(name, status, error, size, **more):
        return {"label": name, "method": "maps" if "maps" in name else "dag", "model": "texels:inf", "parameters": {},
                "status": status, "error": error, "is_complete": True, "bytes": size, "dag_bytes": size, "map_bytes": 0,
                "pair_count": 1000, "false_shadow_count": int(1000 * error), "false_light_count": 0,
                "mean_abs_visibility_error": error, "flip": error, "frames": [],
                "first_frame_time_ms": size / 1e5, **more}
    models = [model(label, "chosen", 0.01, 300000, time_ms=3.5, time_ms_standard_error=0.1),
              model("dag 128^3", "dominated", 0.0, 900000, by=label, reason="keeps the bound, costs more"),
              model("maps", "refuted", 0.08, 200000, reason="breaks the bound"),
              {"label": "dag 256^3", "method": "dag", "model": "texels:inf", "parameters": {}, "status": "ruled out",
               "rule": "known cost", "by": label, "reason": "its voxels alone are at least as large as the choice",
               "least_bytes": 2000000}]
    return {"provenance": {"commit": "c"}, "sweep": {"scenes": ["builtin:made-up"]}, "metric": metric, "bound": 0.02,
            "minimise": minimise, "scenes": [], "frame_count": 1, "model_count": 4, "measured_count": 3,
            "measured_in_all_frames_count": 3,
            "status_counts": {"chosen": 1, "dominated": 1, "refuted": 1, "known cost": 1}, "chosen": models[0],
            "laws": [{"models": "dag", "law": "finer costs no less", "axes": ["resolution"], "slack": 0.1,
                      "checked_pair_count": 1, "violation_count": 0, "worst_violation": 0, "is_given_up": False}],
            "neighbours": [models[1] | {"differs_in": "resolution", "error_over_bound": 0.0, "cost_over_choice": 3.0}],
            "least_error": models[1], "models": models}


def made_diff(name="builtin:atrium, frame 0, maps"):
    """Returns a difference as `shadowdag diff` writes it."""
    def change(key, a, b, verdict, **more):
        return {"list": "runs", "row": name, "key": key, "a": a, "b": b, "verdict": verdict, **more}
    return {"a": "a.json", "b": "b.json", "differences": ["commit was 1 and is 2"], "row_count": 20, "value_count": 900,
            "changes": [change("time_ms", 100.0, 80.0, "better", a_interval=[95.0, 104.0], b_interval=[78.0, 83.0]),
                        change("false_shadow_count", 10, 15, "worse"), change("acne_count", 0, 4, "worse"),
                        change("believes", "all", "none", "changed"), change("page_count", 50, 60, "changed")],
            "only_in_a": [{"list": "runs", "row": name}], "only_in_b": [],
            "values_only_in_a": [{"list": "runs", "row": name, "key": "flip"}], "lost_value_count": 1, "worse_count": 2, "better_count": 1,
            "changed_count": 2, "uncertain_count": 0, "lost_row_count": 1}
