/// What stands still in the 3-D view: the grid, the waypoints, the axes' triad, and how large it all is.

import * as three from "three";
import type { Actor } from "./actor";
import { type Run, at, numberAt } from "./model";

/** A text that faces the reader; `height` in metres, or, on the screen, as a share of the view's. */
function label(text: string, colour: string, height: number, onScreen = false): three.Sprite {
  const canvas = document.createElement("canvas");
  const size = 64;
  const context = canvas.getContext("2d")!;
  context.font = `600 ${size * 0.7}px system-ui, sans-serif`;
  canvas.width = Math.ceil(context.measureText(text).width) + 16;
  canvas.height = size;
  context.font = `600 ${size * 0.7}px system-ui, sans-serif`;
  context.textBaseline = "middle";
  context.lineWidth = 6;
  context.strokeStyle = "rgba(128,128,128,0.35)";
  context.strokeText(text, 8, size / 2);
  context.fillStyle = colour;
  context.fillText(text, 8, size / 2);
  const map = new three.CanvasTexture(canvas);
  const sprite = new three.Sprite(new three.SpriteMaterial({ map, depthTest: false, transparent: true, sizeAttenuation: !onScreen }));
  sprite.scale.set((height * canvas.width) / size, height, 1);
  return sprite;
}

/** Axes with their names, to be drawn into a corner. */
export function makeTriad(): three.Scene {
  const triad = new three.Scene();
  const axes: [string, number, three.Vector3][] = [
    ["x", 0xd55e00, new three.Vector3(1, 0, 0)],
    ["y", 0x009e73, new three.Vector3(0, 1, 0)],
    ["z", 0x0072b2, new three.Vector3(0, 0, 1)],
  ];
  for (const [name, colour, direction] of axes) {
    triad.add(new three.ArrowHelper(direction, new three.Vector3(), 1, colour, 0.28, 0.16));
    const text = label(name, `#${colour.toString(16).padStart(6, "0")}`, 0.5);
    text.position.copy(direction).multiplyScalar(1.25);
    triad.add(text);
  }
  return triad;
}

/** Everything that is ever in view: bodies at all times, paths, waypoints. */
export function findBounds(actors: Actor[], runs: Run[]): three.Box3 {
  const bounds = new three.Box3();
  const p = new three.Vector3();
  const add = (xyz: ArrayLike<number>, step: number) => {
    for (let i = 0; i + 2 < xyz.length; i += 3 * step) {
      p.set(xyz[i]!, xyz[i + 1]!, xyz[i + 2]!);
      if (Number.isFinite(p.x + p.y + p.z)) bounds.expandByPoint(p);
    }
  };
  for (const actor of actors) {
    if (actor.track !== null) add(actor.track.xyz, 1);
    for (const arm of actor.run.shape?.arms ?? []) add(arm.position, 1);
    for (const cable of actor.run.shape?.cables ?? []) add(cable.position, 3);
    const { shape } = actor.run;
    if (shape !== null && shape.mantle !== null) {
      let reach = 0;
      for (const v of shape.mantle.profile) reach = Math.max(reach, Math.abs(v));
      for (let i = 0; i + 2 < shape.rootPosition.length; i += 3) {
        for (const sign of [-1, 1]) {
          p.set(shape.rootPosition[i]!, shape.rootPosition[i + 1]!, shape.rootPosition[i + 2]!).addScalar(sign * reach);
          bounds.expandByPoint(p);
        }
      }
    }
  }
  for (const run of runs) {
    const list = at(run.summary, "control", "waypoints");
    if (Array.isArray(list)) for (const w of list) add((at(w, "at_m") as number[]) ?? [], 1);
  }
  if (bounds.isEmpty()) bounds.set(new three.Vector3(-0.5, -0.5, -0.5), new three.Vector3(0.5, 0.5, 0.5));
  return bounds;
}

/** Lines below everything, 1, 2 or 5 times a power of ten apart, about ten of them. */
export function makeGrid(bounds: three.Box3, dark: boolean, bodyLength: number): { grid: three.GridHelper; spacing_m: number } {
  const size = bounds.getSize(new three.Vector3());
  const across = Math.max(size.x, size.y, 0.25 * size.z, 1e-6);
  const decade = 10 ** Math.floor(Math.log10(across / 8));
  const spacing_m = decade * ([1, 2, 5, 10].find((m) => m * decade >= across / 8) ?? 10);
  const cells = Math.ceil(across / spacing_m) + 4;
  const [major, minor] = dark ? [0x4a5866, 0x2c3742] : [0xaab6c2, 0xd3dbe3];
  const grid = new three.GridHelper(cells * spacing_m, cells, major, minor);
  grid.rotation.x = Math.PI / 2;
  const middle = bounds.getCenter(new three.Vector3());
  const snap = (v: number) => Math.round(v / spacing_m) * spacing_m;
  grid.position.set(snap(middle.x), snap(middle.y), bounds.min.z - 0.02 * bodyLength);
  return { grid, spacing_m };
}

/** Balls of the waypoints' tolerance with their numbers; a waypoint that runs share is there once. */
export function makeWaypoints(runs: Run[], bodyLength: number): three.Group {
  const group = new three.Group();
  const seen = new Set<string>();
  for (const run of runs) {
    const list = at(run.summary, "control", "waypoints");
    if (!Array.isArray(list)) continue;
    const tolerance = numberAt(run.summary, "control", "goal", "tolerance_m");
    list.forEach((waypoint, i) => {
      const place = at(waypoint, "at_m");
      if (!Array.isArray(place) || seen.has(`${i}:${place.join()}`)) return;
      seen.add(`${i}:${place.join()}`);
      const position = new three.Vector3(...(place as [number, number, number]));
      const passed = at(waypoint, "passed");
      const colour = passed === true ? 0x009e73 : passed === false ? 0xd55e00 : 0x56b4e9; // not yet known
      const radius = tolerance ?? 0.02 * bodyLength;
      const ball = new three.Mesh(
        new three.SphereGeometry(radius, 20, 14),
        new three.MeshBasicMaterial({ color: colour, transparent: true, opacity: 0.28, depthWrite: false }),
      );
      const core = new three.Mesh(
        new three.SphereGeometry(0.15 * radius, 10, 8),
        new three.MeshBasicMaterial({ color: colour }),
      );
      const mark = runs.length > 1 || passed === null ? "" : passed === true ? " ✓" : " ✗";
      const text = label(`${i + 1}${mark}`, `#${colour.toString(16).padStart(6, "0")}`, 0.032, true);
      for (const object of [ball, core, text]) {
        object.position.copy(position);
        group.add(object);
      }
      text.position.z += 1.3 * radius;
    });
  }
  return group;
}
