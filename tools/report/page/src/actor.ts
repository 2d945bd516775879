/// One run in the 3-D view: its bodies, the path of its root, its reference, its plan ahead, its jet.

import * as three from "three";
import { Body, type FieldRanges } from "./body";
import { DragArrows, type DragRanges } from "./drag";
import { parseColour, runColour } from "./colour";
import { type Run, numberAt } from "./model";
import { latest, locate, mix } from "./timeline";

/** What is drawn. */
export interface Layers {
  bodies: boolean;
  cables: boolean;
  path: boolean;
  reference: boolean;
  plan: boolean;
  jet: boolean;
  drag: boolean;
  estimate: boolean;
  grid: boolean;
}

const kPlanColour = 0xcc79a7;
const kReferenceColour = 0x8a8a8a;
const kEstimateColour = 0xd55e00;

/** Positions over time, x, y, z of each sample. */
export interface Track {
  time: Float64Array;
  xyz: Float64Array;
}

/** Positions of a run's root over time: of every row, else of the shapes. */
function rootTrack(run: Run): Track | null {
  const t = run.trajectory;
  const axes = ["root_x_m", "root_y_m", "root_z_m"].map((name) => t?.columns.get(name));
  if (t !== null && axes.every((axis) => axis !== undefined)) {
    const xyz = new Float64Array(3 * t.x.length);
    for (let i = 0; i < t.x.length; ++i) for (let k = 0; k < 3; ++k) xyz[3 * i + k] = axes[k]![i]!;
    return { time: t.x, xyz };
  }
  if (run.shape === null) return null;
  return { time: run.shape.time, xyz: run.shape.rootPosition };
}

function referenceTrack(run: Run): Float64Array | null {
  const t = run.trajectory;
  if (t === null) return null;
  for (const stem of ["reference_", "reference_tip_"]) {
    const axes = ["x_m", "y_m", "z_m"].map((axis) => t.columns.get(stem + axis));
    if (!axes.every((axis) => axis !== undefined)) continue;
    const xyz = new Float64Array(3 * t.x.length);
    for (let i = 0; i < t.x.length; ++i) for (let k = 0; k < 3; ++k) xyz[3 * i + k] = axes[k]![i]!;
    return xyz;
  }
  return null;
}

/** Where an observer believes the root to be; null where there is none. */
function estimateAxes(run: Run): Float64Array[] | null {
  const t = run.estimate;
  if (t === null || !t.columns.has("sigma3_x_m")) return null;
  const axes = ["estimate_x_m", "estimate_y_m", "estimate_z_m"].map((name) => t.columns.get(name));
  return axes.every((axis) => axis !== undefined) ? (axes as Float64Array[]) : null;
}

function polyline(xyz: Float64Array, material: three.LineBasicMaterial): three.Line {
  const line = new three.Line(undefined, material);
  redraw(line, xyz);
  line.frustumCulled = false;
  return line;
}

/** Gives a line other points. */
function redraw(line: three.Line, xyz: Float64Array): void {
  const geometry = new three.BufferGeometry();
  geometry.setAttribute("position", new three.BufferAttribute(Float32Array.from(xyz), 3));
  line.geometry.dispose();
  line.geometry = geometry;
  line.computeLineDistances();
}

export class Actor {
  readonly group = new three.Group();
  readonly body: Body | null;
  track: Track | null;
  visible = true;
  private readonly pathAll: three.Line | null = null;
  private readonly pathPast: three.Line | null = null;
  private readonly marker: three.Mesh | null = null;
  private readonly reference: three.Line | null = null;
  private referenceXyz: Float64Array | null;
  private readonly referenceMarker: three.Mesh | null = null;
  private readonly estimate: three.Mesh | null = null;
  private readonly planRoot: three.Line | null = null;
  private readonly planTips: three.Line[] = [];
  private readonly jet: three.ArrowHelper | null = null;
  private readonly drag: DragArrows | null = null;
  private largestThrust: number;

