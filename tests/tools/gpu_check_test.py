#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests tools/gpu_check by running it: as a whole at smoke size on the CPU, without a device, with parts that fail,
hang or run nothing, and carried as a bundle.

    gpu_check_test.py SCRIPT BUILD_DIR
"""
import importlib.machinery
import importlib.util
import io
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT, BUILD = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()


def run(*arguments, **variables):
    return subprocess.run([sys.executable, SCRIPT, *map(str, arguments)], capture_output=True, text=True,
                          env=dict(os.environ, PYTHONDONTWRITEBYTECODE="1", **variables))


def module():
    """Returns the script as a module."""
    loader = importlib.machinery.SourceFileLoader("gpu_check", str(SCRIPT))
    loaded = importlib.util.module_from_spec(importlib.util.spec_from_loader("gpu_check", loader))
    loader.exec_module(loaded)
    return loaded


class GpuCheck(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        self.out = self.folder / "out"

    def results(self):
        return json.loads((self.out / "gpu_check.json").read_text())

    def stub(self, cuda_test):
        """Returns a build folder with the real program and a shell script for cuda_test."""
        build = self.folder / "build"
        for folder in ("tools", "tests/cuda"):
            (build / folder).mkdir(parents=True)
        (build / "tools/shadowdag").symlink_to(BUILD / "tools/shadowdag")
        (build / "tests/cuda/cuda_test").write_text("#!/bin/sh\n" + cuda_test)
        (build / "tests/cuda/cuda_test").chmod(0o755)
        return build

    def test_smoke_does_all_steps_and_ends_with_a_table(self):
        done = run("--backend", "cpu", "--smoke", "--build", BUILD, "-o", self.out)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        results = self.results()
        self.assertEqual(results["failed_steps"], [])
        steps = [step["step"] for step in results["steps"]]
        for name in ("parity cuda_test", "parity voxel_test", "parity shadowmap_test", "parity test_parity",
                     "parity test_frame", "voxelize atrium", "frames atrium dag", "frames atrium exact", "frames atrium maps",
                     "frames atrium hybrid", "rays atrium", "compare atrium"):
            self.assertIn(name, steps)
        self.assertEqual([row["method"] for row in results["frames"]], ["dag", "exact", "maps", "hybrid"])
        for row in results["frames"]:
            self.assertGreater(row["time_ms"], 0)
            self.assertGreaterEqual(row["wall_ms_max"], row["wall_ms"])
            self.assertEqual((row["frame_count"], row["laps"]), (3, 2))
            self.assertIn("shading", row["stages_ms"])
            self.assertGreater(row["pair_count"], 0)
            self.assertGreater(row["host_copy_count"], 0)
        self.assertEqual(results["voxelize"][0]["resolution"], 64)
        self.assertEqual({rate["order"] for rate in results["rays"][0]["rates"]}, {"image", "cluster"})
        notes = {step["step"]: step["note"] for step in results["steps"]}
        self.assertRegex(notes["compare atrium"], r"4 frames, \d+ counts each")
        self.assertRegex(results["commit"], r"^[0-9a-f]{7}")
        lines = done.stdout.strip().splitlines()
        self.assertTrue(lines[-1].startswith("host copies"), lines[-1])
        table = lines[[i for i, line in enumerate(lines) if line.startswith("median ms at 64x36")][0]:]
        self.assertIn("rasterization", " ".join(table))
        self.assertTrue(all(len(line.split()) >= 4 for line in table))

    def test_measures_the_chart_where_it_is_asked_for(self):
        done = run("--backend", "cpu", "--smoke", "--build", BUILD, "-o", self.out, "--only", "chart", "--placed", "builtin:fail-acne")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual([step["step"] for step in self.results()["steps"]][2:], ["chart main_placed_gpu", "chart main_gpu"])
        for experiment, scene in (("main_placed_gpu", "builtin:fail-acne"), ("main_gpu", "builtin:atrium")):
            runs = json.loads((self.out / experiment / "results.json").read_text())["runs"]
            self.assertEqual({run["scene"] for run in runs}, {scene})
            self.assertEqual({run["method"] for run in runs}, {"dag", "maps", "hybrid"})

    def test_without_a_device_says_what_is_missing_and_exits_with_4(self):
        done = run("--build", BUILD, "-o", self.out, CUDA_VISIBLE_DEVICES="")
        self.assertEqual(done.returncode, 4, done.stdout)
        self.assertIn("gpu_check: no device: shadowdag: error: backend 'cuda' is not available", done.stderr)
        self.assertEqual(self.results()["failed_steps"], ["device"])

    def test_names_the_step_that_failed(self):
        report = {"testsuites": [{"name": "Scan", "testsuite": [
            {"name": "Sums/cpu", "result": "COMPLETED", "failures": [{"failure": "3 is not 4"}]},
            {"name": "Sorts/cpu", "result": "COMPLETED"}]}]}
        build = self.stub("for a in \"$@\"; do case $a in --gtest_output=json:*) "
                          f"echo '{json.dumps(report)}' >\"${{a#*json:}}\";; esac; done; echo 3 is not 4; exit 1\n")
        done = run("--backend", "cpu", "--smoke", "--build", build, "--tests", "cuda_test", "-o", self.out)
        self.assertEqual(done.returncode, 1)
        self.assertIn("FAILED: parity cuda_test", done.stdout)
        self.assertEqual(self.results()["failed_steps"], ["parity cuda_test"])
        self.assertIn("1 of 2 failed, status 1: Scan.Sums/cpu", self.results()["steps"][-1]["note"])

    def test_a_binary_that_dies_or_is_absent_is_a_failed_step(self):
        build = self.stub("echo cannot open libfoo.so.1 >&2; exit 127\n")
        done = run("--backend", "cpu", "--build", build, "--tests", "cuda_test,voxel_test", "-o", self.out)
        self.assertEqual(done.returncode, 1)
        notes = {step["step"]: step["note"] for step in self.results()["steps"]}
        self.assertIn("ended with 127: cannot open libfoo.so.1", notes["parity cuda_test"])
        self.assertIn("does not exist", notes["parity voxel_test"])

    def test_sanitizers_run_where_they_are_found_and_what_they_find_is_a_failed_step(self):
        report = {"testsuites": [{"name": "Scan", "testsuite": [{"name": "Sums/cuda", "result": "COMPLETED"}]}]}
        build = self.stub("for a in \"$@\"; do case $a in --gtest_output=json:*) "
                          f"echo '{json.dumps(report)}' >\"${{a#*json:}}\";; esac; done\n")
        program = build / "tools/shadowdag"  # a device answers, as far as this one says
        program.unlink()
        program.write_text("#!/bin/sh\necho '{}'\n")
        sanitizer = self.folder / "bin/compute-sanitizer"
        sanitizer.parent.mkdir()
        sanitizer.write_text("#!/bin/sh\ntool=$2\nwhile [ ! -x \"$1\" ]; do shift; done\n\"$@\"\n"
                             "[ $tool != racecheck ] || { echo ERROR: a race; exit 99; }\n")
        for file in (program, sanitizer):
            file.chmod(0o755)
        done = run("--build", build, "--tests", "cuda_test", "-o", self.out,
                   PATH=f"{sanitizer.parent}:{os.environ['PATH']}")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(self.results()["failed_steps"], ["racecheck cuda_test"])
        steps = {step["step"]: step for step in self.results()["steps"]}
        self.assertTrue(steps["memcheck cuda_test"]["ok"] and steps["initcheck cuda_test"]["ok"])
        self.assertIn("status 99", steps["racecheck cuda_test"]["note"])
        self.assertIn("ERROR: a race", steps["racecheck cuda_test"]["note"])

    def test_an_error_of_the_script_beside_others_is_not_lost(self):
        def broken(*_):
            raise TypeError("no step")
        script = module()
        script.found_tool = lambda name: name
        self.out.mkdir()
        check = script.Check(type("Options", (), {"smoke": True, "minutes": 1, "tests": None, "backend": "cuda"}), self.out)
        check.parity = broken
        with self.assertRaisesRegex(TypeError, "no step"):
            check.sanitize()

    def test_profiles_say_what_every_kernel_of_the_last_whole_frame_takes(self):
        # Four frames of clear, two draws and shade, after kernels of the setup, one as often as frames. Times are 1, 2, ...
        # in ns.
        frame = ["clear", "draw", "draw", "shade"]
        launches = ["build", *["sort"] * 4, *frame, *frame, *frame, *frame]
        metrics = ("gpu__time_duration.sum", "dram__throughput.avg.pct_of_peak_sustained_elapsed",
                   "sm__warps_active.avg.pct_of_peak_sustained_active", "smsp__thread_inst_executed_per_inst_executed.ratio")
        lines = ["==PROF== Connected", '"ID","Kernel Name",' + ",".join(f'"{name}"' for name in metrics),
                 '"","","ns","%","%",""']
        lines += [f'"{i}","{name}","1,{i:03}","{i}","60","32"' for i, name in enumerate(launches)]
        build = self.folder / "build/tools"
        build.mkdir(parents=True)
        (self.folder / "table").write_text("\n".join(lines) + "\n")
        for file, text in ((build / "shadowdag", "echo '{}'"), (self.folder / "bin/ncu", f"cat {self.folder}/table")):
            file.parent.mkdir(exist_ok=True)
            file.write_text(f"#!/bin/sh\n{text}\n")
            file.chmod(0o755)
        path = f"{self.folder / 'bin'}:{os.environ['PATH']}"
        done = run("--build", build.parent, "--only", "profile", "-o", self.out, PATH=path)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual({(row["scene"], row["method"]) for row in self.results()["profiles"]},
                         {(scene, method) for scene in ("atrium", "houses", "necropolis") for method in ("maps", "dag")})
        # The last whole frame is launches 13 to 16: draws take 1.014 + 1.015 us with 14 and 15 %.
        kernels = self.results()["profiles"][0]["kernels"]
        self.assertEqual([row["kernel"] for row in kernels], ["draw", "shade", "clear"])
        self.assertEqual(kernels[0], {"kernel": "draw", "launches": 2, "us": 2.029, "memory_percent": 14.5,
                                      "occupancy_percent": 60.0, "active_lanes": 32.0})
        self.assertIn("4 launches take 0.004 ms", done.stdout)
        for table, reason in (("==ERROR== no permission", "ncu gave no table: ==ERROR== no permission"),
                              (lines[1], "ncu measured no kernel"), ("\n".join(lines[1:3]), "no kernel was launched 4 times")):
            (self.folder / "table").write_text(table + "\n")
            done = run("--build", build.parent, "--only", "profile", "-o", self.out, PATH=path)
            self.assertEqual(done.returncode, 1)
            self.assertIn(reason, done.stdout)

    def test_a_step_that_hangs_ends_with_the_time(self):
        build = self.stub("exec sleep 100\n")
        done = run("--backend", "cpu", "--build", build, "--tests", "cuda_test", "--minutes", "0.1", "-o", self.out)
        self.assertEqual(done.returncode, 1)
        self.assertIn("cuda_test took more than", self.results()["steps"][-1]["note"])

    def test_tests_that_only_skip_are_no_parity(self):
        report = {"testsuites": [{"name": "Scan", "testsuite": [{"name": "Sums/cuda", "result": "SKIPPED"}]}]}
        build = self.stub("for a in \"$@\"; do case $a in --gtest_output=json:*) "
                          f"echo '{json.dumps(report)}' >\"${{a#*json:}}\";; esac; done\n")
        done = run("--backend", "cpu", "--build", build, "--tests", "cuda_test", "-o", self.out)
        self.assertEqual(done.returncode, 1)
        self.assertIn("no test ran: 1 were skipped", self.results()["steps"][-1]["note"])

    def test_pack_carries_what_runs_elsewhere(self):
        bundle = self.folder / "bundle"
        done = run("pack", "--build", BUILD, "--tests", "cuda_test", "--preset", "0", "-o", bundle)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual(sorted(path.name for path in bundle.iterdir()), ["gpu_check", "gpu_check.tar.xz", "main_gpu.json", "main_placed_gpu.json"])
        self.assertLess((bundle / "gpu_check.tar.xz").stat().st_size, 64 << 20)
        done = subprocess.run([sys.executable, bundle / "gpu_check", "--bundle", bundle, "--backend", "cpu", "--smoke",
                               "--tests", "cuda_test", "-o", self.out], capture_output=True, text=True, cwd="/")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        names = [path.name for path in (self.out / "bundle/lib").iterdir()]
        self.assertTrue(any(name.startswith("libtbb") for name in names), names)
        self.assertIn("sdag_openvdb.so", names)  # which the program loads by name, with its libraries
        self.assertTrue(any(name.startswith("libopenvdb") for name in names), names)
        self.assertFalse(any(name.startswith(("libc.", "libm.", "libcuda.", "ld-linux", "libstdc++"))
                             for name in names), names)

    def test_pack_refuses_more_than_may_be_carried(self):
        script = module()
        script.LIMIT_BYTES = 1000
        written = io.BytesIO()
        with self.assertRaises(script.StepFailed):
            limited = script.Limited(written)
            for _ in range(1000):
                limited.write(bytes(300))
        self.assertEqual(written.tell(), 900)
        options = type("Options", (), {"build": BUILD, "output": self.folder / "bundle", "tests": "cuda_test",
                                       "preset": 0})
        with self.assertRaisesRegex(script.StepFailed, "takes more than 0.0 MiB; pack fewer"):
            script.pack(options)
        self.assertEqual(list((self.folder / "bundle").iterdir()), [])

    def test_contradictions_are_wrong_usage(self):
        self.assertEqual(run("--build", BUILD, "--bundle", "x").returncode, 2)
        self.assertEqual(run("pack", "-o", self.folder).returncode, 2)
        done = run("--tests", "cuda_test,nothing")
        self.assertEqual(done.returncode, 2)
        self.assertIn("there is no nothing", done.stderr)
        done = run("--only", "frames,pictures")
        self.assertEqual(done.returncode, 2)
        self.assertIn("--only: there is no pictures; there are parity, voxelize", done.stderr)


if __name__ == "__main__":
    sys.dont_write_bytecode = True
    unittest.main(argv=sys.argv[:1], verbosity=2)
