/// What stands over the 3-D view: its buttons, its colour bars, the key of its lines.

import type { Layers } from "./actor";
import { type FieldRanges, kFieldScale } from "./body";
import { gradient } from "./colour";
import { element, formatNumber } from "./dom";
import type { View3D, ViewName } from "./view3d";

/**
 * Buttons over the view, and what is drawn. `onByRun` hears whether bodies have the colours of their runs,
 * `onLayers` that other things are drawn.
 */
export function viewTools(view: View3D, follow: HTMLElement, time: () => number, onByRun: (byRun: boolean) => void, onLayers: () => void): HTMLElement {
  const tools = element("div", { class: "view-tools" });
  const looks: [ViewName, string, string][] = [
    ["oblique", "3D", "From an angle (1)"], ["front", "xz", "Along y (2)"], ["side", "yz", "Along x (3)"], ["top", "xy", "From above (4)"],
  ];
  for (const [name, text, title] of looks) {
    const button = element("button", { type: "button", title }, [text]);
    button.addEventListener("click", () => view.look(name));
    tools.append(button);
  }
  const picture = element("button", { type: "button", title: "Save the view as a picture" }, ["PNG"]);
  picture.addEventListener("click", () => {
    const link = element("a", { href: view.picture(), download: `mantle-${time().toFixed(2)}s.png` });
    link.click();
  });
  const layers = element("details", { class: "layers" }, [element("summary", { title: "What is drawn" }, ["Layers"])]);
  const menu = element("div", { class: "menu" });
  const names: [keyof Layers, string][] = [
    ["bodies", "bodies"], ["cables", "cables"], ["path", "path of the root"], ["reference", "reference, waypoints"],
    ["plan", "plan ahead"], ["jet", "jet"], ["drag", "drag of the water"], ["estimate", "estimated root"], ["grid", "grid"],
  ];
  for (const [layer, text] of names) {
    if ((layer === "drag" || layer === "estimate") && !view.lines()[layer]) continue;
    const box = element("input", { type: "checkbox" });
    box.checked = view.layers[layer];
    box.addEventListener("change", () => {
      view.setLayer(layer, box.checked);
      onLayers();
    });
    menu.append(element("label", {}, [box, text]));
  }
  const byRun = element("input", { type: "checkbox" });
  byRun.checked = view.byRun;
  byRun.addEventListener("change", () => {
    view.byRun = byRun.checked;
    view.setTime(time());
    onByRun(byRun.checked);
  });
  onByRun(view.byRun);
  menu.append(element("label", {}, [byRun, "colour by run"]));
  layers.append(menu);
  tools.append(follow, layers, picture);
  return tools;
}

/** The scales with their ends, the lines by their names, the grid's spacing. */
export function colourBars(view: View3D, runs: number): HTMLElement {
  const { ranges } = view;
  const bars = element("div", { class: "colour-bars" });
  const bar = (title: string, meaning: string, field: keyof FieldRanges, low: string, high: string) => {
    if (ranges[field] === 0) return;
    const strip = element("div", { class: "strip" });
    strip.style.backgroundImage = gradient(kFieldScale[field]);
    bars.append(
      element("div", { class: `bar ${field}`, title: meaning }, [
        element("div", { class: "bar-title" }, [title]), strip,
        element("div", { class: "ends" }, [element("span", {}, [low]), element("span", {}, [high])]),
      ]),
    );
  };
  const hoop = formatNumber(100 * ranges.hoop, 3);
  bar("hoop strain [%]", "Mantle: hoop strain, positive where it is stretched", "hoop", `−${hoop}`, `+${hoop}`);
  bar("curvature [1/m]", "Arms: curvature of the bend", "curvature", "0", formatNumber(ranges.curvature, 3));
  bar("tension [N]", "Cables: tension", "tension", "0", formatNumber(ranges.tension, 3));
  const lines = view.lines();
  const key = element("ul", { class: "line-key" });
  const line = (there: boolean, kind: string, text: string) => {
    if (there) key.append(element("li", {}, [element("span", { class: `sample ${kind}` }), text]));
  };
  line(runs === 1 && lines.path, "path", "path of the root");
  line(lines.reference, "reference", "reference");
  line(lines.plan, "plan", "plan ahead");
  line(lines.waypoints, "waypoint", "waypoint, tolerance");
  line(lines.jet, "jet", "jet");
  line(lines.estimate && view.layers.estimate, "estimate", "estimated root");
  line(lines.drag && view.layers.drag, "drag", `drag, at most ${formatNumber(view.dragged.nodes, 2)} N/m; of the body ${formatNumber(view.dragged.body, 2)} N`);
  bars.append(key);
  bars.append(element("div", { class: "grid-note" }, [`grid ${formatNumber(view.gridSpacing_m, 2)} m`]));
  return bars;
}
