"""The environment: a scene's closed loop by control periods, the same for the same seed."""

import os
import unittest

import numpy

import mantle
from support import REACH, SCENES

NOISE = SCENES / "reach_noise.toml"
SHORT = {"time.duration": 0.3}


class Episodes(unittest.TestCase):
    def test_an_episode_ends_at_the_scenes_duration(self):
        env = mantle.Env(REACH, SHORT)
        observation, info = env.reset(seed=1)
        self.assertEqual(observation.shape, env.observation_space.shape)
        self.assertEqual(info["time_s"], 0.0)
        rewards, times = [], []
        for _ in range(6):
            observation, reward, terminated, truncated, info = env.step([0.2, 0, 0, 0])
            rewards.append(reward)
            times.append(info["time_s"])
        self.assertTrue(truncated and not terminated)
        numpy.testing.assert_allclose(times, [0.05, 0.1, 0.15, 0.2, 0.25, 0.3], atol=1e-12)
        self.assertAlmostEqual(sum(rewards), -info["cost"], places=12)
        with self.assertRaisesRegex(mantle.BadInput, "reset"):
            env.step([0, 0, 0, 0])

    def test_what_it_pulls_is_what_a_controller_pulls(self):
        env = mantle.Env(REACH, SHORT)
        env.reset(seed=1)
        for _ in range(6):
            *_, info = env.step([0.2, 0, 0, 0])

        class Late:  # an action acts from the SYNC after the one that it is given at
            def __init__(self, parts):
                self.first = True

            def command(self, time_s, estimate, tensions):
                if not self.first:
                    tensions[:] = [0.2, 0, 0, 0]
                self.first = False

        truths = []
        mantle.closed_loop(REACH, SHORT, controller=Late, observer=lambda step: truths.append(step.truth))
        self.assertEqual(info["truth"].q.tobytes(), truths[-1].q.tobytes())

    def test_seeds_decide_the_noise(self):
        env = mantle.Env(NOISE, SHORT)

        def seen(seed=None):
            env.reset(seed=seed)
            return env.step([0, 0, 0, 0])[0].tobytes()

        first, second = seen(5), seen()
        self.assertEqual([seen(5), seen()], [first, second])
        self.assertNotEqual(first, second)
        with self.assertRaisesRegex(mantle.BadInput, "seed"):
            env.reset(seed=-1)

    def test_actions_that_cannot_be(self):
        env = mantle.Env(REACH, SHORT)
        with self.assertRaisesRegex(mantle.BadInput, "reset"):
            env.step([0, 0, 0, 0])
        env.reset(seed=1)
        for action in ([0, 0, 0], [0, 0, 0, float("nan")]):
            with self.assertRaisesRegex(mantle.BadInput, "action"):
                env.step(action)
        self.assertAlmostEqual(env.step([0, 0, 0, 0])[4]["time_s"], 0.05)  # nothing was lost by it
        with self.assertRaisesRegex(mantle.BadInput, "table is missing"):
            mantle.Env(SCENES / "arm_dynamic.toml")

    def test_environments_live_side_by_side_and_end_anywhere(self):
        envs = [mantle.Env(REACH, SHORT) for _ in range(3)]
        for env in envs:
            env.reset(seed=2)
        seen = [env.step(env.action_space.high * share)[0] for env, share in zip(envs, (0.02, 0.02, 0.5))]
        self.assertEqual(seen[0].tobytes(), seen[1].tobytes())
        self.assertNotEqual(seen[0].tobytes(), seen[2].tobytes())
        envs[0].close()
        del envs

    def test_a_fork_cannot_go_on_with_it_and_can_begin_its_own(self):
        env = mantle.Env(REACH, SHORT)
        env.reset(seed=3)
        child = os.fork()
        if child == 0:
            status = 1
            try:
                env.step([0, 0, 0, 0])
            except mantle.BadInput as error:
                status = 0 if "forked" in str(error) else 2
            if status == 0:
                env.reset(seed=3)
                status = 0 if abs(env.step([0, 0, 0, 0])[4]["time_s"] - 0.05) < 1e-12 else 3
                env.close()
            os._exit(status)
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 0)
        self.assertAlmostEqual(env.step([0, 0, 0, 0])[4]["time_s"], 0.05)


class Gymnasium(unittest.TestCase):
    def test_it_is_gymnasiums_where_that_is_installed(self):
        env = mantle.Env(REACH, SHORT)
        self.assertTrue(env.action_space.contains(env.action_space.sample()))
        try:
            import gymnasium
        except ImportError:
            self.assertFalse(env.action_space.contains([2, 0, 0, 0]))
            return
        from gymnasium.utils.env_checker import check_env

        self.assertIsInstance(env, gymnasium.Env)
        check_env(env, skip_render_check=True)


if __name__ == "__main__":
    unittest.main()
