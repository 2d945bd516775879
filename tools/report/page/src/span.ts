/// From when to when a run goes, in simulated seconds.

import type { Run } from "./model";

/** Where its replay begins: of one that grows, what is kept of it. */
export function beginOf(run: Run): number {
  if (!run.growing) return 0;
  return run.shape?.time[0] ?? run.trajectory?.x[0] ?? 0;
}

export function durationOf(run: Run): number {
  const ends = [run.trajectory, run.solver].map((t) => (t !== null && t.over === "time_s" ? (t.x[t.x.length - 1] ?? 0) : 0));
  const { shape } = run;
  if (shape !== null && run.kind !== "static") ends.push(shape.time[shape.time.length - 1] ?? 0);
  return Math.max(0, ...ends);
}
