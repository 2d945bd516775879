import assert from "node:assert/strict";
import test from "node:test";
import { choosePlots, kMostCurves } from "../src/catalogue";
import type { Run, Table } from "../src/model";

function table(over: string, columns: Record<string, number[]>): Table {
  const map = new Map(Object.entries(columns).map(([name, v]) => [name, Float64Array.from(v)]));
  return { over, x: map.get(over)!, columns: map, ofRows: map.get(over)!.length };
}
function run(label: string, trajectory: Table | null, more: Partial<Run> = {}): Run {
  return {
    label, folder: label, kind: "run", complete: true, growing: false, summary: null, notes: [], trajectory, solver: null, energy: null,
    path: null, estimate: null, shape: null, plans: null, drives: null, status: null, counters: null, ...more,
  };
}

test("commanded and actual tensions of a motor share a colour, and commanded ones are dashed", () => {
  const t = table("time_s", { time_s: [0, 1], actual_a_n: [1, 2], command_a_n: [1, 3], actual_b_n: [0, 1], command_b_n: [0, 2] });
  const plot = choosePlots([run("one", t)]).find((p) => p.id === "tension")!;
  assert.deepEqual(plot.curves.map((c) => [c.channel, c.index, c.dashed]), [
    ["a", 0, false], ["a commanded", 0, true], ["b", 1, false], ["b commanded", 1, true],
  ]);
});

test("units are converted: cubic metres to millilitres", () => {
  const t = table("time_s", { time_s: [0, 1], volume_m3: [1e-6, 3e-4] });
  const plot = choosePlots([run("one", t)]).find((p) => p.id === "volume")!;
  assert.equal(plot.unit, "mL");
  assert.ok(Math.abs(plot.curves[0]!.y[1]! - 300) < 1e-9);
});

test("runs with columns of their own are overlaid where they share them", () => {
  const one = run("one", table("time_s", { time_s: [0, 1], root_x_m: [0, 1] }));
  const two = run("two", table("time_s", { time_s: [0, 2], root_x_m: [0, 1], volume_m3: [1, 2] }));
  const plots = choosePlots([one, two]);
  assert.deepEqual(plots.find((p) => p.id === "position")!.curves.map((c) => c.run), [0, 1]);
  assert.deepEqual(plots.find((p) => p.id === "volume")!.curves.map((c) => c.run), [1]);
});

test("no table, no row or a thrust of nothing but zero: no plot", () => {
  assert.deepEqual(choosePlots([run("one", null)]), []);
  assert.deepEqual(choosePlots([run("one", table("time_s", { time_s: [0], root_x_m: [1] }))]), []);
  const still = table("time_s", { time_s: [0, 1], thrust_n: [0, 0] });
  assert.equal(choosePlots([run("one", still)]).some((p) => p.id === "thrust"), false);
});

test("a path of equilibria is plotted over the load factor", () => {
  const path = table("load_factor", { load_factor: [0, 1], rod_tip_x_m: [0, 1], unstable_directions: [0, 0] });
  const plots = choosePlots([run("one", null, { kind: "static", path })]);
  assert.deepEqual(plots.map((p) => [p.id, p.over]), [["static_tip", "load factor"], ["static_stability", "load factor"]]);
});

test("a plot of very many curves is cut to what can be told apart", () => {
  const columns: Record<string, number[]> = { time_s: [0, 1] };
  for (let i = 0; i < 60; ++i) columns[`arm_c${i}_tension_n`] = [0, i];
  const plot = choosePlots([run("one", table("time_s", columns))]).find((p) => p.id === "cable_tension")!;
  assert.equal(plot.curves.length, kMostCurves);
});

test("powers that vanish leave a gap on a logarithmic scale", () => {
  const t = table("time_s", { time_s: [0, 1], power_balance_residual: [0, 1e-16] });
  const plot = choosePlots([run("one", t)]).find((p) => p.id === "balance")!;
  assert.ok(Number.isNaN(plot.curves[0]!.y[0]));
  assert.equal(plot.logarithmic, true);
});
