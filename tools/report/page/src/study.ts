/// A study of controllers: its figures as bars with their values, and the table behind them.

import { runColour } from "./colour";
import { element, formatNumber } from "./dom";
import { type Json, type Run, at, numberAt } from "./model";
import { priceCards } from "./study_price";

interface Figure {
  title: string;
  unit: string;
  value: (run: Json) => number | null;
}
const kFigures: Figure[] = [
  { title: "Cost", unit: "", value: (r) => numberAt(r, "cost") },
  { title: "Mean error", unit: "mm, or mm/s", value: (r) => scaled(numberAt(r, "error", "mean"), 1e3) },
  { title: "Effort", unit: "N² s", value: (r) => numberAt(r, "effort_n2_s") },
  { title: "Longest plan", unit: "ms", value: (r) => numberAt(r, "solver", "step_ms", "max") },
];
const kBar = 16;
const kGap = 4;
const kSvg = "http://www.w3.org/2000/svg";

function scaled(value: number | null, by: number): number | null {
  return value === null ? null : by * value;
}
const word = (value: Json, key: string): string => String(at(value, key) ?? "");

function svg(tag: string, attributes: Record<string, string | number>, ...children: (Node | string)[]): SVGElement {
  const made = document.createElementNS(kSvg, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
  made.append(...children);
  return made;
}

/** Bars on a logarithmic scale where values differ by more than a hundred times. */
function bars(figure: Figure, runs: Json[], controllers: string[], dark: boolean): HTMLElement | null {
  const values = runs.map(figure.value);
  const positive = values.filter((v): v is number => v !== null && v > 0);
  if (positive.length === 0) return null;
  const most = Math.max(...positive);
  const least = Math.min(...positive);
  const logarithmic = most > 100 * least;
  const share = (v: number) => (logarithmic ? 0.04 + (0.96 * Math.log(v / least)) / Math.log(most / least) : v / most);
  const width = 640;
  const left = 190;
  const right = 90;
  let y = 4;
  const items: SVGElement[] = [];
  let scene = "";
  runs.forEach((run, i) => {
    if (word(run, "scene") !== scene) {
      scene = word(run, "scene");
      y += i > 0 ? 8 : 0;
      items.push(svg("text", { x: 0, y: y + 13, class: "scene" }, scene));
      y += 20;
    }
    const controller = word(run, "controller");
    const value = values[i];
    const length = value === null || value === undefined || value <= 0 ? 0 : share(value) * (width - left - right);
    const shown = value === null || value === undefined ? "–" : formatNumber(value, 4);
    const stopped = at(run, "ok") === false ? " (stopped)" : "";
    items.push(
      svg("text", { x: left - 8, y: y + 12, "text-anchor": "end" }, controller),
      svg(
        "rect",
        { x: left, y, width: Math.max(length, 1), height: kBar, rx: 2, fill: runColour(controllers.indexOf(controller), dark) },
        svg("title", {}, `${scene}, ${controller}: ${shown} ${figure.unit}${stopped}`),
      ),
      svg("text", { x: left + length + 6, y: y + 12 }, `${shown}${stopped}`),
    );
    y += kBar + kGap;
  });
  const picture = svg("svg", { viewBox: `0 0 ${width} ${y + 4}`, role: "img", "aria-label": figure.title, class: "bars" }, ...items);
  return element("section", { class: "card" }, [
    element("h3", {}, [figure.title, element("span", { class: "unit" }, [figure.unit === "" ? "" : ` [${figure.unit}]`])]),
    picture as unknown as HTMLElement,
    element("p", { class: "help" }, [logarithmic ? "Lengths are logarithmic." : "Lengths start at 0."]),
  ]);
}

/** Cards of a study. */
export function studyCards(run: Run, dark: boolean): HTMLElement[] {
  const price = priceCards(run, dark);
  if (price !== null) return price;
  const runs = at(run.summary, "runs");
  if (!Array.isArray(runs) || runs.length === 0) {
    return [element("p", { class: "empty" }, [`${run.label}: the study has no runs.`])];
  }
  const controllers = [...new Set(runs.map((r) => word(r, "controller")))];
  return kFigures.map((figure) => bars(figure, runs, controllers, dark)).filter((card) => card !== null);
}
