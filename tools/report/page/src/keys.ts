/// The keys, in words.

import { element } from "./dom";

const kKeys: [string, string][] = [
  ["Space", "play or pause"],
  ["← →", "0.1 s back or ahead; with Shift 1 s"],
  ["Home End", "to the beginning, to the end; of a live run: follow the newest"],
  ["+ −", "faster, slower"],
  ["F", "follow the vehicle, or see the whole run"],
  ["1 2 3 4", "look from an angle, along y, along x, from above"],
  ["W A S D", "orbit; Q and E closer and away"],
  ["T", "light or dark"],
  ["?", "these keys"],
];

/** What the keys and the mouse do. */
export function helpDialog(): HTMLDialogElement {
  const list = element("dl");
  for (const [key, meaning] of kKeys) list.append(element("dt", {}, [key]), element("dd", {}, [meaning]));
  const close = element("button", { type: "button" }, ["Close"]);
  const dialog = element("dialog", { "aria-label": "Keys" }, [
    element("h2", {}, ["Keys"]), list,
    element("p", {}, ["Drag to orbit, with the right button to pan; the wheel, or two fingers, to zoom. In plots: click to go there, drag to look closer, double click for all."]),
    close,
  ]);
  close.addEventListener("click", () => dialog.close());
  return dialog;
}
