/// A run as it grows on the page of `mantle live`: what the server sends (tools/live/live_frame.h), kept as a
/// report keeps a run, the newest part of it.

import { Growing, GrowingTable } from "./growing";
import type { LiveDrives, LiveFrame, LivePlan, LiveRows, LiveSession, LiveShape } from "./live_frame";
import type { Drives, Json, PackedStatus, Plans, Run, Shape, Table } from "./model";

/** Rows of tables, shapes, and samples of the drives that are kept: minutes of plots, a minute of pictures. */
const kMostRows = 6000;
const kMostShapes = 1500;
const kMostPlans = 400;
/** More columns than this are no run of ours. */
const kMostColumns = 400;
const kTables = ["trajectory", "estimate", "energy", "counters"] as const;
type TableName = (typeof kTables)[number];

class ShapeWindow {
  private readonly time = new Growing(1, kMostShapes);
  private readonly rootPosition = new Growing(3, kMostShapes);
  private readonly rootQuaternion = new Growing(4, kMostShapes);
  private readonly arms: { position: Growing; curvature: Growing }[];
  private readonly mantle: { profile: Growing; hoop: Growing } | null;
  private readonly cables: { position: Growing; tension: Growing }[];
  private readonly drag: { nodes: Growing; body: Growing } | null;
  readonly shape: Shape;

  constructor(first: LiveShape, drag: boolean) {
    this.arms = first.arms.map((a) => ({ position: new Growing(3 * a.nodes, kMostShapes), curvature: new Growing(a.nodes - 1, kMostShapes) }));
    this.mantle =
      first.mantle === null
        ? null
        : { profile: new Growing(2 * first.mantle.nodes, kMostShapes), hoop: new Growing(first.mantle.nodes - 1, kMostShapes) };
    this.cables = first.cables.map((c) => ({ position: new Growing(3 * c.points, kMostShapes), tension: new Growing(1, kMostShapes) }));
    const nodes = first.arms.reduce((sum, a) => sum + a.nodes, 0);
    this.drag = drag ? { nodes: new Growing(3 * nodes, kMostShapes), body: new Growing(3, kMostShapes) } : null;
    const none = new Float64Array(0);
    this.shape = {
      time: none, ofFrames: 0, error_m: 0, rootPosition: none, rootQuaternion: none,
      arms: first.arms.map((a) => ({
        name: a.name, nodes: a.nodes, radius: Float64Array.from(a.radius, (r) => r ?? 0), position: none, curvature: none,
      })),
      mantle:
        first.mantle === null
          ? null
          : { name: first.mantle.name, nodes: first.mantle.nodes, halfThickness: first.mantle.half_thickness, profile: none, hoop: none },
      rigid: first.rigid,
      cables: first.cables.map((c) => ({ name: c.name, points: c.points, position: none, tension: none })),
      drag: drag ? { time: none, nodes: none, body: none } : null,
    };
  }

  push(time: number, shape: LiveShape, drag: LiveFrame["drag"]): void {
    this.time.push([time]);
    this.rootPosition.push(shape.root_position);
    this.rootQuaternion.push(shape.root_quaternion);
    shape.arms.forEach((arm, a) => {
      this.arms[a]!.position.push(arm.position);
      this.arms[a]!.curvature.push(arm.curvature);
    });
    if (this.mantle !== null && shape.mantle !== null) {
      this.mantle.profile.push(shape.mantle.profile);
      this.mantle.hoop.push(shape.mantle.hoop);
    }
    shape.cables.forEach((cable, c) => {
      this.cables[c]!.position.push(cable.position);
      this.cables[c]!.tension.push([cable.tension]);
    });
    this.drag?.nodes.push(drag?.nodes ?? []);
    this.drag?.body.push(drag?.body ?? []);
    this.show();
  }

  // The views move with every push.
  private show(): void {
    const { shape } = this;
    shape.time = this.time.view();
    shape.ofFrames = shape.time.length;
    shape.rootPosition = this.rootPosition.view();
    shape.rootQuaternion = this.rootQuaternion.view();
    shape.arms.forEach((arm, a) => {
      arm.position = this.arms[a]!.position.view();
      arm.curvature = this.arms[a]!.curvature.view();
    });
    if (shape.mantle !== null && this.mantle !== null) {
      shape.mantle.profile = this.mantle.profile.view();
      shape.mantle.hoop = this.mantle.hoop.view();
    }
    shape.cables.forEach((cable, c) => {
      cable.position = this.cables[c]!.position.view();
      cable.tension = this.cables[c]!.tension.view();
    });
    if (shape.drag !== null && this.drag !== null) {
      shape.drag.time = shape.time;
      shape.drag.nodes = this.drag.nodes.view();
      shape.drag.body = this.drag.body.view();
    }
  }
}

