"""The closed loop of a scene as an environment for learning: reset, step, seeds."""

import numpy

from mantle import _mantle
from mantle.commands import override_list
from mantle.errors import BadInput, CannotGoOn

try:
    import gymnasium as _gymnasium
except ImportError:
    _gymnasium = None

_Base = _gymnasium.Env if _gymnasium is not None else object


class _Box:
    """What Env needs of gymnasium.spaces.Box where gymnasium is not installed."""

    def __init__(self, low, high):
        self.low, self.high = low, high
        self.shape, self.dtype = low.shape, low.dtype
        self._random = numpy.random.default_rng()

    def seed(self, seed=None):
        self._random = numpy.random.default_rng(seed)

    def sample(self):
        low = numpy.where(numpy.isfinite(self.low), self.low, -1.0)
        return self._random.uniform(low, numpy.where(numpy.isfinite(self.high), self.high, 1.0))

    def contains(self, x):
        x = numpy.asarray(x)
        return x.shape == self.shape and bool((x >= self.low).all() and (x <= self.high).all())


def _box(low, high):
    if _gymnasium is None:
        return _Box(low, high)
    return _gymnasium.spaces.Box(low, high, dtype=numpy.float64)


class Env(_Base):
    """A scene's closed loop with what it is told as the controller: drives, sensors and estimator of the scene.

    A gymnasium.Env where gymnasium is installed, and the same without.

    Action: the tension of every motor [N], float64 of shape (motors,), from the next SYNC on, as a plan of the
    scene's own controller. It is held for a control period (control.period of the scene); the motors' limits and
    rates are kept by the loop.

    Observation, float64: what the estimator says at the beginning of a control period, one behind the other:
        root position [m] (3), root quaternion w, x, y, z (4), strain and shape coordinates q (coordinate_count),
        root twist and their rates v (velocity_count), actual tensions [N] (motors), the error of the goal (1).
    info: time_s, cost (since t = 0), error, estimate and truth (ReducedState), and at the end reason.

    Reward: minus the scene's stage cost over the control period, so that an episode's sum is minus its cost.
    truncated: the scene's duration has come. terminated: the run could not go on.

    seed: reset(seed=...) seeds the noise of the sensors ([sensors] seed of the scene); without one, every reset of
    an Env made from the same arguments draws the next seed of its own generator, that the first seed started.
    """

    metadata = {"render_modes": []}

    def __init__(self, scene, overrides=None):
        if isinstance(scene, _mantle.Scene):
            self._file, before = scene.file, scene.overrides
        else:
            self._file, before = str(scene), []
        self._overrides = [*before, *override_list(overrides)]
        self.scene = _mantle.Scene(self._file, self._overrides)
        if not self.scene.has_control:
            raise BadInput(f"{self._file}: control: table is missing: an Env needs [control]")
        low, high = self.scene.tension_limits
        self.action_space = _box(low.copy(), high.copy())
        self._random = numpy.random.default_rng()
        self._episode = None
        self._cost = 0.0
        model = _mantle.ReducedModel(self.scene)
        size = 3 + 4 + model.coordinate_count + model.velocity_count + len(model.motors) + 1
        self.observation_space = _box(numpy.full(size, -numpy.inf), numpy.full(size, numpy.inf))

    def _begin(self, seed):
        self._episode = _mantle.Episode(_mantle.Scene(self._file, [*self._overrides, f"sensors.seed={seed}"]))
        return self._episode.view()

    @staticmethod
    def _observe(view):
        estimate = view["estimate"]
        return numpy.concatenate([estimate.root_position_m, estimate.root_quaternion_wxyz, estimate.q, estimate.v,
                                  view["tension_n"], [view["error"]]])

    @staticmethod
    def _info(view):
        info = {name: view[name] for name in ("time_s", "cost", "error", "estimate", "truth")}
        if view["over"]:
            info["reason"] = view["reason"]
        return info

    def reset(self, *, seed=None, options=None):
        """Begins an episode at t = 0; returns (observation, info)."""
        if _gymnasium is not None:
            super().reset(seed=seed)
        if seed is not None:
            if not 0 <= int(seed) < 2**32:
                raise BadInput(f"reset: seed: {seed}: must be in [0, 4294967295]")
            self._random = numpy.random.default_rng(int(seed))
        self._episode = None  # the one before ends here
        view = self._begin(int(self._random.integers(0, 1_000_000_000)))
        if view["over"]:
            raise CannotGoOn(f"{self.scene.name}: {view['reason']}")
        self._cost = view["cost"]
        return self._observe(view), self._info(view)

    def step(self, action):
        """A control period; returns (observation, reward, terminated, truncated, info)."""
        if self._episode is None:
            raise BadInput("step: reset() begins an episode")
        view = self._episode.act(numpy.asarray(action, dtype=numpy.float64))
        reward = self._cost - view["cost"]
        self._cost = view["cost"]
        over, complete = view["over"], view["complete"]
        if over:
            self._episode = None
        return self._observe(view), reward, over and not complete, over and complete, self._info(view)

    def render(self):
        """Nothing: mantle.run(..., report=True) makes a page to look at."""

    def close(self):
        """Ends the episode, its drives stopped in order."""
        self._episode = None
