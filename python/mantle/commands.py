"""The commands of the program, and runs with parts that are written in Python.

What needs nothing of Python is done by the program itself, in a process of its own: same bits, side by side
from several threads, and nothing that goes wrong there takes this process along.
"""

import collections.abc
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import warnings
import weakref

import numpy

from mantle import _mantle
from mantle.errors import BadInput, CannotGoOn, Fault, MantleWarning
from mantle.results import Results, Table, table_of


def program():
    """Path of the program `mantle` that this module belongs to: in the build tree, or PREFIX/bin."""
    package = pathlib.Path(_mantle.__file__).absolute().parent
    built = package.parent.parent / "mantle"
    return str(built if built.is_file() else package.parents[3] / "bin/mantle")  # PREFIX/lib/python3/dist-packages


def _raise_for(status, complaints, partial=None, level=4):
    """Warns of warnings, and raises what an exit status stands for."""
    mild = [line for line in complaints if status == 0 or line.startswith("warning: ")]
    grave = [line for line in complaints if line not in mild]
    for line in mild:
        warnings.warn(line.removeprefix("warning: "), MantleWarning, stacklevel=level)
    if status == 0:
        return
    line = grave[0] if grave else f"exit status {status}"
    if status == 2:
        raise BadInput(line)
    if status != 3:
        raise Fault(line)
    error = CannotGoOn(line)
    error.results = partial() if partial else None
    raise error


def _run(arguments, *, partial=None):
    """Runs a command of the program and returns what it printed; raises what its exit status stands for.

    Ctrl-C is passed on, once for each, so that a run ends in order and keeps what it reached.
    """
    try:
        # Of a session of its own: else a terminal's Ctrl-C would reach it twice.
        process = subprocess.Popen([program(), *map(str, arguments)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, start_new_session=True)
    except OSError as error:
        raise Fault(f"{program()}: {error.strerror}: the program must be installed with its module") from None
    while True:
        try:
            output, errors = process.communicate()
            break
        except KeyboardInterrupt:
            process.send_signal(signal.SIGINT)
            process.communicate()
            raise
    if process.returncode < 0:
        raise Fault(f"mantle {arguments[0]}: ended by signal {signal.Signals(-process.returncode).name}")
    lines = [line.removeprefix("mantle: ") for line in errors.decode("utf-8", "replace").splitlines()]
    _raise_for(process.returncode, lines, partial, level=5)
    return output.decode("utf-8", "replace")


def _toml(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, numpy.integer)):
        return str(int(value))
    if isinstance(value, (float, numpy.floating)):
        return repr(float(value))
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{json.dumps(str(k))} = {_toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, (list, tuple, numpy.ndarray)):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    raise BadInput(f"overrides: {value!r}: must be a number, text, boolean, list or table")


def override_list(overrides):
    """KEY=VALUE texts of what was given: None, a dictionary {key: value}, or texts as of --set."""
    if overrides is None:
        return []
    if isinstance(overrides, str):
        return [overrides]
    if isinstance(overrides, dict):
        return [f"{key}={_toml(value)}" for key, value in overrides.items()]
    return [str(text) for text in overrides]


def _scene_arguments(scene, overrides):
    if isinstance(scene, _mantle.Scene):
        file, before = scene.file, scene.overrides
    else:
        file, before = os.fspath(scene), []
    arguments = [file]
    for text in [*before, *override_list(overrides)]:
        arguments += ["--set", text]
    return arguments


class _Temporary:
    """A folder that goes with the last object that holds it."""

    def __init__(self):
        self.path = pathlib.Path(tempfile.mkdtemp(prefix="mantle-"))
        weakref.finalize(self, shutil.rmtree, self.path, ignore_errors=True)


class _Folder:
    """Where results go: what was asked for, or a folder that goes with them."""

    def __init__(self, out):
        self.temporary = _Temporary() if out is None else None
        self.path = self.temporary.path / "results" if out is None else pathlib.Path(os.fspath(out))

    def results(self):
        return Results(self.path, _temporary=self.temporary)

    def partial(self):
        # Where DIR's parent cannot be written, the partial results are inside (docs/outputs.md).
        beside = self.path.with_name(self.path.name + ".partial")
        at = next((p for p in (beside, self.path / "run.partial") if p.is_dir()), None)
        return Results(at, complete=False, _temporary=self.temporary) if at else None


def _into_folder(arguments, out, report=False):
    folder = _Folder(out)
    more = ["--report"] if report else []
    _run([*arguments, *more, "--json", "--out", folder.path], partial=folder.partial)
    return folder.results()


