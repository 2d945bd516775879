"""The figure of a closed loop: path and reference in two planes, error, tensions, solve times."""

import matplotlib.pyplot as plt
import numpy as np

from plot_style import COLOURS, INK, MIN_SPAN_M, open_sides, read_table, xyz

AXES = "xyz"
MAX_MOTORS = 8


def followed(data):
    """What follows the reference: name, path, reference (None where it is a speed)."""
    if "reference_x_m" in data:
        return "root", xyz(data, "root"), xyz(data, "reference")
    if "reference_tip_x_m" in data:
        tip = next(t[:-4] for t in data if t.endswith("_tip_x_m") and t != "reference_tip_x_m")
        return tip.replace("_", " "), xyz(data, tip), xyz(data, "reference_tip")
    return "root", xyz(data, "root"), None


def draw_plane(axes, data, across, up, waypoints, tolerance_m):
    name, path, reference = followed(data)
    if reference is not None:
        axes.plot(reference[:, across], reference[:, up], "--", color=INK, linewidth=1.0, label="reference")
    axes.plot(path[:, across], path[:, up], color=COLOURS[0], label=name)
    axes.plot(*path[0, [across, up]], "o", markerfacecolor="white", color=COLOURS[0], markersize=5)
    for i, waypoint in enumerate(waypoints):
        at = [waypoint["at_m"][across], waypoint["at_m"][up]]
        colour = COLOURS[2] if waypoint["passed"] else COLOURS[1]
        axes.add_patch(plt.Circle(at, tolerance_m, facecolor=colour, alpha=0.35, edgecolor=colour, zorder=3))
        axes.annotate(str(i + 1), at, textcoords="offset points", xytext=(9, -3), color=colour, weight="bold")
    axes.set_xlabel(f"{AXES[across]} [m]")
    axes.set_ylabel(f"{AXES[up]} [m]")


def draw_planes(left, right, data, summary):
    """Both share the direction in which the way is longest."""
    control = summary.get("control", {})
    waypoints = control.get("waypoints") or []
    tolerance_m = control.get("goal", {}).get("tolerance_m", 0.0)
    _, path, reference = followed(data)
    points = path if reference is None else np.vstack([path, reference])
    low, high = points.min(axis=0), points.max(axis=0)
    third, second, longest = np.argsort(high - low, kind="stable")
    centre = 0.5 * (low + high)
    half = 0.55 * max((high - low)[longest], MIN_SPAN_M)
    width = 0.5 * max((high - low)[second], 0.35 * 2 * half)
    for axes, across in ((left, second), (right, third)):
        draw_plane(axes, data, across, longest, waypoints, tolerance_m)
        axes.set_aspect("equal")
        axes.set_xlim(centre[across] - 1.15 * width, centre[across] + 1.15 * width)
        axes.set_ylim(centre[longest] - half, centre[longest] + half)
        open_sides(axes)
    left.set_title("Path in two planes")
    right.legend(*left.get_legend_handles_labels(), ncol=2, loc="lower left", bbox_to_anchor=(0, 1))


def draw_error(axes, data, summary):
    name = next(title for title in data if title.startswith("error_"))
    axes.plot(data["time_s"], 1e3 * data[name], color=COLOURS[0])
    unit = "mm/s" if name.endswith("_m_s") else "mm"
    control = summary.get("control", {})
    goal = control.get("goal", {})
    if "tolerance_m" in goal:
        axes.axhline(1e3 * goal["tolerance_m"], color=COLOURS[1], linewidth=1.0, linestyle=":")
    top = 1.15 * axes.get_ylim()[1]
    for i, waypoint in enumerate(control.get("waypoints") or []):
        if waypoint["time_s"] is None:
            continue
        colour = COLOURS[2] if waypoint["passed"] else COLOURS[1]
        axes.axvline(waypoint["time_s"], color=colour, linewidth=1.0)
        axes.annotate(f"{i + 1}: {1e3 * waypoint['distance_m']:.1f} mm", (waypoint["time_s"], top),
                      textcoords="offset points", xytext=(-3, -10), ha="right", color=colour, fontsize=8)
    axes.set_ylim(0, top)
    what = {"error_position_m": "Distance from the reference", "error_tip_m": "Distance of the tip from its reference"}
    axes.set_title(what.get(name, "Error of the mean speed"))
    axes.set_ylabel(f"error [{unit}]")


