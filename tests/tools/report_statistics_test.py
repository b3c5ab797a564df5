# SPDX-License-Identifier: Apache-2.0
"""The statistics of the reports' package against values computed by hand, and the stamps of charts.

    report_statistics_test.py SOURCE_DIR
"""
import json
import os
import pathlib
import shutil
import sys
import tempfile

SOURCE = pathlib.Path(sys.argv[1])
sys.path.insert(0, str(SOURCE / "tools/report"))
sys.dont_write_bytecode = True

from shadowdag_report import adjudicated, animations, claims, collection, committed, device, explained, intervals, mutation, series, stamp  # noqa: E402
from shadowdag_report.charts import regret_analysis  # noqa: E402
from shadowdag_report.charts.speed_accuracy import pure_run, rings_sentence  # noqa: E402
from shadowdag_report.figures import lines, sequence  # noqa: E402
from shadowdag_report.pages import sequence_table  # noqa: E402


def equal(is_, should_be):
    if is_ != should_be:
        sys.exit(f"{is_!r} instead of {should_be!r}")


def test_kernels_of_a_device():
    for name, short in (("void a::<unnamed>::shadeKernel<4>(a::ShadeSamples)", "shade<4>"),
                        ("void a::parallelForKernel<a::CudaTag, a::b::Mark>(unsigned long, T2)", "Mark"),
                        ("void a::sharePartsKernel<a::CudaTag, a::Draw>(a::SplitWorkView, T2)", "Draw"),
                        ("void scan::DeviceScanKernel<scan::hub<int, plus<void>>::P, int *, S<int, (bool)1>>(T2)", "DeviceScan"),
                        ("void a::demandKernel<a::Maps>(T1)", "demand<Maps>"), ("clear", "clear")):
        equal(device.kernel_name(name), short)
    row = {"launches": 1, "memory_percent": 40.2, "occupancy_percent": 45.6, "active_lanes": 26.3}
    kernels = [row | {"kernel": f"k{i}", "us": 10.0 - i} for i in range(4)]
    equal(device.kernels_table([{"scene": "s", "method": "maps", "kernels": kernels}], 2)[2:],
          ["| s | maps | `k0` | 1 | 10 | 40 | 46 | 26.3 |", "| s | maps | `k1` | 1 | 9 | 40 | 46 | 26.3 |",
           "| s | maps | 2 others | 2 | 15 | | | |"])


def test_sanitizers_of_a_device():
    steps = [{"step": "memcheck a", "ok": True, "note": "4 passed, 0 skipped"}, {"step": "parity a", "ok": True, "note": ""},
             {"step": "racecheck a", "ok": False, "note": "compute-sanitizer took more than 9 s"},
             {"step": "initcheck a", "ok": False, "note": "0 of 2 failed, status 99; ERROR SUMMARY: 1945 errors"},
             {"step": "synccheck b", "ok": False, "note": "1 of 2 failed"}]
    equal(device.sanitizers_table(steps)[2:], ["| `a` | none, 4 passed | no time | 1,945 |  |", "| `b` |  |  |  | failed |"])


def test_intervals():
    new = {"time_ms": 5.5, "time_ms_low": 2, "time_ms_high": 9, "time_ms_confidence": 0.978, "repeat_count": 10}
    equal(intervals.interval(new), (2, 9, 0.978))
    equal(intervals.half_widths(new), (3.5, 3.5))
    equal(intervals.interval_text(new, decimals=1), "5.5 (2.0 to 9.0)")
    # Older results: the least and the greatest of n hold the median with 1 - 2^(1 - n).
    for count, text in ((6, "5 (1 to 8)"), (5, "5 (1 to 8, 93 %)"), (2, "5 (1 to 8, 50 %)"), (1, "5 (1 to 8, 0 %)")):
        old = {"time_ms": 5, "time_ms_min": 1, "time_ms_max": 8, "repeat_count": count}
        equal(intervals.interval(old), (1, 8, 1 - 2.0 ** (1 - count)))
        equal(intervals.interval_text(old), text)
    equal(intervals.interval({"time_ms": 5}), (5, 5, 0.0))
    equal(intervals.least_confidence([new, {"time_ms": 5}]), 0.0)
    apart = {"time_ms": 12, "time_ms_low": 9.5, "time_ms_high": 13}
    equal((intervals.are_apart(new, apart), intervals.are_apart(new, new)), (True, False))
    # Twice as long to four times: the ends of a ratio of intervals.
    base = {"time_ms": 4, "time_ms_low": 3, "time_ms_high": 5}
    equal(regret_analysis.ratio_interval({"time_ms": 12, "time_ms_low": 10, "time_ms_high": 15}, base), (1.0, 4.0))
    # Of ten paired rounds, whose noise both times share, the second and the ninth ratio hold the median with 97.9 %.
    slow = [2.0, 4.0, 8.0, 16.0, 2.0, 4.0, 8.0, 16.0, 2.0, 4.0]
    factors = [1.0, 1.5, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.5, 3.0]
    run = {"time_ms": 5, "round_times_ms": [a * b for a, b in zip(slow, factors)]}
    equal(regret_analysis.ratio_interval(run, {"time_ms": 4, "round_times_ms": slow}), (0.5, 1.5))
    equal(regret_analysis.regret_of(run, {"time_ms": 4, "round_times_ms": slow}), 1.0)
    equal(regret_analysis.regret_of({"time_ms": 5}, {"time_ms": 4}), 0.25)
    few = {"time_ms": 5, "round_times_ms": [2.0, 6.0, 4.0]}
    equal(regret_analysis.ratio_interval(few, {"time_ms": 1, "round_times_ms": [2.0, 2.0, 2.0]}), (0.0, 2.0))


