"""What controllers, estimators and observers written in Python are given."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class ControllerParts:
    """What a controller is made of.

    model: the reduced model that the run's controller believes in (mantle.ReducedModel). It ends
        with the run.
    motors: names of the motors, in the order of tensions and limits.
    limits: lowest tension [N], highest tension [N] and rate [N/s] of every motor, shape (motors, 3).
    period_s: control period [s], in which `update` is called once.
    reference: the goal of the scene (mantle.Reference).
    pull_directions: which way every motor pulls what is steered, in its lateral plane: columns of
        length 1 or 0, shape (2, motors).
    """

    model: object
    motors: list
    limits: object
    period_s: float
    reference: object
    pull_directions: object


@dataclasses.dataclass(frozen=True)
class EstimatorParts:
    """What an estimator is made of: the reduced model (it ends with the run) and the motors' names."""

    model: object
    motors: list


@dataclasses.dataclass(frozen=True)
class LoopStep:
    """What an observer of a closed loop sees at a SYNC, in the earth's frame; values to keep.

    time_s: of the SYNC, from t = 0 [s].
    planned: the controller was asked for a plan at this instant.
    truth, estimate: states of the reduced model.
    command_n, tension_n: commanded and actual tension of every motor [N].
    cost: integral of the scene's stage cost so far.
    error: distance from the reference [m, or m/s].
    """

    time_s: float
    planned: bool
    truth: object
    estimate: object
    command_n: object
    tension_n: object
    cost: float
    error: float
