# SPDX-License-Identifier: Apache-2.0
"""Scenes from arrays: what stands where, and the same frames as the same scene in a file."""
import unittest

import numpy as np
import shadowdag as sd

SQUARE = np.float32([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]])
FLOOR = SQUARE * np.float32([4, 1, 4]) - np.float32([0, 1, 0])
VERTICES = np.concatenate([SQUARE, FLOOR])
TRIANGLES = np.uint32([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])


class Scenes(unittest.TestCase):
    def test_arrays_come_back(self):
        scene = sd.scene(VERTICES, TRIANGLES, lights=[[0, 2, 0], [1, 2, 0]], cameras={"above": (0, 6, 4, 0, 0, 0, 50)},
                         name="square")
        np.testing.assert_array_equal(scene.vertices, VERTICES)
        np.testing.assert_array_equal(scene.triangles, TRIANGLES)
        np.testing.assert_array_equal(scene.lights["position"], [[0, 2, 0], [1, 2, 0]])
        self.assertEqual(scene.name, "square")
        self.assertEqual(list(scene.cameras), ["above"])
        numbers = [float(n) for n in scene.cameras["above"].split(",")]
        np.testing.assert_allclose(numbers[:3], [0, 6, 4], atol=1e-5)
        self.assertAlmostEqual(numbers[6], 50, places=3)
        np.testing.assert_array_equal(scene.bounds, [[-4, -1, -4], [4, 0, 4]])

    def test_lights_shine_where_they_are_told(self):
        rows = np.concatenate([
            sd.lights([0, 3, 0], intensity=(1, 2, 3), range=9, kind="spot", direction=(0, -2, 0), inner=0.1, outer=0.4),
            sd.lights([[0, 0, 0]], intensity=5, kind="directional", direction=(1, -1, 0))])
        lights = sd.scene(VERTICES, TRIANGLES, lights=rows).lights
        self.assertEqual(lights["kind"].tolist(), [1, 2])
        np.testing.assert_allclose(lights["direction"], [[0, -1, 0], [0.5 ** 0.5, -0.5 ** 0.5, 0]], atol=1e-6)
        np.testing.assert_allclose(lights["intensity"], [[1, 2, 3], [5, 5, 5]])
        np.testing.assert_allclose(np.arccos([lights["cos_inner"][0], lights["cos_outer"][0]]), [0.1, 0.4], atol=1e-4)
        self.assertEqual(lights["range"][0], 9)

    def test_the_square_shadows_what_lies_below(self):
        scene = sd.scene(VERTICES, TRIANGLES, lights=sd.lights([0, 1, 0], intensity=20))
        frame = scene.frame(method="dag", size="64x64", camera="0,9,0.01,0,-1,0,60")
        truth = frame.truth()
        np.testing.assert_array_equal(frame.visibility, truth)
        pixels = sd.pixels_of_pairs(frame)
        self.assertGreater((truth == 0).sum(), 20)
        # By similar triangles the shadow on the floor is 4 x 4, of which the camera sees what the square does not hide.
        places = np.array([frame.pair(int(i))["position_world"] for i in np.flatnonzero(truth == 0)])
        self.assertTrue((np.abs(places[:, [0, 2]]) <= 2 + 1e-3).all())
        np.testing.assert_allclose(places[:, 1], -1, atol=1e-3)
        self.assertEqual(pixels.shape, (len(truth), 2))
        told = frame.pair(int(np.flatnonzero(truth == 0)[0]))
        self.assertEqual(told["pixel"], pixels[np.flatnonzero(truth == 0)[0]].tolist())
        self.assertIn(told["truth_blocker"]["triangle"], (0, 1))
        self.assertGreater(told["truth_blocker"]["distance_world"], 1 - 1e-3)

    def test_bad_arrays_are_refused_by_row(self):
        for arguments, text in (
                ((VERTICES, [[0, 1, 8]]), "triangles: row 0 names vertex 8, but there are 8"),
                ((VERTICES, [[0, -1, 2]]), "row 0 names vertex -1"),
                ((VERTICES * np.nan, TRIANGLES), "vertices: row 0"),
                ((VERTICES[:, :2], TRIANGLES), r"vertices has the shape \(8, 2\)"),
                ((VERTICES, TRIANGLES.astype(float)), "whole numbers"),
                ((VERTICES, TRIANGLES, [[np.inf, 0, 0]]), "lights: row 0")):
            with self.subTest(text), self.assertRaisesRegex(sd.UsageError, text):
                sd.scene(*arguments)
        with self.assertRaisesRegex(sd.UsageError, "kind 'sun'"):
            sd.lights([0, 0, 0], kind="sun")
        with self.assertRaisesRegex(sd.InputError, "no supported light"):
            sd.scene(VERTICES, TRIANGLES).frame(size="16x16", camera="0,9,1,0,0,0")
        with self.assertRaises(sd.Error):
            sd.scene(np.zeros((0, 3)), np.zeros((0, 3), int))
        for intensity in (-1, np.nan, np.inf, (1, 1, -2), 1e300):
            with self.subTest(intensity), self.assertRaisesRegex(sd.UsageError, "lights: row 1 has the intensity"):
                sd.scene(VERTICES, TRIANGLES, lights=np.concatenate([sd.lights([0, 3, 0]), sd.lights([0, 3, 0], intensity)]))
        for more, text in (({"range": -5}, "the range -5"), ({"range": np.nan}, "the range"),
                           ({"kind": "spot", "inner": 0.5, "outer": 0.4}, "cone angles 0.5 and 0.4"),
                           ({"kind": "spot", "outer": 60}, "cone angles 0 and 60; needed, in radians")):
            with self.subTest(text), self.assertRaisesRegex(sd.UsageError, "lights: row 0 has " + text):
                sd.scene(VERTICES, TRIANGLES, lights=sd.lights([0, 3, 0], **more))
        row = sd.lights([0, 3, 0])
        for kind in (7, -1, 0.5, np.nan):
            row[0, 10] = kind
            with self.subTest(kind), self.assertRaisesRegex(sd.UsageError, "lights: row 0 has the kind"):
                sd.scene(VERTICES, TRIANGLES, lights=row)
        for color in ((255, 128, 0), np.nan, -1):
            with self.subTest(color), self.assertRaisesRegex(sd.UsageError, "color holds"):
                sd.scene(VERTICES, TRIANGLES, color=color)
        three = np.zeros((3, 3))
        for more, text in (({"intensity": [1, 2, 3]}, "one a light, or RGB"), ({"range": [1, 2]}, "range has the shape"),
                           ({"direction": [0, 1]}, "direction has the shape"), ({"kind": ["spot"] * 2}, "kind has the shape")):
            with self.subTest(text), self.assertRaisesRegex(sd.UsageError, text):
                sd.lights(three, **more)
        self.assertEqual(sd.lights(three, intensity=[[1], [2], [3]])[:, 7].tolist(), [1, 2, 3])
        self.assertEqual(sd.lights(np.zeros((2, 3)), intensity=[4, 5])[:, 8].tolist(), [4, 5])
        with self.assertRaisesRegex(sd.UsageError, "position has the shape"):
            sd.lights([[0, 1]])
        for count in (-2, 100001, 10 ** 9):
            with self.subTest(count), self.assertRaisesRegex(sd.UsageError, "placed_lights .*: must be .* from -1 to 100000"):
                sd.scene(VERTICES, TRIANGLES, placed_lights=count)


if __name__ == "__main__":
    unittest.main()