  /** `index` among the page's runs gives its colour; `bodyLength` [m] the size of marks. */
  constructor(
    readonly run: Run,
    private readonly index: number,
    ranges: FieldRanges,
    dragged: DragRanges,
    private readonly bodyLength: number,
  ) {
    const { group } = this;
    const body = run.shape === null ? null : new Body(run.shape, ranges, bodyLength);
    this.body = body;
    if (body !== null) group.add(body.group);
    const track = rootTrack(run);
    this.track = track;
    const colour = runColour(index, false);
    if (track !== null && track.time.length > 1) {
      this.pathAll = polyline(track.xyz, new three.LineBasicMaterial({ color: colour, transparent: true, opacity: 0.35 }));
      this.pathPast = polyline(track.xyz, new three.LineBasicMaterial({ color: colour }));
      group.add(this.pathAll, this.pathPast);
    }
    if (track !== null) {
      this.marker = new three.Mesh(
        new three.SphereGeometry((body === null ? 0.03 : 0.008) * bodyLength, 16, 12),
        new three.MeshLambertMaterial({ color: colour }),
      );
      group.add(this.marker);
    }
    const referenceXyz = referenceTrack(run);
    this.referenceXyz = referenceXyz;
    if (referenceXyz !== null) {
      const dash = 0.04 * bodyLength;
      this.reference = polyline(
        referenceXyz,
        new three.LineDashedMaterial({ color: kReferenceColour, dashSize: dash, gapSize: 0.7 * dash }),
      );
      this.referenceMarker = new three.Mesh(
        new three.OctahedronGeometry(0.02 * bodyLength),
        new three.MeshBasicMaterial({ color: kReferenceColour }),
      );
      group.add(this.reference, this.referenceMarker);
    }
    if (estimateAxes(run) !== null) {
      this.estimate = new three.Mesh(
        new three.OctahedronGeometry(0.035 * bodyLength),
        new three.MeshBasicMaterial({ color: kEstimateColour, wireframe: true }),
      );
      group.add(this.estimate);
    }
    if (run.plans !== null && run.plans.time.length > 0) {
      const line = (opacity: number) =>
        polyline(
          new Float64Array(3 * run.plans!.knots),
          new three.LineBasicMaterial({ color: kPlanColour, transparent: true, opacity }),
        );
      this.planRoot = line(1);
      for (let a = 0; a < run.plans.arms; ++a) this.planTips.push(line(0.6));
      group.add(this.planRoot, ...this.planTips);
    }
    this.largestThrust = largestThrustOf(run);
    if (run.shape != null && run.shape.drag !== null) {
      this.drag = new DragArrows(run.shape, dragged, bodyLength);
      group.add(this.drag.object);
    }
    if ((this.largestThrust > 0 || run.growing) && run.shape?.mantle != null && run.trajectory?.columns.has("thrust_n") === true) {
      this.jet = new three.ArrowHelper(new three.Vector3(0, 0, -1), new three.Vector3(), 1, 0x56b4e9);
      group.add(this.jet);
    }
  }

  /** Which lines there are. */
  get lines(): { path: boolean; reference: boolean; plan: boolean; jet: boolean; drag: boolean; estimate: boolean } {
    return {
      path: this.pathAll !== null,
      reference: this.reference !== null,
      plan: this.planRoot !== null,
      jet: this.jet !== null,
      drag: this.drag !== null,
      estimate: this.estimate !== null,
    };
  }

  /** The run has grown. */
  refresh(): void {
    this.track = rootTrack(this.run);
    if (this.track !== null) for (const line of [this.pathAll, this.pathPast]) if (line !== null) redraw(line, this.track.xyz);
    this.referenceXyz = referenceTrack(this.run);
    if (this.reference !== null && this.referenceXyz !== null) redraw(this.reference, this.referenceXyz);
    this.largestThrust = Math.max(this.largestThrust, largestThrustOf(this.run));
  }

  setDark(dark: boolean): void {
    const colour = runColour(this.index, dark);
    for (const line of [this.pathAll, this.pathPast]) {
      if (line !== null) (line.material as three.LineBasicMaterial).color.set(colour);
    }
    if (this.marker !== null) (this.marker.material as three.MeshLambertMaterial).color.set(colour);
  }

  /** What a camera follows at time `t`: the middle of the bodies, or the root. False: nothing. */
  focus(t: number, out: three.Vector3): boolean {
    if (this.track === null) return false;
    if (this.body !== null) {
      this.body.middle(t, out);
      return true;
    }
    const place = locate(this.track.time, t);
    const { xyz } = this.track;
    out.set(mix(xyz, 3, place, 0), mix(xyz, 3, place, 1), mix(xyz, 3, place, 2));
    return true;
  }

