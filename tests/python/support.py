"""What the tests of the module share: scenes, the program, its tables."""

import os
import pathlib
import subprocess
import tempfile

import mantle
from mantle.commands import program
from mantle.results import table_of

SOURCE = pathlib.Path(os.environ["MANTLE_SOURCE"])
SCENES = SOURCE / "scenes"
ARM = SCENES / "arm_dynamic.toml"
REACH = SCENES / "reach.toml"
SHORT = {"time.duration": 0.2}


def run_program(*arguments):
    """The program as a user types it; returns the process that has ended."""
    return subprocess.run([program(), *map(str, arguments)], capture_output=True, text=True)


def trajectory_of_program(scene, *arguments):
    """trajectory.csv that `mantle run` leaves, as a table."""
    with tempfile.TemporaryDirectory() as work:
        done = run_program("run", scene, *arguments, "--out", f"{work}/out")
        assert done.returncode == 0, done.stderr
        return table_of(pathlib.Path(f"{work}/out/trajectory.csv").read_text())


def sets(overrides):
    """Options --set of a dictionary."""
    return [word for text in mantle.commands.override_list(overrides) for word in ("--set", text)]