def load(file, overrides=None):
    """Reads a scene file and checks its keys (docs/scene.md).

    overrides: {"time.step": 0.002, "arms.arm.length": "40 cm"}, or texts as of --set. Numbers are SI;
    texts carry a unit. Raises BadInput.
    """
    return _mantle.Scene(os.fspath(file), override_list(overrides))


def check(scene, overrides=None, *, model="full", open_loop=False):
    """What is active in a scene, what a run of it would cost, and what looks wrong (`mantle check`).

    Raises BadInput where a run would be refused. Returns a dictionary.
    """
    arguments = ["check", *_scene_arguments(scene, overrides), "--json", "--model", model]
    return json.loads(_run(arguments + (["--open-loop"] if open_loop else [])))


def run(scene, overrides=None, *, out=None, model="full", open_loop=False, controller=None, bus=None, realtime=False,
        lcm=None, record=None, shape_every=1, report=False):
    """Runs a scene in time (`mantle run`), in closed loop where it has a table [control].

    out: folder of the results, as of the program; None: they are kept with the object that is returned, and go
        with it.
    model: "full", the plant, or "reduced".
    open_loop: the plant alone, in spite of the scene's [control].
    controller: instead of the scene's: "mpc", "gait", "pursuit", "pid" or "lqr". One that is written in Python is
        for closed_loop().
    bus, realtime, lcm, record, report: as the options of `mantle run`.
    shape_every: the whole bodies of every N-th sample are logged; 0: of none.

    Ctrl-C ends it in order, with partial results in `out`.partial. Raises BadInput, and CannotGoOn with the
    partial results.
    """
    arguments = ["run", *_scene_arguments(scene, overrides), "--model", model, "--shape-every", shape_every]
    for option, value in (("--controller", controller), ("--bus", bus), ("--lcm", lcm), ("--record", record)):
        if value is not None:
            arguments += [option, value]
    for option, value in (("--open-loop", open_loop), ("--realtime", realtime)):
        if value:
            arguments.append(option)
    return _into_folder(arguments, out, report)


def _with(scene, overrides, controller, estimator):
    """The scene with its overrides, and with what Python gives named in it."""
    file, before = (scene.file, scene.overrides) if isinstance(scene, _mantle.Scene) else (os.fspath(scene), [])
    before = [*before, *override_list(overrides)]
    if not _mantle.Scene(file, before).has_control:
        raise BadInput(f"{file}: control: table is missing: a closed loop needs [control]")
    more = []
    if controller is not None and not isinstance(controller, str):
        more.append('control.controller="python"')
    if estimator is not None:
        more.append('control.estimator.type="python"')
    scene = _mantle.Scene(file, [*before, *more])
    if estimator is not None and re.search(r"^(\[\[sensors\.instruments\]\]|instruments = \[)", scene.text, re.M):
        raise BadInput(f"{file}: sensors.instruments: an estimator that is written in Python gets whole measurements, "
                       "not readings of instruments: the scene must name none")
    return scene


class LoopResults(collections.abc.Mapping):
    """A closed loop that ran in this process. As a mapping it is the summary, as summary.json of `mantle run`
    but for "reduced" (docs/outputs.md).

    trajectory: a Table with the plant's columns of trajectory.csv, `command_MOTOR_n` and `actual_MOTOR_n` [N] of
        every motor, and `error` [m, or m/s].
    complete, reason: whether it came to its end, and why not.
    """

    def __init__(self, summary_text, trajectory_text, complete, reason):
        self._texts = {"summary.json": summary_text, "trajectory.csv": trajectory_text}
        self.summary, self.trajectory = json.loads(summary_text), table_of(trajectory_text)
        self.complete, self.reason = complete, reason

    def save(self, folder):
        """Leaves summary.json and trajectory.csv in a new folder, which appears whole or not at all; for
        mantle.Results, report() and tools/plot. Returns its path."""
        folder = pathlib.Path(os.fspath(folder))
        if folder.exists():
            raise BadInput(f"{folder}: is there already")
        try:
            folder.parent.mkdir(parents=True, exist_ok=True)
            work = pathlib.Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
            for name, text in self._texts.items():
                (work / name).write_text(text)
            work.chmod(0o755)
            work.rename(folder)
        except OSError as error:
            raise BadInput(f"{folder}: cannot be written: {error.strerror}") from None
        return folder

    def __getitem__(self, key):
        return self.summary[key]

    def __iter__(self):
        return iter(self.summary)

    def __len__(self):
        return len(self.summary)

    def __repr__(self):
        return f"<mantle.LoopResults of {self.summary['scene']}{'' if self.complete else ', ' + self.reason}>"


