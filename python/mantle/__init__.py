"""Soft underwater vehicles: simulate, control and look at them from Python (docs/python.md).

    import mantle
    results = mantle.run("scenes/paper.toml", {"time.duration": 2})
    results.trajectory["root_x_m"]

SI units throughout, names carry them; 6-vectors have the angular part first; quaternions the scalar.
"""

import pathlib as _pathlib

from mantle._mantle import (ArmShape, Episode, MantleShape, ReducedModel, ReducedState, Reference, Scene, Shape,
                            Simulation, __version__)
from mantle.commands import (LoopResults, check, closed_loop, compare, export, load, modes, report, run, static, study,
                             tune)
from mantle.commands import program as _program
from mantle.env import Env
from mantle.errors import BadInput, CannotGoOn, Error, Fault, MantleWarning
from mantle.log import Log
from mantle.parts import ControllerParts, EstimatorParts, LoopStep
from mantle.results import Results, Table


def scene_folder():
    """The folder of the scenes that come along. Raises Fault where there is none."""
    program = _pathlib.Path(_program()).parent
    for folder in (program.parent / "share/mantle/scenes", program.parent / "scenes"):
        if folder.is_dir():
            return folder
    raise Fault(f"{program.parent / 'share/mantle/scenes'}: is missing")


__all__ = ["ArmShape", "BadInput", "CannotGoOn", "ControllerParts", "Env", "Episode", "Error", "EstimatorParts", "Fault",
           "Log", "LoopResults", "LoopStep", "MantleShape", "MantleWarning", "ReducedModel", "ReducedState", "Reference",
           "Results", "Scene", "Shape", "Simulation", "Table", "__version__", "check", "closed_loop", "compare",
           "export", "load", "modes", "report", "run", "scene_folder", "static", "study", "tune"]