def test_faster_in_the_same_rounds():
    noise = [1.0, 3.0, 2.0, 5.0, 1.0, 4.0]
    run = lambda factor: {"time_ms": factor, "time_ms_low": 0.0, "time_ms_high": 9.0, "round_times_ms": [factor * n for n in noise]}
    equal(series.is_faster(run(0.96), run(1.0)), True)  # in every round, however much these differ
    equal(series.is_faster(run(0.98), run(1.0)), False)  # by less than 3 %
    mixed = run(0.5) | {"round_times_ms": [0.5 * n for n in noise[:-1]] + [5.0]}
    equal(series.is_faster(mixed, run(1.0)), False)
    few = run(0.96) | {"round_times_ms": [0.5] * 5}
    equal(series.is_faster(few, run(1.0) | {"round_times_ms": [1.0] * 5}), False)  # by the intervals


def test_explained():
    row = {"false_shadow_count": 70, "false_light_count": 30, "unexplained_false_shadow_count": 4, "unexplained_false_light_count": 1,
           "acne_count": 10, "contact_count": 4, "magnified_count": 1, "null_rate": 0.125}
    equal(explained.explained_share(row), 0.8)
    equal(explained.null_text(row), "– (12.5 %)")
    equal(explained.null_text(row | {"outline_null_rate": 0.75, "outline_null_sample_count": 8}), "75.0 % (12.5 %)")
    equal(explained.null_rate(row | {"outline_null_rate": 0.0, "outline_null_sample_count": 0}), None)
    equal(explained.share_text(explained.explained_share(row | {"false_shadow_count": 0, "false_light_count": 0})), "–")


def test_committed_checks_have_the_rate_near_outlines():
    paths = sorted((SOURCE / "tests/bench/results").glob("validate-*.json"))
    equal(len(paths), 15)
    equal([path.name for path in paths if explained.null_rate(json.loads(path.read_text())) is None], [])
    header, _, *rows = [line for line in claims.validate_table(paths) if line.startswith("|")]
    column = header.split(" | ").index("null rate")
    equal([row for row in rows if row.split(" | ")[column].startswith("–")], [])


def test_commands_name_the_scenes_that_experiments_leave_open():
    of, run = SOURCE / "scenes/experiments", "shadowdag compare --experiment scenes/experiments/"
    equal(claims.compare_command(of / "atrium.json", "builtin:atrium"), run + "atrium.json -o report")
    equal(claims.compare_command(of / "beams.json", "builtin:houses"), run + "beams.json builtin:houses -o report")


def test_hidden_errors():
    """Of 20 wrong pairs more, 11 are explained; fewer than none is none, and a fault without any has no share."""
    def fault(*excess):
        return {"name": "f", "what": "", "harmless": "", "ended": "", "notices": [],
                "excess": [{"row": "a", "wrong_count": w, "explained_count": e} for w, e in excess]}
    equal([mutation.hidden_share(fault(*x)) for x in (((15, 10), (5, 1)), ((5, -1),), ())], [0.55, 0.0, None])
    equal([cells[-2:] for cells in mutation.rows({"mutants": [fault((2000, 1101)), fault()]})], [("2 000", "55"), ("–", "–")])
    equal(mutation.power_text({"mutants": [fault((10, 5))]}).split(". ")[1],
          "Of none, more than half of these pairs count as explained, so there the class says little.")
    equal(mutation.power_text({"mutants": [fault((10, 6)), fault()]}).endswith("so there the class says little: `f`."), True)


