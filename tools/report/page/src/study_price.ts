/// Studies of what accuracy costs, of hard cases and of effects: a picture and the tables behind it.

import { runColour } from "./colour";
import { element, formatNumber } from "./dom";
import { type Json, type Run, at, numberAt } from "./model";

const kSvg = "http://www.w3.org/2000/svg";
const kWidth = 640;
const kHeight = 380;
const kLeft = 64;
const kBottom = 40;
const kTop = 12;
const kRight = 12;

const list = (value: Json): Json[] => (Array.isArray(value) ? value : []);
const word = (value: Json, ...keys: string[]): string => {
  const found = at(value, ...keys);
  return found === null ? "" : String(found);
};
const percent = (value: number | null): string => (value === null ? "–" : `${formatNumber(100 * value, 3)} %`);

function svg(tag: string, attributes: Record<string, string | number>, ...children: (Node | string)[]): SVGElement {
  const made = document.createElementNS(kSvg, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
  made.append(...children);
  return made;
}

/** A card with a table; the first column names the row. */
export function tableCard(title: string, labels: string[], rows: string[][], help = ""): HTMLElement {
  const head = element("tr", {}, labels.map((label) => element("th", { scope: "col" }, [label])));
  const body = rows.map((row) =>
    element("tr", {}, row.map((cell, i) => i === 0 ? element("th", { scope: "row" }, [cell]) : element("td", {}, [cell]))),
  );
  return element("section", { class: "card table" }, [
    element("h3", {}, [title]),
    element("div", { class: "scroll", tabindex: "0" }, [
      element("table", {}, [element("thead", {}, [head]), element("tbody", {}, body)]),
    ]),
    ...(help === "" ? [] : [element("p", { class: "help" }, [help])]),
  ]);
}

/** Powers of ten between two positive numbers, the outer ones included. */
export function decades(least: number, most: number): number[] {
  const first = Math.floor(Math.log10(least) + 1e-9);
  const last = Math.max(Math.ceil(Math.log10(most) - 1e-9), first + 1);
  return Array.from({ length: last - first + 1 }, (_, i) => 10 ** (first + i));
}

/** Error in all against CPU time, both logarithmic; a colour for every family. */
function scatter(points: Json[], dark: boolean): HTMLElement | null {
  const shown = points.filter((p) => (numberAt(p, "error_in_all") ?? 0) > 0 && (numberAt(p, "cpu_s") ?? 0) > 0);
  if (shown.length === 0) return null;
  const cost = (p: Json) => numberAt(p, "cpu_s") ?? 1;
  const error = (p: Json) => numberAt(p, "error_in_all") ?? 1;
  const columns = decades(Math.min(...shown.map(cost)), Math.max(...shown.map(cost)));
  const rows = decades(Math.min(...shown.map(error)), Math.max(...shown.map(error)));
  const share = (value: number, ticks: number[]) =>
    Math.log(value / (ticks[0] ?? 1)) / Math.log((ticks[ticks.length - 1] ?? 10) / (ticks[0] ?? 1));
  const x = (value: number) => kLeft + share(value, columns) * (kWidth - kLeft - kRight);
  const y = (value: number) => kHeight - kBottom - share(value, rows) * (kHeight - kBottom - kTop);
  const families = [...new Set(shown.map((p) => word(p, "family")))];
  const items: SVGElement[] = [];
  for (const tick of columns) {
    items.push(
      svg("line", { x1: x(tick), x2: x(tick), y1: kTop, y2: kHeight - kBottom, stroke: "currentColor", "stroke-opacity": 0.15 }),
      svg("text", { x: x(tick), y: kHeight - kBottom + 16, "text-anchor": "middle" }, `${tick} s`),
    );
  }
  for (const tick of rows) {
    items.push(
      svg("line", { x1: kLeft, x2: kWidth - kRight, y1: y(tick), y2: y(tick), stroke: "currentColor", "stroke-opacity": 0.15 }),
      svg("text", { x: kLeft - 6, y: y(tick) + 4, "text-anchor": "end" }, percent(tick)),
    );
  }
  for (const point of shown) {
    const front = at(point, "front") === true;
    const title = `${word(point, "name")}: ${percent(error(point))}, ${formatNumber(cost(point), 3)} s`;
    items.push(
      svg(
        "circle",
        {
          cx: x(cost(point)),
          cy: y(error(point)),
          r: front ? 5 : 3.5,
          fill: runColour(families.indexOf(word(point, "family")), dark),
          stroke: "currentColor",
          "stroke-width": front ? 1.5 : 0,
        },
        svg("title", {}, title),
      ),
    );
  }
  families.forEach((family, i) => {
    items.push(
      svg("circle", { cx: kWidth - 110, cy: kTop + 10 + 16 * i, r: 4, fill: runColour(i, dark) }),
      svg("text", { x: kWidth - 100, y: kTop + 14 + 16 * i }, family),
    );
  });
  const title = "Error against CPU time";
  const picture = svg("svg", { viewBox: `0 0 ${kWidth} ${kHeight}`, role: "img", "aria-label": title, class: "bars" }, ...items);
  return element("section", { class: "card" }, [
    element("h3", {}, [title]),
    picture as unknown as HTMLElement,
    element("p", { class: "help" }, ["Largest distance of root and tips from the finest plant, in % of the body length. Outlined: no other point is cheaper and better."]),
  ]);
}

function accuracyCards(summary: Json, dark: boolean): HTMLElement[] {
  const points = list(at(summary, "points"));
  const picture = scatter(points, dark);
  const recommendations = list(at(summary, "recommendations")).map((r) => [word(r, "text")]);
  const orders = list(at(summary, "orders")).map((o) => [
    word(o, "of"),
    formatNumber(numberAt(o, "order"), 3),
    formatNumber(numberAt(o, "theory"), 3),
    word(o, "points"),
  ]);
  const rows = points.map((p) =>
    at(p, "ok") === true
      ? [
          `${at(p, "front") === true ? "* " : ""}${word(p, "name")}`,
          percent(numberAt(p, "error")),
          percent(numberAt(p, "error_in_all")),
          formatNumber(numberAt(p, "cpu_s"), 3),
          formatNumber(numberAt(p, "times_real_time"), 3),
        ]
      : [word(p, "name"), word(p, "reason"), "", "", ""],
  );
  return [
    ...(picture === null ? [] : [picture]),
    tableCard("What to take", ["For an error of"], recommendations),
    tableCard("Orders of convergence", ["Of", "Observed", "Theory", "Points"], orders),
    tableCard("Points", ["Point", "Error of its own kind", "Error in all", "CPU time [s]", "Times real time"], rows),
  ];
}

function stabilityCards(summary: Json): HTMLElement[] {
  const integrators = list(at(summary, "integrators"));
  const names = integrators.map((i) => word(i, "integrator"));
  const cases = [...new Set(list(at(summary, "points")).map((p) => word(p, "case")))];
  const step = (value: number | null) => (value === null ? "none" : `${formatNumber(1e3 * value, 4)} ms`);
  const rows = cases.map((name) => {
    const of = (integrator: string) =>
      list(at(summary, "points")).find((p) => word(p, "case") === name && word(p, "integrator") === integrator) ?? null;
    return [name, ...names.map((integrator) => step(numberAt(of(integrator), "largest_step_s"))), word(of(names[0] ?? ""), "hard")];
  });
  return [
    tableCard(
      "Verdicts of all runs",
      ["Integrator", "Holds", "Told", "Refused", "Slow", "Violates"],
      integrators.map((i) => ["integrator", "holds", "told", "refused", "slow", "violates"].map((key) => word(i, key))),
    ),
    tableCard("Largest step that holds", ["Case", ...names, "What makes it hard"], rows),
  ];
}

function effectsCards(summary: Json): HTMLElement[] {
  const rows = list(at(summary, "effects")).map((e) => [
    `${word(e, "model")}: ${word(e, "effect")}`,
    percent(numberAt(e, "costs")),
    percent(numberAt(e, "off_against_never")),
    word(e, "state"),
    percent(numberAt(e, "changes")),
    word(e, "reason"),
  ]);
  return [
    tableCard(
      "Effects",
      ["Effect", "Costs", "Off against never mentioned", "State", "Changes", ""],
      rows,
      `Work by ${word(summary, "counter")}; what it changes is the largest distance of root and tips, in % of the body length.`,
    ),
  ];
}

/** Cards of a study that is not one of controllers; null for those. */
export function priceCards(run: Run, dark: boolean): HTMLElement[] | null {
  switch (word(run.summary, "study")) {
    case "accuracy":
      return accuracyCards(run.summary, dark);
    case "stability":
      return stabilityCards(run.summary);
    case "effects":
      return effectsCards(run.summary);
    default:
      return null;
  }
}
