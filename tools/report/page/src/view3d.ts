/// The 3-D view: every run's bodies, paths, references, waypoints with their tolerance, plans ahead,
/// the jet, a grid with a known spacing, and a camera to orbit, follow or look along an axis.

import * as three from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { Body, type FieldRanges, fieldRanges } from "./body";
import { parseColour, runColour } from "./colour";
import { type Run, at, numberAt } from "./model";
import { latest, locate, mix } from "./timeline";

export type ViewName = "oblique" | "front" | "side" | "top";
export interface Layers {
  bodies: boolean;
  cables: boolean;
  path: boolean;
  reference: boolean;
  plan: boolean;
  jet: boolean;
  grid: boolean;
}

const kFieldOfView = 40; // degrees
const kSlowFrame_s = 0.036;
const kSlowFrames = 10;
const kCoarsest = 0.6; // of the screen's pixels, each way
const kPlanColour = 0xcc79a7;
const kReferenceColour = 0x8a8a8a;

/** Whether WebGL is drawn by the processor, where smooth edges cost more than they are worth. */
function drawsInSoftware(): boolean {
  const context = document.createElement("canvas").getContext("webgl2");
  if (context === null) return false;
  const info = context.getExtension("WEBGL_debug_renderer_info");
  const name = String(context.getParameter(info === null ? context.RENDERER : info.UNMASKED_RENDERER_WEBGL));
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

/** Positions of a run's root over time: of every row, else of the shapes. */
function rootTrack(run: Run): { time: Float64Array; xyz: Float64Array } | null {
  const t = run.trajectory;
  const axes = ["root_x_m", "root_y_m", "root_z_m"].map((name) => t?.columns.get(name));
  if (t !== null && axes.every((axis) => axis !== undefined)) {
    const xyz = new Float64Array(3 * t.x.length);
    for (let i = 0; i < t.x.length; ++i) for (let k = 0; k < 3; ++k) xyz[3 * i + k] = axes[k]![i]!;
    return { time: t.x, xyz };
  }
  if (run.shape === null) return null;
  return { time: run.shape.time, xyz: run.shape.rootPosition };
}

function referenceTrack(run: Run): Float64Array | null {
  const t = run.trajectory;
  if (t === null) return null;
  for (const stem of ["reference_", "reference_tip_"]) {
    const axes = ["x_m", "y_m", "z_m"].map((axis) => t.columns.get(stem + axis));
    if (!axes.every((axis) => axis !== undefined)) continue;
    const xyz = new Float64Array(3 * t.x.length);
    for (let i = 0; i < t.x.length; ++i) for (let k = 0; k < 3; ++k) xyz[3 * i + k] = axes[k]![i]!;
    return xyz;
  }
  return null;
}

function polyline(xyz: Float64Array, material: three.LineBasicMaterial): three.Line {
  const geometry = new three.BufferGeometry();
  geometry.setAttribute("position", new three.BufferAttribute(Float32Array.from(xyz), 3));
  const line = new three.Line(geometry, material);
  line.computeLineDistances();
  line.frustumCulled = false;
  return line;
}

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

interface Actor {
  run: Run;
  body: Body | null;
  group: three.Group;
  pathAll: three.Line | null;
  pathPast: three.Line | null;
  track: { time: Float64Array; xyz: Float64Array } | null;
  marker: three.Mesh | null;
  reference: three.Line | null;
  referenceXyz: Float64Array | null;
  referenceMarker: three.Mesh | null;
  planRoot: three.Line | null;
  planTips: three.Line[];
  jet: three.ArrowHelper | null;
  largestThrust: number;
  visible: boolean;
}

export class View3D {
  readonly ranges: FieldRanges;
  readonly layers: Layers = { bodies: true, cables: true, path: true, reference: true, plan: true, jet: true, grid: true };
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
  private readonly bounds = new three.Box3();
  private readonly triad = new three.Scene();
  private readonly triadCamera = new three.OrthographicCamera(-1.5, 1.5, 1.5, -1.5, 0.1, 10);
  private grid: three.GridHelper | null = null;
  private waypointGroup = new three.Group();
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
    runs: Run[],
  ) {
    const software = drawsInSoftware();
    this.software = software;
    this.renderer = new three.WebGLRenderer({ canvas, antialias: !software, powerPreference: "high-performance" });
    this.pixelRatio = Math.min(window.devicePixelRatio || 1, software ? 1 : 2);
    this.ranges = fieldRanges(runs);
    this.byRun = runs.filter((r) => r.shape !== null).length > 1;
    this.bodyLength = bodyLengthOf(runs);
    this.actors = runs.map((run, index) => this.makeActor(run, index));
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener("change", () => {
      this.stale = true;
    });
    this.controls.addEventListener("start", () => canvas.focus({ preventScroll: true }));
    this.scene.add(new three.HemisphereLight(0xffffff, 0x8d99a6, 1.7), this.light, this.waypointGroup);
    this.makeTriad();
    this.findBounds(runs);
    this.makeGrid();
    this.makeWaypoints(runs);
    this.look("oblique");
  }

  private makeActor(run: Run, index: number): Actor {
    const group = new three.Group();
    this.scene.add(group);
    const body = run.shape === null ? null : new Body(run.shape, this.ranges, this.bodyLength);
    if (body !== null) group.add(body.group);
    const track = rootTrack(run);
    const colour = runColour(index, false);
    let pathAll: three.Line | null = null;
    let pathPast: three.Line | null = null;
    let marker: three.Mesh | null = null;
    if (track !== null && track.time.length > 1) {
      pathAll = polyline(track.xyz, new three.LineBasicMaterial({ color: colour, transparent: true, opacity: 0.35 }));
      pathPast = polyline(track.xyz, new three.LineBasicMaterial({ color: colour }));
      group.add(pathAll, pathPast);
    }
    if (track !== null) {
      marker = new three.Mesh(
        new three.SphereGeometry((body === null ? 0.03 : 0.008) * this.bodyLength, 16, 12),
        new three.MeshLambertMaterial({ color: colour }),
      );
      group.add(marker);
    }
    const referenceXyz = referenceTrack(run);
    let reference: three.Line | null = null;
    let referenceMarker: three.Mesh | null = null;
    if (referenceXyz !== null) {
      const dash = 0.04 * this.bodyLength;
      reference = polyline(
        referenceXyz,
        new three.LineDashedMaterial({ color: kReferenceColour, dashSize: dash, gapSize: 0.7 * dash }),
      );
      referenceMarker = new three.Mesh(
        new three.OctahedronGeometry(0.02 * this.bodyLength),
        new three.MeshBasicMaterial({ color: kReferenceColour }),
      );
      group.add(reference, referenceMarker);
    }
    let planRoot: three.Line | null = null;
    const planTips: three.Line[] = [];
    if (run.plans !== null && run.plans.time.length > 0) {
      const line = (opacity: number) =>
        polyline(
          new Float64Array(3 * run.plans!.knots),
          new three.LineBasicMaterial({ color: kPlanColour, transparent: true, opacity }),
        );
      planRoot = line(1);
      for (let a = 0; a < run.plans.arms; ++a) planTips.push(line(0.6));
      group.add(planRoot, ...planTips);
    }
    const thrust = run.trajectory?.columns.get("thrust_n");
    const largestThrust = thrust === undefined ? 0 : thrust.reduce((most, x) => Math.max(most, Math.abs(x)), 0);
    let jet: three.ArrowHelper | null = null;
    if (largestThrust > 0 && run.shape?.mantle != null) {
      jet = new three.ArrowHelper(new three.Vector3(0, 0, -1), new three.Vector3(), 1, 0x56b4e9);
      group.add(jet);
    }
    return {
      run, body, group, pathAll, pathPast, track, marker, reference, referenceXyz, referenceMarker,
      planRoot, planTips, jet, largestThrust, visible: true,
    };
  }

  private makeTriad(): void {
    const axes: [string, number, three.Vector3][] = [
      ["x", 0xd55e00, new three.Vector3(1, 0, 0)],
      ["y", 0x009e73, new three.Vector3(0, 1, 0)],
      ["z", 0x0072b2, new three.Vector3(0, 0, 1)],
    ];
    for (const [name, colour, direction] of axes) {
      this.triad.add(new three.ArrowHelper(direction, new three.Vector3(), 1, colour, 0.28, 0.16));
      const text = label(name, `#${colour.toString(16).padStart(6, "0")}`, 0.5);
      text.position.copy(direction).multiplyScalar(1.25);
      this.triad.add(text);
    }
  }

  private findBounds(runs: Run[]): void {
    const p = new three.Vector3();
    const add = (xyz: ArrayLike<number>, step: number) => {
      for (let i = 0; i + 2 < xyz.length; i += 3 * step) {
        p.set(xyz[i]!, xyz[i + 1]!, xyz[i + 2]!);
        if (Number.isFinite(p.x + p.y + p.z)) this.bounds.expandByPoint(p);
      }
    };
    for (const actor of this.actors) {
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
            this.bounds.expandByPoint(p);
          }
        }
      }
    }
    for (const run of runs) {
      const list = at(run.summary, "control", "waypoints");
      if (Array.isArray(list)) for (const w of list) add((at(w, "at_m") as number[]) ?? [], 1);
    }
    if (this.bounds.isEmpty()) this.bounds.set(new three.Vector3(-0.5, -0.5, -0.5), new three.Vector3(0.5, 0.5, 0.5));
  }

  private makeGrid(): void {
    if (this.grid !== null) {
      this.scene.remove(this.grid);
      this.grid.dispose();
    }
    const size = this.bounds.getSize(new three.Vector3());
    const across = Math.max(size.x, size.y, 0.25 * size.z, 1e-6);
    // 1, 2 or 5 times a power of ten, about ten lines.
    const decade = 10 ** Math.floor(Math.log10(across / 8));
    this.gridSpacing_m = decade * ([1, 2, 5, 10].find((m) => m * decade >= across / 8) ?? 10);
    const cells = Math.ceil(across / this.gridSpacing_m) + 4;
    const [major, minor] = this.dark ? [0x4a5866, 0x2c3742] : [0xaab6c2, 0xd3dbe3];
    this.grid = new three.GridHelper(cells * this.gridSpacing_m, cells, major, minor);
    this.grid.rotation.x = Math.PI / 2;
    const middle = this.bounds.getCenter(new three.Vector3());
    const snap = (v: number) => Math.round(v / this.gridSpacing_m) * this.gridSpacing_m;
    this.grid.position.set(snap(middle.x), snap(middle.y), this.bounds.min.z - 0.02 * this.bodyLength);
    this.grid.visible = this.layers.grid;
    this.scene.add(this.grid);
  }

  private makeWaypoints(runs: Run[]): void {
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
        const passed = at(waypoint, "passed") === true;
        const colour = passed ? 0x009e73 : 0xd55e00;
        const radius = tolerance ?? 0.02 * this.bodyLength;
        const ball = new three.Mesh(
          new three.SphereGeometry(radius, 20, 14),
          new three.MeshBasicMaterial({ color: colour, transparent: true, opacity: 0.28, depthWrite: false }),
        );
        const core = new three.Mesh(
          new three.SphereGeometry(0.15 * radius, 10, 8),
          new three.MeshBasicMaterial({ color: colour }),
        );
        const text = label(`${i + 1}${runs.length === 1 ? (passed ? " ✓" : " ✗") : ""}`, passed ? "#009e73" : "#d55e00", 0.032, true);
        for (const object of [ball, core, text]) {
          object.position.copy(position);
          this.waypointGroup.add(object);
        }
        text.position.z += 1.3 * radius;
      });
    }
  }

  /** Which lines there are besides the paths. */
  lines(): { path: boolean; reference: boolean; plan: boolean; waypoints: boolean; jet: boolean } {
    return {
      path: this.actors.some((a) => a.pathAll !== null),
      reference: this.actors.some((a) => a.reference !== null),
      plan: this.actors.some((a) => a.planRoot !== null),
      waypoints: this.waypointGroup.children.length > 0,
      jet: this.actors.some((a) => a.jet !== null),
    };
  }

  hasBodies(): boolean {
    return this.actors.some((actor) => actor.body !== null);
  }

  setDark(dark: boolean): void {
    this.dark = dark;
    this.renderer.setClearColor(dark ? 0x10161c : 0xf6f8fa, 1);
    this.actors.forEach((actor, index) => {
      const colour = runColour(index, dark);
      for (const line of [actor.pathAll, actor.pathPast]) {
        if (line !== null) (line.material as three.LineBasicMaterial).color.set(colour);
      }
      if (actor.marker !== null) (actor.marker.material as three.MeshLambertMaterial).color.set(colour);
    });
    this.makeGrid();
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
    if (actor === undefined || actor.track === null) return false;
    if (actor.body !== null) {
      actor.body.middle(t, out);
      return true;
    }
    const place = locate(actor.track.time, t);
    const { xyz } = actor.track;
    out.set(mix(xyz, 3, place, 0), mix(xyz, 3, place, 1), mix(xyz, 3, place, 2));
    return true;
  }

  setTime(t: number): void {
    this.time = t;
    const here = new three.Vector3();
    this.actors.forEach((actor, index) => {
      actor.group.visible = actor.visible;
      if (actor.visible) this.moveActor(actor, index, t, here);
    });
    if (this.follow && this.focusOf(t, here)) {
      const shift = here.clone().sub(this.followed);
      this.followed.copy(here);
      this.controls.target.add(shift);
      this.camera.position.add(shift);
      this.controls.update();
    }
    this.waypointGroup.visible = this.layers.reference;
    this.stale = true;
  }

  private moveActor(actor: Actor, index: number, t: number, scratch: three.Vector3): void {
    const { layers } = this;
    if (actor.body !== null) {
      actor.body.group.visible = layers.bodies;
      actor.body.setCablesVisible(layers.cables);
      actor.body.moveTo(t, this.byRun ? parseColour(runColour(index, this.dark)) : null);
    }
    if (actor.track !== null) {
      const place = locate(actor.track.time, t);
      actor.marker?.position.set(
        mix(actor.track.xyz, 3, place, 0), mix(actor.track.xyz, 3, place, 1), mix(actor.track.xyz, 3, place, 2),
      );
      actor.pathPast?.geometry.setDrawRange(0, place.i + 1);
      for (const line of [actor.pathAll, actor.pathPast]) if (line !== null) line.visible = layers.path;
      if (actor.referenceXyz !== null && actor.referenceMarker !== null && actor.reference !== null) {
        actor.referenceMarker.position.set(
          mix(actor.referenceXyz, 3, place, 0), mix(actor.referenceXyz, 3, place, 1), mix(actor.referenceXyz, 3, place, 2),
        );
        actor.reference.visible = actor.referenceMarker.visible = layers.reference;
      }
    }
    this.movePlan(actor, t);
    if (actor.jet !== null && actor.body !== null) {
      const thrust = actor.run.trajectory!.columns.get("thrust_n")!;
      const value = mix(thrust, 1, locate(actor.run.trajectory!.x, t), 0);
      const along = new three.Vector3();
      actor.body.jet(t, scratch, along);
      const length = (0.35 * this.bodyLength * value) / actor.largestThrust;
      actor.jet.visible = layers.jet && Math.abs(length) > 0.004 * this.bodyLength;
      actor.jet.position.copy(scratch);
      actor.jet.setDirection(along.multiplyScalar(Math.sign(length) || 1));
      const size = Math.max(Math.abs(length), 1e-6);
      actor.jet.setLength(size, Math.min(0.3 * size, 0.06 * this.bodyLength), 0.03 * this.bodyLength);
    }
  }

  private movePlan(actor: Actor, t: number): void {
    const { plans } = actor.run;
    if (plans === null || actor.planRoot === null) return;
    const i = latest(plans.time, t);
    const visible = this.layers.plan && i >= 0;
    actor.planRoot.visible = visible;
    for (const line of actor.planTips) line.visible = visible;
    if (!visible) return;
    const copy = (line: three.Line, values: Float64Array, stride: number, offset: number) => {
      const attribute = line.geometry.getAttribute("position") as three.BufferAttribute;
      for (let k = 0; k < plans.knots; ++k) {
        const from = i * plans.knots * stride + k * stride + offset;
        attribute.setXYZ(k, values[from]!, values[from + 1]!, values[from + 2]!);
      }
      attribute.needsUpdate = true;
    };
    copy(actor.planRoot, plans.root, 3, 0);
    actor.planTips.forEach((line, a) => copy(line, plans.tips, 3 * plans.arms, 3 * a));
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

/** Largest extent of the first frame of any run, or what the scene says [m]. */
export function bodyLengthOf(runs: Run[]): number {
  let length = 0;
  for (const run of runs) {
    const said = numberAt(run.summary, "control", "body_length_m") ?? numberAt(run.summary, "body_length_m");
    if (said !== null) length = Math.max(length, said);
    if (said !== null || run.shape === null) continue;
    const box = new three.Box3();
    const p = new three.Vector3();
    for (const arm of run.shape.arms) {
      for (let k = 0; k < arm.nodes; ++k) {
        box.expandByPoint(p.set(arm.position[3 * k]!, arm.position[3 * k + 1]!, arm.position[3 * k + 2]!));
      }
    }
    let reach = 0;
    for (const v of run.shape.mantle?.profile ?? []) reach = Math.max(reach, Math.abs(v));
    length = Math.max(length, reach, box.isEmpty() ? 0 : box.getSize(p).length());
  }
  return length || 1;
}
