"""Commands from Python: what the program does, to the bit, and what it refuses, in its own words."""

import os
import pathlib
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import unittest
import warnings

import numpy

import mantle
from support import ARM, REACH, SCENES, SHORT, run_program, sets, trajectory_of_program


class Scenes(unittest.TestCase):
    def test_a_scene_says_what_is_in_it(self):
        scene = mantle.load(REACH, {"time.duration": 3})
        self.assertEqual((scene.name, scene.duration_s, scene.has_control), ("reach", 3.0, True))
        self.assertEqual(scene.motors, ["arm.a", "arm.b", "arm.c", "arm.d"])
        low, high = scene.tension_limits
        self.assertTrue((low == 0).all() and (high == 1).all())
        self.assertNotEqual(scene.fingerprint, mantle.load(REACH).fingerprint)

    def test_a_scene_goes_to_other_processes(self):
        scene = mantle.load(REACH, {"time.duration": 3})
        again = pickle.loads(pickle.dumps(scene))
        self.assertEqual((again.file, again.overrides, again.fingerprint), (scene.file, scene.overrides, scene.fingerprint))

    def test_overrides_of_every_kind_are_what_set_reads(self):
        scene = mantle.load(ARM, {"time.step": numpy.float64(0.002), "arms.arm.elements": numpy.int64(7),
                                  "arms.arm.length": "40 cm", "effects.drag": False, "robot.root": "clamped"})
        self.assertIn("elements = 7", scene.text)
        self.assertIn("step = 0.002", scene.text)
        self.assertEqual(mantle.load(ARM, ["arms.arm.elements=7"]).text, mantle.load(ARM, {"arms.arm.elements": 7}).text)

    def test_what_cannot_be_is_refused_in_the_programs_words(self):
        for arguments, overrides in ((("nowhere.toml",), None), ((ARM,), {"time.step": -1}), ((ARM,), {"time.nonsense": 1}),
                                     ((ARM,), {"time.step": float("nan")})):
            with self.assertRaises(mantle.BadInput) as caught:
                mantle.load(*arguments, overrides)
            done = run_program("check", *arguments, *sets(overrides))
            self.assertEqual(done.returncode, 2)
            self.assertEqual(f"mantle: {caught.exception}\n", done.stderr)
        with self.assertRaisesRegex(mantle.BadInput, "must be a number"):
            mantle.load(ARM, {"time.step": object()})
        self.assertTrue(issubclass(mantle.BadInput, ValueError) and issubclass(mantle.CannotGoOn, RuntimeError))

    def test_check_says_what_a_run_costs(self):
        report = mantle.check(ARM)
        self.assertGreater(report["us_per_step"], 0)
        with self.assertRaisesRegex(mantle.BadInput, "model"):
            mantle.check(ARM, model="middling")