def test_disputed_pairs():
    """The sum of the frames that are the same: as many pairs, and as many of them wrong."""
    def verdict(scene, frame, count, ambiguous, truth, exact):
        return {"scene": scene, "disputed": {"frame_pair_count": frame, "count": count, "ambiguous_count": ambiguous,
                                             "truth_right_count": truth, "exact_right_count": exact}}
    verdicts = [verdict("a", 1000, 5, 2, 2, 1), verdict("b", 2000, 1, 1, 0, 0), verdict("c", 500, 0, 0, 0, 0)]
    results = {"verdicts": verdicts, "study": {"disputed_size": "64x36"}}
    equal(adjudicated.dispute_text(results),
          "In whole frames of 64 x 36 truth and exact packets differ in 6 of 3 500 pairs. Of these 3 are ambiguous; in 2 the truth is "
          "right, in 1 the exact packets.")
    equal([row[0] for row in adjudicated.dispute_rows(results)], ["a", "b"])
    equal(adjudicated.skipped_text({"skipped": []}), "")
    equal(adjudicated.skipped_text({"skipped": [{"scene": "x", "reason": "none"}]}), " Skipped: x, none.")

    def run(scene, pairs, wrong):
        return {"scene": scene, "pair_count": pairs, "false_shadow_count": wrong, "false_light_count": 0}
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        equal(claims.adjudicated_text([run("builtin:a", 1000, 5)], folder), "")
        (folder / "adjudication_x.json").write_text(json.dumps(results))
        equal(claims.adjudicated_text([run("builtin:a", 1000, 5), run("b.glb", 2000, 1), run("c.glb", 500, 0)], folder),
              " The [adjudicator](adjudicator.md#results) was asked about 6 of these pairs: 3 are ambiguous; in 2 the truth is right, in 1 "
              "exact rays are.")
        equal(claims.adjudicated_text([run("builtin:a", 999, 5), run("b.glb", 2000, 2), run("d.glb", 1, 1)], folder), "")


def test_panels():
    """Seven lines beside their base: five a panel, the base in each."""
    names = ["base"] + [str(i) for i in range(7)]
    panels = lines.panels_of(dict.fromkeys(names, 0), "base")
    equal([list(p) for p in panels], [["base", "0", "1", "2", "3"], ["base", "4", "5", "6"]])
    equal(lines.gap_of([0, 1, 2]), 1)
    equal(lines.gap_of([0, 100, 150]), 50)
    equal(lines.gap_of([7]), 1)


def test_sequences():
    rows = [{"label": "a", "scene": "s", "frame": f, "time_ms": t, "triangle_draw_count": 1, "texel_count": 2, "pair_count": 100,
             "false_shadow_count": 1, "false_light_count": 0, "flicker_count": 0, "flicker_answer_count": 1} for f, t in enumerate((3, 9, 5, 4))]
    rows[1]["frame_difference_error"], rows[2]["frame_difference_error"] = 0.25, 0.75
    times = {"label": "a", "scene": "s", "value_count": 8, "time_ms": 4.25, "time_ms_low": 3, "time_ms_high": 9, "time_ms_confidence": 0.99,
             "time_ms_p99": 9, "time_ms_p99_low": 5, "time_ms_p99_high": 9, "time_ms_p99_confidence": 0.077}
    shown = [[cell.shown for cell in sequence_table.sequence_table(rows, summaries)[1][0]] for summaries in ((), (times,))]
    equal([str(s) for s in shown[0]], ["a", "s", "4", "4.50", "", "", "", "4", "", "", "1", "9.00", "1", "2", "1.000", "0.0000", "0.50000"])
    equal([str(s) for s in shown[1][3:8]], ["4.25", "3.00 to 9.00", "9.00", "5.00 to 9.00 (7 %)", "8"])
    equal(len(sequence_table.HEADINGS), len(shown[0]))
    ratio = times | {"time_over_embree": 0.5, "time_over_embree_low": 0.25, "time_over_embree_high": 0.75, "time_over_embree_confidence": 0.96}
    equal([str(cell.shown) for cell in sequence_table.sequence_table(rows, (ratio,))[1][0]][8:10], ["0.500", "0.25 to 0.75"])


