# SPDX-License-Identifier: Apache-2.0
"""Measurements as tables and charts: the module's own, the program's compare, a study."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

import shadowdag as sd

try:
    import pandas
except ImportError:
    pandas = None

SCENE, SIZE = "builtin:fail-sconce", "64x36"
RUNS = {"rays": {"method": "dag", "size": SIZE}, "maps": {"method": "maps", "size": SIZE},
        "mine": {"model": lambda maps: maps["texels"] < 64, "size": SIZE}}


class Results(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = sd.load(SCENE)

    def test_measured_runs_have_errors_and_times(self):
        told = []
        results = sd.measure(self.scene, RUNS, repeats=3, warmups=1, progress=lambda what, share: told.append(share))
        runs = {run["label"]: run for run in results.data["runs"]}
        self.assertEqual(list(runs), list(RUNS))
        self.assertEqual(len(told), 3 * 5)
        self.assertEqual(told, sorted(told))
        for label, run in runs.items():
            frame = self.scene.frame(RUNS[label])
            self.assertEqual(run["false_shadow_count"], frame.judge()["counts"]["false_shadow_count"])
            self.assertEqual(run["repeat_count"], 3)
            self.assertEqual(len(run["round_times_ms"]), 3)
            self.assertTrue(0 < run["time_ms_min"] <= run["time_ms"] <= run["time_ms_max"])
        self.assertEqual(runs["rays"]["false_shadow_count"], 0)
        self.assertGreater(runs["maps"]["mean_abs_visibility_error"], 0)
        self.assertIn("3 runs", repr(results))

    def test_runs_that_cannot_be_compared_are_refused(self):
        for runs, text in (({"a": {"size": "8x8"}, "b": {"size": "16x8"}}, "several sizes"), ([], "nothing to measure"),
                           ([{"size": SIZE}, {"size": SIZE}], "two runs are labelled")):
            with self.assertRaisesRegex(sd.UsageError, text):
                sd.measure(self.scene, runs, repeats=0)
        untimed = sd.measure(self.scene, [{"size": SIZE}], repeats=0)
        with self.assertRaisesRegex(sd.UsageError, "charts need runs with times"):
            untimed.chart()

    def test_charts_are_figures_and_leave_ones_own_style_alone(self):
        import matplotlib
        before = dict(matplotlib.rcParams)
        results = sd.measure(self.scene, RUNS, repeats=2)
        figure = results.chart()
        self.assertIsInstance(figure, matplotlib.figure.Figure)
        axes = figure.axes[0]
        self.assertEqual(axes.get_xlabel(), "frame time (ms)")
        self.assertTrue(axes.lines or axes.collections)
        with tempfile.NamedTemporaryFile(suffix=".png") as file:
            figure.savefig(file.name)
            self.assertGreater(os.path.getsize(file.name), 5000)
        self.assertEqual(dict(matplotlib.rcParams), before)

    def test_charts_are_those_of_the_report(self):
        with tempfile.TemporaryDirectory() as folder:
            output = os.path.join(folder, "r")
            results = sd.compare(SCENE, output, size=SIZE, methods=["hybrid", "maps", "dag"], repeats=1, warmups=0,
                                 believe=["none", "2", "all"], thresholds=["8", "16"])
            drawn = {os.path.splitext(name)[0] for name in os.listdir(os.path.join(output, "charts")) if name.endswith(".png")}
        charts = results.charts()
        self.assertEqual(set(charts), drawn)
        for kind in ("speed_accuracy", "threshold", "stages", "bytes", "believe", "visibility"):
            self.assertTrue(any(name.startswith(kind + "_") for name in charts), kind)
        self.assertEqual(list(results.charts("stages")), [name for name in charts if name.startswith("stages_")])

    def test_charts_need_no_window(self):
        script = f"""
