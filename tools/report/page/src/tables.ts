/// Tables: the figures of each run side by side, what was run, the drives at the present time, and
/// studies.

import { driveRemarks, driveState } from "./drives";
import { element, formatNumber } from "./dom";
import { type Json, type Run, at, numberAt } from "./model";
import { latest } from "./timeline";

type Cell = string | null;
export interface Row {
  name: string;
  cells: Cell[];
}

function number(run: Run, scale: number, unit: string, ...path: (string | number)[]): Cell {
  const value = numberAt(run.summary, ...path);
  return value === null ? null : `${formatNumber(scale * value, 4)}${unit === "" ? "" : ` ${unit}`}`;
}
function text(run: Run, ...path: (string | number)[]): Cell {
  const value = at(run.summary, ...path);
  if (typeof value === "string") return value === "" ? null : value;
  return typeof value === "number" || typeof value === "boolean" ? String(value) : null;
}
function vector(run: Run, ...path: (string | number)[]): Cell {
  const value = at(run.summary, ...path);
  if (!Array.isArray(value)) return null;
  return `(${value.map((v) => formatNumber(typeof v === "number" ? v : null, 4)).join(", ")}) m`;
}

function waypoints(run: Run): Cell {
  const list = at(run.summary, "control", "waypoints");
  if (!Array.isArray(list) || list.length === 0) return null;
  return list
    .map((w, i) => {
      const distance = numberAt(w, "distance_m");
      const time = numberAt(w, "time_s");
      if (distance === null || time === null) return `${i + 1}: not reached`;
      const passed = at(w, "passed") === true ? "passed" : "missed";
      return `${i + 1}: ${passed} at ${formatNumber(time, 4)} s, ${formatNumber(1e3 * distance, 3)} mm away`;
    })
    .join("\n");
}

function solverTimes(run: Run): Cell {
  const step = at(run.summary, "control", "solver", "step_ms");
  if (step === null) return null;
  const [median, p99, max] = ["median", "p99", "max"].map((key) => formatNumber(numberAt(step, key), 3));
  return `${median} / ${p99} / ${max} ms`;
}

function entries(value: Json, unit: string): Cell {
  if (value === null || typeof value !== "object" || Array.isArray(value)) return null;
  const lines = Object.entries(value)
    .filter(([, v]) => typeof v === "number" && v !== 0)
    .map(([k, v]) => `${k}: ${formatNumber(v as number, 4)} ${unit}`);
  return lines.length > 0 ? lines.join("\n") : null;
}

function tips(run: Run): Cell {
  const list = at(run.summary, "tips") ?? at(run.summary, "final", "tips");
  if (list === null || typeof list !== "object" || Array.isArray(list)) return null;
  const lines = Object.entries(list).map(([name, tip]) => {
    const p = at(tip, "position_m");
    return Array.isArray(p) ? `${name}: (${p.map((v) => formatNumber(v as number, 5)).join(", ")}) m` : name;
  });
  return lines.length > 0 ? lines.join("\n") : null;
}

function list(run: Run, ...path: string[]): Cell {
  const value = at(run.summary, ...path);
  return Array.isArray(value) && value.length > 0 ? value.map(String).join(", ") : null;
}

