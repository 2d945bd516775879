/// The keys: what they do, and in words.

import { element } from "./dom";
import type { ViewName } from "./view3d";

/** What keys ask for. */
export interface KeyActions {
  toggle(): void;
  step(seconds: number): void;
  begin(): void;
  end(): void;
  /** One faster (1) or slower (-1). */
  speed(by: number): void;
  follow(): void;
  theme(): void;
  help(): void;
  look(from: ViewName): void;
  turn(azimuth: number, polar: number, zoom: number): void;
}

const kLooks: Record<string, ViewName> = { 1: "oblique", 2: "front", 3: "side", 4: "top" };
const kTurns: Record<string, [number, number, number]> = {
  a: [-0.1, 0, 1], d: [0.1, 0, 1], w: [0, -0.08, 1], s: [0, 0.08, 1], q: [0, 0, 0.9], e: [0, 0, 1.1],
};

/** Does what a key asks for; false: it is not for the page, but for the control that has the focus, or nobody. */
export function pressKey(event: KeyboardEvent, slider: HTMLElement, actions: KeyActions): boolean {
  const target = event.target as HTMLElement;
  if (event.ctrlKey || event.metaKey || event.altKey) return false;
  // What the focused control does with the key itself is its own.
  const typing = /^(select|textarea)$/i.test(target.tagName) || (target.tagName === "INPUT" && target !== slider);
  const pressing = /^(button|summary)$/i.test(target.tagName) && (event.key === " " || event.key === "Enter");
  if (typing || pressing) return false;
  const seconds = event.shiftKey ? 1 : 0.1;
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const plain: Record<string, () => void> = {
    " ": actions.toggle, Home: actions.begin, End: actions.end, f: actions.follow, t: actions.theme, "?": actions.help,
    ArrowLeft: () => actions.step(-seconds), ArrowRight: () => actions.step(seconds),
    "+": () => actions.speed(1), "=": () => actions.speed(1), "-": () => actions.speed(-1),
  };
  const action = plain[key];
  const look = kLooks[key];
  const turn = kTurns[key];
  if (action !== undefined) action();
  else if (look !== undefined) actions.look(look);
  else if (turn !== undefined) actions.turn(...turn);
  else return false;
  return true;
}

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
