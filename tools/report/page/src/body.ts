/// One run's bodies as three meshes, moved to a time: the mantle as a surface of revolution, arms and
/// cables as tubes, the rigid body.

import * as three from "three";
import { type Rgb, type ScaleName, colourInto } from "./colour";
import { type Mesh, makeMesh, paintRing, revolve, spansToNodes, tube } from "./geometry";
import type { Run, Shape } from "./model";
import { locate, mix, mixQuaternion } from "./timeline";

const kMantleSides = 40;
const kArmSides = 12;
const kCableSides = 5;
/** Cables are drawn this thick, as a share of the body's length: they have no thickness. */
const kCableShare = 0.002;

/** What the colours span, common to all runs of the page. */
export interface FieldRanges {
  hoop: number;
  curvature: number;
  tension: number;
}

export const kFieldScale: Record<keyof FieldRanges, ScaleName> = {
  hoop: "signed",
  curvature: "viridis",
  tension: "cividis",
};

/** Share of the scale for a value of a field. */
export function fieldShare(field: keyof FieldRanges, value: number, ranges: FieldRanges): number {
  const range = ranges[field] || 1;
  return field === "hoop" ? 0.5 + (0.5 * value) / range : value / range;
}

function largest(values: Float64Array): number {
  let most = 0;
  for (const v of values) if (Math.abs(v) > most) most = Math.abs(v);
  return most;
}

/** Ranges over every frame of every run. */
export function fieldRanges(runs: Run[]): FieldRanges {
  const ranges: FieldRanges = { hoop: 0, curvature: 0, tension: 0 };
  for (const { shape } of runs) {
    if (shape === null) continue;
    if (shape.mantle !== null) ranges.hoop = Math.max(ranges.hoop, largest(shape.mantle.hoop));
    for (const arm of shape.arms) ranges.curvature = Math.max(ranges.curvature, largest(arm.curvature));
    for (const cable of shape.cables) ranges.tension = Math.max(ranges.tension, largest(cable.tension));
  }
  return ranges;
}

class Part {
  readonly object: three.Mesh;
  constructor(
    readonly mesh: Mesh,
    material: three.Material,
  ) {
    const geometry = new three.BufferGeometry();
    for (const [name, array] of [
      ["position", mesh.position],
      ["normal", mesh.normal],
      ["color", mesh.colour],
    ] as const) {
      const attribute = new three.BufferAttribute(array, 3);
      attribute.setUsage(three.DynamicDrawUsage);
      geometry.setAttribute(name, attribute);
    }
    geometry.setIndex(new three.BufferAttribute(mesh.index, 1));
    this.object = new three.Mesh(geometry, material);
    this.object.frustumCulled = false; // its bounds change with every frame
  }

  upload(): void {
    for (const name of ["position", "normal", "color"]) {
      this.object.geometry.getAttribute(name).needsUpdate = true;
    }
  }
}

export class Body {
  readonly group = new three.Group();
  private readonly inRoot = new three.Group();
  private readonly mantle: Part | null;
  private readonly arms: Part[];
  private readonly cables: Part[];
  private readonly lines: Float64Array[];
  private readonly rgb = new Float32Array(3);
  private readonly opaque = new three.MeshLambertMaterial({ vertexColors: true });
  /** Cables run inside the arms, and are to be seen. */
  private readonly skin = new three.MeshLambertMaterial({ vertexColors: true, transparent: true, opacity: 0.8 });
  private readonly translucent = new three.MeshLambertMaterial({
    vertexColors: true,
    transparent: true,
    opacity: 0.55,
    side: three.DoubleSide,
    depthWrite: false,
  });

  constructor(
    private readonly shape: Shape,
    private readonly ranges: FieldRanges,
    bodyLength: number,
  ) {
    this.group.add(this.inRoot);
    this.mantle = shape.mantle === null ? null : new Part(makeMesh(shape.mantle.nodes, kMantleSides), this.translucent);
    if (this.mantle !== null) this.inRoot.add(this.mantle.object);
    this.arms = shape.arms.map((arm) => new Part(makeMesh(arm.nodes, kArmSides), shape.cables.length > 0 ? this.skin : this.opaque));
    this.cables = shape.cables.map((cable) => new Part(makeMesh(cable.points, kCableSides), this.opaque));
    for (const part of [...this.arms, ...this.cables]) this.group.add(part.object);
    this.lines = [...shape.arms.map((a) => a.nodes), ...shape.cables.map((c) => c.points)].map(
      (n) => new Float64Array(3 * n),
    );
    this.cableRadius = shape.cables.map((c) => new Float64Array(c.points).fill(kCableShare * bodyLength));
    this.middleInRoot = this.findMiddle();
    if (shape.rigid.length > 1) {
      const rigid = new Part(makeMesh(shape.rigid.length, kArmSides * 2), this.opaque);
      revolve(rigid.mesh, shape.rigid.flat());
      rigid.mesh.colour.fill(0.55);
      rigid.object.geometry.computeVertexNormals();
      this.inRoot.add(rigid.object);
    }
  }
  private readonly cableRadius: Float64Array[];
  private readonly middleInRoot: three.Vector3;

  setCablesVisible(visible: boolean): void {
    for (const cable of this.cables) cable.object.visible = visible;
  }

