import assert from "node:assert/strict";
import test from "node:test";
import { choosePlots } from "../src/catalogue";
import { Growing, GrowingTable } from "../src/growing";
import type { LiveFrame } from "../src/live_frame";
import { LiveRun } from "../src/live_run";

function frame(time: number, more: Partial<LiveFrame> = {}): LiveFrame {
  return {
    time,
    rows: { trajectory: { time_s: time, root_x_m: 2 * time, root_y_m: 0, root_z_m: null }, counters: { time_s: time, misses: 0 } },
    shape: {
      root_position: [2 * time, 0, 0], root_quaternion: [1, 0, 0, 0],
      arms: [{ name: "arm", nodes: 2, radius: [0.01, 0.005], position: [0, 0, 0, time, 0, 0], curvature: [time] }],
      mantle: null, rigid: [], cables: [],
    },
    ...more,
  };
}

test("the newest rows stay, the oldest make room, and a view is one piece", () => {
  const rows = new Growing(2, 3);
  for (let i = 0; i < 100; ++i) {
    rows.push([i, -i]);
    const view = rows.view();
    const first = Math.max(0, i - 2);
    assert.equal(rows.length, Math.min(i + 1, 3));
    assert.deepEqual([...view], Array.from({ length: i + 1 - first }, (_v, k) => [first + k, -(first + k)]).flat());
  }
});

test("a number that is missing is NaN, and a row with other titles is refused", () => {
  const table = new GrowingTable("t", { t: 0, a: null }, 10);
  assert.ok(Number.isNaN(table.column("a")[0]!));
  assert.equal(table.push({ t: 1, b: 2 }), false);
  assert.equal(table.push({ t: 1, a: 2 }), true);
  assert.equal(table.length, 2);
});

test("a run grows by its frames, and its plots with it", () => {
  const run = new LiveRun(frame(0));
  for (let i = 1; i <= 10; ++i) {
    const next = frame(0.1 * i);
    assert.ok(run.fits(next));
    run.add(next);
  }
  assert.equal(run.run.shape!.time.length, 11);
  assert.ok(Math.abs(run.run.shape!.arms[0]!.position[10 * 6 + 3]! - 1) < 1e-12);
  const position = choosePlots([run.run]).find((plot) => plot.id === "position")!;
  assert.equal(position.curves.find((c) => c.channel === "x")!.y.at(-1), 2);
  assert.ok(Math.abs(run.time - 1) < 1e-12);
});

test("a frame that came before, or of another robot, is of another run", () => {
  const run = new LiveRun(frame(1));
  assert.equal(run.fits(frame(0.5)), false);
  const other = frame(2);
  other.shape!.arms[0]!.name = "leg";
  assert.equal(run.fits(other), false);
  assert.ok(run.fits(frame(1)), "the same one again, from a server that has begun anew");
  run.add(frame(1));
  assert.equal(run.run.shape!.time.length, 1);
});

test("a server that has begun anew and knows no plan yet goes on with the run; one that knows more begins a page", () => {
  const plan = { time: 0, knots: 1, arms: 0, ahead: [0], root: [0, 0, 0], tips: [], solve_ms: 0 };
  const run = new LiveRun(frame(0, { plan }));
  assert.ok(run.fits(frame(0.1)));
  run.add(frame(0.1));
  assert.equal(run.run.plans!.time.length, 1);
  assert.equal(new LiveRun(frame(0)).fits(frame(0.1, { plan })), false);
});

test("what was before a page was opened is in its plots, once", () => {
  const before = [0, 0.1, 0.2].map((t) => frame(t).rows);
  const run = new LiveRun(frame(0.2), before);
  assert.deepEqual([...run.run.trajectory!.x], [0, 0.1, 0.2]);
  assert.equal(run.run.shape!.time.length, 1);
  run.addMissed(frame(0.1).rows);
  run.addMissed(frame(0.3).rows);
  run.add(frame(0.4));
  assert.deepEqual([...run.run.trajectory!.x], [0, 0.1, 0.2, 0.3, 0.4]);
  assert.equal(new LiveRun(frame(0.5), run.rows()).run.trajectory!.x.length, 6);
});

test("plans are kept once each, and their solve times plotted", () => {
  const plan = (time: number) => ({ time, knots: 2, arms: 1, ahead: [0, 1], root: [0, 0, 0, 1, 0, 0], tips: [0, 0, 0, 1, 1, 0], solve_ms: 5 });
  const run = new LiveRun(frame(0, { plan: plan(0) }));
  run.add(frame(0.1, { plan: plan(0) }));
  run.add(frame(0.2, { plan: plan(0.2) }));
  assert.equal(run.run.plans!.time.length, 2);
  assert.equal(run.run.plans!.arms, 1);
  assert.deepEqual([...run.run.solver!.columns.get("solve_ms")!], [5, 5]);
});
