import assert from "node:assert/strict";
import test from "node:test";
import { makeMesh, revolve, spansToNodes, tube } from "../src/geometry";

const near = (a: number, b: number, tolerance = 1e-6) => assert.ok(Math.abs(a - b) <= tolerance, `${a} is not ${b}`);
const point = (array: Float32Array, i: number) => [array[3 * i]!, array[3 * i + 1]!, array[3 * i + 2]!] as const;

test("a cylinder of revolution has its radius everywhere and normals outward", () => {
  const mesh = makeMesh(3, 16);
  revolve(mesh, [0.5, 0, 0.5, -1, 0.5, -2]);
  for (let i = 0; i < 3 * 17; ++i) {
    const [x, y] = point(mesh.position, i);
    const [nx, ny, nz] = point(mesh.normal, i);
    near(Math.hypot(x, y), 0.5);
    near(nx * x + ny * y, 0.5);
    near(nz, 0);
  }
});

test("every point of a tube lies its radius away from the line, on a plane across it", () => {
  // A helix: it bends and twists everywhere.
  const rings = 40;
  const line = new Float64Array(3 * rings);
  const radius = new Float64Array(rings);
  for (let i = 0; i < rings; ++i) {
    line.set([Math.cos(0.2 * i), Math.sin(0.2 * i), 0.05 * i], 3 * i);
    radius[i] = 0.1 - 0.001 * i;
  }
  const mesh = makeMesh(rings, 8);
  tube(mesh, line, radius);
  for (let ring = 1; ring + 1 < rings; ++ring) {
    const t = [0, 1, 2].map((k) => line[3 * (ring + 1) + k]! - line[3 * (ring - 1) + k]!);
    for (let k = 0; k <= 8; ++k) {
      const p = point(mesh.position, 9 * ring + k);
      const d = p.map((v, axis) => v - line[3 * ring + axis]!);
      near(Math.hypot(...d), radius[ring]!);
      near(d.reduce((sum, v, axis) => sum + v * t[axis]!, 0), 0, 1e-6);
    }
  }
});

test("sections of a tube do not turn about a straight line, nor flip along a circle", () => {
  const rings = 60;
  const line = new Float64Array(3 * rings);
  for (let i = 0; i < rings; ++i) line.set([Math.cos(0.1 * i), Math.sin(0.1 * i), 0], 3 * i);
  const mesh = makeMesh(rings, 6);
  tube(mesh, line, new Float64Array(rings).fill(0.05));
  for (let ring = 0; ring + 1 < rings; ++ring) {
    const a = point(mesh.normal, 7 * ring);
    const b = point(mesh.normal, 7 * (ring + 1));
    assert.ok(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] > 0.99);
  }
});

test("indices stay within the points, and triangles join neighbouring rings", () => {
  const mesh = makeMesh(4, 5);
  assert.equal(mesh.index.length, 6 * 3 * 5);
  assert.ok(mesh.index.every((i) => i < 4 * 6));
  assert.equal(makeMesh(1, 5).index.length, 0);
});

test("a node has the mean of its spans, an end its only one", () => {
  const out = new Float64Array(3);
  spansToNodes([2, 4], 3, out);
  assert.deepEqual([...out], [2, 3, 4]);
});