import shadowdag as sd
sd.measure(sd.load({SCENE!r}), [{{"method": "dag", "size": {SIZE!r}}}], repeats=1).chart()
from matplotlib import pyplot
pyplot.figure()
"""
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, "matplotlibrc"), "w", encoding="utf-8") as file:
                file.write("backend: TkAgg\n")  # Debian's own default
            headless = {key: value for key, value in os.environ.items()
                        if key not in ("MPLBACKEND", "DISPLAY", "WAYLAND_DISPLAY")}
            done = subprocess.run([sys.executable, "-c", script], env=headless | {"MATPLOTLIBRC": folder},
                                  capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_the_programs_compare_is_read(self):
        with tempfile.TemporaryDirectory() as folder:
            output = os.path.join(folder, "report")
            told = []
            results = sd.compare(SCENE, output, charts=False, size=SIZE, methods=["dag", "maps"], repeats=1, warmups=0,
                                 progress=lambda what, share: told.append((what, share)))
            self.assertTrue(all(what and 0 <= share <= 1 for what, share in told), told)
            with open(os.path.join(output, "results.json"), encoding="utf-8") as file:
                self.assertEqual(results.data, json.load(file))
            frame = self.scene.frame(method="maps", size=SIZE)
            counts = frame.judge()["counts"]
            run = next(r for r in results.data["runs"] if r["method"] == "maps")
            shared = set(counts) & set(run)
            self.assertGreater(len(shared), 8)
            self.assertEqual({key: run[key] for key in shared if not key.startswith("null")},
                             {key: counts[key] for key in shared if not key.startswith("null")})
            self.assertEqual(sd.load_results(output).data, results.data)
        by_dict = sd.compare(experiment={"scenes": [SCENE], "size": SIZE, "methods": ["dag"], "repeats": 1, "warmups": 0})
        self.assertEqual([run["method"] for run in by_dict.data["runs"]], ["dag"])
        self.assertTrue(by_dict.data["lights"])
        with self.assertRaisesRegex(sd.InputError, '"tapz"'):
            sd.compare(experiment={"scenes": [SCENE], "tapz": 1})

    def test_a_study_is_read(self):
        with tempfile.TemporaryDirectory() as folder:
            results = sd.study("failures", os.path.join(folder, "s"), charts=False, only="acne")
        self.assertTrue(results.tables)

    def test_missing_results_are_named(self):
        with tempfile.TemporaryDirectory() as folder:
            with self.assertRaisesRegex(sd.InputError, "contains no results"):
                sd.load_results(folder)
            with self.assertRaisesRegex(sd.InputError, "cannot be read"):
                sd.load_results(os.path.join(folder, "results.json"))

    def test_files_that_are_no_results_are_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.json")
            for text, reason in (("[]", "contains no results"), ("{}", "contains no results"), ("7", "contains no results"),
                                 ('{"runs": 7}', "contains no results"), ("[" * 100000, "nests too deep"), ("", "is not JSON")):
                with open(path, "w", encoding="utf-8") as file:
                    file.write(text)
                with self.subTest(text[:20]), self.assertRaisesRegex(sd.InputError, f"a.json: {reason}"):
                    sd.load_results(path)
            with open(path, "w", encoding="utf-8-sig") as file:  # with a byte order mark
                json.dump({"runs": [{"label": "a"}]}, file)
            self.assertEqual(sd.load_results(path).data["runs"], [{"label": "a"}])
            os.mkfifo(os.path.join(folder, "pipe"))
            script = f"import shadowdag as sd; sd.load_results({os.path.join(folder, 'pipe')!r})"
            done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
            self.assertIn("InputError", done.stderr)
            self.assertIn("pipe: is not a regular file", done.stderr)

    def test_displays_show_names_and_pictures(self):
        frame = self.scene.frame(method="dag", size=SIZE)
        self.assertTrue(frame._repr_png_().startswith(b"\x89PNG"))
        self.assertIn("fail-sconce", self.scene._repr_html_())
        self.assertIn("64³", self.scene.voxelize(64)._repr_html_())
        self.assertIn(SIZE, repr(frame))

    @unittest.skipIf(pandas is None, "python3-pandas is not installed")
    def test_tables_are_frames(self):
        results = sd.measure(self.scene, RUNS, repeats=1)
        self.assertEqual(results.runs["label"].tolist(), list(RUNS))
        self.assertEqual(results.runs["parameters.taps"].notna().tolist(), [False, True, True])
        self.assertEqual(set(results.lights["label"]), set(RUNS))
        self.assertEqual(int(results.lights["pair_count"].sum()), int(results.runs["pair_count"].sum()))
        self.assertIn("<table", results._repr_html_())


if __name__ == "__main__":
    unittest.main()
