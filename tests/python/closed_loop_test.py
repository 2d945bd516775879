"""Closed loops with parts written in Python: in the loop as ours are, and what they cannot break."""

import math
import os
import signal
import tempfile
import threading
import unittest
import weakref

import numpy

import mantle
from support import REACH, SCENES, SHORT, sets, trajectory_of_program


class Spring:
    """Pulls the tip to its reference; the C++ of examples/own_controller.cc."""

    def __init__(self, parts):
        self.parts = parts

    def command(self, time_s, estimate, tensions):
        tensions[:] = 0.02
        if estimate is not None:
            error, rate = self.parts.reference.aim(estimate)
            tensions += numpy.maximum(0, self.parts.pull_directions.T @ (4.0 * error + 0.3 * rate))


class Quiet:
    def __init__(self, parts):
        pass

    def command(self, time_s, estimate, tensions):
        return tensions


class Controllers(unittest.TestCase):
    def test_a_run_in_this_process_has_the_programs_bits(self):
        results = mantle.closed_loop(REACH, SHORT, controller="pid")
        expected = trajectory_of_program(REACH, *sets(SHORT), "--controller", "pid")
        for name in results.trajectory:
            if name != "error":
                self.assertTrue((results.trajectory[name] == expected[name]).all(), name)
        self.assertTrue((results.trajectory["error"] == expected["error_tip_m"]).all())

    def test_what_is_saved_is_a_folder_of_results(self):
        loop = mantle.closed_loop(REACH, SHORT, controller=Quiet)
        with tempfile.TemporaryDirectory() as work:
            folder = loop.save(f"{work}/new/out")
            again = mantle.Results(folder)
            self.assertEqual(again.summary, loop.summary)
            self.assertTrue((again.trajectory.matrix() == loop.trajectory.matrix()).all())
            self.assertEqual(again.files, ["summary.json", "trajectory.csv"])
            with self.assertRaisesRegex(mantle.BadInput, "is there already"):
                loop.save(folder)
            with self.assertRaisesRegex(mantle.BadInput, "cannot be written"):
                loop.save(folder / "summary.json/out")
            try:
                self.assertGreater(mantle.report(folder).stat().st_size, 10_000)
            except mantle.BadInput as error:  # built without npm
                self.assertIn("page is missing", str(error))

    def test_a_controller_of_python_steers(self):
        steered = mantle.closed_loop(REACH, {"time.duration": 2.5}, controller=Spring)
        quiet = mantle.closed_loop(REACH, {"time.duration": 2.5}, controller=Quiet)
        self.assertLess(steered["control"]["error"]["final"], 0.7 * quiet["control"]["error"]["final"])

    def test_it_is_called_as_the_contract_says(self):
        calls = []

        class Noting:
            def __init__(self, parts):
                calls.append(("made", parts.motors, parts.limits.tolist(), parts.period_s))

            def start(self, estimate):
                calls.append(("start", estimate.time_s))

            def update(self, time_s, estimate, tensions):
                calls.append(("update", time_s, estimate.time_s))

            def prepare(self, time_s, tensions):
                calls.append(("prepare", time_s))

            def command(self, time_s, estimate, tensions):
                calls.append(("command", time_s))
                return [0.1, 0.2, 0.0, 0.3]

        results = mantle.closed_loop(REACH, SHORT, controller=Noting)
        names = [call[0] for call in calls]
        self.assertEqual(calls[0][1:], (["arm.a", "arm.b", "arm.c", "arm.d"], [[0, 1, 2]] * 4, 0.05))
        self.assertEqual(names[:4], ["made", "start", "update", "command"])
        self.assertEqual((names.count("command"), names.count("update")), (20, 4))  # of 200 ms: 10 ms, 50 ms
        self.assertTrue(all(call[1] == call[2] for call in calls if call[0] == "update"))
        command = results.trajectory.matrix("command_arm.a_n", "command_arm.b_n", "command_arm.c_n", "command_arm.d_n")
        self.assertTrue((command[-1] == [0.1, 0.2, 0.0, 0.3]).all())

    def test_what_it_raises_ends_the_run_and_is_raised(self):
        class Broken(Quiet):
            def command(self, time_s, estimate, tensions):
                if time_s > 0.1:
                    raise ZeroDivisionError("mine")

        with self.assertRaisesRegex(ZeroDivisionError, "mine"):
            mantle.closed_loop(REACH, SHORT, controller=Broken)

        def refuses(parts):
            raise LookupError("no such gain")

        with self.assertRaisesRegex(LookupError, "no such gain"):
            mantle.closed_loop(REACH, SHORT, controller=refuses)
        self.assertTrue(mantle.closed_loop(REACH, SHORT, controller=Quiet).complete)  # nothing is left of them

    def test_tensions_that_cannot_be(self):
        for returned, why in (([0.1, 0.2], "returned 2 tensions, must be 4"), ([0, 0, math.nan, 0], '"arm.c": nan N'),
                              (numpy.zeros((4, 1)), r"the shape \(4, 1\), must be \(4,\)"), ([0, 0, 0, math.inf], "arm.d")):
            with self.assertRaisesRegex(mantle.BadInput, why):
                mantle.closed_loop(REACH, SHORT, controller=lambda parts, r=returned: _Returning(r))
        with self.assertRaises((TypeError, ValueError)):
            mantle.closed_loop(REACH, SHORT, controller=lambda parts: _Returning("much"))
        with self.assertRaisesRegex(TypeError, "must have a method command"):
            mantle.closed_loop(REACH, SHORT, controller=lambda parts: object())
        with self.assertRaisesRegex(TypeError, "class or function"):
            mantle.closed_loop(REACH, SHORT, controller=3)

    def test_limits_are_kept_for_it(self):
        results = mantle.closed_loop(REACH, SHORT, controller=lambda parts: _Returning([1e9, -1e9, 0, 0]))
        command = results.trajectory["command_arm.a_n"]
        self.assertLessEqual(command.max(), 1.0)
        self.assertLessEqual(numpy.diff(command).max(), 2 * 0.02 + 1e-12)  # N/s over an output interval
        self.assertEqual(results.trajectory["command_arm.b_n"].min(), 0.0)

    def test_its_model_ends_with_the_run_and_its_states_do_not(self):
        kept = {}

        class Keeping(Quiet):
            def __init__(self, parts):
                kept["parts"] = parts

            def command(self, time_s, estimate, tensions):
                kept["tip"] = kept["parts"].model.tip(estimate)[0]
                kept.setdefault("states", []).append(estimate)

        mantle.closed_loop(REACH, SHORT, controller=Keeping)
        self.assertEqual(kept["tip"].shape, (3,))
        times = [state.time_s for state in kept["states"]]
        self.assertEqual(times, sorted(set(times)))  # each its own
        for use in (lambda: kept["parts"].model.state(), lambda: kept["parts"].model.motors,
                    lambda: kept["parts"].reference.aim(kept["states"][0])):
            with self.assertRaisesRegex(mantle.BadInput, "has ended"):
                use()
        self.assertEqual(kept["parts"].reference.at(0.0)["tip_m"].shape, (3,))  # the goal is its own

    def test_it_is_let_go_of_after_the_run(self):
        class Plain(Quiet):
            pass

        made = []

        def make(parts):
            controller = Plain(parts)
            made.append(weakref.ref(controller))
            return controller

        mantle.closed_loop(REACH, SHORT, controller=make)
        self.assertIsNone(made[0]())

    def test_a_run_within_a_run_is_refused(self):
        class Nesting(Quiet):
            def command(self, time_s, estimate, tensions):
                mantle.closed_loop(REACH, SHORT, controller="gait")

        with self.assertRaisesRegex(mantle.BadInput, "cannot begin another"):
            mantle.closed_loop(REACH, SHORT, controller=Nesting)

    def test_two_threads_with_two_controllers(self):
        results = {}

        def go(pull):
            results[pull] = mantle.closed_loop(REACH, SHORT, controller=lambda parts: _Returning([pull, 0, 0, 0]))

        threads = [threading.Thread(target=go, args=(pull,)) for pull in (0.05, 0.1)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for pull, found in results.items():
            self.assertEqual(found.trajectory["command_arm.a_n"][-1], pull)

    def test_predictive_controllers_run_side_by_side(self):
        # With Ipopt, whose linear solver has one set of variables for the process.
        overrides = {"time.duration": 0.15, "control.solver": "ipopt"}
        alone = mantle.closed_loop(REACH, overrides).trajectory.matrix().tobytes()
        found = []
        threads = [threading.Thread(target=lambda: found.append(
            mantle.closed_loop(REACH, overrides).trajectory.matrix().tobytes())) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(found, [alone, alone])

    def test_scenes_without_a_loop_are_refused(self):
        with self.assertRaisesRegex(mantle.BadInput, "control: table is missing"):
            mantle.closed_loop(SCENES / "arm_dynamic.toml", controller=Quiet)
        with self.assertRaisesRegex(mantle.BadInput, "stands for one that is given"):
            mantle.closed_loop(REACH, {**SHORT, "control.controller": "python"})


class _Returning:
    def __init__(self, tensions):
        self.tensions = tensions

    def command(self, time_s, estimate, tensions):
        return self.tensions


class Estimators(unittest.TestCase):
    def test_the_measurement_itself_is_what_ours_makes_of_perfect_sensors(self):
        measured_at, errors = set(), {}

        class Passing:
            def __init__(self, parts):
                pass

            def update(self, time_s, tensions, measured):
                if measured is not None:
                    measured_at.add(time_s)
                return measured

        def observer(step):
            if step.time_s in measured_at:
                errors[step.time_s] = abs(step.estimate.q - step.truth.q).max()

        results = mantle.closed_loop(REACH, SHORT, controller="pid", estimator=Passing, observer=observer)
        self.assertTrue(results.complete)
        self.assertGreater(len(errors), 2)
        self.assertLess(max(errors.values()), 1e-12)

    def test_states_that_cannot_be(self):
        def returning(state):
            class Wrong:
                def __init__(self, parts):
                    pass

                def update(self, time_s, tensions, measured):
                    return state(measured)

            return Wrong

        def with_nan(measured):
            measured.q[0] = math.nan
            return measured

        other = mantle.ReducedModel(mantle.load(SCENES / "vehicle.toml")).state()
        with self.assertRaisesRegex(mantle.BadInput, "not finite"):
            mantle.closed_loop(REACH, SHORT, controller="pid", estimator=returning(with_nan))
        with self.assertRaisesRegex(mantle.BadInput, "must be"):
            mantle.closed_loop(REACH, SHORT, controller="pid", estimator=returning(lambda _: other))
        with self.assertRaisesRegex(TypeError, "ReducedState"):
            mantle.closed_loop(REACH, SHORT, controller="pid", estimator=returning(lambda _: 7))


class Observers(unittest.TestCase):
    def test_it_sees_every_sync_and_may_stop(self):
        steps = []

        def observer(step):
            steps.append(step)
            return step.time_s < 0.095

        results = mantle.closed_loop(REACH, SHORT, controller="gait", observer=observer)
        self.assertFalse(results.complete)
        self.assertEqual(results.reason, "stopped by its observer")
        self.assertEqual(len(steps), 11)
        self.assertEqual(len({step.truth.q.tobytes() for step in steps}), 11)
        self.assertGreater(steps[-1].cost, steps[1].cost)

    def test_ctrl_c_stops_the_loop_in_order(self):
        began = threading.Event()
        threading.Thread(target=lambda: (began.wait(60), os.kill(os.getpid(), signal.SIGINT))).start()
        with self.assertRaises(KeyboardInterrupt):
            mantle.closed_loop(REACH, {"time.duration": 500}, controller=Quiet, observer=lambda step: began.set())
        self.assertTrue(mantle.closed_loop(REACH, SHORT, controller=Quiet).complete)


if __name__ == "__main__":
    unittest.main()
