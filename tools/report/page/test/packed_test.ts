import assert from "node:assert/strict";
import test from "node:test";
import { unpack } from "../src/packed";

const base64 = (bytes: ArrayBuffer) => Buffer.from(bytes).toString("base64");

test("sixteen-bit arrays give lo + step u, and no number for 65535", () => {
  const d = base64(Uint16Array.from([0, 1, 65534, 65535]).buffer);
  const values = unpack({ k: "u16", n: 4, lo: -2, step: 0.5, d });
  assert.deepEqual([...values.slice(0, 3)], [-2, -1.5, 32765]);
  assert.ok(Number.isNaN(values[3]));
});

test("single and double precision come out as they went in", () => {
  assert.deepEqual([...unpack({ k: "f32", n: 2, d: base64(Float32Array.from([1.5, -0.25]).buffer) })], [1.5, -0.25]);
  assert.deepEqual([...unpack({ k: "f64", n: 1, d: base64(Float64Array.from([Math.PI]).buffer) })], [Math.PI]);
});

test("a constant has its value everywhere, and no number where there is none", () => {
  assert.deepEqual([...unpack({ k: "c", n: 3, v: 7 })], [7, 7, 7]);
  assert.ok(unpack({ k: "c", n: 2, v: null }).every(Number.isNaN));
});

test("an array that is shorter than it says is refused", () => {
  const d = base64(Uint16Array.from([1, 2]).buffer);
  assert.throws(() => unpack({ k: "u16", n: 3, lo: 0, step: 1, d }), /4 bytes, must be 6/);
});
