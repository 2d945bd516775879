/// The linked plots: uPlot draws each once, and the line of the present moves over it.

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import type { Plot } from "./catalogue";
import { runColour } from "./colour";
import { element, formatNumber, formatWithin } from "./dom";
import { locate, mix } from "./timeline";

const kHeight = 190;
const kDashes = [[], [7, 4], [2, 3], [10, 3, 2, 3], [1, 5], [14, 4]];

interface Hooks {
  /** The reader has clicked at this time [s]. */
  seek(time: number): void;
  runLabels: string[];
  /** The runs go on: their last values are the present ones. */
  growing: boolean;
}

/** One x for all curves: uPlot draws several tables over their joined x. */
function join(plot: Plot): uPlot.AlignedData {
  const tables: uPlot.AlignedData[] = plot.curves.map((c) => [c.x, c.y] as unknown as uPlot.AlignedData);
  const same = plot.curves.every((c) => c.x === plot.curves[0]!.x);
  if (same) return [plot.curves[0]!.x, ...plot.curves.map((c) => c.y)] as unknown as uPlot.AlignedData;
  return uPlot.join(tables);
}

export class PlotCard {
  readonly root: HTMLElement;
  private chart: uPlot | null = null;
  private readonly host: HTMLElement;
  private readonly now: HTMLElement;
  private readonly values: HTMLElement[] = [];
  private readonly swatches: HTMLElement[] = [];
  private readonly rows: HTMLElement[] = [];
  private readonly hidden: boolean[];
  private time = 0;
  private onScreen = true;
  private dark = false;
  private visible: boolean[] = [];
  private data: uPlot.AlignedData;
  private span = 0;
  private stale = false;

  constructor(
    public plot: Plot,
    private readonly hooks: Hooks,
  ) {
    this.data = join(plot);
    this.span = spanOf(plot);
    this.hidden = plot.curves.map(() => false);
    this.host = element("div", { class: "plot-host" });
    this.now = element("div", { class: "plot-now", "aria-hidden": "true" });
    const legend = element("ul", { class: "legend" });
    const overlaid = new Set(plot.curves.map((c) => c.run)).size > 1;
    plot.curves.forEach((curve, i) => {
      const swatch = element("span", { class: "swatch" });
      const value = element("span", { class: "value" });
      const name = overlaid ? `${this.hooks.runLabels[curve.run]}: ${curve.channel}` : curve.channel;
      const row = element("button", { type: "button", class: "legend-row", title: `Show or hide ${name}`, "aria-pressed": "true" }, [
        swatch, element("span", { class: "name" }, [name]), value,
      ]);
      row.addEventListener("click", () => this.hide(i, !this.hidden[i]));
      this.values.push(value);
      this.swatches.push(swatch);
      this.rows.push(row);
      legend.append(element("li", {}, [row]));
    });
    this.root = element("section", { class: "card plot", "data-plot": plot.id, "aria-label": plot.title }, [
      element("h3", {}, [plot.title, element("span", { class: "unit" }, [` [${plot.unit}]`])]),
      this.host, legend, element("p", { class: "help" }, [plot.help]),
    ]);
  }

  private colourOf(i: number): string {
    const curve = this.plot.curves[i]!;
    const overlaid = new Set(this.plot.curves.map((c) => c.run)).size > 1;
    return runColour(overlaid ? curve.run : curve.index, this.dark);
  }
  private dashOf(i: number): number[] {
    const curve = this.plot.curves[i]!;
    const overlaid = new Set(this.plot.curves.map((c) => c.run)).size > 1;
    if (!overlaid) return curve.dashed ? [5, 4] : [];
    return curve.dashed ? [2, 3] : kDashes[curve.index % kDashes.length]!;
  }

