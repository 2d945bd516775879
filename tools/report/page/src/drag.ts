/// Arrows of the water's drag: one at each node of the arms, per length, and one of mantle and rigid body together.

import * as three from "three";
import { mergeGeometries } from "three/examples/jsm/utils/BufferGeometryUtils.js";
import type { Run, Shape } from "./model";
import { locate, mix } from "./timeline";

const kColour = 0xe69f00;
/** The longest arrow, as a share of the body's length. */
const kLongest = 0.3;
const kThick = 0.004;

/** Longest arrows of a page: [N/m] at nodes, [N] of bodies. */
export interface DragRanges {
  nodes: number;
  body: number;
}

function longest(rows: Float64Array): number {
  let most = 0;
  for (let i = 0; i + 2 < rows.length; i += 3) most = Math.max(most, Math.hypot(rows[i]!, rows[i + 1]!, rows[i + 2]!) || 0);
  return most;
}

export function dragRanges(runs: Run[]): DragRanges {
  const ranges = { nodes: 0, body: 0 };
  for (const { shape } of runs) {
    if (shape === null || shape.drag === null) continue;
    ranges.nodes = Math.max(ranges.nodes, longest(shape.drag.nodes));
    ranges.body = Math.max(ranges.body, longest(shape.drag.body));
  }
  return ranges;
}

/** An arrow of length 1 along y, from 0. */
function makeArrow(): three.BufferGeometry {
  const shaft = new three.CylinderGeometry(1, 1, 0.75, 6).translate(0, 0.375, 0);
  const head = new three.ConeGeometry(2.6, 0.25, 8).translate(0, 0.875, 0);
  return mergeGeometries([shaft, head]);
}

export class DragArrows {
  readonly object: three.InstancedMesh;
  private readonly nodes: number;
  private readonly matrix = new three.Matrix4();
  private readonly from = new three.Vector3();
  private readonly force = new three.Vector3();
  private readonly turn = new three.Quaternion();
  private readonly size = new three.Vector3();

  constructor(
    private readonly shape: Shape,
    private readonly ranges: DragRanges,
    private readonly bodyLength: number,
  ) {
    this.nodes = shape.arms.reduce((sum, arm) => sum + arm.nodes, 0);
    this.object = new three.InstancedMesh(makeArrow(), new three.MeshLambertMaterial({ color: kColour }), this.nodes + 1);
    this.object.frustumCulled = false;
  }

  moveTo(t: number, middle: three.Vector3): void {
    const { shape } = this;
    if (shape.drag === null) return;
    const place = locate(shape.time, t);
    const here = locate(shape.drag.time, t);
    let node = 0;
    for (const arm of shape.arms) {
      for (let k = 0; k < arm.nodes; ++k, ++node) {
        for (const [axis, name] of (["x", "y", "z"] as const).entries()) {
          this.from[name] = mix(arm.position, 3 * arm.nodes, place, 3 * k + axis);
          this.force[name] = mix(shape.drag.nodes, 3 * this.nodes, here, 3 * node + axis);
        }
        this.put(node, this.ranges.nodes, 1);
      }
    }
    for (const [axis, name] of (["x", "y", "z"] as const).entries()) this.force[name] = mix(shape.drag.body, 3, here, axis);
    this.from.copy(middle);
    this.put(node, this.ranges.body, 2);
    this.object.instanceMatrix.needsUpdate = true;
  }

  private put(index: number, range: number, thick: number): void {
    const strength = this.force.length();
    const length = range > 0 && Number.isFinite(strength) ? (kLongest * this.bodyLength * strength) / range : 0;
    if (length < 0.01 * kLongest * this.bodyLength) {
      this.matrix.makeScale(0, 0, 0);
    } else {
      this.turn.setFromUnitVectors(new three.Vector3(0, 1, 0), this.force.divideScalar(strength));
      const width = kThick * this.bodyLength * thick;
      this.matrix.compose(this.from, this.turn, this.size.set(width, length, width));
    }
    this.object.setMatrixAt(index, this.matrix);
  }
}