  setMantleOpacity(opacity: number): void {
    this.translucent.opacity = opacity;
  }

  /** Position of the root at time `t`, into `out`. */
  root(t: number, out: three.Vector3): three.Vector3 {
    const place = locate(this.shape.time, t);
    const p = this.shape.rootPosition;
    return out.set(mix(p, 3, place, 0), mix(p, 3, place, 1), mix(p, 3, place, 2));
  }

  /** Middle of the bodies at time `t`: that of the first shape, carried along by the root. */
  middle(t: number, out: three.Vector3): three.Vector3 {
    const [w, x, y, z] = mixQuaternion(this.shape.rootQuaternion, locate(this.shape.time, t));
    const turned = this.middleInRoot.clone().applyQuaternion(new three.Quaternion(x, y, z, w));
    return this.root(t, out).add(turned);
  }

  private findMiddle(): three.Vector3 {
    const { shape } = this;
    const root = this.root(-1, new three.Vector3());
    const [w, x, y, z] = mixQuaternion(shape.rootQuaternion, { i: 0, j: 0, share: 0 });
    const back = new three.Quaternion(x, y, z, w).invert();
    const box = new three.Box3().expandByPoint(new three.Vector3());
    const p = new three.Vector3();
    for (const arm of shape.arms) {
      for (let k = 0; k < 3 * arm.nodes; k += 3) {
        p.set(arm.position[k]!, arm.position[k + 1]!, arm.position[k + 2]!);
        box.expandByPoint(p.sub(root).applyQuaternion(back));
      }
    }
    for (let k = 0; shape.mantle !== null && k < 2 * shape.mantle.nodes; k += 2) {
      box.expandByPoint(p.set(0, 0, shape.mantle.profile[k + 1]!));
    }
    return box.getCenter(new three.Vector3());
  }

  /** Lip of the mantle on its axis, and the direction of the jet, in the earth frame. */
  jet(t: number, from: three.Vector3, along: three.Vector3): boolean {
    const { mantle } = this.shape;
    if (mantle === null) return false;
    const place = locate(this.shape.time, t);
    const z = mix(mantle.profile, 2 * mantle.nodes, place, 2 * mantle.nodes - 1);
    from.set(0, 0, z);
    this.inRoot.localToWorld(from);
    along.set(0, 0, -1).applyQuaternion(this.inRoot.quaternion);
    return true;
  }

  /** Moves everything to time `t`. `flat`: this colour instead of the fields'. */
  moveTo(t: number, flat: Rgb | null): void {
    const { shape } = this;
    const place = locate(shape.time, t);
    this.root(t, this.inRoot.position);
    const [w, x, y, z] = mixQuaternion(shape.rootQuaternion, place);
    this.inRoot.quaternion.set(x, y, z, w);
    this.inRoot.updateMatrixWorld();
    if (this.mantle !== null && shape.mantle !== null) {
      const { nodes, profile, hoop } = shape.mantle;
      const outline = new Float64Array(2 * nodes);
      for (let k = 0; k < 2 * nodes; ++k) outline[k] = mix(profile, 2 * nodes, place, k);
      revolve(this.mantle.mesh, outline);
      this.paint(this.mantle, hoop, nodes, place, "hoop", flat);
      this.mantle.upload();
    }
    shape.arms.forEach((arm, a) => {
      const part = this.arms[a]!;
      this.carry(part, this.lines[a]!, arm.position, arm.nodes, place, arm.radius);
      this.paint(part, arm.curvature, arm.nodes, place, "curvature", flat);
      part.upload();
    });
    shape.cables.forEach((cable, c) => {
      const part = this.cables[c]!;
      if (!part.object.visible) return;
      this.carry(part, this.lines[shape.arms.length + c]!, cable.position, cable.points, place, this.cableRadius[c]!);
      const tension = mix(cable.tension, 1, place, 0);
      colourInto(kFieldScale.tension, fieldShare("tension", tension, this.ranges), this.rgb, 0);
      for (let ring = 0; ring < cable.points; ++ring) paintRing(part.mesh, ring, this.rgb, 0);
      part.upload();
    });
  }

  private carry(
    part: Part,
    line: Float64Array,
    position: Float64Array,
    nodes: number,
    place: ReturnType<typeof locate>,
    radius: Float64Array,
  ): void {
    for (let k = 0; k < 3 * nodes; ++k) line[k] = mix(position, 3 * nodes, place, k);
    tube(part.mesh, line, radius);
  }

  private paint(
    part: Part,
    spans: Float64Array,
    nodes: number,
    place: ReturnType<typeof locate>,
    field: "hoop" | "curvature",
    flat: Rgb | null,
  ): void {
    const values = new Float64Array(nodes - 1);
    const atNodes = new Float64Array(nodes);
    for (let k = 0; k < nodes - 1; ++k) values[k] = mix(spans, nodes - 1, place, k);
    spansToNodes(values, nodes, atNodes);
    for (let ring = 0; ring < nodes; ++ring) {
      if (flat === null) {
        colourInto(kFieldScale[field], fieldShare(field, atNodes[ring]!, this.ranges), this.rgb, 0);
      } else {
        this.rgb.set(flat);
      }
      paintRing(part.mesh, ring, this.rgb, 0);
    }
  }
}
