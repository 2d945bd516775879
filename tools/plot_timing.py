"""The figure of a loop in real time: how late SYNC was beside a bare timer, how long commands took."""

import matplotlib.pyplot as plt
import numpy as np

from plot_style import COLOURS, INK, open_sides

PARTS = (("sync_lateness", "SYNC, late by"), ("bare_timer", "a bare timer beside it, late by"),
         ("command", "command, from sensors to torques"))
STEP = 2 ** 0.25  # a bin of DurationHistogram
LEAST_MS = 1e-3


def of(summary):
    """The real-time table of a run, or of the control side of two programs; none in lock-step."""
    control = summary.get("control") or {}
    return control.get("real_time")


def draw_histogram(axes, table, title, colour):
    begins = np.array([max(b["from_ms"], LEAST_MS / STEP) for b in table["bins"]])
    counts = np.array([b["count"] for b in table["bins"]])
    axes.bar(begins, counts, width=begins * (STEP - 1), align="edge", color=colour)
    axes.axvline(table["p99_ms"], color=INK, linestyle="--", linewidth=1.0)
    axes.set_title(f"{title}: median {table['median_ms']:.3g}, p99 {table['p99_ms']:.3g}, "
                   f"max {table['max_ms']:.3g} ms", loc="left")
    axes.set_yscale("symlog", linthresh=1)
    axes.set_ylabel("count")


def draw(folder, summary):
    table = of(summary)
    parts = [(key, title) for key, title in PARTS if table.get(key)]
    if not parts:
        return None
    figure, all_axes = plt.subplots(len(parts), 1, sharex=True, figsize=(8, 2.2 * len(parts)), layout="constrained",
                                    squeeze=False)
    for i, (key, title) in enumerate(parts):
        axes = all_axes[i][0]
        draw_histogram(axes, table[key], title, COLOURS[i])
        axes.set_xscale("log")
        open_sides(axes)
    axes.set_xlabel("time [ms]; dashed: 99 of 100 lie below")
    figure.suptitle(f"{summary.get('scene', folder.name)}:  {table['cycles']} SYNCs in real time, "
                    f"{table['late_cycles']} late, {table['missed_cycles']} left out",
                    x=0.01, ha="left", fontsize=12, fontweight="bold")
    return figure
