# SPDX-License-Identifier: Apache-2.0
"""Cost models written in Python route as the same models of the program, and their exceptions reach the caller."""
import json
import os
import tempfile
import unittest

import numpy as np
import shadowdag as sd

VIEW = {"size": "96x54"}


class Models(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = sd.load("builtin:fail-sconce", lights=12)
        cls.texels = np.sort(cls.scene.frame(VIEW, method="hybrid").maps["texels"])
        cls.middle = float(cls.texels[len(cls.texels) // 2]) - 1e-3

    def routes(self, model):
        frame = self.scene.frame(VIEW, method="hybrid", model=model)
        return frame.maps["route"].tolist(), frame

    def test_bools_and_ratios_route_as_texels_does(self):
        wanted, program = self.routes(f"texels:{self.middle!r}")
        self.assertEqual(set(wanted), {0, 1})
        for model in (lambda maps: maps["texels"] < self.middle,
                      lambda maps: self.middle / maps["texels"],
                      lambda maps: (maps["texels"] < self.middle).tolist(),
                      lambda maps: np.where(maps["texels"] < self.middle, np.inf, 0)):
            got, frame = self.routes(model)
            self.assertEqual(got, wanted)
            np.testing.assert_array_equal(frame.visibility, program.visibility)
            self.assertEqual(frame.counts["ray_count"], program.counts["ray_count"])

    def test_models_see_the_quantities_that_maps_report(self):
        seen = []

        def model(maps):
            seen.append(maps)
            return np.zeros(len(maps), bool)
        _, frame = self.routes(model)
        self.assertEqual(len(seen), 1)
        self.assertEqual(set(seen[0].dtype.names) | {"route", "pair_count"}, set(frame.maps.dtype.names))
        for name in seen[0].dtype.names:
            np.testing.assert_array_equal(seen[0][name], frame.maps[name], name)
        self.assertTrue((seen[0]["pages"] > 0).any() and (seen[0]["pairs"] > 0).any())

    def test_what_a_model_does_not_read_is_not_counted_for_it(self):
        seen = []

        @sd.cost_model(counts=["pages"], name="mine")
        def model(maps):
            seen.append(maps)
            return maps["pages"] > 4
        _, frame = self.routes(model)
        self.assertTrue((seen[0]["pages"] > 0).any())
        self.assertFalse({"triangles", "batches", "pairs", "movers"} & set(seen[0].dtype.names))
        self.assertIn("mine", frame.label)
        self.assertTrue(frame.maps["triangles"].any())  # counted afterwards, for reports
        with self.assertRaisesRegex(ValueError, "pairs"):  # not a silent zero
            self.routes(sd.cost_model(counts="pages")(lambda maps: maps["pairs"] > 4))

        @sd.cost_model
        def plain(maps):
            return maps["pairs"] > 4

        @sd.cost_model(name="named")
        def named(maps):
            return maps["pairs"] > 4
        self.assertEqual(self.routes(plain)[0], self.routes(named)[0])  # both see all counts
        model.counts = ("texels",)
        with self.assertRaisesRegex(sd.UsageError, "'texels' is not counted; the names are pages, triangles"):
            self.routes(model)

    def test_exceptions_of_a_model_reach_the_caller(self):
        class Mine(Exception):
            pass

        def model(maps):
            raise Mine("from the model")
        for _ in range(3):
            with self.assertRaisesRegex(Mine, "from the model"):
                self.routes(model)
        wanted, _ = self.routes("texels:0")
        self.assertEqual(set(wanted), {1})  # the scene goes on working

    def test_wrong_results_are_refused(self):
        for model, text in ((lambda maps: [True], "for each of the"), (lambda maps: None, "object"),
                            (lambda maps: -np.ones(len(maps)), "below 0 or NaN"),
                            (lambda maps: np.full(len(maps), np.nan), "below 0 or NaN")):
            with self.assertRaisesRegex(sd.UsageError, text):
                self.routes(model)
        with self.assertRaisesRegex(sd.UsageError, "for method hybrid, not for 'dag'"):
            self.scene.frame(VIEW, method="dag", model=lambda maps: maps["texels"])

    def test_costs_of_another_size_are_refused_unless_stale_ones_are_allowed(self):
        frame = self.scene.frame(VIEW, method="hybrid")
        maps = [{"light": int(light), "octave": int(octave), "rays_ms": 1, "map_ms": 2}
                for light, octave in zip(frame.maps["light"], frame.maps["octave"])]
        with tempfile.TemporaryDirectory() as directory:
            path = os.path.join(directory, "costs.json")
            with open(path, "w", encoding="utf-8") as file:
                json.dump({"costs": [{"scene": "builtin:fail-sconce", "frame": 0, "rays_scale": 1, "maps_scale": 1,
                                      "degrade_divisor": 1, "maps": maps,
                                      "of": {"size": "96x54", "lights": 12, "light_seed": 1}}]}, file)

            def routes(**more):
                frame = self.scene.frame(method="hybrid", model="oracle", costs=path, **more)
                return set(frame.maps["route"].tolist())
            self.assertEqual(routes(**VIEW), {0})
            with self.assertRaisesRegex(sd.InputError, 'size "96x54" instead of "48x27"; .*allow_stale=True'):
                routes(size="48x27")
            self.assertEqual(routes(size="48x27", allow_stale=True), {0})
            for bad in (dict(costs=path, model="oracle", allow_stale=1), dict(allow_stale=True)):
                with self.assertRaisesRegex(sd.UsageError, "allow_stale"):
                    self.scene.frame(VIEW, method="hybrid", **bad)

    def test_a_model_may_use_other_scenes_but_not_its_own(self):
        other = sd.load("builtin:fail-acne")

        def uses_other(maps):
            other.frame(method="dag", size="8x8")
            return maps["texels"] < 1
        self.routes(uses_other)
        with self.assertRaisesRegex(sd.UsageError, "use another Scene"):
            self.routes(lambda maps: self.scene.frame(method="dag", size="8x8"))


if __name__ == "__main__":
    unittest.main()
