"""Folders of results as arrays (docs/outputs.md has their files and columns)."""

import collections.abc
import csv
import io
import json
import pathlib
import tempfile

import numpy

from mantle.errors import BadInput


class Table(collections.abc.Mapping):
    """Named columns of one length: numbers as arrays of float64, texts as arrays of str. Read-only.

    Numbers are the program's to the last bit.
    """

    def __init__(self, columns):
        self._columns = dict(columns)
        for column in self._columns.values():
            column.setflags(write=False)

    def __getitem__(self, name):
        try:
            return self._columns[name]
        except KeyError:
            raise KeyError(f"no column is called {name!r}; known: {', '.join(self._columns)}") from None

    def __iter__(self):
        return iter(self._columns)

    def __len__(self):
        return len(self._columns)

    @property
    def rows(self):
        """Number of rows."""
        return len(next(iter(self._columns.values()), ()))

    def matrix(self, *names):
        """The columns of these names (default: every column of numbers) side by side, shape (rows, columns)."""
        names = names or [n for n, c in self._columns.items() if c.dtype == numpy.float64]
        return numpy.column_stack([self[name] for name in names])

    def to_pandas(self):
        """A pandas.DataFrame. Raises ImportError where pandas is not installed."""
        import pandas

        return pandas.DataFrame({name: column.copy() for name, column in self._columns.items()})

    def __repr__(self):
        return f"<mantle.Table of {self.rows} rows: {', '.join(self._columns)}>"


def _column(cells):
    try:
        return numpy.array([float(cell) for cell in cells], dtype=numpy.float64)
    except ValueError:
        return numpy.array(cells, dtype=str)


def table_of(text):
    """A Table of CSV text with a title line."""
    rows = list(csv.reader(io.StringIO(text)))
    if not rows:
        return Table({})
    titles, rows = rows[0], rows[1:]
    columns = zip(*rows) if rows else [() for _ in titles]
    return Table({title: _column(cells) for title, cells in zip(titles, columns)})


class Results(collections.abc.Mapping):
    """A folder of results: what a command left, or a folder that was opened with mantle.Results(DIR).

    As a mapping it is the summary: results["final"]["root"]. Tables are read when they are first
    asked for: results.trajectory["time_s"].
    """

    def __init__(self, folder, *, complete=None, _temporary=None):
        self.folder = pathlib.Path(folder)
        self._temporary = _temporary  # goes with this object
        self._tables = {}
        name = next((n for n in ("summary.json", "study.json", "tuning.json") if (self.folder / n).is_file()), None)
        if name is None:
            if complete is None:
                raise BadInput(f"{self.folder}: holds no results (summary.json, study.json or tuning.json)")
            self._summary = {}
        else:
            self._summary = json.loads((self.folder / name).read_text())
        self.complete = bool(self._summary.get("complete", True)) if complete is None else complete

    @property
    def summary(self):
        """The summary as a dictionary (summary.json, study.json or tuning.json)."""
        return self._summary

    def __getitem__(self, key):
        return self._summary[key]

    def __iter__(self):
        return iter(self._summary)

    def __len__(self):
        return len(self._summary)

    @property
    def files(self):
        """Names of the files of the folder."""
        return sorted(path.name for path in self.folder.iterdir())

    def table(self, name):
        """The table NAME.csv of the folder."""
        if name not in self._tables:
            file = self.folder / f"{name}.csv"
            if not file.is_file():
                tables = ", ".join(n.removesuffix(".csv") for n in self.files if n.endswith(".csv"))
                raise BadInput(f"{self.folder}: has no table {name}; known: {tables or 'none'}")
            self._tables[name] = table_of(file.read_text())
        return self._tables[name]

    @property
    def trajectory(self):
        """trajectory.csv: a row for each sample of a run."""
        return self.table("trajectory")

    @property
    def log(self):
        """The telemetry log, telemetry.lcmlog, as a mantle.Log."""
        from mantle.log import Log

        return Log(self.folder / "telemetry.lcmlog")

    def shapes(self):
        """The whole bodies over time as a dictionary of arrays, as `mantle export --format npz` writes them."""
        from mantle.commands import export

        with tempfile.TemporaryDirectory() as work:
            with numpy.load(export(self.folder, "npz", out=pathlib.Path(work) / "shapes.npz")) as data:
                return {name: data[name] for name in data.files}

    def __repr__(self):
        of = self._summary.get("scene", self._summary.get("study", "results"))
        return f"<mantle.Results of {of} in {self.folder}{'' if self.complete else ', partial'}>"
