"""Telemetry logs as arrays (docs/telemetry.md has channels and fields)."""

import json
import pathlib

from mantle.commands import _run
from mantle.results import table_of


class Log:
    """An event log of LCM, as every run leaves one: telemetry.lcmlog."""

    def __init__(self, file):
        self.file = pathlib.Path(file)
        self._summary = json.loads(_run(["log", str(self.file), "--json"]))

    @property
    def channels(self):
        """Of every channel: messages, bytes, first_us, last_us, rate_hz."""
        return self._summary["channels"]

    @property
    def span_s(self):
        """Time between the first message and the last [s]."""
        return self._summary["span_s"]

    def channel(self, name):
        """The messages of a channel as a mantle.Table, a row for each; lists as columns NAME_0, NAME_1 ..."""
        return table_of(_run(["log", str(self.file), "--channel", str(name), "--csv"]))

    def __repr__(self):
        return f"<mantle.Log {self.file}: {', '.join(self.channels)}>"
