/// What the program hands to the page (tools/report/page_data.h), and the same decoded.

import { type Packed, unpack } from "./packed";

export interface PackedColumn {
  name: string;
  data: Packed;
  /** Largest error of the packed column, after decimation, in its own unit. */
  error: number;
}
export interface PackedTable {
  /** Name of the column that the others are plotted over. */
  over: string;
  rows: number;
  /** Rows of the file. */
  of_rows: number;
  columns: PackedColumn[];
}
export interface PackedShape {
  time: Packed;
  /** Messages of the log. */
  of_frames: number;
  /** Largest error of a position between what is drawn and what was logged [m]. */
  error_m: number;
  root_position: Packed;
  root_quaternion: Packed;
  arms: { name: string; nodes: number; radius: Packed; position: Packed; curvature: Packed }[];
  mantle: { name: string; nodes: number; half_thickness: number; profile: Packed; hoop: Packed } | null;
  rigid: [number, number][];
  cables: { name: string; points: number; position: Packed; tension: Packed }[];
  /** Drag of the water at the nodes of the arms [N/m], and on mantle and rigid body [N]. */
  drag: { time: Packed; nodes: Packed; body: Packed } | null;
}
export interface PackedPlans {
  time: Packed;
  knots: number;
  arms: number;
  /** Seconds after the plan's time. */
  ahead: Packed;
  root: Packed;
  tips: Packed;
}
export interface PackedDrives {
  time: Packed;
  motors: string[];
  nodes: number[];
  statusword: Packed;
  torque_permille: Packed;
  target_torque_permille: Packed;
  temperature_celsius: Packed;
  reeled_length: Packed;
}
export interface PackedStatus {
  /** Where the words change [s]. */
  time: number[];
  control_mode: string[];
  solver_status: string[];
}
export interface PackedRun {
  label: string;
  folder: string;
  kind: "run" | "compare" | "static" | "modes" | "study" | "tune";
  complete: boolean;
  summary: Json;
  notes: string[];
  trajectory?: PackedTable;
  solver?: PackedTable;
  energy?: PackedTable;
  path?: PackedTable;
  estimate?: PackedTable;
  shape?: PackedShape;
  plans?: PackedPlans;
  drives?: PackedDrives;
  status?: PackedStatus;
  counters?: PackedTable;
}
export interface ReportData {
  format: number;
  made_by: string;
  runs: PackedRun[];
  /** Of `mantle live`: the runs come from its server. */
  live?: { url: string };
}

export type Json = null | boolean | number | string | Json[] | { [key: string]: Json };

export const kFormat = 2;

/** A table whose first column rises; columns by name. */
export interface Table {
  over: string;
  x: Float64Array;
  columns: Map<string, Float64Array>;
  ofRows: number;
}

export interface Arm {
  name: string;
  nodes: number;
  radius: Float64Array;
  /** frames x nodes x 3 [m] */
  position: Float64Array;
  /** frames x (nodes - 1) [1/m] */
  curvature: Float64Array;
}
export interface Mantle {
  name: string;
  nodes: number;
  halfThickness: number;
  /** frames x nodes x (r, z) [m], in the root's frame */
  profile: Float64Array;
  /** frames x (nodes - 1) */
  hoop: Float64Array;
}
export interface Cable {
  name: string;
  points: number;
  position: Float64Array;
  tension: Float64Array;
}
export interface Shape {
  time: Float64Array;
  ofFrames: number;
  error_m: number;
  rootPosition: Float64Array;
  rootQuaternion: Float64Array;
  arms: Arm[];
  mantle: Mantle | null;
  rigid: [number, number][];
  cables: Cable[];
  /** At times of its own: nodes of all arms x 3 [N/m]; 3 [N]; the earth frame. */
  drag: { time: Float64Array; nodes: Float64Array; body: Float64Array } | null;
}
export interface Plans {
  time: Float64Array;
  knots: number;
  arms: number;
  ahead: Float64Array;
  root: Float64Array;
  tips: Float64Array;
}
export interface Drives {
  time: Float64Array;
  motors: string[];
  nodes: number[];
  /** samples x motors, as what follows */
  statusword: Float64Array;
  torque: Float64Array;
  targetTorque: Float64Array;
  temperature: Float64Array;
  reeledLength: Float64Array;
}
export interface Run {
  label: string;
  folder: string;
  kind: PackedRun["kind"];
  complete: boolean;
  /** It is looked at while it goes on. */
  growing: boolean;
  summary: Json;
  notes: string[];
  trajectory: Table | null;
  solver: Table | null;
  energy: Table | null;
  path: Table | null;
  estimate: Table | null;
  shape: Shape | null;
  plans: Plans | null;
  drives: Drives | null;
  status: PackedStatus | null;
  counters: Table | null;
}