/** What a page is laid out for, part by part; null where a frame says nothing of it. */
function layoutOf(frame: LiveFrame): (string | null)[] {
  const { rows, shape, drives, plan, drag, session } = frame;
  const parts = [
    ...kTables.map((name) => (rows[name] === undefined ? null : Object.keys(rows[name]))),
    shape === undefined
      ? null
      : [shape.arms.map((a) => [a.name, a.nodes]), shape.mantle?.nodes, shape.rigid.length, shape.cables.map((c) => [c.name, c.points])],
    drives === undefined ? null : drives.motors,
    plan === undefined ? null : [plan.knots, plan.arms],
    drag === undefined ? null : true,
    session === undefined ? null : [session.host, session.process, session.scene],
  ];
  return parts.map((part) => (part === null ? null : JSON.stringify(part)));
}

export class LiveRun {
  readonly run: Run;
  private readonly tables = new Map<TableName, GrowingTable>();
  private readonly solver = new Growing(2, kMostPlans);
  private shapes: ShapeWindow | null = null;
  private readonly layout: (string | null)[];
  private planTime = Number.NaN;
  private readonly plans: { time: Growing; ahead: Growing; root: Growing; tips: Growing } | null;
  private readonly drives: { time: Growing; values: Growing[] } | null;
  /** Begins with a frame and what was before it. */
  constructor(first: LiveFrame, before: LiveRows[] = []) {
    this.layout = layoutOf(first);
    const { plan, drives, session } = first;
    this.plans =
      plan === undefined
        ? null
        : {
            time: new Growing(1, kMostPlans), ahead: new Growing(plan.knots, kMostPlans),
            root: new Growing(3 * plan.knots, kMostPlans), tips: new Growing(3 * plan.knots * plan.arms, kMostPlans),
          };
    this.drives =
      drives === undefined
        ? null
        : { time: new Growing(1, kMostShapes), values: Array.from({ length: 5 }, () => new Growing(drives.motors.length, kMostShapes)) };
    if (first.shape !== undefined) this.shapes = new ShapeWindow(first.shape, first.drag !== undefined);
    this.run = {
      label: session?.scene || "live", folder: session?.results ?? "", kind: "run", complete: true, growing: true,
      summary: summaryOf(session), notes: [], trajectory: null, solver: null, energy: null, path: null, estimate: null,
      shape: this.shapes?.shape ?? null, plans: null, drives: null, status: null, counters: null,
    };
    for (const rows of before) this.addRows(rows);
    this.add(first);
  }

  get time(): number {
    const time = this.tables.get("trajectory")?.column("time_s");
    return Math.max(time?.[time.length - 1] ?? 0, this.shapes?.shape.time.at(-1) ?? 0);
  }

  /** First time of what is kept. */
  get begin(): number {
    const shape = this.shapes?.shape.time[0];
    return shape ?? this.tables.get("trajectory")?.column("time_s")[0] ?? 0;
  }

  /** Whether the frame goes on with this run; what it says nothing of, it may say later. */
  fits(frame: LiveFrame): boolean {
    return frame.time >= this.time - 1e-9 && layoutOf(frame).every((part, i) => part === null || part === this.layout[i]);
  }

  /** Rows of the last minutes, for a page that begins anew. */
  rows(): LiveRows[] {
    const out: LiveRows[] = [];
    for (const name of kTables) {
      const table = this.tables.get(name);
      if (table === undefined) continue;
      const columns = table.titles.map((title) => table.column(title));
      for (let i = 0; i < table.length; ++i) {
        const row = Object.fromEntries(table.titles.map((title, k) => [title, columns[k]![i]!]));
        (out[i] ??= {})[name] = row;
      }
    }
    return out;
  }

  /** Rows of the trajectory, or of shapes. */
  get length(): number {
    return Math.max(this.tables.get("trajectory")?.length ?? 0, this.shapes?.shape.time.length ?? 0);
  }

  /** Rows that came late; those that are known already change nothing. */
  addMissed(rows: LiveRows): void {
    this.addRows(rows);
  }