  /** Moves everything to time `t`; `byRun`: bodies in the run's own colour. */
  moveTo(t: number, layers: Layers, byRun: boolean, dark: boolean): void {
    this.group.visible = this.visible;
    if (!this.visible) return;
    if (this.body !== null) {
      this.body.group.visible = layers.bodies;
      this.body.setCablesVisible(layers.cables);
      this.body.moveTo(t, byRun ? parseColour(runColour(this.index, dark)) : null);
    }
    if (this.track !== null) {
      const place = locate(this.track.time, t);
      this.marker?.position.set(
        mix(this.track.xyz, 3, place, 0), mix(this.track.xyz, 3, place, 1), mix(this.track.xyz, 3, place, 2),
      );
      this.pathPast?.geometry.setDrawRange(0, place.i + 1);
      for (const line of [this.pathAll, this.pathPast]) if (line !== null) line.visible = layers.path;
      if (this.referenceXyz !== null && this.referenceMarker !== null && this.reference !== null) {
        this.referenceMarker.position.set(
          mix(this.referenceXyz, 3, place, 0), mix(this.referenceXyz, 3, place, 1), mix(this.referenceXyz, 3, place, 2),
        );
        this.reference.visible = this.referenceMarker.visible = layers.reference;
      }
    }
    this.movePlan(t, layers.plan);
    this.moveEstimate(t, layers.estimate);
    if (this.drag !== null && this.body !== null) {
      this.drag.object.visible = layers.drag;
      if (layers.drag) this.drag.moveTo(t, this.body.root(t, new three.Vector3()));
    }
    if (this.jet !== null && this.body !== null) {
      const thrust = this.run.trajectory!.columns.get("thrust_n")!;
      const value = mix(thrust, 1, locate(this.run.trajectory!.x, t), 0);
      const along = new three.Vector3();
      const from = new three.Vector3();
      this.body.jet(t, from, along);
      const length = (0.35 * this.bodyLength * value) / (this.largestThrust || 1);
      this.jet.visible = layers.jet && Math.abs(length) > 0.004 * this.bodyLength;
      this.jet.position.copy(from);
      this.jet.setDirection(along.multiplyScalar(Math.sign(length) || 1));
      const size = Math.max(Math.abs(length), 1e-6);
      this.jet.setLength(size, Math.min(0.3 * size, 0.06 * this.bodyLength), 0.03 * this.bodyLength);
    }
  }

  private moveEstimate(t: number, shown: boolean): void {
    const axes = estimateAxes(this.run);
    if (this.estimate === null || axes === null) return;
    this.estimate.visible = shown;
    const place = locate(this.run.estimate!.x, t);
    this.estimate.position.set(mix(axes[0]!, 1, place, 0), mix(axes[1]!, 1, place, 0), mix(axes[2]!, 1, place, 0));
  }

  private movePlan(t: number, shown: boolean): void {
    const { plans } = this.run;
    if (plans === null || this.planRoot === null) return;
    const i = latest(plans.time, t);
    const visible = shown && i >= 0;
    this.planRoot.visible = visible;
    for (const line of this.planTips) line.visible = visible;
    if (!visible) return;
    const copy = (line: three.Line, values: Float64Array, stride: number, offset: number) => {
      const attribute = line.geometry.getAttribute("position") as three.BufferAttribute;
      for (let k = 0; k < plans.knots; ++k) {
        const from = i * plans.knots * stride + k * stride + offset;
        attribute.setXYZ(k, values[from]!, values[from + 1]!, values[from + 2]!);
      }
      attribute.needsUpdate = true;
    };
    copy(this.planRoot, plans.root, 3, 0);
    this.planTips.forEach((line, a) => copy(line, plans.tips, 3 * plans.arms, 3 * a));
  }
}

function largestThrustOf(run: Run): number {
  let most = 0;
  for (const x of run.trajectory?.columns.get("thrust_n") ?? []) most = Math.max(most, Math.abs(x) || 0);
  return most;
}

/** Largest extent of the first frame of any run, or what the scene says [m]. */
export function bodyLengthOf(runs: Run[]): number {
  let length = 0;
  for (const run of runs) {
    const said = numberAt(run.summary, "control", "body_length_m") ?? numberAt(run.summary, "body_length_m");
    if (said !== null) length = Math.max(length, said);
    if (said !== null || run.shape === null) continue;
    const box = new three.Box3();
    const p = new three.Vector3();
    for (const arm of run.shape.arms) {
      for (let k = 0; k < arm.nodes; ++k) {
        box.expandByPoint(p.set(arm.position[3 * k]!, arm.position[3 * k + 1]!, arm.position[3 * k + 2]!));
      }
    }
    let reach = 0;
    for (const v of run.shape.mantle?.profile ?? []) reach = Math.max(reach, Math.abs(v));
    length = Math.max(length, reach, box.isEmpty() ? 0 : box.getSize(p).length());
  }
  return length || 1;
}