function decodeTable(table: PackedTable | undefined): Table | null {
  if (table === undefined) return null;
  const columns = new Map(table.columns.map((c) => [c.name, unpack(c.data)]));
  const x = columns.get(table.over);
  if (x === undefined) throw new Error(`a table lacks its column ${table.over}`);
  return { over: table.over, x, columns, ofRows: table.of_rows };
}

function decodeShape(shape: PackedShape | undefined): Shape | null {
  if (shape === undefined) return null;
  return {
    time: unpack(shape.time),
    ofFrames: shape.of_frames,
    error_m: shape.error_m,
    rootPosition: unpack(shape.root_position),
    rootQuaternion: unpack(shape.root_quaternion),
    arms: shape.arms.map((a) => ({
      name: a.name,
      nodes: a.nodes,
      radius: unpack(a.radius),
      position: unpack(a.position),
      curvature: unpack(a.curvature),
    })),
    mantle:
      shape.mantle === null
        ? null
        : {
            name: shape.mantle.name,
            nodes: shape.mantle.nodes,
            halfThickness: shape.mantle.half_thickness,
            profile: unpack(shape.mantle.profile),
            hoop: unpack(shape.mantle.hoop),
          },
    rigid: shape.rigid,
    cables: shape.cables.map((c) => ({
      name: c.name,
      points: c.points,
      position: unpack(c.position),
      tension: unpack(c.tension),
    })),
    drag: shape.drag === null ? null : { time: unpack(shape.drag.time), nodes: unpack(shape.drag.nodes), body: unpack(shape.drag.body) },
  };
}

/** Everything of a run, decoded. Throws where the data is not what its counts say. */
export function decodeRun(run: PackedRun): Run {
  const { plans, drives } = run;
  return {
    label: run.label,
    folder: run.folder,
    kind: run.kind,
    complete: run.complete,
    growing: false,
    summary: run.summary,
    notes: run.notes,
    trajectory: decodeTable(run.trajectory),
    solver: decodeTable(run.solver),
    energy: decodeTable(run.energy),
    path: decodeTable(run.path),
    estimate: decodeTable(run.estimate),
    shape: decodeShape(run.shape),
    plans:
      plans === undefined
        ? null
        : {
            time: unpack(plans.time),
            knots: plans.knots,
            arms: plans.arms,
            ahead: unpack(plans.ahead),
            root: unpack(plans.root),
            tips: unpack(plans.tips),
          },
    drives:
      drives === undefined
        ? null
        : {
            time: unpack(drives.time),
            motors: drives.motors,
            nodes: drives.nodes,
            statusword: unpack(drives.statusword),
            torque: unpack(drives.torque_permille),
            targetTorque: unpack(drives.target_torque_permille),
            temperature: unpack(drives.temperature_celsius),
            reeledLength: unpack(drives.reeled_length),
          },
    status: run.status ?? null,
    counters: decodeTable(run.counters),
  };
}

/** `value` at a path of keys, null where there is none. */
export function at(value: Json, ...keys: (string | number)[]): Json {
  let here: Json = value;
  for (const key of keys) {
    if (here === null || typeof here !== "object") return null;
    here = (Array.isArray(here) ? here[key as number] : here[key as string]) ?? null;
  }
  return here;
}

/** A number at a path of keys, null where there is none. */
export function numberAt(value: Json, ...keys: (string | number)[]): number | null {
  const found = at(value, ...keys);
  return typeof found === "number" ? found : null;
}
