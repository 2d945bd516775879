"""The compiled part of mantle. SI units; quaternions scalar first; 6-vectors angular part first.

Arrays of shapes and states are views: they share their numbers with the object they come from, keep it alive, and
change with it. Copy what has to stay (`array.copy()`). Those that cannot be written say so (`flags.writeable`).
"""

from typing import Any, Callable, Optional, Sequence, Tuple, Union

import numpy
import numpy.typing

__version__: str
_Array = numpy.typing.NDArray[numpy.float64]
_Numbers = numpy.typing.ArrayLike

class Scene:
    """A scene file that was read and checked (docs/scene.md)."""

    def __init__(self, file: str, overrides: Sequence[str] = ...) -> None:
        """overrides: texts KEY=VALUE, as of --set. Raises BadInput."""
    @property
    def file(self) -> str: ...
    @property
    def overrides(self) -> list[str]: ...
    @property
    def name(self) -> str: ...
    @property
    def description(self) -> str: ...
    @property
    def text(self) -> str:
        """The scene as TOML with every default spelt out."""
    @property
    def fingerprint(self) -> str:
        """Of text and files: scenes that run differently have different ones."""
    @property
    def duration_s(self) -> Optional[float]:
        """Of the table [time] [s]; None without one."""
    @property
    def output_interval_s(self) -> float: ...
    @property
    def has_control(self) -> bool: ...
    @property
    def motors(self) -> list[str]:
        """Names of the motors, in the order of tensions."""
    @property
    def tension_limits(self) -> Optional[Tuple[_Array, _Array]]:
        """Lowest and highest tension of every motor [N]; None without a table [control]."""

class ArmShape:
    """An arm at one instant, in the earth's frame: N elements between N + 1 nodes, from the base. Views."""

    name: str
    @property
    def arc_length_m(self) -> _Array:
        """Of the nodes at rest, shape (N + 1,) [m]."""
    @property
    def position_m(self) -> _Array:
        """Of the nodes, shape (N + 1, 3) [m]."""
    @property
    def quaternion_wxyz(self) -> _Array:
        """Section to earth, shape (N + 1, 4)."""
    @property
    def twist(self) -> _Array:
        """Of the nodes in their sections' axes, shape (N + 1, 6) [rad/s, m/s]."""
    @property
    def strain(self) -> _Array:
        """Of the elements: torsion, bending y, z [1/m], stretch, shear y, z [1]; shape (N, 6)."""
    @property
    def stress(self) -> _Array:
        """What the material holds, conjugate to the strain: moments [N m], forces [N]; shape (N, 6)."""

class MantleShape:
    """The mantle's meridian at one instant, relative to the root: N elements between N + 1 nodes. Views."""

    name: str
    @property
    def arc_length_m(self) -> _Array: ...
    @property
    def profile(self) -> _Array:
        """(r, z, theta) of the nodes, shape (N + 1, 3) [m, m, rad]."""
    @property
    def profile_rate(self) -> _Array:
        """Their rates, shape (N + 1, 3) [m/s, m/s, rad/s]."""
    @property
    def strain(self) -> _Array:
        """Of the elements, shape (N, 5): model/shell_element.h."""

class Shape:
    """A robot's whole bodies at one instant, in the earth's frame. Views."""

    time_s: float
    @property
    def root_position_m(self) -> _Array: ...
    @property
    def root_quaternion_wxyz(self) -> _Array: ...
    @property
    def root_twist(self) -> _Array:
        """In the root's axes, shape (6,) [rad/s, m/s]."""
    @property
    def arms(self) -> dict[str, ArmShape]: ...
    @property
    def mantle(self) -> Optional[MantleShape]: ...

class Simulation:
    """The plant of a scene in time, under its schedules, stepped by hand.

    `advance_to` goes by way of the scene's output times, as `mantle run` does: the same scene gives the same bits,
    where output.interval is longer than time.step and no tension is set by hand.
    One thread at a time: another one is refused while it advances.
    """

    def __init__(self, scene: Scene) -> None:
        """At the scene's start. Raises BadInput."""
    @property
    def time_s(self) -> float: ...
    @property
    def duration_s(self) -> float: ...
    @property
    def output_interval_s(self) -> float: ...
    @property
    def body_length_m(self) -> float: ...
    @property
    def unknowns(self) -> int:
        """Number of velocities."""
    @property
    def cables(self) -> list[str]:
        """Names of the cables, ARM.CABLE and MANTLE.SPOKES."""
    @property
    def shape(self) -> Shape:
        """The bodies now. Its arrays change as the simulation advances."""
    def advance_to(self, time_s: float) -> None:
        """To that time [s], at or after time_s. Releases the interpreter. Raises CannotGoOn where a step fails; what
        was reached stays."""
    def set_tension(self, cable: str, tension_n: Optional[float]) -> None:
        """From now on this tension of a cable [N], >= 0, instead of its schedule or reel; None: as the scene has it."""
    def observe(self) -> dict[str, float]:
        """A row of trajectory.csv (docs/outputs.md), by its titles."""
    def checkpoint(self) -> str:
        """All that restore() needs to go on with the same bits."""
    def restore(self, checkpoint: str) -> None:
        """Raises BadInput where it is of another robot, or damaged."""

