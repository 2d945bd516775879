"""The figures of studies: error against CPU time with orders and front, largest steps that hold, what effects cost."""

import math

import matplotlib.pyplot as plt
import numpy as np

from plot_style import COLOURS, GRID, INK, open_sides

FAMILIES = ["time", "tolerance", "arms", "mantle", "reduced", "composed"]
VERDICTS = {"holds": COLOURS[2], "told": COLOURS[3], "refused": GRID, "slow": COLOURS[0], "violates": COLOURS[1]}


def draw_front(axes, points):
    """Every point that has an error in all, and the front."""
    for i, family in enumerate(FAMILIES):
        rows = [p for p in points if p["family"] == family and p["ok"] and p.get("error_in_all", 0) > 0]
        if rows:
            axes.loglog([p["cpu_s"] for p in rows], [100 * p["error_in_all"] for p in rows], "o", color=COLOURS[i],
                        markersize=4, alpha=0.8, label=family)
    front = sorted((p["cpu_s"], 100 * p["error_in_all"]) for p in points if p.get("front"))
    if front:
        axes.step(*zip(*front), where="post", color=INK, linewidth=1.0, label="Pareto front")
    axes.set_title("Error in all against CPU time")
    axes.set_xlabel("CPU time [s]")
    axes.set_ylabel("error [% of body length]")
    axes.legend()


def draw_orders(axes, study):
    """Errors of each family against its own reference, by size relative to its coarsest."""
    for i, order in enumerate(study["orders"]):
        size = {"arms": "arm_elements", "mantle": "mantle_elements"}.get(order["family"], "step_s")
        rows = [p for p in study["points"] if p["family"] == order["family"] and p["ok"] and p.get("error", 0) > 0
                and (order["family"] != "time" or p["integrator"] == order["of"])]
        if not rows:
            continue
        sizes = np.array([p[size] if size == "step_s" else 1.0 / p[size] for p in rows], float)
        label = order["of"] if order["order"] is None else f"{order['of']}: order {order['order']:.2f} (theory {order['theory']:g})"
        axes.loglog(sizes / sizes.max(), [100 * p["error"] for p in rows], "o-", color=COLOURS[i % len(COLOURS)],
                    markersize=3, linewidth=1.0, label=label)
    axes.set_title("Error of each family against its own reference")
    axes.set_xlabel("step, or length of an element, over the coarsest")
    axes.set_ylabel("error [% of body length]")
    axes.legend()


def accuracy(study):
    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 6), layout="constrained")
    draw_front(left, study["points"])
    draw_orders(right, study)
    for axes in (left, right):
        open_sides(axes)
    return figure, f"{study['scene']}: what accuracy costs"


def stability(study):
    """A square per case, integrator and step."""
    cases = sorted({p["case"] for p in study["points"]})
    integrators = [i["integrator"] for i in study["integrators"]]
    figure, every = plt.subplots(1, len(integrators), figsize=(3 * len(integrators), 0.17 * len(cases) + 1.5),
                                 sharey=True, layout="constrained", squeeze=False)
    for axes, integrator in zip(every[0], integrators):
        for point in study["points"]:
            if point["integrator"] != integrator:
                continue
            for k, run in enumerate(point.get("runs", [])):
                axes.add_patch(plt.Rectangle((k - 0.45, cases.index(point["case"]) - 0.45), 0.9, 0.9,
                                             color=VERDICTS[run["verdict"]]))
        steps = next((p["runs"] for p in study["points"] if p.get("runs")), [])
        axes.set_xlim(-0.5, max(len(steps), 1) - 0.5)
        axes.set_ylim(len(cases) - 0.5, -0.5)
        axes.set_xticks(range(len(steps)), [f"{1e3 * run['step_s']:g}" for run in steps], fontsize=7)
        axes.set_yticks(range(len(cases)), cases, fontsize=6)
        axes.grid(False)
        axes.set_title(integrator)
        axes.set_xlabel("step [ms]")
    figure.legend(handles=[plt.Rectangle((0, 0), 1, 1, color=c, label=v) for v, c in VERDICTS.items()], ncol=5,
                  loc="outside lower right")
    return figure, f"{study['cases']} hard cases"


def effects(study):
    lines = [line for line in study["effects"] if line["costs"] is not None]
    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 0.28 * len(lines) + 2), sharey=True, layout="constrained")
    names = [f"{line['model']}: {line['effect']}" for line in lines]
    models = sorted({line["model"] for line in lines})
    colours = [COLOURS[models.index(line["model"])] for line in lines]
    left.barh(names, [100 * line["costs"] for line in lines], color=colours)
    left.invert_yaxis()
    left.set_title(f"What it costs, by {study['counter']}")
    left.set_xlabel("% of the work without it")
    changes = [100 * line["changes"] if line["changes"] else math.nan for line in lines]
    right.barh(names, changes, color=colours)
    if np.nanmax(changes + [0]) > 0:
        right.set_xscale("log")
    right.set_title("What it changes")
    right.set_xlabel("largest distance of root and tips [% of body length]")
    for axes in (left, right):
        open_sides(axes)
    return figure, f"{study['scene']}: what effects cost"


KINDS = {"accuracy": accuracy, "stability": stability, "effects": effects}


def draw(study):
    """The figure of a study that has one; None for others."""
    kind = KINDS.get(study.get("study"))
    if kind is None:
        return None
    figure, title = kind(study)
    figure.suptitle(title, x=0.01, ha="left", fontsize=12, fontweight="bold")
    return figure
