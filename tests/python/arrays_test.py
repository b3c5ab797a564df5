# SPDX-License-Identifier: Apache-2.0
"""Arrays are shared, not copied: inputs are read where they lie, results of the library are views that keep it alive."""
import gc
import resource
import tempfile
import unittest
import weakref

import numpy as np
import shadowdag as sd

MIB = 1 << 20


def address(array):
    return array.__array_interface__["data"][0]


def peak():
    """Returns the most memory that the process has held, bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def box_scene():
    """A square of 2 x 2 at height 0 over a floor of 8 x 8 at height -1."""
    vertices = np.float32([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1], [-4, -1, -4], [4, -1, -4], [4, -1, 4], [-4, -1, 4]])
    return sd.scene(vertices, [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])


class Arrays(unittest.TestCase):
    def setUp(self):
        self.scene = box_scene()
        self.dag = self.scene.voxelize(64)

    def test_segments_are_answered_as_geometry_says(self):
        start = np.float32([[0, 1, 0], [0, 1, 0], [3, 1, 3], [0.5, 2, 0.5]])
        end = np.float32([[0, -0.5, 0], [0, 0.5, 0], [3, -0.5, 3], [0.5, -0.5, 0.5]])
        wanted = [True, False, False, True]
        self.assertEqual(self.dag.occluded(start, end).tolist(), wanted)
        self.assertEqual(self.scene.occluded(start, end).tolist(), wanted)

    def test_voxels_hide_what_triangles_hide(self):
        random = np.random.default_rng(7)
        start, end = random.uniform(-4, 4, (2, 20000, 3)).astype(np.float32)
        by_triangles, by_voxels = self.scene.occluded(start, end), self.dag.occluded(start, end)
        self.assertGreater(by_triangles.mean(), 0.02)
        self.assertFalse((by_triangles & ~by_voxels).any())
        self.assertFalse((by_voxels & ~self.dag.occluded(start, end, level=3)).any())

    def test_one_point_serves_all_segments(self):
        ends = np.float32([[0, -0.5, 0], [3, -0.5, 3]])
        light = np.float32([0, 1, 0])
        both = self.dag.occluded(np.repeat(light[None], 2, axis=0), ends)
        np.testing.assert_array_equal(self.dag.occluded(light, ends), both)
        np.testing.assert_array_equal(self.dag.occluded(ends, light), both)

    def test_inputs_are_read_where_they_lie(self):
        count = 4_000_000  # a copy of one list takes 46 MiB; the result takes 4
        ends = np.broadcast_to(np.float32([0, -0.5, 0]), (count, 3))
        starts = np.broadcast_to(np.float32([0, 1, 0]), (count, 3))
        out = np.zeros(count, bool)
        self.dag.occluded(starts[:1000], ends[:1000])  # what is built at the first call is there
        before = peak()
        for _ in range(2):
            self.assertTrue(self.dag.occluded(starts, ends, out=out).all())
        self.assertLess(peak() - before, 16 * MIB)

    def test_strided_and_mapped_inputs_need_no_copy(self):
        random = np.random.default_rng(3)
        table = random.uniform(-4, 4, (500, 8)).astype(np.float32)
        wanted = self.dag.occluded(table[:, 0:3].copy(), table[:, 4:7].copy())
        np.testing.assert_array_equal(self.dag.occluded(table[:, 0:3], table[:, 4:7]), wanted)
        np.testing.assert_array_equal(self.dag.occluded(table[::-1, 0:3], table[::-1, 4:7]), wanted[::-1])
        with tempfile.NamedTemporaryFile() as file:
            table.tofile(file.name)
            mapped = np.memmap(file.name, np.float32, "r", shape=(500, 8))
            np.testing.assert_array_equal(self.dag.occluded(mapped[:, 0:3], mapped[:, 4:7]), wanted)

    def test_results_go_where_they_are_wanted(self):
        out = np.zeros(2, bool)
        points = np.float32([[0, 1, 0], [3, 1, 3]])
        result = self.dag.occluded(points, points - np.float32([0, 1.5, 0]), out=out)
        self.assertEqual(address(result), address(out))
        self.assertEqual(out.tolist(), [True, False])

    def test_other_types_are_refused_instead_of_converted(self):
        points = np.zeros((3, 3), np.float32)
        for start, error, text in ((points.astype(np.float64), TypeError, "float64"), (points.astype(int), TypeError, "int64"),
                                   (points[:, :2], ValueError, r"\(3, 2\)"), (points[:2], ValueError, "2 points")):
            with self.assertRaisesRegex(error, text):
                self.dag.occluded(start, points)
        for out in (np.zeros(2, bool), np.zeros(3, np.uint8), np.zeros(6, bool)[::2]):
            with self.assertRaisesRegex(ValueError, "contiguous array of bool"):
                self.dag.occluded(points, points, out=out)

    def test_points_out_of_reach_are_refused_by_row(self):
        points = np.zeros((3, 3), np.float32)
        for value in (np.nan, np.inf, -np.inf, 1e30, -1e30, 1.001e9):
            bad = points.copy()
            bad[2, 1] = value
            for name, start, end in (("start", bad, points), ("end", points, bad)):
                with self.subTest(f"{name} {value}"), self.assertRaisesRegex(sd.UsageError, f"{name}: row 2 is .*finite and at most"):
                    self.scene.occluded(start, end)
        far = np.float32([1e9, -1e9, 1e9])
        self.assertEqual(self.scene.occluded(far, -far).shape, (1,))

    def test_arrays_of_a_frame_are_views(self):
        lit = sd.scene(self.scene.vertices, self.scene.triangles, lights=[[0, 3, 0]])
        frame = lit.frame(method="dag", size="32x24", camera="0,5,5,0,0,0")
        for name in ("color", "visibility", "light", "first_pair"):
            array = getattr(frame, name)
            self.assertGreater(array.size, 0, name)
            self.assertEqual(address(array), address(getattr(frame, name)), name)
            self.assertFalse(array.flags.writeable, name)
            self.assertFalse(array.flags.owndata, name)
        self.assertEqual(frame.color.shape, (24, 32, 3))
        color, kept = frame.color, frame.color.copy()
        del frame
        lit.frame(method="maps", size="32x24", camera="0,5,5,0,0,0")
        gc.collect()
        np.testing.assert_array_equal(color, kept)

    def test_arrays_keep_their_owner_alive(self):
        words = self.dag.words
        kept, reference = words.copy(), weakref.ref(self.dag)
        self.assertEqual(address(words), address(self.dag.words))
        del self.dag, self.scene
        gc.collect()
        self.assertIsNone(reference())
        np.testing.assert_array_equal(words, kept)

    def test_levels_hold_every_node_once(self):
        info, levels = self.dag.info(), self.dag.levels
        self.assertEqual(len(levels), 5)  # 64, 32, 16, 8, and leaves of 4
        self.assertEqual([len(level) for level in levels], info["node_counts"][:4] + [info["leaf_count"]])
        words = self.dag.words
        popcount = np.vectorize(lambda word: bin(word).count("1"))
        sizes = sum(int((1 + popcount(words[level])).sum()) for level in levels[:-1]) + 2 * len(levels[-1])
        self.assertEqual(sizes, len(words))

    def test_cells_are_those_of_the_geometry(self):
        cells = self.dag.cells(2)
        self.assertEqual(len(np.unique(cells, axis=0)), len(cells))
        centers = self.dag.origin + (cells + 0.5) * 4 * self.dag.voxel_size
        half = 2 * self.dag.voxel_size + 1e-6
        on_square = (np.abs(centers[:, 1]) <= half) & (np.abs(centers[:, [0, 2]]) <= 1 + half).all(axis=1)
        on_floor = np.abs(centers[:, 1] + 1) <= half
        self.assertTrue((on_square | on_floor).all())
        self.assertEqual(len(self.dag.cells(6)), 1)
        with self.assertRaisesRegex(sd.ResourceError, "max_count = 3"):
            self.dag.cells(2, max_count=3)


if __name__ == "__main__":
    unittest.main()