class ReducedState:
    """A state of a reduced model, in the earth's frame. `q`, `v` and `root_position_m` are writable views.

    q: strains of the arms [1/m, 1], then the mantle's shape coordinates [kg^(1/2) m].
    v: root's twist in its own axes [rad/s, m/s], then the rates of q.
    """

    time_s: float
    root_quaternion_wxyz: _Array
    @property
    def root_position_m(self) -> _Array: ...
    @property
    def q(self) -> _Array: ...
    @property
    def v(self) -> _Array: ...
    def copy(self) -> ReducedState: ...
    def __copy__(self) -> ReducedState: ...
    def __deepcopy__(self, memo: dict[Any, Any]) -> ReducedState: ...

class ReducedModel:
    """The reduced model of a scene (docs/reduced.md). n is velocity_count; derivatives in a state are laid out as
    (zeta, q, v), zeta the root's increment in its own axes: 2 n entries.

    The model that a controller of a run is given ends with the run: then its members raise BadInput.
    """

    def __init__(self, scene: Scene) -> None:
        """Raises BadInput."""
    @property
    def motors(self) -> list[str]: ...
    @property
    def coordinate_count(self) -> int: ...
    @property
    def velocity_count(self) -> int:
        """coordinate_count + 6."""
    @property
    def body_length_m(self) -> float: ...
    @property
    def longest_step_s(self) -> float: ...
    def state(self) -> ReducedState:
        """A new state: where a run of the model starts."""
    def step(self, state: ReducedState, dt_s: float, tensions: Optional[_Numbers] = None, *,
             jacobian: bool = False) -> Union[ReducedState, Tuple[ReducedState, _Array, _Array]]:
        """The state dt_s later [s], with these tensions of the motors [N] all along, or the scene's schedules. A
        negative tension pushes, which no cable does: it is for derivatives.

        Goes in parts that end at break points and are no longer than longest_step_s, as `mantle run --model reduced`.
        jacobian: also the derivatives of the new state in the old one, shape (2 n, 2 n), and in the tensions, shape
        (2 n, motors), exact. Raises CannotGoOn where the step fails.
        """
    def linearise(self, state: ReducedState, acceleration: _Numbers,
                  tensions: Optional[_Numbers] = None) -> dict[str, _Array]:
        """residual R = M a - f, and its derivatives: stiffness in (zeta, q), damping in v, mass in a, input in the
        tensions."""
    def acceleration(self, state: ReducedState, tensions: Optional[_Numbers] = None) -> _Array:
        """Rates of v, shape (n,)."""
    def tip(self, state: ReducedState, arm: str = "") -> Tuple[_Array, _Array]:
        """Place of an arm's tip in the earth's frame, shape (3,) [m], and its derivative in (zeta, q), shape (3, n)."""
    def volume(self, state: ReducedState) -> Tuple[float, _Array]:
        """Volume that the mantle encloses [m^3], and its derivative in q."""
    def shape(self, state: ReducedState) -> Shape:
        """The plant's nodes in that state; not of a run's model."""
    def difference(self, from_state: ReducedState, to_state: ReducedState) -> _Array:
        """(zeta, dq, dv) from one to the other, shape (2 n,)."""
    def move(self, state: ReducedState, by: _Numbers) -> ReducedState:
        """The state moved by (zeta, dq, dv)."""

class Reference:
    """The goal of a scene's table [control.goal], as a function of time."""

    def at(self, time_s: float) -> dict[str, Optional[_Array]]:
        """position_m of the root, direction of its e3, velocity_m_s, tip_m; None where the goal has none."""
    def aim(self, state: ReducedState, lookahead_s: float = 0.0) -> Tuple[_Array, _Array]:
        """What is to be steered away in the lateral plane and its rate, shape (2,) each: an angle [rad, rad/s], or the
        way of a tip [m, m/s]. Ends with the run."""

class Episode:
    """A closed loop that waits at every control period for the tensions of the next; mantle.Env is made of it."""

    def __init__(self, scene: Scene) -> None: ...
    def view(self) -> dict[str, Any]: ...
    def act(self, tensions: _Numbers) -> dict[str, Any]: ...

def run_loop(scene: Scene, observer: Optional[Callable[[Any], Any]], controller: str, bus: str, real_time: bool,
             make_controller: Optional[Callable[[Any], Any]],
             make_estimator: Optional[Callable[[Any], Any]]) -> Tuple[bytes, str, bool, str]: ...
