/// The figures of the paper whose experiment scenes/paper.toml repeats (Renda et al., "A Multi-Soft-Body Dynamic
/// Model for Underwater Soft Robots", Fig. 5 and 6): snapshots of the swimming, and the powers of its four phases.

import uPlot from "uplot";
import { runColour } from "./colour";
import { element, formatNumber } from "./dom";
import { type Run, at } from "./model";
import { padded } from "./plots";
import type { View3D } from "./view3d";

const kScenes = ["paper", "paper_frozen"];
/** Of Fig. 5 [s]. */
const kSnapshots = [0, 1.5, 4, 5.5, 7.5, 9];
/** Of Fig. 6 [s]: the arm bends in its plane, rests, bends across it, rests. */
const kPhases: [number, number, string][] = [
  [0, 1.5, "Δt₁"], [1.5, 4.5, "Δt₂"], [4.5, 6, "Δt₃"], [6, 9, "Δt₄"],
];
const kWidth = 320;
const kHeight = 300;
const kSame_s = 1e-6;

/** A card that is drawn anew in another theme. */
export interface Figure {
  root: HTMLElement;
  draw(dark: boolean): void;
}

export function isPaperScene(run: Run): boolean {
  return kScenes.includes(String(at(run.summary, "scene") ?? "")) && run.shape !== null && run.kind === "run";
}

function snapshots(run: Run, view: View3D): Figure {
  const end = run.shape!.time.at(-1) ?? 0;
  const pictures = kSnapshots
    .filter((t) => t <= end + kSame_s)
    .map((t) => {
      const picture = element("img", { alt: `The robot at ${t} s`, width: String(kWidth), height: String(kHeight) });
      return { t, picture, figure: element("figure", {}, [picture, element("figcaption", {}, [`t = ${t} s`])]) };
    });
  const root = element("section", { class: "card wide", "data-figure": "snapshots" }, [
    element("h3", {}, [`Snapshots: ${run.label}`]),
    element("div", { class: "snapshots" }, pictures.map((p) => p.figure)),
    element("p", { class: "help" }, ["As Fig. 5 of Renda et al., from one side and at one scale; the camera goes along."]),
  ]);
  return {
    root,
    draw: () => {
      for (const { t, picture } of pictures) picture.src = view.snapshot(t, "oblique", 2 * kWidth, 2 * kHeight);
    },
  };
}

function powers(run: Run): Figure | null {
  const table = run.trajectory;
  const output = table?.columns.get("index_output_w");
  const input = table?.columns.get("index_input_w");
  if (table === null || output === undefined || input === undefined) return null;
  const host = element("div", { class: "plot-host" });
  const root = element("section", { class: "card wide", "data-figure": "powers" }, [
    element("h3", {}, [`Kinematic and actuation power: ${run.label}`, element("span", { class: "unit" }, [" [W]"])]),
    host,
    element("p", { class: "help" }, ["As Fig. 6 of Renda et al.: kinematic power on the left scale, actuation power on the right one, the four phases of the arm's torque shaded."]),
  ]);
  let chart: uPlot | null = null;
  const draw = (dark: boolean) => {
    chart?.destroy();
    const ink = dark ? "#c3ced9" : "#33404d";
    const faint = dark ? "#26313b" : "#e3e8ed";
    const shade = dark ? "rgba(255,255,255,0.05)" : "rgba(0,0,0,0.045)";
    const font = "12px system-ui, sans-serif";
    const [blue, red] = [runColour(0, dark), runColour(1, dark)];
    const axis = { font, ticks: { stroke: faint, width: 1, size: 4 }, grid: { stroke: faint, width: 1 } };
    const numbers = (_u: uPlot, splits: number[]) => splits.map((v) => (v === null ? "" : formatNumber(v, 3)));
    chart = new uPlot(
      {
        width: Math.max(host.clientWidth, 200), height: 260, pxAlign: 0,
        legend: { show: true }, cursor: { drag: { x: true, y: false }, y: false },
        scales: { x: { time: false }, out: { range: (_u, low, high) => padded(low, high) }, in: { range: (_u, low, high) => padded(low, high) } },
        axes: [
          { ...axis, stroke: ink, label: "time [s]", labelSize: 16, labelFont: font, size: 30 },
          { ...axis, scale: "out", stroke: blue, size: 60, values: numbers },
          { ...axis, scale: "in", side: 1, stroke: red, size: 60, values: numbers, grid: { show: false } },
        ],
        series: [
          { label: "time [s]" },
          { label: "kinematic power", scale: "out", stroke: blue, width: 1.6, points: { show: false } },
          { label: "actuation power", scale: "in", stroke: red, width: 1.6, points: { show: false } },
        ],
        hooks: {
          drawClear: [
            (u) => {
              const { ctx } = u;
              const { top, height } = u.bbox;
              ctx.save();
              ctx.font = `${13 * devicePixelRatio}px system-ui, sans-serif`;
              ctx.textAlign = "center";
              kPhases.forEach(([from, to, name], i) => {
                const left = u.valToPos(Math.max(from, u.scales["x"]!.min ?? from), "x", true);
                const right = u.valToPos(Math.min(to, u.scales["x"]!.max ?? to), "x", true);
                if (right <= left) return;
                ctx.fillStyle = i % 2 === 0 ? shade : "transparent";
                ctx.fillRect(left, top, right - left, height);
                ctx.fillStyle = ink;
                ctx.fillText(name, (left + right) / 2, top + 16 * devicePixelRatio);
              });
              ctx.restore();
            },
          ],
        },
      },
      [table.x, output, input] as unknown as uPlot.AlignedData,
      host,
    );
  };
  return { root, draw };
}

/** Figures of a run of the paper's scene; none of any other. */
export function paperFigures(run: Run, view: View3D): Figure[] {
  if (!isPaperScene(run)) return [];
  return [snapshots(run, view), powers(run)].filter((figure) => figure !== null);
}