const kFigures: [string, (run: Run) => Cell][] = [
  ["Came to its end", (r) => (r.growing ? null : r.complete ? "yes" : "no: see above")],
  ["Simulated time", (r) => number(r, 1, "s", "sim_time_s")],
  ["Wall-clock time", (r) => number(r, 1, "s", "wall_time_s")],
  ["Times real time", (r) => number(r, 1, "", "realtime_factor")],
  ["Controller", (r) => [text(r, "control", "controller"), text(r, "control", "mode")].filter((x) => x !== null).join(", ") || null],
  ["Goal", (r) => text(r, "control", "goal", "type")],
  ["Waypoints", waypoints],
  ["Cost", (r) => number(r, 1, "", "control", "cost")],
  ["Shares of the cost", (r) => entries(at(r.summary, "control", "cost_terms"), "")],
  ["Error, mean", (r) => number(r, 1e3, at(r.summary, "control", "error", "name") === "mean_speed_m_s" ? "mm/s" : "mm", "control", "error", "mean")],
  ["Error, largest", (r) => number(r, 1e3, at(r.summary, "control", "error", "name") === "mean_speed_m_s" ? "mm/s" : "mm", "control", "error", "max")],
  ["Mean speed", (r) => number(r, 1e3, "mm/s", "control", "mean_speed_m_s")],
  ["Effort", (r) => number(r, 1, "N² s", "control", "effort_n2_s")],
  ["Work of the cables", (r) => number(r, 1, "J", "control", "cable_work_j")],
  ["Tensions, actual minus commanded (rms)", (r) => number(r, 1e3, "mN", "control", "tension_error_n")],
  ["Plan: median / p99 / longest", solverTimes],
  ["Plans; deadlines missed; fallbacks", (r) => {
    const parts = ["plans", "deadline_misses", "fallbacks"].map((key) => text(r, "control", "solver", key));
    return parts[0] === null ? null : parts.join("; ");
  }],
  ["Load of the bus", (r) => number(r, 100, "%", "control", "bus", "load")],
  ["Energetic index (ratio of means)", (r) => number(r, 100, "%", "energetic_index", "ratio_of_means")],
  ["Root at the end", (r) => vector(r, "final", "root", "position_m")],
  ["Tips at the end", tips],
  ["Volume, smallest", (r) => number(r, 1e6, "mL", "volume_m3", "min")],
  ["Volume, largest", (r) => number(r, 1e6, "mL", "volume_m3", "max")],
  ["Residual of the power balance", (r) => number(r, 1, "", "power_balance_residual")],
  ["Energy drift", (r) => number(r, 1, "", "energy_drift")],
  ["Load factor", (r) => number(r, 1, "", "load_factor")],
  ["Limit load factor", (r) => number(r, 1, "", "limit_load_factor")],
  ["Unstable directions", (r) => text(r, "unstable_directions")],
  ["Largest strain", (r) => number(r, 100, "%", "largest_strain", "value")],
  ["Unbalanced force", (r) => number(r, 1, "N", "residual_n")],
  ["Reduced against full: root", (r) => number(r, 100, "% of body length", "reduced_error_root")],
  ["Reduced against full: tip", (r) => number(r, 100, "% of body length", "reduced_error_tip")],
  ["Reduced against full: heading", (r) => number(r, 1, "rad", "reduced_error_heading_rad")],
  ["Work done by", (r) => entries(at(r.summary, "work_j"), "J")],
];

const kSettings: [string, (run: Run) => Cell][] = [
  ["Scene", (r) => text(r, "scene")],
  ["Model", (r) => text(r, "model") ?? (r.kind === "run" ? "full" : null)],
  ["Made by Mantle", (r) => text(r, "mantle_version")],
  ["Effects", (r) => list(r, "settings", "effects")],
  ["Elements", (r) => entries(at(r.summary, "settings", "elements"), "")],
  ["Integrator", (r) => text(r, "settings", "integrator")],
  ["Step", (r) => number(r, 1e3, "ms", "settings", "step_s")],
  ["Coupling", (r) => text(r, "settings", "coupling")],
  ["Steps; rejected", (r) => (text(r, "steps") === null ? null : `${text(r, "steps")}; ${text(r, "rejected_steps") ?? "0"}`)],
  ["Overrides (--set)", (r) => list(r, "overrides")],
  ["Bus", (r) => text(r, "control", "bus", "spec")],
  ["Folder", (r) => r.folder],
];

function rows(runs: Run[], specs: [string, (run: Run) => Cell][]): Row[] {
  return specs
    .map(([name, cell]) => ({ name, cells: runs.map(cell) }))
    .filter((row) => row.cells.some((cell) => cell !== null));
}

export function table(title: string, labels: string[], body: Row[]): HTMLElement {
  const head = element("tr", {}, [element("td"), ...labels.map((l) => element("th", { scope: "col" }, [l]))]);
  const lines = body.map((row) =>
    element("tr", {}, [
      element("th", { scope: "row" }, [row.name]),
      ...row.cells.map((cell) => element("td", {}, [cell ?? "–"])),
    ]),
  );
  return element("section", { class: "card table" }, [
    element("h3", {}, [title]),
    element("div", { class: "scroll", tabindex: "0" }, [
      element("table", {}, [element("thead", {}, [head]), element("tbody", {}, lines)]),
    ]),
  ]);
}

