/// What `mantle tune` found: the cost of the best parameters over the runs of the search, and the parameters.

import uPlot from "uplot";
import { runColour } from "./colour";
import { element, formatNumber } from "./dom";
import { type Json, type Run, at, numberAt } from "./model";
import type { Figure } from "./paper";
import { table } from "./tables";

function entriesOf(value: Json): [string, Json][] {
  return value !== null && typeof value === "object" && !Array.isArray(value) ? Object.entries(value) : [];
}

/** Cost of the best parameters so far, over the runs. */
function search(run: Run, controllers: [string, Json][]): Figure {
  const host = element("div", { class: "plot-host" });
  const root = element("section", { class: "card", "data-figure": "search" }, [
    element("h3", {}, [`Least cost found: ${run.label}`]), host,
    element("p", { class: "help" }, ["Of the best parameters so far, over the closed-loop runs that the search has made; logarithmic."]),
  ]);
  let chart: uPlot | null = null;
  const tables = controllers.map(([, c]) => {
    const trace = at(c, "trace");
    const rows = Array.isArray(trace) ? trace : [];
    return [rows.map((row) => numberAt(row, 0)), rows.map((row) => numberAt(row, 1))];
  });
  const draw = (dark: boolean) => {
    chart?.destroy();
    const ink = dark ? "#c3ced9" : "#33404d";
    const faint = dark ? "#26313b" : "#e3e8ed";
    const font = "12px system-ui, sans-serif";
    const axis = { stroke: ink, font, grid: { stroke: faint, width: 1 }, ticks: { stroke: faint, width: 1, size: 4 } };
    chart = new uPlot(
      {
        width: Math.max(host.clientWidth, 200), height: 260, pxAlign: 0,
        scales: { x: { time: false }, y: { distr: 3 } },
        cursor: { drag: { x: true, y: false }, y: false },
        axes: [
          { ...axis, label: "runs", labelSize: 16, labelFont: font, size: 30 },
          { ...axis, size: 60, values: (_u, splits) => splits.map((v) => (v === null ? "" : formatNumber(v, 4))) },
        ],
        series: [{ label: "runs" }, ...controllers.map(([name], i) => ({ label: name, stroke: runColour(i, dark), width: 1.8, spanGaps: true, points: { show: false } }))],
      },
      uPlot.join(tables as unknown as uPlot.AlignedData[]),
      host,
    );
  };
  return { root, draw };
}

/** Figures of runs of `mantle tune`. */
export function tuneFigures(runs: Run[]): Figure[] {
  return runs
    .filter((run) => run.kind === "tune")
    .flatMap((run) => {
      const controllers = entriesOf(at(run.summary, "controllers"));
      const body = (key: string, name: string) => ({ name, cells: controllers.map(([, c]) => formatNumber(numberAt(c, key), 5)) });
      const parameters = [...new Set(controllers.flatMap(([, c]) => entriesOf(at(c, "parameters")).map(([key]) => key)))];
      const rows = [
        body("cost_before", "Cost before"), body("cost", "Cost, tuned"), body("evaluations", "Runs"),
        ...parameters.map((key) => ({
          name: key,
          cells: controllers.map(([, c]) => (numberAt(c, "parameters", key) === null ? null : formatNumber(numberAt(c, "parameters", key), 5))),
        })),
      ];
      const found = table(`Tuned on ${String(at(run.summary, "scene") ?? run.label)}`, controllers.map(([name]) => name), rows);
      return [search(run, controllers), { root: found, draw: () => {} }];
    });
}
