/// Which plots a set of runs asks for: by the columns that there are (docs/outputs.md), not by what a
/// scene is called.

import type { Run, Table } from "./model";
import { locate, mix } from "./timeline";

export interface Curve {
  run: number;
  /** What is plotted: "x", "commanded a", the name of a cable. */
  channel: string;
  x: Float64Array;
  y: Float64Array;
  /** Position of the channel in its plot: chooses colour, or dash where runs are overlaid. */
  index: number;
  dashed: boolean;
}
export interface Plot {
  id: string;
  title: string;
  unit: string;
  /** What stands along x: time, which the scrubber moves along, or something else. */
  over: string;
  help: string;
  logarithmic: boolean;
  curves: Curve[];
}

type Source = "trajectory" | "solver" | "energy" | "counters" | "path" | "estimate";
interface Channel {
  name: string;
  column: string;
  dashed?: boolean;
  /** Times the column. */
  factor?: number;
}
interface Spec {
  id: string;
  title: string;
  unit: string;
  help: string;
  source: Source;
  scale?: number;
  logarithmic?: boolean;
  channels: (table: Table) => Channel[];
}

/** Channels of the columns that match; the name is the pattern's first group. */
function matching(table: Table, pattern: RegExp, dashed = false): Channel[] {
  const found: Channel[] = [];
  for (const column of table.columns.keys()) {
    const match = pattern.exec(column);
    if (match !== null) found.push({ name: match[1] ?? column, column, dashed });
  }
  return found;
}
function fixed(...channels: [string, string, boolean?][]): (table: Table) => Channel[] {
  return (table) =>
    channels
      .filter(([, column]) => table.columns.has(column))
      .map(([name, column, dashed]) => ({ name, column, dashed: dashed ?? false }));
}
/** Errors of the estimator along the axes, between three deviations of each where they are told. */
function withDeviations(stem: string, unit: string): (table: Table) => Channel[] {
  return (table) =>
    ["x", "y", "z"].flatMap((axis) => {
      const column = `error_${stem}${axis}_${unit}`;
      if (!table.columns.has(column)) return [];
      const bound = `sigma3_${stem}${axis}_${unit}`;
      const channels: Channel[] = [{ name: axis, column }];
      if (table.columns.has(bound)) {
        channels.push({ name: `${axis} +3σ`, column: bound, dashed: true }, { name: `${axis} −3σ`, column: bound, dashed: true, factor: -1 });
      }
      return channels;
    });
}
const words = (text: string) => text.replaceAll("_", " ");