def test_animations():
    """Ratios to Embree's frame are of the same frame and round; results that state them are read, of others they are computed."""
    def row(label, frame, *rounds):
        return {"scene": "builtin:a", "label": label, "method": label, "frame": frame, "round_times_ms": list(rounds), "pair_count": 10**6,
                "false_shadow_count": 1, "false_light_count": 2}
    rows = [row("embree", 0, 1, 2), row("maps", 0, 2, 4), row("embree", 1, 10, 20), row("maps", 1, 20, 60)]
    times = {"scene": "builtin:a", "label": "maps", "value_count": 4, "time_ms_mean": 21, "time_ms_p99": 60, "time_ms_p99_low": 4,
             "time_ms_p99_high": 60}
    equal(animations.ratio_of(times, rows), {"time_over_embree": 2, "time_over_embree_low": 2, "time_over_embree_high": 3,
                                             "time_over_embree_confidence": 0.875})
    equal(animations.ratio_of(times, rows[1:]), None)
    stated = {"time_over_embree": 1.5, "time_over_embree_low": 1, "time_over_embree_high": 2, "time_over_embree_confidence": 0.95}
    equal(animations.ratio_of(times | stated, rows), stated)
    lines = [line for line in animations.table({"sequence_times": [times, times | stated], "sequence_runs": rows}).splitlines() if line]
    equal(lines[2:], ["| a | maps | 21 | 60 (4 to 60) | 2.00 (2.00 to 3.00, 87 %) | 4 | 6 of 2 M | – |",
                      "| a | maps | 21 | 60 (4 to 60) | 1.50 (1.00 to 2.00) | 4 | 6 of 2 M | – |"])
    asked = {"adjudicated_count": 1100, "ambiguous_count": 1099, "proven_wrong_count": 1}
    equal(animations.adjudicated([asked, asked]), "2 198, 2 of 2 200")
    equal(animations.adjudicated([dict.fromkeys(asked, 0)]), "none")


def test_times_of_a_pair():
    """Older results of a bench state the interval of the CPU time alone."""
    old = {"method": "m", "cpu_s": 2.0, "cpu_s_min": 1.0, "cpu_s_max": 4.0, "ns_per_pair": 50.0, "embree_over_it": 1.0, "disagreement_share": 0}
    equal(intervals.interval_text(intervals.pair_time(old, 5), "ns_per_pair"), "50 (25 to 100, 93 %)")
    new = old | {"repeat_count": 10, "ns_per_pair_low": 40.0, "ns_per_pair_high": 60.0, "ns_per_pair_confidence": 0.97,
                 "embree_over_it_low": 0.9, "embree_over_it_high": 1.1, "embree_over_it_confidence": 0.97}
    equal(intervals.interval_text(intervals.pair_time(new, 5), "ns_per_pair"), "50 (40 to 60)")
    frame = {"pair_count": 7, "width": 1, "height": 1, "true_lit_share": 0, "true_dark_share": 0, "methods": [old, new]}
    equal(claims.frame_table(frame, 5)[-2:], ["| m | 50.0 (25.0 to 100.0, 93 %) | 5 | 1.00 | 0.00 % |",
                                              "| m | 50.0 (40.0 to 60.0) | 10 | 1.00 (0.90 to 1.10) | 0.00 % |"])


def test_stamps():
    """The stamp is in both files, and follows the data and the command."""
    with tempfile.TemporaryDirectory() as folder:
        data = os.path.join(folder, "data.json")
        pathlib.Path(data).write_text("{}")
        collection.STAMP = first = stamp.stamp_of("regret", [data])
        figure, axes = collection.plt.subplots()
        axes.plot([0, 1], [0, 1])
        charts = collection.Charts(folder)
        charts.save(figure, "chart", "t", "c")
        equal([stamp.stamp_in(os.path.join(folder, f"chart.{kind}")) for kind in ("svg", "png")], [first, first])
        equal(committed.compare(os.path.join(folder, "chart.png"), os.path.join(folder, "chart.svg")), "")
        equal(stamp.stamp_in(data), None)
        pathlib.Path(data).write_text("{ }")
        changed = stamp.stamp_of("regret", [data])
        if len({first, changed, stamp.stamp_of("frame", [data]), stamp.stamp_of("regret", [data, data])}) != 4:
            sys.exit("equal stamps of different data")
        collection.STAMP = changed
        figure, _ = collection.plt.subplots()
        charts.save(figure, "later", "t", "c")
        if "other data" not in committed.compare(os.path.join(folder, "later.png"), os.path.join(folder, "chart.png")):
            sys.exit("a chart that is older than its data was not found")
        collection.STAMP = ""