def closed_loop(scene, overrides=None, *, observer=None, controller=None, estimator=None, bus=None, realtime=False):
    """Runs the closed loop of a scene in this process, without files, and returns its LoopResults.

    controller: instead of the scene's: a name ("mpc", "gait", "pursuit", "pid", "lqr"), or a class or function
        that makes a controller of ControllerParts (docs/python.md).
    estimator: instead of the scene's: a class or function that makes one of EstimatorParts.
    observer: called at every SYNC with a LoopStep; where it returns False the run ends there.
    bus, realtime: as the options of `mantle run`.

    The interpreter is taken for the calls of Python code alone. Ctrl-C stops the run in order, the drives with it.
    Raises BadInput, CannotGoOn (with the LoopResults), and what Python code of the run raised.
    """
    loaded = _with(scene, overrides, controller, estimator)
    named = controller if isinstance(controller, str) else ""
    text, table, complete, reason = _mantle.run_loop(loaded, observer, named, bus or "", realtime,
                                                     None if named else controller, estimator)
    results = LoopResults(text.decode("utf-8", "replace"), table, complete, reason)
    for line in results["warnings"]:
        warnings.warn(f"{loaded.name}: {line}", MantleWarning, stacklevel=2)
    if not complete and reason != "stopped by its observer":
        error = CannotGoOn(f"{loaded.name}: {reason} at t = {results['sim_time_s']:.6g} s")
        error.results = results
        raise error
    return results


def static(scene, overrides=None, *, out=None, report=False):
    """The equilibrium of a scene whose root is held (`mantle static`). Tables: path, shape.

    Raises BadInput, CannotGoOn where there is none.
    """
    return _into_folder(["static", *_scene_arguments(scene, overrides)], out, report)


def modes(scene, overrides=None, *, out=None, about="reference", count=None, buckling=None):
    """Linearised motions about the reference shape or an equilibrium (`mantle modes`). Table: shapes."""
    arguments = ["modes", *_scene_arguments(scene, overrides), "--about", about]
    for option, value in (("--count", count), ("--buckling", buckling)):
        if value is not None:
            arguments += [option, value]
    return _into_folder(arguments, out)


def compare(scene, overrides=None, *, out=None, report=False):
    """The full and the reduced model side by side (`mantle compare`). Tables: full, reduced."""
    return _into_folder(["compare", *_scene_arguments(scene, overrides)], out, report)


def tune(scene, overrides=None, *, out=None, controller="all", evaluations=200, method="subplex", report=False):
    """The best parameters of the baseline controllers (`mantle tune`)."""
    arguments = ["tune", *_scene_arguments(scene, overrides), "--controller", controller, "--evaluations", evaluations,
                 "--method", method]
    return _into_folder(arguments, out, report)


def study(kind, scenes, overrides=None, *, out=None, options=(), report=False):
    """Many runs side by side (`mantle study KIND SCENES`): results["runs"] has a dictionary for each.

    options: further options of the command, as texts: ("--controllers", "pid,lqr").
    """
    scenes = [scenes] if isinstance(scenes, (str, os.PathLike)) else list(scenes)
    arguments = ["study", kind, *(os.fspath(s) for s in scenes)]
    for text in override_list(overrides):
        arguments += ["--set", text]
    return _into_folder([*arguments, *options], out, report)


def report(folders, *, out=None):
    """One HTML page of one or several folders of results (`mantle report`). Returns its path."""
    if isinstance(folders, (str, os.PathLike, Results)):
        folders = [folders]
    arguments = ["report", *(f.folder if isinstance(f, Results) else os.fspath(f) for f in folders), "--json"]
    if out is not None:
        arguments += ["--out", os.fspath(out)]
    return pathlib.Path(json.loads(_run(arguments))["report"])


def export(folder, format, *, out=None, options=()):
    """Results for other programs (`mantle export`): npz, csv, vtk, gltf, mcap, mp4. Returns what it made."""
    folder = folder.folder if isinstance(folder, Results) else pathlib.Path(os.fspath(folder))
    arguments = ["export", folder, "--format", format, *options]
    if out is not None:
        arguments += ["--out", os.fspath(out)]
    return pathlib.Path(json.loads(_run([*arguments, "--json"]))["exports"][0]["out"])


__all__ = ["LoopResults", "Results", "Table", "check", "closed_loop", "compare", "export", "load", "modes", "report",
           "run", "static", "study", "table_of", "tune"]
