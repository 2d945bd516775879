"""The plant stepped by hand: the program's bits, views that live as long as they are held, and what is refused."""

import gc
import math
import os
import threading
import unittest

import numpy

import mantle
from support import ARM, REACH, SCENES, sets, trajectory_of_program

DURATION = {"time.duration": 0.3}


class Steps(unittest.TestCase):
    def test_observations_are_rows_of_the_program(self):
        simulation = mantle.Simulation(mantle.load(ARM, DURATION))
        expected = trajectory_of_program(ARM, *sets(DURATION))
        for row, time_s in enumerate(expected["time_s"]):
            simulation.advance_to(time_s)
            for name, value in simulation.observe().items():
                # Energies are accounted from t = 0 in a run; all else is of the instant.
                if name != "power_balance_residual":
                    self.assertEqual(value, expected[name][row], (name, time_s))

    def test_one_long_advance_is_the_many(self):
        simulation = mantle.Simulation(mantle.load(ARM, DURATION))
        simulation.advance_to(0.3)
        expected = trajectory_of_program(ARM, *sets(DURATION))
        self.assertEqual(simulation.observe()["arm_tip_x_m"], expected["arm_tip_x_m"][-1])

    def test_shapes_are_views_that_follow_and_outlive_their_owner(self):
        simulation = mantle.Simulation(mantle.load(ARM))
        arm = simulation.shape.arms["arm"]
        position, strain = arm.position_m, arm.strain
        self.assertEqual(position.shape, (len(arm.arc_length_m), 3))
        self.assertEqual(strain.shape, (len(position) - 1, 6))
        before = position.copy()
        simulation.advance_to(0.1)
        self.assertGreater(abs(position - before).max(), 1e-6)  # the same array has moved
        self.assertEqual(position[-1, 0], simulation.observe()["arm_tip_x_m"])
        self.assertFalse(position.flags.writeable or strain.flags.writeable)
        with self.assertRaises(ValueError):
            position[0, 0] = 1
        with self.assertRaises(ValueError):
            position.flags.writeable = True
        tip = position[-1].copy()
        del simulation, arm
        gc.collect()
        self.assertTrue((position[-1] == tip).all())

    def test_strains_are_those_of_the_poses(self):
        simulation = mantle.Simulation(mantle.load(SCENES / "vehicle.toml"))
        simulation.advance_to(0.2)
        arm = simulation.shape.arms["arm"]
        # A fine element's bending and torsion are twice its vector part over its length, to the third order.
        w = arm.quaternion_wxyz
        conjugate = w[:-1] * [1, -1, -1, -1]
        a, b = conjugate, w[1:]
        vector = a[:, :1] * b[:, 1:] + b[:, :1] * a[:, 1:] + numpy.cross(a[:, 1:], b[:, 1:])
        length = numpy.diff(arm.arc_length_m)[:, None]
        self.assertLess(abs(2 * vector / length - arm.strain[:, :3]).max(), 1e-2 * abs(arm.strain[:, :3]).max() + 1e-9)
        profile = simulation.shape.mantle.profile
        r, z = profile[:, 0], profile[:, 1]
        volume = abs(math.pi / 3 * ((r[1:] ** 2 + r[1:] * r[:-1] + r[:-1] ** 2) * numpy.diff(z)).sum())
        self.assertLess(abs(volume / simulation.observe()["volume_m3"] - 1), 1e-12)

    def test_a_tension_by_hand_pulls_and_is_given_back(self):
        scene = mantle.load(REACH)
        pulled, free = mantle.Simulation(scene), mantle.Simulation(scene)
        self.assertEqual(pulled.cables, ["arm.a", "arm.b", "arm.c", "arm.d"])
        pulled.set_tension("arm.a", 0.5)
        for simulation in (pulled, free):
            simulation.advance_to(0.2)
        self.assertEqual(pulled.observe()["arm_a_tension_n"], 0.5)
        tips = [s.shape.arms["arm"].position_m[-1] for s in (pulled, free)]
        self.assertGreater(numpy.linalg.norm(tips[0] - tips[1]), 1e-3)
        pulled.set_tension("arm.a", None)
        pulled.advance_to(0.25)
        self.assertEqual(pulled.observe()["arm_a_tension_n"], 0.0)

    def test_a_checkpoint_goes_on_with_the_same_bits(self):
        scene = mantle.load(ARM)
        first, second = mantle.Simulation(scene), mantle.Simulation(scene)
        first.advance_to(0.1)
        second.restore(first.checkpoint())
        for simulation in (first, second):
            simulation.advance_to(0.2)
        self.assertTrue((first.shape.arms["arm"].position_m == second.shape.arms["arm"].position_m).all())
        with self.assertRaises(mantle.BadInput):
            first.restore(first.checkpoint()[:-40])


class Refusals(unittest.TestCase):
    def test_times_and_tensions_that_cannot_be(self):
        simulation = mantle.Simulation(mantle.load(REACH))
        simulation.advance_to(0.05)
        for time_s in (0.01, math.nan, math.inf):
            with self.assertRaisesRegex(mantle.BadInput, "advance_to"):
                simulation.advance_to(time_s)
        for tension in (-1.0, math.nan, math.inf):
            with self.assertRaisesRegex(mantle.BadInput, "arm.a"):
                simulation.set_tension("arm.a", tension)
        with self.assertRaisesRegex(mantle.BadInput, "known: arm.a"):
            simulation.set_tension("arm.z", 1)
        for call in (lambda: simulation.advance_to("soon"), lambda: simulation.set_tension("arm.a", "much")):
            with self.assertRaises(TypeError):
                call()
        self.assertEqual(simulation.time_s, 0.05)

    def test_scenes_that_do_not_run(self):
        with self.assertRaisesRegex(mantle.BadInput, "time: table is missing"):
            mantle.Simulation(mantle.load(SCENES / "arm_static.toml"))
        with self.assertRaises(TypeError):
            mantle.Simulation(str(ARM))

    def test_another_thread_is_refused_while_it_advances(self):
        simulation = mantle.Simulation(mantle.load(SCENES / "octopus.toml"))
        thread = threading.Thread(target=simulation.advance_to, args=(0.6,))
        thread.start()
        refused = False
        while thread.is_alive() and not refused:
            try:
                simulation.observe()
            except mantle.BadInput as error:
                refused = "another thread" in str(error)
        thread.join()
        self.assertTrue(refused)
        self.assertAlmostEqual(simulation.time_s, 0.6)

    def test_a_fork_goes_its_own_way(self):
        simulation = mantle.Simulation(mantle.load(ARM))
        simulation.advance_to(0.05)
        child = os.fork()
        if child == 0:
            simulation.advance_to(0.1)
            os._exit(0 if simulation.time_s >= 0.1 else 1)
        self.assertEqual(os.waitpid(child, 0)[1], 0)
        self.assertEqual(simulation.time_s, 0.05)


if __name__ == "__main__":
    unittest.main()