def test_stamps_follow_the_drawing():
    """A change of the code that draws a chart, also of a module that it imports, changes its stamp; one of a comment, of a
    docstring or of another chart's module does not."""
    with tempfile.TemporaryDirectory() as folder:
        def drawing(command, name="", old="", new=""):
            package = os.path.join(folder, f"{len(os.listdir(folder))}")
            shutil.copytree(SOURCE / "tools/report/shadowdag_report", package)
            if name:
                path = pathlib.Path(package) / name
                text = path.read_text()
                equal(old in text, True)
                path.write_text(text.replace(old, new, 1))
            return stamp.drawing_of(command, package)

        first = drawing("regret")
        equal(first, stamp.drawing_of("regret"))
        equal(drawing("regret", "charts/regret.py", '"""Draws', '"""Paints'), first)
        equal(drawing("regret", "style.py", "import", "# A comment.\n\nimport"), first)
        equal(drawing("regret", "charts/frame.py", "0.85", "0.95"), first)
        equal(drawing("regret", "files.py", "def read_json", "def read_any_json"), first)
        changed = [drawing("regret", "charts/regret.py", "import", "import json\nimport"),
                   drawing("regret", "intervals.py", "CONFIDENCE = 0.95", "CONFIDENCE = 0.9"),  # imported by what it imports
                   drawing("regret", "style.py", "import", "import json\nimport")]
        equal(len({first, *changed}), 4)
        equal(drawing("frame", "charts/frame.py", "0.85", "0.95") != stamp.drawing_of("frame"), True)
        equal(drawing("figures", "figures/times.py", "import", "import json\nimport") != stamp.drawing_of("figures"), True)


def test_bars_of_a_sequence():
    timed = lambda label, count, confidence: {"time_ms": 5.0, "time_ms_low": 4.0, "time_ms_high": 7.0, "time_ms_confidence": confidence,
                                              "repeat_count": count, "label": label, "frame": 0}
    rows = {(label, 0): timed(label, *of) for label, of in {"once": (1, 0.0), "twice": (2, 0.5), "ten": (10, 0.978)}.items()}
    bars = sequence.Sequence("s", rows).bars_text
    equal([bars(["once"]), bars(["twice"]), bars(["ten"]), bars(["ten", "twice"])],
          ["", "range of 2 repeats", "95 % interval of the median of 10 repeats", "range of 2 to 10 repeats"])


def test_a_threshold_that_divides_no_map():
    runs = [{"parameters": {"threshold_texels": value}} for value in (0, 160, "inf")]
    costs = [{"texels": texels} for texels in (122.0, 1119.5)]
    for texels, place in ((96, 0), (122, 0), (200, None), (1119.5, None), (1200, 2)):
        equal(pure_run(runs, texels, costs), None if place is None else runs[place])
    equal(pure_run(runs, 96, []), None)
    equal(pure_run(runs[1:], 96, costs), None)
    equal(rings_sentence([(96, 0)], {"size": "640x360"}),
          " The cross stands at the paper's 96 texels, which draw every map here.")


def test_smallest_text_in_print():
    inch = lambda cm: cm / 2.54
    for width, size, points in ((8.5, 6.0, 6.0), (4.0, 6.0, 6.0), (9.0, 9.0, 8.5), (17.8, 6.0, 6.0), (35.6, 6.0, 3.0)):
        figure, axes = collection.plt.subplots(figsize=(inch(width), 2))
        axes.set_title("small", fontsize=size)
        axes.set_xlabel("", fontsize=1)  # an empty text and one that is not shown do not count
        axes.text(0.5, 0.5, "hidden", fontsize=1).set_visible(False)
        axes.tick_params(labelsize=20)
        equal(round(collection.smallest_text(figure), 6), points)
        collection.plt.close(figure)


def test_every_picture_of_docs_is_listed():
    equal(committed.unlisted(SOURCE / "docs"), [])
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(SOURCE / "docs", folder, dirs_exist_ok=True)
        os.rename(os.path.join(folder, "view.png"), os.path.join(folder, "another.png"))
        equal(committed.unlisted(folder), ["another.png: is listed neither in CHARTS nor in OTHER_PICTURES",
                                           "view.png: is listed and does not exist"])


for test in [value for name, value in list(globals().items()) if name.startswith("test_")]:
    test()
    print(f"{test.__name__}: ok")
