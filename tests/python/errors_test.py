# SPDX-License-Identifier: Apache-2.0
"""Every kind of error is a class, and a dict of settings is refused with the messages of experiment files."""
import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest
import warnings

import numpy

import shadowdag as sd


class Errors(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = sd.load("builtin:fail-acne")

    def test_kinds_are_classes(self):
        for kind, base in ((sd.UsageError, ValueError), (sd.InputError, ValueError), (sd.ResourceError, RuntimeError),
                           (sd.DeviceError, RuntimeError), (sd.DefectError, RuntimeError)):
            self.assertTrue(issubclass(kind, sd.Error) and issubclass(kind, base))
        with tempfile.TemporaryDirectory() as folder:
            broken = os.path.join(folder, "a.svdag")
            pathlib.Path(broken).write_bytes(b"not an asset")
            with self.assertRaisesRegex(sd.InputError, "a.svdag"):
                sd.load_asset(broken)
            with self.assertRaisesRegex(sd.InputError, "missing.glb"):
                sd.load(os.path.join(folder, "missing.glb"))
            with self.assertRaisesRegex(sd.InputError, "missing.glb"):
                sd.load(pathlib.Path(folder) / "missing.glb")
            with self.assertRaisesRegex(TypeError, "must be str or os.PathLike"):
                sd.load(7)
            with self.assertRaisesRegex(sd.ResourceError, "no directory"):
                self.scene.voxelize(16).save(os.path.join(folder, "absent", "a.svdag"))
            with self.assertRaisesRegex(sd.UsageError, "use that extension"):
                self.scene.voxelize(16).save(os.path.join(folder, "a.bin"))
        with self.assertRaisesRegex(sd.UsageError, "no built-in scene .nothing."):
            sd.load("builtin:nothing")
        with self.assertRaisesRegex(sd.UsageError, "resolution '65'"):
            self.scene.voxelize(65)
        if not sd.built_with_cuda():
            with self.assertRaises(sd.DeviceError):
                sd.load("builtin:fail-acne", backend="cuda")

    def test_limits_are_those_of_the_program(self):
        for count in (-5, 100001, 10 ** 9):
            with self.subTest(count), self.assertRaisesRegex(sd.UsageError, "lights .*: must be .* from -1 to 100000"):
                sd.load("builtin:fail-acne", lights=count)
        before = sd.threads()
        for count in (-1, 4097, 10 ** 9):
            with self.subTest(count), self.assertRaisesRegex(sd.UsageError, "count .*: must be .* from 0 to 4096"):
                sd.set_threads(count)
        self.assertEqual(sd.threads(), before)

    def test_zero_bytes_do_not_end_messages(self):
        for call in (lambda: sd.load("a\0b.glb"), lambda: sd.load_asset("a\0b.svdag"),
                     lambda: self.scene.frame(model="oracle", costs="a\0b")):
            with self.assertRaisesRegex(sd.UsageError, r"a\\x00b.*contains a zero byte; drop it"):
                call()

    def test_settings_have_the_messages_of_experiment_files(self):
        program = os.environ["SHADOWDAG_PROGRAM"]
        for key, value in (("taps", 3), ("size", "0x5"), ("offset", "far"), ("page_size", 100), ("believe", -1),
                           ("exposure", -2), ("bias", [1, 2, "x"]), ("lod", "deep")):
            with self.subTest(key), tempfile.TemporaryDirectory() as folder:
                path = os.path.join(folder, "e.json")
                listed = value if key in ("size", "exposure") or isinstance(value, list) else [value]
                pathlib.Path(path).write_text(json.dumps({"scenes": ["builtin:fail-acne"], key: listed}))
                done = subprocess.run([program, "compare", "--experiment", path, "-o", os.path.join(folder, "r")],
                                      capture_output=True, text=True)
                self.assertEqual(done.returncode, 2, done.stderr)
                wanted = done.stderr.strip().splitlines()[-1].replace("shadowdag: error: " + path, "settings")
                with self.assertRaises(sd.UsageError) as caught:
                    self.scene.frame({key: value if key != "bias" else ["x"], "method": "hybrid"})
                said = str(caught.exception)
                if key == "bias":  # a frame takes one value: the program names the third of three
                    self.assertIn("x", said)
                else:
                    self.assertEqual(said, wanted)

    def test_wrong_settings_are_refused_by_name(self):
        endless = []
        endless.append(endless)
        for settings, text in (
                ({"metod": "dag"}, 'unknown key "metod"; the keys are allow_stale, beams_mib, believe, bias, camera'),
                ({"method": "rays"}, "'rays': must be one of dag, maps, hybrid, embree"),
                ({"method": "dag", "taps": 4}, '"taps" is for methods that draw maps, not for \'dag\'; drop it'),
                ({"method": "maps", "believe": "all"}, '"believe" is for methods dag and hybrid'),
                ({"method": "dag", "offset": 2}, "that believes none; add"),
                ({"method": "dag", "model": "cost"}, '"model" is for method hybrid'),
                ({"model": "guess"}, "unknown cost model 'guess'"),
                ({"taps": [1, 4]}, "a frame takes one value, compare takes a list"),
                ({"lights": 5}, '"lights" belongs to the scene'),
                ({"backend": "cuda"}, '"backend" belongs to the scene'),
                ({"variant": "PMCD-EB-4SM-u2", "undersample": 2}, "contradict each other"),
                ({"variant": "nothing"}, "nothing"),
                ({"camera": "behind"}, "there is no camera of that name"),
                ({"time": "soon"}, '"time" is "soon"'),
                ({"method": "dag", "believe": "all", "resolution": 100}, "100"),
                ({"size": object()}, "neither a number"),
                ({"taps": 2 ** 64}, "is beyond 64 bits"),
                ({"camera": "\udce9"}, "is no text that UTF-8 can write"),
                ({"taps": endless}, "nests deeper than 100 levels, or contains itself")):
            with self.subTest(str(settings)), self.assertRaisesRegex(sd.UsageError, re.escape(text)):
                self.scene.frame(settings)

    def test_the_table_lists_what_is_taken(self):
        rows = sd.frame_settings()
        keys = [row["key"] for row in rows]
        self.assertEqual(len(keys), len(set(keys)))
        self.assertTrue({"method", "model", "size", "believe", "taps", "pool_mib", "resolution"} <= set(keys))
        self.assertTrue(all(row["help"] for row in rows))

    def test_older_frames_say_that_they_are_older(self):
        camera = {"size": "24x16"}
        first = self.scene.frame(method="dag", **camera)
        kept = self.scene.frame(method="dag", **camera)
        kept_truth = kept.truth()
        self.scene.frame(method="maps", **camera)
        with self.assertRaisesRegex(sd.UsageError, "has rendered another frame since"):
            first.truth()
        with self.assertRaisesRegex(sd.UsageError, "has rendered another frame since"):
            kept.judge()
        self.assertEqual(kept.truth().tolist(), kept_truth.tolist())
        with self.assertRaises(IndexError):
            self.scene.frame(method="dag", **camera).pair(10 ** 9)
        with self.assertRaisesRegex(sd.UsageError, "record=False"):
            self.scene.frame(method="dag", record=False, **camera).judge()

    def test_a_refused_frame_leaves_no_older_one_current(self):
        scene = sd.load("builtin:fail-mover")
        first = scene.frame(method="dag", size="24x16", time=0)
        with self.assertRaises(sd.UsageError):
            scene.frame(method="dag", size="24x16", time=1, camera="nosuch")
        with self.assertRaisesRegex(sd.UsageError, "has rendered another frame since"):
            first.truth()
        again = scene.frame(method="dag", size="24x16", time=0)
        self.assertEqual(again.visibility.tolist(), first.visibility.tolist())
        self.assertEqual(int(((again.truth() < 128) != (again.visibility < 128)).sum()), 0)

    def test_views_far_from_the_origin_are_told_apart(self):
        far = 2e8
        ground = [[far - 2e4, far - 4000, far - 2e4], [far + 2e4, far - 4000, far - 2e4],
                  [far + 2e4, far - 4000, far + 2e4], [far - 2e4, far - 4000, far + 2e4]]
        lights = sd.lights([[far, far + 2000, far]], intensity=1e9, range=1e5)
        scene = sd.scene(numpy.array(ground, numpy.float32), numpy.array([[0, 2, 1], [0, 3, 2]], numpy.uint32), lights)
        views = [f"{far:.0f},{far:.0f},{far:.0f},{far + x:.0f},{far + y:.0f},{far:.0f},60,1,100000"
                 for x, y in ((960, -1280), (1280, -960))]
        frames = [scene.frame(method="dag", size="24x16", camera=view) for view in views]
        self.assertNotEqual(frames[0].run["camera_numbers"], frames[1].run["camera_numbers"])
        again = scene.frame(method="dag", size="24x16", camera=frames[0].run["camera_numbers"])
        self.assertEqual(len(again.visibility), len(frames[0].visibility))
        self.assertEqual(len(again.truth()), len(again.visibility))
        other = scene.frame(method="dag", size="24x16", camera=views[1])
        self.assertEqual(len(other.truth()), len(other.visibility))

    def test_names_of_files_may_be_any_bytes(self):
        with tempfile.TemporaryDirectory() as folder:
            name = os.path.join(os.fsencode(folder), b"caf\xe9.glb")
            program = os.environ["SHADOWDAG_PROGRAM"]
            subprocess.run([program, "scene", "fail-acne", "-o", name], check=True, capture_output=True)
            path = os.fsdecode(name)
            scene = sd.load(path)
            self.assertEqual(scene.argument, path)
            self.assertEqual(scene.frame(method="dag", size="8x8").run["scene"], os.path.basename(path))
            with self.assertRaisesRegex(sd.InputError, "gone\udce9.glb: no such file"):
                sd.load(os.fsdecode(os.path.join(os.fsencode(folder), b"gone\xe9.glb")))
            costs = os.path.join(os.fsencode(folder), b"cost\xe9s.json")
            with open(costs, "w") as file:
                file.write("[]")
            for given in (os.fsdecode(costs), pathlib.Path(os.fsdecode(costs))):
                with self.assertRaisesRegex(sd.InputError, "is not a cost file"):
                    scene.frame(method="hybrid", model="oracle", costs=given, size="8x8")
            with self.assertRaisesRegex(sd.UsageError, "zero byte"):
                scene.frame(method="hybrid", model="oracle", costs="a\0b", size="8x8")
            with self.assertRaisesRegex(sd.UsageError, "must be a text"):
                scene.frame(method="hybrid", model="oracle", costs=3, size="8x8")

    def test_remarks_are_warnings(self):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            self.scene.frame(method="dag", size="8x8").judge()
        self.assertTrue(any(issubclass(w.category, sd.Warning) and "shares of fewer than" in str(w.message) for w in caught))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with self.assertRaises(sd.Warning):
                self.scene.frame(method="dag", size="8x8").judge()

    def test_the_programs_errors_are_the_same_classes(self):
        with self.assertRaisesRegex(sd.UsageError, "--taps '3'"):
            sd.run_program("render", "builtin:fail-acne", "-o", "a.png", "--method", "maps", "--taps", "3")
        with self.assertRaisesRegex(sd.InputError, "missing.glb"):
            sd.run_program("info", "missing.glb")
        before = os.environ["SHADOWDAG_PROGRAM"]
        try:
            os.environ["SHADOWDAG_PROGRAM"] = "/bin/true"
            with self.assertRaisesRegex(sd.UsageError, "build and install both together"):
                sd.program()
        finally:
            os.environ["SHADOWDAG_PROGRAM"] = before


if __name__ == "__main__":
    unittest.main()