  /** Draws it anew, in the host's present width. */
  draw(dark: boolean, visible: boolean[]): void {
    this.dark = dark;
    this.visible = visible;
    this.chart?.destroy();
    const ink = dark ? "#c3ced9" : "#33404d";
    const faint = dark ? "#26313b" : "#e3e8ed";
    const font = "12px system-ui, sans-serif";
    const axis = { stroke: ink, font, grid: { stroke: faint, width: 1 }, ticks: { stroke: faint, width: 1, size: 4 } };
    this.chart = new uPlot(
      {
        width: Math.max(this.host.clientWidth, 200),
        height: kHeight,
        pxAlign: 0,
        legend: { show: false },
        cursor: { sync: { key: "mantle", setSeries: false }, drag: { x: true, y: false }, y: false, points: { size: 5 } },
        scales: {
          x: { time: false },
          y: this.plot.logarithmic ? { distr: 3 } : { range: (_u, low, high) => padded(low, high) },
        },
        axes: [
          { ...axis, label: this.plot.over === "time" ? "time [s]" : this.plot.over, labelSize: 16, labelFont: font, size: 30 },
          { ...axis, size: 56, values: (_u, splits) => splits.map((v) => (v === null ? "" : formatNumber(v, 4))) },
        ],
        series: [
          {},
          ...this.plot.curves.map((curve, i) => ({
            label: curve.channel,
            stroke: this.colourOf(i),
            width: curve.dashed ? 1.2 : 1.6,
            dash: this.dashOf(i),
            spanGaps: true,
            points: { show: false },
            show: this.shown(i),
          })),
        ],
        hooks: { setScale: [() => this.moveNow()], ready: [() => this.moveNow()] },
      },
      this.data,
      this.host,
    );
    this.chart.over.append(this.now);
    this.chart.over.title = "Click: go there. Drag: look closer. Double click: all.";
    this.chart.over.addEventListener("click", () => {
      const left = this.chart?.cursor.left;
      if (this.plot.over !== "time" || left === undefined || left < 0) return;
      this.hooks.seek(this.chart!.posToVal(left, "x"));
    });
    this.swatches.forEach((swatch, i) => {
      swatch.style.borderTopColor = this.colourOf(i);
      const [on] = this.dashOf(i);
      swatch.style.borderTopStyle = on === undefined ? "solid" : on <= 2 ? "dotted" : "dashed";
    });
    this.showRows();
    this.moveNow();
  }

  private shown(i: number): boolean {
    return !this.hidden[i] && (this.visible[this.plot.curves[i]!.run] ?? true);
  }

  private showRows(): void {
    this.rows.forEach((row, i) => {
      row.setAttribute("aria-pressed", String(!this.hidden[i]));
      row.parentElement!.hidden = !(this.visible[this.plot.curves[i]!.run] ?? true);
    });
  }

  private hide(i: number, hidden: boolean): void {
    this.hidden[i] = hidden;
    this.chart?.setSeries(i + 1, { show: this.shown(i) });
    this.showRows();
  }

  /** The runs that are shown. */
  setVisible(visible: boolean[]): void {
    this.visible = visible;
    this.plot.curves.forEach((_curve, i) => this.chart?.setSeries(i + 1, { show: this.shown(i) }));
    this.showRows();
  }

  /** The same curves with more points. */
  update(plot: Plot): void {
    this.plot = plot;
    this.data = join(plot);
    this.span = spanOf(plot);
    this.stale = true;
    if (this.onScreen) this.redraw();
  }

  private redraw(): void {
    if (!this.stale) return;
    this.stale = false;
    this.chart?.setData(this.data);
    this.moveNow();
  }

  dispose(): void {
    this.chart?.destroy();
    this.chart = null;
  }

  resize(): void {
    this.chart?.setSize({ width: Math.max(this.host.clientWidth, 200), height: kHeight });
    this.moveNow();
  }

  /** What the reader does not see is not moved. */
  setOnScreen(onScreen: boolean): void {
    this.onScreen = onScreen;
    if (onScreen) this.redraw();
    if (onScreen) this.setTime(this.time, true);
  }

  /** `texts`: the values beside the curves' names too. */
  setTime(time: number, texts: boolean): void {
    this.time = time;
    if (!this.onScreen) return;
    this.moveNow();
    if (this.plot.over !== "time" || !texts) return;
    this.plot.curves.forEach((curve, i) => {
      // A run that has ended has no value any more.
      const ended = !this.hooks.growing && time > curve.x[curve.x.length - 1]! + 1e-6;
      const value = ended ? Number.NaN : mix(curve.y, 1, locate(curve.x, time), 0);
      const text = this.plot.logarithmic ? formatNumber(value, 3) : formatWithin(value, this.span);
      if (this.values[i]!.textContent !== text) this.values[i]!.textContent = text;
    });
  }

  private moveNow(): void {
    if (this.chart === null) return;
    const left = this.chart.valToPos(this.time, "x");
    const inside = this.plot.over === "time" && Number.isFinite(left) && left >= 0 && left <= this.chart.over.clientWidth + 1;
    this.now.style.visibility = inside ? "visible" : "hidden";
    if (inside) this.now.style.transform = `translateX(${left}px)`;
  }
}

function spanOf(plot: Plot): number {
  let low = Number.POSITIVE_INFINITY;
  let high = Number.NEGATIVE_INFINITY;
  for (const { y } of plot.curves) {
    for (const v of y) {
      if (v < low) low = v;
      if (v > high) high = v;
    }
  }
  return high - low;
}

/** A range with a little room; a constant gets room of its own size. */
export function padded(low: number | null, high: number | null): [number, number] {
  if (low === null || high === null || !Number.isFinite(low) || !Number.isFinite(high)) return [0, 1];
  const span = high - low;
  const room = span > 0 ? 0.06 * span : Math.abs(high) * 0.1 || 1;
  return [low - room, high + room];
}