def draw_tensions(axes, data, motors, title):
    for i, motor in enumerate(motors):
        colour = COLOURS[i % len(COLOURS)]
        axes.plot(data["time_s"], data[f"actual_{motor}_n"], color=colour, linewidth=0.7, alpha=0.45)
        axes.plot(data["time_s"], data[f"command_{motor}_n"], color=colour, linewidth=1.1, label=motor)
    axes.set_title(title)
    axes.set_ylabel("tension [N]")
    if len(motors) <= MAX_MOTORS:
        axes.legend(ncol=len(motors), loc="upper right")


def draw_solver(axes, plans):
    time, prepare, solve = (plans[c].astype(float) for c in ("time_s", "prepare_ms", "solve_ms"))
    axes.fill_between(time, prepare, color=COLOURS[0], alpha=0.35, linewidth=0, label="prepare")
    axes.fill_between(time, prepare, prepare + solve, color=COLOURS[1], alpha=0.6, linewidth=0, label="solve")
    outcomes = plans["outcome"]
    other = outcomes != "solved"
    if other.any():
        axes.plot(time[other], (prepare + solve)[other], "x", color=INK, markersize=5, label="not solved")
    total = prepare + solve
    axes.set_ylim(0, 1.15 * max(np.quantile(total, 0.995), 1e-3))
    axes.set_title(f"Plans: median {np.median(total):.1f} ms, largest {total.max():.1f} ms")
    axes.set_ylabel("wall clock [ms]")
    axes.legend(ncol=3, loc="upper right")


def split_motors(data, motors, summary):
    """Those on the mantle's cables, and those on arms'."""
    arms = tuple(f"{t[:-len('_tip_x_m')]}_" for t in data if t.endswith("_tip_x_m"))
    cables = {d["motor"]: d["cables"] for d in summary.get("control", {}).get("drives", [])}
    pulling = [m for m in motors if all(c.startswith(arms) for c in cables.get(m, []))]
    return [m for m in motors if m not in pulling], pulling


def draw(folder, data, summary):
    """The figure of a run whose trajectory says which tensions were commanded."""
    motors = [t[len("command_"):-len("_n")] for t in data if t.startswith("command_")]
    plans = read_table(folder, "solver.csv")
    squeezing, pulling = split_motors(data, motors, summary)
    panels = [lambda a: draw_error(a, data, summary)]
    if squeezing:
        panels.append(lambda a: draw_tensions(a, data, squeezing, "Mantle (bold: commanded, thin: actual)"))
    if pulling:
        panels.append(lambda a: draw_tensions(a, data, pulling, "Arms (bold: commanded, thin: actual)"))
    if plans is not None:
        panels.append(lambda a: draw_solver(a, plans))
    figure = plt.figure(figsize=(14, max(6.5, 2.2 * len(panels))), layout="constrained")
    grid = figure.add_gridspec(len(panels), 3, width_ratios=[1, 1, 2])
    draw_planes(figure.add_subplot(grid[:, 0]), figure.add_subplot(grid[:, 1]), data, summary)
    first = None
    for i, panel in enumerate(panels):
        axes = figure.add_subplot(grid[i, 2], sharex=first)
        first = first or axes
        panel(axes)
        axes.set_xlim(data["time_s"][0], max(data["time_s"][-1], 1e-9))
        open_sides(axes)
        if i + 1 < len(panels):
            axes.tick_params(labelbottom=False)
    axes.set_xlabel("time [s]")
    title = summary.get("scene", folder.name)
    if "control" in summary:
        title += f":  closed loop with {summary['control']['controller']}, cost {summary['control']['cost']:.4g}"
    figure.suptitle(title, x=0.01, ha="left", fontsize=12, fontweight="bold")
    return figure