/** Figures and settings of runs, side by side. Studies have tables of their own. */
export function figureTables(runs: Run[]): HTMLElement[] {
  const shown = runs.filter((r) => r.kind !== "study" && r.kind !== "tune");
  if (shown.length === 0) return [];
  const labels = shown.map((r) => r.label);
  const figures = rows(shown, kFigures);
  return [...(figures.length > 0 ? [table("Figures", labels, figures)] : []), table("What was run", labels, rows(shown, kSettings))];
}

/** Modes of `mantle modes`. */
export function modesTable(run: Run): HTMLElement | null {
  const modes = at(run.summary, "modes");
  if (!Array.isArray(modes)) return null;
  const labels = ["frequency [Hz]", "damping ratio", "growth rate [1/s]"];
  const body = modes.map((mode, i) => ({
    name: `Mode ${text({ ...run, summary: mode }, "mode") ?? i + 1}${at(mode, "unstable") === true ? " (unstable)" : ""}`,
    cells: ["frequency_hz", "damping_ratio", "growth_rate_1_s"].map((key) => formatNumber(numberAt(mode, key), 5)),
  }));
  return table(`Modes: ${run.label}`, labels, body);
}

/** What the page leaves out, in words. */
export function accuracyOf(runs: Run[]): string {
  const parts: string[] = [];
  for (const { label, shape, trajectory } of runs) {
    if (shape !== null) {
      parts.push(`${label}: ${shape.time.length} of ${shape.ofFrames} logged shapes, drawn within ${formatNumber(1e3 * shape.error_m, 2)} mm of the log`);
    }
    if (trajectory !== null && trajectory.x.length < trajectory.ofRows) {
      parts.push(`${label}: ${trajectory.x.length} of ${trajectory.ofRows} rows are plotted`);
    }
  }
  return parts.length === 0 ? "" : `${parts.join("; ")}.`;
}

/** The drives of a run at a time, in words. */
export class DriveTable {
  readonly root: HTMLElement;
  private readonly cells: HTMLElement[][];

  constructor(private readonly run: Run) {
    const drives = run.drives!;
    this.cells = drives.motors.map(() => Array.from({ length: 5 }, () => element("td")));
    const head = ["state", "torque [‰]", "target [‰]", "free cable [mm]", "temperature [°C]"];
    this.root = element("section", { class: "card table" }, [
      element("h3", {}, [`Drives: ${run.label}`]),
      element("div", { class: "scroll", tabindex: "0" }, [
        element("table", {}, [
          element("thead", {}, [
            element("tr", {}, [element("td"), ...head.map((h) => element("th", { scope: "col" }, [h]))]),
          ]),
          element("tbody", {}, drives.motors.map((motor, i) =>
            element("tr", {}, [
              element("th", { scope: "row" }, [`${motor} (node ${drives.nodes[i]})`]),
              ...this.cells[i]!,
            ]),
          )),
        ]),
      ]),
      element("p", { class: "help" }, ["At the time of the scrubber. Torques in thousandths of the rated one."]),
    ]);
  }

  setTime(time: number): void {
    const drives = this.run.drives!;
    const sample = Math.max(latest(drives.time, time), 0);
    const width = drives.motors.length;
    this.cells.forEach((cells, i) => {
      const k = sample * width + i;
      const word = drives.statusword[k]!;
      const texts = [
        [driveState(word), ...driveRemarks(word)].join(", "),
        formatNumber(drives.torque[k], 4),
        formatNumber(drives.targetTorque[k], 4),
        formatNumber(1e3 * drives.reeledLength[k]!, 4),
        formatNumber(drives.temperature[k], 3),
      ];
      texts.forEach((t, c) => {
        if (cells[c]!.textContent !== t) cells[c]!.textContent = t;
      });
    });
  }
}
