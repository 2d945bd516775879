import assert from "node:assert/strict";
import test from "node:test";
import { latest, locate, mix, mixQuaternion } from "../src/timeline";

const times = Float64Array.from([0, 1, 1.5, 4]);

test("a time lies between its neighbours, and at the ends beyond them", () => {
  assert.deepEqual(locate(times, -1), { i: 0, j: 0, share: 0 });
  assert.deepEqual(locate(times, 9), { i: 3, j: 3, share: 0 });
  assert.deepEqual(locate(times, 1.25), { i: 1, j: 2, share: 0.5 });
  assert.deepEqual(locate(times, Number.NaN), { i: 0, j: 0, share: 0 });
  assert.deepEqual(locate(Float64Array.of(2), 5), { i: 0, j: 0, share: 0 });
});

test("every sample's own time gives the sample", () => {
  const values = Float64Array.from([10, 20, 30, 40]);
  times.forEach((t, i) => assert.equal(mix(values, 1, locate(times, t), 0), values[i]));
  assert.equal(mix(values, 1, locate(times, 2.75), 0), 35);
});

test("the latest sample is at or before the time", () => {
  assert.equal(latest(times, -0.1), -1);
  assert.equal(latest(times, 1), 1);
  assert.equal(latest(times, 3.9), 2);
});

test("rotations stay of unit length and go the shorter way round", () => {
  const h = Math.SQRT1_2;
  // The second sample is the same rotation as its negative.
  const q = mixQuaternion(Float64Array.from([1, 0, 0, 0, -h, 0, 0, -h]), { i: 0, j: 1, share: 0.5 });
  assert.ok(Math.abs(Math.hypot(...q) - 1) < 1e-12);
  // Half of a quarter turn about z.
  assert.ok(Math.abs(q[0] - Math.cos(Math.PI / 8)) < 1e-12 && Math.abs(q[3] - Math.sin(Math.PI / 8)) < 1e-12);
});
