# SPDX-License-Identifier: Apache-2.0
"""Frames, truth and judgement of the module are those of the program, bit for bit."""
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np
import shadowdag as sd
from shadowdag.display import png

SCENE, SIZE = "builtin:fail-sconce", "96x54"
TIMES = {"host_copy_count", "host_readback_count", "list_rerun_count", "unsplit_triangle_count"}
CASES = [
    {"method": "dag"},
    {"method": "dag", "believe": "all", "resolution": 128, "offset": 1.5},
    {"method": "maps", "taps": 4, "page_size": 64},
    {"method": "hybrid", "model": "texels:64", "undersample": 2},
    {"method": "hybrid", "model": "expr:samples - 100"},
    {"method": "embree"},
    {"variant": "PMCD-EB-4SM-u2"},
]


def option_of(key):
    return "--" + {"max_face_texels": "max-face"}.get(key, key.replace("_", "-"))


def run(command, settings, *more):
    """Returns the program's JSON."""
    options = [text for key, value in settings.items() for text in (option_of(key), str(value))]
    done = subprocess.run([os.environ["SHADOWDAG_PROGRAM"], command, SCENE, "--size", SIZE, *options, *more, "--json"],
                          capture_output=True, text=True)
    if done.returncode:
        raise AssertionError(done.stderr)
    return json.loads(done.stdout)


class Parity(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = sd.load(SCENE)

    def test_frames_have_the_counts_of_render(self):
        with tempfile.TemporaryDirectory() as folder:
            for settings in CASES:
                with self.subTest(**settings):
                    wanted = run("render", settings, "-o", os.path.join(folder, "a.png"))["frames"][0]
                    frame = self.scene.frame(settings, size=SIZE)
                    counts = frame.counts
                    self.assertGreater(wanted["pair_count"], 100)
                    self.assertEqual(len(frame.visibility), wanted["pair_count"])
                    shared = (set(counts) & set(wanted)) - TIMES
                    self.assertGreater(len(shared), 25)
                    self.assertEqual({k: counts[k] for k in shared}, {k: wanted[k] for k in shared})
                    self.assertEqual(set(frame.stages), set(wanted["stages_ms"]))

    def test_pictures_are_those_of_render(self):
        import matplotlib.image
        with tempfile.TemporaryDirectory() as folder:
            path, own = os.path.join(folder, "a.png"), os.path.join(folder, "b.png")
            for settings in CASES[:4]:
                with self.subTest(**settings):
                    run("render", settings, "-o", path)
                    pathlib.Path(own).write_bytes(png(self.scene.frame(settings, size=SIZE).picture()))
                    wanted, got = (np.round(255 * matplotlib.image.imread(p)[..., :3]).astype(int) for p in (path, own))
                    self.assertEqual(wanted.shape, (54, 96, 3))
                    self.assertGreater(wanted.std(), 5)
                    np.testing.assert_array_equal(got, wanted)

    def test_judgements_are_those_of_validate(self):
        for settings in CASES[:4]:
            with self.subTest(**settings):
                wanted = run("validate", settings)
                frame = self.scene.frame(settings, size=SIZE)
                report = frame.judge()
                self.assertEqual(report["counts"], {key: wanted[key] for key in report["counts"]})
                self.assertEqual(report["per_light"], wanted["lights"])
                dark, truth = frame.visibility < 128, frame.truth() < 128
                self.assertEqual(int((dark & ~truth).sum()), wanted["false_shadow_count"])
                self.assertEqual(int((~dark & truth).sum()), wanted["false_light_count"])
                np.testing.assert_array_equal(report["verdicts"] != 0, dark != truth)

    def test_verdicts_stand_in_the_order_of_their_numbers(self):
        frame = self.scene.frame(method="dag", believe="all", resolution=64, size=SIZE)
        report = frame.judge()
        counts, verdicts = report["counts"], report["verdicts"]
        for name in ("magnified", "acne", "contact"):
            self.assertEqual(int((verdicts == sd.VERDICTS.index(name)).sum()), counts[name + "_count"], name)
        self.assertGreater(counts["magnified_count"], 0)

    def test_lights_are_served_as_the_counts_say(self):
        frame = self.scene.frame(method="hybrid", model="texels:64", size=SIZE)
        servers = np.bincount(frame.server, minlength=3)
        self.assertEqual(servers[sd.SERVERS.index("rays")], frame.counts["ray_count"])
        self.assertEqual(servers[sd.SERVERS.index("map")], frame.counts["lookup_count"])
        self.assertEqual(len(frame.maps), frame.counts["traced_map_count"] + frame.counts["drawn_map_count"])
        self.assertEqual(int((frame.maps["route"] == 1).sum()), frame.counts["drawn_map_count"])

    def test_assets_are_those_of_voxelize(self):
        with tempfile.TemporaryDirectory() as folder:
            for packing in ("fast", "compact"):
                path, own = os.path.join(folder, "a.svdag"), os.path.join(folder, "b.svdag")
                wanted = json.loads(subprocess.run(
                    [os.environ["SHADOWDAG_PROGRAM"], "voxelize", SCENE, "-o", path, "--resolution", "128", "--packing",
                     packing, "--json"], capture_output=True, text=True, check=True).stdout)
                dag = self.scene.voxelize(128)
                dag.save(pathlib.Path(own), packing=packing)
                self.assertEqual(pathlib.Path(own).read_bytes(), pathlib.Path(path).read_bytes())
                info = sd.load_asset(pathlib.Path(path)).info()
                self.assertEqual(info, {key: wanted[key] for key in info})
                self.assertEqual(dag.info(), info)

    def test_sizes_and_cameras_may_be_numbers(self):
        frame = self.scene.frame(size=(64, 36), camera=(0, 3, 6, 0, 1, 0), method="dag")
        self.assertEqual(frame.size, (64, 36))
        again = self.scene.frame(size="64x36", camera="0,3,6,0,1,0", method="dag")
        np.testing.assert_array_equal(frame.visibility, again.visibility)

    def test_frames_do_not_depend_on_threads_or_frames_before(self):
        settings = CASES[3] | {"size": SIZE}
        first = self.scene.frame(settings)
        self.scene.frame(CASES[2], size="64x64")
        sd.set_threads(1)
        try:
            again = self.scene.frame(settings)
        finally:
            sd.set_threads(0)
        np.testing.assert_array_equal(first.visibility, again.visibility)
        np.testing.assert_array_equal(first.color, again.color)


if __name__ == "__main__":
    unittest.main()