class Runs(unittest.TestCase):
    def test_numbers_are_the_programs_to_the_last_bit(self):
        results = mantle.run(ARM, SHORT)
        expected = trajectory_of_program(ARM, *sets(SHORT))
        self.assertEqual(list(results.trajectory), list(expected))
        for name in expected:
            self.assertEqual(results.trajectory[name].tobytes(), expected[name].tobytes(), name)
        self.assertEqual(results.trajectory["time_s"][-1], 0.2)
        self.assertEqual(results["sim_time_s"], 0.2)
        self.assertTrue(results.complete)

    def test_columns_cannot_be_written_and_unknown_ones_name_the_known(self):
        table = mantle.run(ARM, SHORT).trajectory
        with self.assertRaises(ValueError):
            table["time_s"][0] = 1
        with self.assertRaisesRegex(KeyError, "known: time_s"):
            table["tim_s"]
        self.assertEqual(table.matrix("root_x_m", "root_y_m").shape, (table.rows, 2))

    def test_a_folder_is_the_programs_and_stays(self):
        with tempfile.TemporaryDirectory() as work:
            results = mantle.run(ARM, SHORT, out=f"{work}/out", shape_every=2)
            self.assertIn("telemetry.lcmlog", results.files)
            again = mantle.Results(f"{work}/out")
            self.assertEqual(again["scene"], "arm_dynamic")
            with self.assertRaisesRegex(mantle.BadInput, "known: trajectory"):
                again.table("solver")
        with self.assertRaisesRegex(mantle.BadInput, "holds no results"):
            mantle.Results(work)

    def test_logs_and_shapes_are_arrays(self):
        results = mantle.run(ARM, SHORT)
        log = results.log
        self.assertIn("MANTLE_STATE", log.channels)
        states = log.channel("MANTLE_STATE")
        self.assertEqual(states.rows, results.trajectory.rows)
        self.assertTrue((states["root_position_0"] == results.trajectory["root_x_m"]).all())
        shapes = results.shapes()
        self.assertTrue((shapes["arm_position_m"][:, -1, 0] == results.trajectory["arm_tip_x_m"]).all())
        with self.assertRaisesRegex(mantle.BadInput, "no message of ours"):
            log.channel("MANTLE_NONE")

    def test_the_reduced_model_and_closed_loops_run_too(self):
        self.assertEqual(mantle.run(REACH, SHORT, model="reduced")["model"], "reduced")
        loop = mantle.run(REACH, SHORT, controller="pid")
        self.assertEqual(loop["control"]["controller"], "pid")
        with self.assertRaisesRegex(mantle.BadInput, "controller"):
            mantle.run(REACH, SHORT, controller="nobody")

    def test_a_run_that_cannot_go_on_leaves_what_it_reached(self):
        # The jet of the paper's mantle runs away at this pressure (docs/model.md).
        broken = {"time.integrator": "rk4", "time.step": 0.01, "time.duration": 0.5}
        with self.assertRaises((mantle.CannotGoOn, mantle.BadInput)):
            mantle.run(SCENES / "arm_dynamic.toml", broken)

    def test_pandas_is_asked_for_only_where_it_is_wanted(self):
        table = mantle.run(ARM, SHORT).trajectory
        try:
            import pandas
        except ImportError:
            with self.assertRaises(ImportError):
                table.to_pandas()
        else:
            frame = table.to_pandas()
            self.assertIsInstance(frame, pandas.DataFrame)
            self.assertTrue((frame["time_s"].to_numpy() == table["time_s"]).all())

    def test_runs_of_two_threads_do_not_mix(self):
        found = {}

        def go(step):
            found[step] = mantle.run(ARM, {**SHORT, "time.step": step}).trajectory["arm_tip_x_m"].tobytes()

        threads = [threading.Thread(target=go, args=(step,)) for step in (0.002, 0.005)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for step, tip in found.items():
            self.assertEqual(tip, mantle.run(ARM, {**SHORT, "time.step": step}).trajectory["arm_tip_x_m"].tobytes())
        self.assertEqual(len(set(found.values())), 2)


class OtherCommands(unittest.TestCase):
    def test_static_finds_the_equilibrium(self):
        results = mantle.static(SCENES / "elastica.toml")
        self.assertEqual(results["unstable_directions"], 0)
        self.assertGreater(results.table("path").rows, 2)
        self.assertIn("x_m", results.table("shape"))
        with self.assertRaisesRegex(mantle.BadInput, "robot.root"):
            mantle.static(SCENES / "neutral_body.toml")

    def test_compare_modes_and_studies(self):
        self.assertLess(mantle.compare(REACH, SHORT)["reduced_error_tip"], 0.05)
        self.assertGreater(mantle.modes(SCENES / "arm_static.toml", count=2).table("shapes").rows, 0)
        study = mantle.study("control", REACH, SHORT, options=["--controllers", "gait,pid"])
        self.assertEqual([run["controller"] for run in study["runs"]], ["gait", "pid"])
        with self.assertRaises(mantle.BadInput):
            mantle.study("nonsense", REACH)


class Interrupts(unittest.TestCase):
    def test_ctrl_c_ends_a_run_and_keeps_what_it_reached(self):
        with tempfile.TemporaryDirectory() as work:
            code = f"import mantle\nmantle.run({str(ARM)!r}, {{'time.duration': 2000}}, out={work + '/out'!r})\n"
            process = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True)
            partial = pathlib.Path(work) / "out.partial"
            while not (partial / "telemetry.lcmlog").exists():
                self.assertIsNone(process.poll(), "it ended by itself")
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=60)
            self.assertIn("KeyboardInterrupt", errors)
            self.assertEqual(mantle.Results(partial)["reason"], "interrupted")
            self.assertFalse((pathlib.Path(work) / "out").exists())


if __name__ == "__main__":
    warnings.simplefilter("default")
    unittest.main()