  add(frame: LiveFrame): void {
    this.addRows(frame.rows);
    if (frame.shape !== undefined && this.shapes !== null) {
      const last = this.shapes.shape.time.at(-1) ?? -1;
      if (frame.time > last) this.shapes.push(frame.time, frame.shape, frame.drag);
    }
    if (frame.plan !== undefined) this.addPlan(frame.plan);
    if (frame.drives !== undefined) this.addDrives(frame.time, frame.drives);
    this.run.status = frame.status === undefined ? null : wordsOf(frame);
    this.show();
  }

  private addRows(rows: LiveRows): void {
    for (const name of kTables) {
      const row = rows[name];
      if (row === undefined || Object.keys(row).length > kMostColumns) continue;
      const table = this.tables.get(name);
      const time = row["time_s"] ?? Number.NaN;
      if (table === undefined) this.tables.set(name, new GrowingTable("time_s", row, kMostRows));
      else if (time > (table.column("time_s").at(-1) ?? -1)) table.push(row);
    }
  }

  private addPlan(plan: LivePlan): void {
    if (this.plans === null || plan.time === this.planTime) return;
    this.planTime = plan.time;
    this.plans.time.push([plan.time]);
    this.plans.ahead.push(plan.ahead);
    this.plans.root.push(plan.root);
    this.plans.tips.push(plan.tips);
    if (plan.solve_ms > 0) this.solver.push([plan.time, plan.solve_ms]);
  }

  private addDrives(time: number, drives: LiveDrives): void {
    if (this.drives === null) return;
    this.drives.time.push([time]);
    const { values } = this.drives;
    [drives.statusword, drives.torque_permille, drives.target_torque_permille, drives.temperature_celsius, drives.reeled_length].forEach(
      (list, k) => values[k]!.push(list),
    );
    if (this.run.drives === null) {
      const none = new Float64Array(0);
      this.run.drives = {
        time: none, motors: drives.motors, nodes: drives.nodes, statusword: none, torque: none, targetTorque: none, temperature: none, reeledLength: none,
      } satisfies Drives;
    }
    const shown = this.run.drives;
    shown.time = this.drives.time.view();
    [shown.statusword, shown.torque, shown.targetTorque, shown.temperature, shown.reeledLength] =
      values.map((v) => v.view()) as [Float64Array, Float64Array, Float64Array, Float64Array, Float64Array];
  }

  private show(): void {
    const { run } = this;
    run.trajectory = this.tableOf("trajectory");
    run.estimate = this.tableOf("estimate");
    run.energy = this.tableOf("energy");
    run.counters = this.tableOf("counters");
    if (this.plans !== null) {
      run.plans ??= { time: this.plans.time.view(), knots: this.plans.ahead.width, arms: this.plans.tips.width / Math.max(this.plans.root.width, 1), ahead: this.plans.ahead.view(), root: this.plans.root.view(), tips: this.plans.tips.view() } satisfies Plans;
      run.plans.time = this.plans.time.view();
      run.plans.ahead = this.plans.ahead.view();
      run.plans.root = this.plans.root.view();
      run.plans.tips = this.plans.tips.view();
    }
    if (this.solver.length > 1) {
      const rows = this.solver.view();
      const x = rows.filter((_v, i) => i % 2 === 0);
      run.solver = { over: "time_s", x, columns: new Map([["time_s", x], ["solve_ms", rows.filter((_v, i) => i % 2 === 1)]]), ofRows: x.length };
    }
  }

  private tableOf(name: TableName): Table | null {
    const table = this.tables.get(name);
    if (table === undefined || table.length < 1) return null;
    const columns = new Map(table.titles.map((title) => [title, table.column(title)]));
    return { over: table.over, x: table.column("time_s"), columns, ofRows: table.length };
  }
}

function wordsOf(frame: LiveFrame): PackedStatus {
  const { status } = frame;
  return { time: [frame.time], control_mode: [status!.control_mode], solver_status: [status!.solver_status] };
}

/** What a session says, where a report has a run's summary. */
function summaryOf(session: LiveSession | undefined): Json {
  if (session === undefined) return {};
  return {
    scene: session.scene,
    mantle_version: session.version,
    control: {
      controller: session.controller,
      body_length_m: session.body_length > 0 ? session.body_length : null,
      goal: { type: session.goal, tolerance_m: session.tolerance },
      waypoints: session.waypoints.map((w) => ({ at_m: w.at_m })),
      bus: { spec: session.bus },
    },
  };
}
