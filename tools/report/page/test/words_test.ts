import assert from "node:assert/strict";
import test from "node:test";
import { colourInto, kPalette, parseColour } from "../src/colour";
import { driveRemarks, driveState } from "../src/drives";
import { formatNumber } from "../src/dom";

test("statuswords are the states of CiA 402", () => {
  const states: [number, string][] = [
    [0x0000, "not ready to switch on"], [0x0240, "switch on disabled"], [0x0231, "ready to switch on"],
    [0x0233, "switched on"], [0x0237, "operation enabled"], [0x0217, "quick stop active"],
    [0x021f, "fault reaction active"], [0x0218, "fault"],
  ];
  for (const [word, state] of states) assert.equal(driveState(word), state, word.toString(16));
  assert.deepEqual(driveRemarks(0x0a37 | 0x80), ["warning", "internal limit active"]);
});

test("a scale begins and ends with its own colours; what is no number is grey", () => {
  const out = new Float32Array(3);
  colourInto("viridis", 0, out, 0);
  assert.deepEqual([...out], parseColour("#440154").map(Math.fround));
  colourInto("viridis", 5, out, 0);
  assert.deepEqual([...out], parseColour("#fde725").map(Math.fround));
  colourInto("signed", Number.NaN, out, 0);
  assert.deepEqual([...out], [0.5, 0.5, 0.5]);
});

test("brightness rises along the scales that start at 0, so that they read without colours", () => {
  for (const scale of ["viridis", "cividis"] as const) {
    let before = -1;
    for (let i = 0; i <= 20; ++i) {
      const out = new Float32Array(3);
      colourInto(scale, i / 20, out, 0);
      const brightness = 0.2126 * out[0]! + 0.7152 * out[1]! + 0.0722 * out[2]!;
      assert.ok(brightness > before, `${scale} at ${i}`);
      before = brightness;
    }
  }
});

test("colours of runs differ", () => assert.equal(new Set(kPalette).size, kPalette.length));

test("numbers are short, and none is a dash", () => {
  assert.equal(formatNumber(0.0123456, 4), "0.01235");
  assert.equal(formatNumber(1e-16, 4), "1.00e-16");
  assert.equal(formatNumber(2.5e7, 3), "2.5e7");
  assert.equal(formatNumber(0, 4), "0");
  assert.equal(formatNumber(Number.NaN, 4), "–");
  assert.equal(formatNumber(null, 4), "–");
});