const kSpecs: Spec[] = [
  {
    id: "position", title: "Position of the root", unit: "m", source: "trajectory",
    help: "In the earth frame; dashed: where the reference is.",
    channels: fixed(
      ["x", "root_x_m"], ["y", "root_y_m"], ["z", "root_z_m"],
      ["x reference", "reference_x_m", true], ["y reference", "reference_y_m", true], ["z reference", "reference_z_m", true],
    ),
  },
  {
    id: "error", title: "Position error", unit: "mm", scale: 1e3, source: "trajectory",
    help: "Distance between the root, or the tip, and where it should be.",
    channels: fixed(["root", "error_position_m"], ["tip", "error_tip_m"]),
  },
  {
    id: "speed_error", title: "Error of the mean speed", unit: "mm/s", scale: 1e3, source: "trajectory",
    help: "Of the velocity's mean over a pulse from the commanded one.",
    channels: fixed(["mean velocity", "error_mean_speed_m_s"]),
  },
  {
    id: "velocity", title: "Velocity of the root", unit: "m/s", source: "trajectory",
    help: "In the root's own frame; z is the swimming direction.",
    channels: fixed(["x", "root_vx_m_s"], ["y", "root_vy_m_s"], ["z", "root_vz_m_s"]),
  },
  {
    id: "turn_rate", title: "Turn rate of the root", unit: "rad/s", source: "trajectory",
    help: "In the root's own frame; z is roll.",
    channels: fixed(["x", "root_wx_rad_s"], ["y", "root_wy_rad_s"], ["z (roll)", "root_wz_rad_s"]),
  },
  {
    id: "tip", title: "Position of the tips", unit: "m", source: "trajectory",
    help: "In the earth frame; dashed: where the tip should be.",
    channels: (table) => [
      ...matching(table, /^(.+_tip_[xyz])_m$/).filter((c) => !c.column.startsWith("reference_")).map((c) => ({ ...c, name: words(c.name) })),
      ...matching(table, /^reference_(tip_[xyz])_m$/, true).map((c) => ({ ...c, name: `${words(c.name)} reference` })),
    ],
  },
  {
    id: "volume", title: "Enclosed volume", unit: "mL", scale: 1e6, source: "trajectory",
    help: "Inside the mantle.",
    channels: fixed(["volume", "volume_m3"]),
  },
  {
    id: "thrust", title: "Thrust of the jet", unit: "N", source: "trajectory",
    help: "Along the root's z axis.",
    channels: fixed(["thrust", "thrust_n"]),
  },
  {
    id: "tension", title: "Motor tensions", unit: "N", source: "trajectory",
    help: "Per unit gain of the motor's cables; dashed: commanded, full: actual.",
    channels: (table) =>
      matching(table, /^actual_(.+)_n$/).flatMap((actual) => [
        { ...actual, dashed: false },
        { name: `${actual.name} commanded`, column: `command_${actual.name}_n`, dashed: true },
      ]),
  },
  {
    id: "cable_tension", title: "Cable tensions", unit: "N", source: "trajectory",
    help: "What pulls on the body, all spokes of the mantle together.",
    channels: (table) => matching(table, /^(.+)_tension_n$/).map((c) => ({ ...c, name: words(c.name) })),
  },
  {
    id: "cable_length", title: "Cable lengths", unit: "m", source: "trajectory",
    help: "Along the path of each cable.",
    channels: (table) => matching(table, /^(.+)_length_m$/).map((c) => ({ ...c, name: words(c.name) })),
  },
  {
    id: "solve", title: "Solve times", unit: "ms", source: "solver",
    help: "Wall-clock time of each plan: preparing goes before the measurement, solving after it.",
    channels: fixed(["prepare", "prepare_ms"], ["solve", "solve_ms"]),
  },
  {
    id: "iterations", title: "Solver's iterations", unit: "per plan", source: "solver",
    help: "Of each plan.",
    channels: fixed(["iterations", "iterations"]),
  },
  {
    id: "misses", title: "Missed deadlines and fallbacks", unit: "count", source: "counters",
    help: "Counted from the start of the run.",
    channels: fixed(["deadlines missed", "misses"], ["fallbacks", "fallbacks"], ["safe decays", "safe_decays"]),
  },
  ...(
    [
      ["estimate_position", "Estimator's error: position", "mm", 1e3, "", "m"],
      ["estimate_attitude", "Estimator's error: attitude", "mrad", 1e3, "r", "rad"],
      ["estimate_velocity", "Estimator's error: velocity", "mm/s", 1e3, "v", "m_s"],
      ["estimate_rate", "Estimator's error: turn rate", "mrad/s", 1e3, "w", "rad_s"],
    ] as const
  ).map(
    ([id, title, unit, scale, stem, column]): Spec => ({
      id, title, unit, scale, source: "estimate",
      help: "Truth against estimate, in the root's frame; dashed: three of the deviations that the estimator expects.",
      channels: withDeviations(stem, column),
    }),
  ),
  {
    id: "energy", title: "Energies", unit: "J", source: "trajectory",
    help: "Kinetic energy of solid and added mass, elastic energy of the bodies.",
    channels: fixed(
      ["kinetic, solid", "kinetic_solid_j"], ["kinetic, water", "kinetic_water_j"],
      ["elastic, arms", "elastic_arms_j"], ["elastic, mantle", "elastic_mantle_j"],
    ),
  },
  {
    id: "work", title: "Work of loads and cables", unit: "J", source: "energy",
    help: "Since the start; what took energy out is negative.",
    channels: (table) => [
      ...matching(table, /^work (.+)$/).filter((c) => table.columns.get(c.column)!.some((v) => Math.abs(v) > 1e-12)),
      ...fixed(["dissipated by viscosity", "dissipated_j"])(table),
    ],
  },
  {
    id: "power", title: "Powers of the energetic index", unit: "W", source: "trajectory",
    help: "Output: power that propels the body. Input: power put into the bodies' shape.",
    channels: fixed(["output", "index_output_w"], ["input", "index_input_w"]),
  },
  {
    id: "momentum", title: "Momentum", unit: "N s", source: "trajectory",
    help: "Of solid and added mass, in the earth frame.",
    channels: fixed(["x", "momentum_x_n_s"], ["y", "momentum_y_n_s"], ["z", "momentum_z_n_s"]),
  },
  {
    id: "balance", title: "Residual of the power balance", unit: "of the powers' sum", source: "trajectory",
    logarithmic: true,
    help: "Forces and energies are assembled apart; round-off alone is left where they agree.",
    channels: fixed(["residual", "power_balance_residual"]),
  },
  {
    id: "static_load", title: "Load factor along the path of equilibria", unit: "–", source: "path",
    help: "Where it falls, the path goes back behind a limit of the load.",
    channels: fixed(["load factor", "load_factor"]),
  },
  {
    id: "static_tip", title: "Tips along the path of equilibria", unit: "m", source: "path",
    help: "In the earth frame.",
    channels: (table) => matching(table, /^(.+_tip_[xyz])_m$/).map((c) => ({ ...c, name: words(c.name) })),
  },
  {
    id: "static_volume", title: "Volume along the path of equilibria", unit: "mL", scale: 1e6, source: "path",
    help: "Enclosed by the mantle.",
    channels: fixed(["volume", "volume_m3"]),
  },
  {
    id: "static_stability", title: "Unstable directions", unit: "count", source: "path",
    help: "0: stable. -1: could not be told.",
    channels: fixed(["unstable directions", "unstable_directions"]),
  },
];

