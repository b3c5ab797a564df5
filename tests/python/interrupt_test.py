# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C ends work of the library as KeyboardInterrupt, progress is told and may end it, and the interpreter's lock is
free meanwhile."""
import os
import signal
import threading
import time
import unittest

import shadowdag as sd

LONG = 16384  # a resolution whose voxels take many seconds to build here
SCENE = "builtin:houses"


class Stop(Exception):
    pass


def stop_after(seconds):
    """Returns a progress function that ends the work after some seconds."""
    start = time.monotonic()

    def progress(what, fraction):
        if time.monotonic() - start > seconds:
            raise Stop
    return progress


class Interrupts(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = sd.load(SCENE)

    def test_a_signal_raises_keyboard_interrupt(self):
        timer = threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT))
        start = time.monotonic()
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            self.scene.voxelize(LONG)
        self.assertGreater(time.monotonic() - start, 0.4)
        self.assertEqual(self.scene.voxelize(16).resolution, 16)  # the scene goes on working

    def test_a_handler_of_ones_own_is_called(self):
        def handler(number, frame):
            raise Stop(number)
        before = signal.signal(signal.SIGINT, handler)
        try:
            timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
            timer.start()
            with self.assertRaises(Stop):
                self.scene.voxelize(LONG)
        finally:
            signal.signal(signal.SIGINT, before)

    def test_progress_is_told_and_may_end_the_work(self):
        told = []

        def progress(what, fraction):
            told.append((what, fraction))
            if len(told) == 3:
                raise Stop
        with self.assertRaises(Stop):
            self.scene.voxelize(LONG, progress=progress)
        self.assertEqual(len(told), 3)
        for what, fraction in told:
            self.assertIn("houses", what)
            self.assertTrue(0 <= fraction <= 1)

    def test_other_threads_run_meanwhile(self):
        turns, ends = [], threading.Event()

        def count():
            while not ends.is_set():
                turns.append(time.monotonic())
                time.sleep(0.01)

        other = threading.Thread(target=count)
        other.start()
        with self.assertRaises(Stop):
            self.scene.voxelize(LONG, progress=stop_after(1))
        ends.set()
        other.join()
        self.assertGreater(len(turns), 10)  # with the lock held it would have been one or two

    def test_pictures_wait_for_no_lock(self):
        # On one thread the loop of a picture waits for the other call, which asks for the interpreter meanwhile.
        frame = sd.load("builtin:fail-acne").frame(method="dag", size="320x180")
        self.addCleanup(sd.set_threads, sd.threads())
        sd.set_threads(1)
        ends = []

        def work():
            with self.assertRaises(Stop):
                self.scene.voxelize(LONG, progress=stop_after(2))
            ends.append(True)
        other = threading.Thread(target=work)
        other.start()
        time.sleep(0.5)
        self.assertEqual(frame.picture().shape, (180, 320, 3))
        other.join()
        self.assertEqual(ends, [True])

    def test_a_program_ends_with_its_caller(self):
        timer = threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT))
        timer.start()
        start = time.monotonic()
        with self.assertRaises(KeyboardInterrupt):
            sd.compare(SCENE, size="1280x720", repeats=100)
        self.assertLess(time.monotonic() - start, 30)


if __name__ == "__main__":
    unittest.main()
