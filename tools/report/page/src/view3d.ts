/// The 3-D view: every run's bodies, paths, references, waypoints with their tolerance, plans ahead,
/// the jet, a grid with a known spacing, and a camera to orbit, follow or look along an axis.

import * as three from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { Actor, type Layers, bodyLengthOf } from "./actor";
import { type FieldRanges, fieldRanges } from "./body";
import { type DragRanges, dragRanges } from "./drag";
import type { Run } from "./model";
import { findBounds, makeGrid, makeTriad, makeWaypoints } from "./stage";

export type ViewName = "oblique" | "front" | "side" | "top";
const kFieldOfView = 40; // degrees
const kSlowFrame_s = 0.036;
const kSlowFrames = 10;
const kCoarsest = 0.6; // of the screen's pixels, each way

/** Whether WebGL is drawn by the processor, where smooth edges cost more than they are worth. */
function drawsInSoftware(): boolean {
  const context = document.createElement("canvas").getContext("webgl2");
  if (context === null) return false;
  const info = context.getExtension("WEBGL_debug_renderer_info");
  const name = String(context.getParameter(info === null ? context.RENDERER : info.UNMASKED_RENDERER_WEBGL));
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

export class View3D {
  readonly ranges: FieldRanges;
  /** Of the arrows of the drag. */
  readonly dragged: DragRanges;
  readonly layers: Layers = { bodies: true, cables: true, path: true, reference: true, plan: true, jet: true, drag: false, estimate: true, grid: true };
  follow = true;
  /** WebGL is drawn by the processor. */
  readonly software: boolean;
  byRun: boolean;
  /** Spacing of the grid's lines [m]. */
  gridSpacing_m = 0.1;
  private readonly renderer: three.WebGLRenderer;
  private readonly scene = new three.Scene();
  private readonly camera = new three.PerspectiveCamera(kFieldOfView, 1, 0.01, 100);
  private readonly controls: OrbitControls;
  private readonly light = new three.DirectionalLight(0xffffff, 1.6);
  private readonly actors: Actor[];
  private readonly bounds: three.Box3;
  private readonly triad = makeTriad();
  private readonly triadCamera = new three.OrthographicCamera(-1.5, 1.5, 1.5, -1.5, 0.1, 10);
  private grid: three.GridHelper | null = null;
  private readonly waypoints: three.Group;
  private readonly followed = new three.Vector3();
  private time = 0;
  private dark = false;
  private stale = true;
  private pixelRatio: number;
  private slow = 0;
  private readonly bodyLength: number;

  /** Throws where the browser has no WebGL. */
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly runs: Run[],
  ) {
    const software = drawsInSoftware();
    this.software = software;
    this.renderer = new three.WebGLRenderer({ canvas, antialias: !software, powerPreference: "high-performance" });
    this.pixelRatio = Math.min(window.devicePixelRatio || 1, software ? 1 : 2);
    this.ranges = fieldRanges(runs);
    this.dragged = dragRanges(runs);
    this.byRun = runs.filter((r) => r.shape !== null).length > 1;
    this.bodyLength = bodyLengthOf(runs);
    this.actors = runs.map((run, index) => new Actor(run, index, this.ranges, this.dragged, this.bodyLength));
    this.bounds = findBounds(this.actors, runs);
    this.waypoints = makeWaypoints(runs, this.bodyLength);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener("change", () => {
      this.stale = true;
    });
    this.controls.addEventListener("start", () => canvas.focus({ preventScroll: true }));
    this.scene.add(new three.HemisphereLight(0xffffff, 0x8d99a6, 1.7), this.light, this.waypoints);
    this.scene.add(...this.actors.map((actor) => actor.group));
    this.layGrid();
    this.look("oblique");
  }

  private layGrid(): void {
    if (this.grid !== null) {
      this.scene.remove(this.grid);
      this.grid.dispose();
    }
    const { grid, spacing_m } = makeGrid(this.bounds, this.dark, this.bodyLength);
    this.grid = grid;
    this.gridSpacing_m = spacing_m;
    grid.visible = this.layers.grid;
    this.scene.add(grid);
  }

  /** Which lines there are besides the paths. */
  lines(): { path: boolean; reference: boolean; plan: boolean; waypoints: boolean; jet: boolean; drag: boolean; estimate: boolean } {
    const any = (line: "path" | "reference" | "plan" | "jet" | "drag" | "estimate") => this.actors.some((actor) => actor.lines[line]);
    return {
      path: any("path"), reference: any("reference"), plan: any("plan"), jet: any("jet"), drag: any("drag"), estimate: any("estimate"),
      waypoints: this.waypoints.children.length > 0,
    };
  }

  /** The runs have grown: true where the colours span more than before, or the grid has moved. */
  refresh(): boolean {
    for (const actor of this.actors) actor.refresh();
    const field = fieldRanges(this.runs);
    const drag = dragRanges(this.runs);
    let wider = false;
    const widen = <T extends Record<keyof T, number>>(known: T, seen: T) => {
      for (const name of Object.keys(known) as (keyof T)[]) {
        if (seen[name] <= known[name]) continue;
        // In steps, so that the colours of what has been seen stay for a while.
        known[name] = (1.25 * seen[name]) as T[keyof T];
        wider = true;
      }
    };
    widen(this.ranges, field);
    widen(this.dragged, drag);
    const room = this.bounds.clone().expandByScalar(0.1 * this.bodyLength);
    const middle = new three.Vector3();
    for (const actor of this.actors) {
      if (!actor.focus(Number.POSITIVE_INFINITY, middle)) continue;
      const here = new three.Box3().setFromCenterAndSize(middle, new three.Vector3().setScalar(1.4 * this.bodyLength));
      if (room.containsBox(here)) continue;
      this.bounds.union(here.expandByScalar(0.5 * this.bodyLength));
      this.layGrid();
      wider = true;
    }
    this.setTime(this.time);
    return wider;
  }

  /** Gives the graphics processor back what it holds. */
  dispose(): void {
    this.controls.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  /** The view at a time, as a PNG of this size from this side; the view stays as it is. */
  snapshot(time: number, view: ViewName, width: number, height: number): string {
    const { follow } = this;
    const before = { time: this.time, size: this.renderer.getSize(new three.Vector2()), position: this.camera.position.clone(), target: this.controls.target.clone(), followed: this.followed.clone() };
    this.follow = true;
    this.setTime(time);
    this.resize(width, height);
    this.look(view);
    const picture = this.picture();
    this.follow = follow;
    this.resize(before.size.x, before.size.y);
    this.camera.position.copy(before.position);
    this.controls.target.copy(before.target);
    this.controls.update();
    this.followed.copy(before.followed);
    this.setTime(before.time);
    return picture;
  }

  hasBodies(): boolean {
    return this.actors.some((actor) => actor.body !== null);
  }

  setDark(dark: boolean): void {
    this.dark = dark;
    this.renderer.setClearColor(dark ? 0x10161c : 0xf6f8fa, 1);
    for (const actor of this.actors) actor.setDark(dark);
    this.layGrid();
    this.stale = true;
  }

  setVisible(run: number, visible: boolean): void {
    const actor = this.actors[run];
    if (actor !== undefined) actor.visible = visible;
    this.setTime(this.time);
  }

  setLayer(layer: keyof Layers, visible: boolean): void {
    this.layers[layer] = visible;
    if (this.grid !== null) this.grid.visible = this.layers.grid;
    this.setTime(this.time);
  }

  /** Where the camera looks from; the whole of the run in view, or the vehicle where it is followed. */
  look(view: ViewName): void {
    const direction = {
      oblique: new three.Vector3(1, -1.35, 0.55),
      front: new three.Vector3(0, -1, 0.0001),
      side: new three.Vector3(1, 0, 0.0001),
      top: new three.Vector3(0, -0.0001, 1),
    }[view].normalize();
    const target = this.bounds.getCenter(new three.Vector3());
    let radius = 0.5 * this.bounds.getSize(new three.Vector3()).length();
    if (this.follow && this.focusOf(this.time, target)) radius = Math.min(radius, 0.72 * this.bodyLength);
    const aspect = Math.min(this.camera.aspect, 1);
    const distance = radius / Math.sin(((kFieldOfView / 2) * Math.PI) / 180) / Math.max(aspect, 0.5);
    this.controls.target.copy(target);
    this.followed.copy(target);
    this.camera.position.copy(target).addScaledVector(direction, distance);
    this.camera.near = 0.005 * distance;
    this.camera.far = 50 * distance + 10 * this.bounds.getSize(new three.Vector3()).length();
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.stale = true;
  }

  /** Turns the camera by angles [rad] and moves it closer (zoom < 1) or away: for the keyboard. */
  turn(azimuth: number, polar: number, zoom: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const s = new three.Spherical().setFromVector3(new three.Vector3(offset.x, offset.z, -offset.y));
    s.theta += azimuth;
    s.phi = Math.min(Math.max(s.phi + polar, 0.01), Math.PI - 0.01);
    s.radius *= zoom;
    const v = new three.Vector3().setFromSpherical(s);
    this.camera.position.copy(this.controls.target).add(new three.Vector3(v.x, -v.z, v.y));
    this.controls.update();
    this.stale = true;
  }

  setFollow(follow: boolean): void {
    this.follow = follow;
    this.look("oblique");
    this.setTime(this.time);
  }

  // Middle of the bodies of the first visible run, or its root.
  private focusOf(t: number, out: three.Vector3): boolean {
    const actor = this.actors.find((a) => a.visible && a.track !== null);
    return actor !== undefined && actor.focus(t, out);
  }

  setTime(t: number): void {
    this.time = t;
    const here = new three.Vector3();
    for (const actor of this.actors) actor.moveTo(t, this.layers, this.byRun, this.dark);
    if (this.follow && this.focusOf(t, here)) {
      const shift = here.clone().sub(this.followed);
      this.followed.copy(here);
      this.controls.target.add(shift);
      this.camera.position.add(shift);
      this.controls.update();
    }
    this.waypoints.visible = this.layers.reference;
    this.stale = true;
  }

  resize(width: number, height: number): void {
    if (width < 2 || height < 2) return;
    this.renderer.setPixelRatio(this.pixelRatio);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.stale = true;
  }

  /** Draws where something has changed; true where it drew. */
  render(): boolean {
    if (!this.stale) return false;
    this.stale = false;
    this.light.position.copy(this.camera.position);
    this.light.target.position.copy(this.controls.target);
    this.light.target.updateMatrixWorld();
    const size = this.renderer.getSize(new three.Vector2());
    this.renderer.setScissorTest(false);
    this.renderer.setViewport(0, 0, size.x, size.y);
    this.renderer.autoClear = true;
    this.renderer.render(this.scene, this.camera);
    this.triadCamera.position.copy(this.camera.position).sub(this.controls.target).setLength(4);
    this.triadCamera.up.copy(this.camera.up);
    this.triadCamera.lookAt(0, 0, 0);
    const side = Math.min(88, 0.2 * size.y);
    this.renderer.autoClear = false;
    this.renderer.clearDepth();
    this.renderer.setViewport(6, 6, side, side);
    this.renderer.render(this.triad, this.triadCamera);
    return true;
  }

  /** A frame of the replay took so long [s]: where many are slow (no GPU), the picture gets coarser. */
  judge(elapsed: number): void {
    this.slow = elapsed > kSlowFrame_s ? this.slow + 1 : Math.max(this.slow - 1, 0);
    if (this.slow < kSlowFrames || this.pixelRatio <= kCoarsest) return;
    this.slow = 0;
    this.pixelRatio = Math.max(0.75 * this.pixelRatio, kCoarsest);
    const size = this.renderer.getSize(new three.Vector2());
    this.resize(size.x, size.y);
  }

  /** The view as a PNG, as a data URL. */
  picture(): string {
    this.stale = true;
    this.render();
    return this.canvas.toDataURL("image/png");
  }
}