/** Beyond this many curves a plot says too much: the rest is left to the table of the run. */
export const kMostCurves = 24;

function scaled(values: Float64Array, scale: number, logarithmic: boolean): Float64Array {
  if (logarithmic) return values.map((v) => (v > 0 ? v : Number.NaN));
  return scale === 1 ? values : values.map((v) => scale * v);
}

const isFlatZero = (values: Float64Array) => values.every((v) => v === 0 || Number.isNaN(v));

const rises = (x: Float64Array) => x.every((v, i) => i === 0 || v >= x[i - 1]!);

/** Whether a curve says what is drawn already: within a thousandth of its span, where both are. */
function agree(known: Curve, x: Float64Array, values: Float64Array, scale: number): boolean {
  const span = Math.max(...known.y) - Math.min(...known.y) || 1;
  for (let k = 0; k <= 50; ++k) {
    const i = Math.round((k / 50) * (x.length - 1));
    if (x[i]! > known.x[known.x.length - 1]!) break;
    if (Math.abs(mix(known.y, 1, locate(known.x, x[i]!), 0) - scale * values[i]!) > 1e-3 * span) return false;
  }
  return true;
}

/** Plots of the runs, in order; one that no run has a column for is not there. */
export function choosePlots(runs: Run[]): Plot[] {
  const plots: Plot[] = [];
  for (const spec of kSpecs) {
    const curves: Curve[] = [];
    const channels: string[] = [];
    let over = "time";
    const folded = runs.some((run) => run[spec.source] !== null && !rises(run[spec.source]!.x));
    runs.forEach((run, r) => {
      const table = run[spec.source];
      if (table === null || table.x.length < 2) return;
      over = table.over === "time_s" ? "time" : folded ? "point of the path" : words(table.over);
      const x = folded ? table.x.map((_v, i) => i) : table.x;
      for (const channel of spec.channels(table)) {
        const values = table.columns.get(channel.column);
        if (values === undefined || curves.length >= kMostCurves) continue;
        const known = curves.find((c) => c.channel === channel.name && c.channel.endsWith("reference"));
        if (known !== undefined && agree(known, x, values, spec.scale ?? 1)) continue;
        // One colour for what is commanded and what comes of it.
        const colour = channel.name.replace(/ (reference|commanded|[+−]3σ)$/, "");
        if (!channels.includes(colour)) channels.push(colour);
        curves.push({
          run: r,
          channel: channel.name,
          x,
          y: scaled(values, (spec.scale ?? 1) * (channel.factor ?? 1), spec.logarithmic ?? false),
          index: channels.indexOf(colour),
          dashed: channel.dashed ?? false,
        });
      }
    });
    if (curves.length === 0 || (spec.id === "misses" && curves.every((c) => isFlatZero(c.y)))) continue;
    if (spec.id === "static_load" && over !== "point of the path") continue;
    if (spec.id === "thrust" && curves.every((c) => isFlatZero(c.y))) continue;
    plots.push({
      id: spec.id, title: spec.title, unit: spec.unit, over, help: spec.help,
      logarithmic: spec.logarithmic ?? false, curves,
    });
  }
  return plots;
}
