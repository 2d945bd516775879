"""Colours and lines of the pictures that tools/plot makes, and what they are made from."""

import csv
import json
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

INK = "#22303c"
GRID = "#d9e0e6"
COLOURS = ["#0b6e99", "#d1495b", "#66a182", "#edae49", "#7768ae", "#2e4057", "#c06e52", "#4f9da6"]
MAX_LEGEND = 5  # more names hide more than they tell
MIN_SPAN_M = 0.02  # a body at rest still gets a frame


def fail(message):
    print(f"plot: {message}", file=sys.stderr)
    sys.exit(2)


def read_table(folder, name):
    """Columns of the folder's file NAME; None where there is none."""
    path = folder / name
    if not path.is_file():
        return None
    with open(path, newline="") as file:
        rows = csv.reader(file)
        titles = next(rows, [])
        values = [row for row in rows if len(row) == len(titles)]
    if not values:
        fail(f"{path}: holds no rows")
    return dict(zip(titles, np.array(values).T))


def read_trajectory(folder):
    table = read_table(folder, "trajectory.csv")
    if table is None:
        fail(f"{folder}/trajectory.csv: cannot be read")
    return {title: column.astype(float) for title, column in table.items()}


def read_summary(folder):
    path = folder / "summary.json"
    return json.loads(path.read_text()) if path.is_file() else {}


def style():
    plt.rcParams.update({
        "font.size": 9, "axes.edgecolor": GRID, "axes.labelcolor": INK, "text.color": INK,
        "xtick.color": INK, "ytick.color": INK, "axes.grid": True, "grid.color": GRID,
        "grid.linewidth": 0.6, "axes.axisbelow": True, "axes.titlesize": 10,
        "axes.titleweight": "bold", "axes.titlelocation": "left", "lines.linewidth": 1.5,
        "legend.frameon": False, "legend.fontsize": 8, "axes.prop_cycle": plt.cycler(color=COLOURS),
    })


def xyz(data, name):
    return np.column_stack([data[f"{name}_{axis}_m"] for axis in "xyz"])


def open_sides(axes):
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def save(figure, target):
    """As a whole file or not at all; PNG or SVG, by the target's name."""
    partial = target.with_name("." + target.name)
    figure.savefig(partial, dpi=130, format=target.suffix[1:])
    partial.replace(target)
    print(f"  picture in {target}")
