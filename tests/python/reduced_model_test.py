"""The reduced model stepped by hand: the program's bits, exact derivatives, and what is refused."""

import copy
import gc
import math
import unittest

import numpy

import mantle
from support import ARM, REACH, SCENES, sets, trajectory_of_program

DURATION = {"time.duration": 0.2}
# Central differences with increments of 1e-5 of a step that is solved to round-off: errors of that over the
# increment, and of the third derivative.
DIFFERENCE, AGREE = 1e-5, 1e-4


class Steps(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = mantle.load(REACH, DURATION)
        cls.model = mantle.ReducedModel(cls.scene)

    def test_a_run_by_hand_is_the_programs_to_the_last_bit(self):
        expected = trajectory_of_program(REACH, *sets(DURATION), "--model", "reduced")
        state = self.model.state()
        for row, time_s in enumerate(expected["time_s"]):
            if row > 0:
                state = self.model.step(state, time_s - state.time_s)
            # Steps end where the run's do to round-off of the time.
            tip = self.model.shape(state).arms["arm"].position_m[-1]
            for k, axis in enumerate("xyz"):
                self.assertLess(abs(tip[k] - expected[f"arm_tip_{axis}_m"][row]), 1e-12)

    def test_vectors_are_writable_views_that_outlive_their_state(self):
        state = self.model.state()
        q, v = state.q, state.v
        self.assertEqual((q.size, v.size), (self.model.coordinate_count, self.model.velocity_count))
        q[3] = 0.25
        self.assertEqual(state.q[3], 0.25)
        other = copy.deepcopy(state)
        other.q[3] = 1.0
        self.assertEqual(q[3], 0.25)
        del state
        gc.collect()
        self.assertEqual(q[3], 0.25)

    def test_jacobians_are_the_derivatives_of_a_step(self):
        model = mantle.ReducedModel(mantle.load(REACH, {"reduced.tolerance": 1e-13}))
        tensions = numpy.array([0.3, 0.1, 0.0, 0.2])
        state = model.step(model.state(), 0.1, tensions)
        end, by_state, by_input = model.step(state, 0.12, tensions, jacobian=True)
        n = model.velocity_count
        self.assertEqual((by_state.shape, by_input.shape), ((2 * n, 2 * n), (2 * n, 4)))
        for column in (6, 9, n + 7):
            by = numpy.zeros(2 * n)
            by[column] = DIFFERENCE
            plus, minus = (model.step(model.move(state, s * by), 0.12, tensions) for s in (1, -1))
            difference = model.difference(minus, plus) / (2 * DIFFERENCE)
            self.assertLess(abs(difference - by_state[:, column]).max(), AGREE * abs(by_state[:, column]).max(), column)
        for motor in range(4):
            by = numpy.zeros(4)
            by[motor] = DIFFERENCE
            plus, minus = (model.step(state, 0.12, tensions + s * by) for s in (1, -1))
            difference = model.difference(minus, plus) / (2 * DIFFERENCE)
            self.assertLess(abs(difference - by_input[:, motor]).max(), AGREE * abs(by_input[:, motor]).max(), motor)

    def test_tip_and_volume_with_their_derivatives(self):
        vehicle = mantle.ReducedModel(mantle.load(SCENES / "vehicle.toml"))
        state = vehicle.state()
        state.q[:] += numpy.linspace(-0.1, 0.1, state.q.size)
        place, jacobian = vehicle.tip(state)
        shape = vehicle.shape(state)
        self.assertLess(abs(place - shape.arms["arm"].position_m[-1]).max(), 1e-9)
        n = vehicle.velocity_count
        volume, by_q = vehicle.volume(state)
        for column in (0, 2, 4, 7, n - 1):
            by = numpy.zeros(2 * n)
            by[column] = DIFFERENCE
            plus, minus = vehicle.move(state, by), vehicle.move(state, -by)
            slope = (vehicle.tip(plus)[0] - vehicle.tip(minus)[0]) / (2 * DIFFERENCE)
            self.assertLess(abs(slope - jacobian[:, column]).max(), 1e-6)
            slope = (vehicle.volume(plus)[0] - vehicle.volume(minus)[0]) / (2 * DIFFERENCE)
            expected = by_q[column - 6] if column >= 6 else 0.0
            self.assertLess(abs(slope - expected), 1e-6 * max(abs(by_q).max(), 1e-6))
        self.assertGreater(volume, 0)
        with self.assertRaisesRegex(mantle.BadInput, "no mantle"):
            self.model.volume(self.model.state())

    def test_the_linearisation_balances_the_acceleration(self):
        model = self.model
        state = model.step(model.state(), 0.1, [0.5, 0, 0, 0])
        a = model.acceleration(state, [0.5, 0, 0, 0])
        parts = model.linearise(state, a, [0.5, 0, 0, 0])
        self.assertLess(abs(parts["residual"][6:]).max(), 1e-8)
        self.assertLess(abs(parts["mass"] - parts["mass"].T).max(), 1e-12)
        self.assertEqual(parts["input"].shape, (model.velocity_count, 4))


class Refusals(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.model = mantle.ReducedModel(mantle.load(REACH))

    def test_wrong_shapes_and_numbers(self):
        model, state = self.model, self.model.state()
        with self.assertRaisesRegex(mantle.BadInput, r"tensions: has the shape \(3\), must be \(4,\)"):
            model.step(state, 0.01, [0, 0, 0])
        with self.assertRaisesRegex(mantle.BadInput, "entry 1 is nan"):
            model.step(state, 0.01, [0, math.nan, 0, 0])
        for dt_s in (0.0, -0.01, math.nan, math.inf):
            with self.assertRaisesRegex(mantle.BadInput, "dt_s"):
                model.step(state, dt_s)
        late = model.state()
        late.time_s = 1e18
        with self.assertRaisesRegex(mantle.BadInput, "lost in the digits"):
            model.step(late, 0.01)
        state.q[0] = math.nan
        with self.assertRaisesRegex(mantle.BadInput, "not finite"):
            model.step(state, 0.01)
        with self.assertRaisesRegex(mantle.BadInput, "must be 1"):
            model.state().root_quaternion_wxyz = [1, 1, 0, 0]
        with self.assertRaises((mantle.BadInput, TypeError, ValueError)):
            model.step(model.state(), 0.01, "tensions")

    def test_states_of_another_model(self):
        other = mantle.ReducedModel(mantle.load(SCENES / "vehicle.toml"))
        with self.assertRaisesRegex(mantle.BadInput, "entries, must be"):
            self.model.step(other.state(), 0.01)
        with self.assertRaisesRegex(mantle.BadInput, "no arm is called"):
            self.model.tip(self.model.state(), "leg")

    def test_jacobians_in_a_current(self):
        model = mantle.ReducedModel(mantle.load(REACH, {"effects.current": [0.1, 0, 0]}))
        with self.assertRaisesRegex(mantle.BadInput, "current"):
            model.step(model.state(), 0.01, jacobian=True)
        self.assertGreater(abs(model.step(model.state(), 0.1).q).max(), 1e-4)  # the arm bends


if __name__ == "__main__":
    unittest.main()
