/// The page of some runs: lays out what there is, and moves everything to the time of the player.

import { type Plot, choosePlots } from "./catalogue";
import { runColour } from "./colour";
import { element } from "./dom";
import { helpDialog, pressKey } from "./keys";
import type { Run } from "./model";
import { type Figure, isPaperScene, paperFigures } from "./paper";
import { Player, kSpeeds } from "./player";
import { PlotCard } from "./plots";
import { studyCards } from "./study";
import { beginOf, durationOf } from "./span";
import { DriveTable, accuracyOf, figureTables, modesTable } from "./tables";
import { keepTheme, readTheme } from "./theme";
import { tuneFigures } from "./tune";
import { View3D } from "./view3d";
import { colourBars, viewTools } from "./view_panel";

/** How often the view's lines and the plots of a run that grows are drawn anew. */
const kGrow_ms = 200;
const kReplot_ms = 500;
const kLiveFoot = "The newest minutes of the run are kept on this page; its results are where it writes them.";

/** What a page is of. */
export interface ReportParts {
  runs: Run[];
  madeBy: string;
  /** The runs grow while they are looked at. */
  live: boolean;
}

export class Report {
  private readonly runs: Run[];
  private readonly visible: boolean[];
  private readonly player: Player;
  private view: View3D | null = null;
  private canvas: HTMLCanvasElement | null = null;
  private readonly cards: PlotCard[] = [];
  private readonly drives: DriveTable[] = [];
  private dark: boolean;
  private readonly playButton = element("button", { type: "button", class: "play", title: "Play or pause (Space)" });
  private readonly slider = element("input", { type: "range", min: "0", step: "any", value: "0", "aria-label": "Time" });
  private readonly clock = element("output", { class: "clock" });
  private readonly filmClock = element("p", { class: "film-clock" });
  private readonly speed = element("select", { title: "Speed (+ and −)", "aria-label": "Speed of the replay" });
  private readonly followButton = element("button", { type: "button", title: "Follow the vehicle (F)", "aria-pressed": "true" }, ["Follow"]);
  private readonly help: HTMLDialogElement;
  private studies: HTMLElement | null = null;
  private readonly figures: Figure[] = [];
  private last = performance.now();
  private told = 0;

  private readonly live: boolean;
  /** Of a live page: the newest is shown as it comes. */
  private following: boolean;
  private readonly liveButton = element("button", { type: "button", class: "live-now", title: "Follow the newest (End)", "aria-pressed": "true" }, ["Live"]);
  private bars: HTMLElement | null = null;
  private grown = 0;
  private replotted = 0;
  private readonly ended = new AbortController();

  constructor(
    private readonly app: HTMLElement,
    parts: ReportParts,
  ) {
    this.runs = parts.runs;
    this.live = this.following = parts.live;
    this.visible = this.runs.map(() => true);
    this.dark = readTheme();
    this.player = new Player(Math.max(0, ...this.runs.map(durationOf)), Math.min(...this.runs.map(beginOf)));
    if (this.live) this.player.time = this.player.duration;
    this.help = helpDialog();
    this.layOut(parts.madeBy);
    const watch = new IntersectionObserver((entries) => {
      for (const entry of entries) {
        const card = this.cards.find((c) => c.root === entry.target);
        card?.setOnScreen(entry.isIntersecting);
      }
    });
    for (const card of this.cards) watch.observe(card.root);
    this.player.listen(() => this.show());
    this.listen();
    this.setDark(this.dark);
    this.show();
    app.dataset.ready = "true";
    requestAnimationFrame((now) => this.tick(now));
  }

  // ---- layout

  private layOut(madeBy: string): void {
    const motion = this.runs.filter((r) => r.kind !== "study" && r.kind !== "modes" && r.kind !== "tune");
    document.title = `${this.runs.map((r) => r.label).join(", ")} – Mantle ${this.live ? "live" : "report"}`;
    const theme = element("button", { type: "button", title: "Light or dark (T)" }, ["Theme"]);
    theme.addEventListener("click", () => this.setDark(!this.dark));
    const keys = element("button", { type: "button", title: "Keys (?)" }, ["Keys"]);
    keys.addEventListener("click", () => this.help.showModal());
    this.app.append(
      element("header", {}, [
        element("h1", {}, [this.runs.length === 1 ? this.runs[0]!.label : "Runs side by side"]),
        this.makeRunChips(),
        element("div", { class: "tools" }, [theme, keys]),
      ]),
    );
    for (const run of this.runs) {
      for (const note of run.notes) {
        this.app.append(element("p", { class: run.complete ? "note" : "note bad", role: "status" }, [element("strong", {}, [`${run.label}: `]), note]));
      }
    }
    const main = element("main");
    const plots = element("div", { class: "plots", id: "plots" });
    if (motion.length > 0) {
      main.append(element("div", { class: "stage" }, [this.makeView(), this.makeTransport()]));
    }
    for (const plot of choosePlots(this.runs)) {
      const card = new PlotCard(plot, {
        seek: (t) => this.seek(t),
        runLabels: this.runs.map((r) => r.label),
        growing: this.live,
      });
      this.cards.push(card);
      plots.append(card.root);
    }
    if (motion.length > 0 && this.cards.length === 0) {
      plots.append(element("p", { class: "empty" }, ["There is nothing to plot: no table of these results has two rows."]));
    }
    if (motion.length > 0) main.append(plots);
    this.app.append(main);
    if (motion.length === 0) main.classList.add("no-stage");
    const tables = element("div", { class: "tables" });
    const studies = this.runs.filter((r) => r.kind === "study");
    if (studies.length > 0) {
      this.studies = element("div", { class: "studies" });
      this.app.append(this.studies);
    }
    for (const run of this.runs) {
      if (run.drives !== null && run.drives.motors.length > 0) {
        const drives = new DriveTable(run);
        this.drives.push(drives);
        tables.append(drives.root);
      }
      const modes = run.kind === "modes" ? modesTable(run) : null;
      if (modes !== null) tables.append(modes);
    }
    const paper = this.live ? undefined : this.runs.find(isPaperScene);
    if (this.view !== null && paper !== undefined) this.figures.push(...paperFigures(paper, this.view));
    this.figures.push(...tuneFigures(this.runs));
    tables.append(...this.figures.map((f) => f.root), ...figureTables(this.runs));
    this.app.append(tables, element("footer", {}, [this.live ? kLiveFoot : accuracyOf(this.runs), ` Made by ${madeBy}.`]), this.help);
  }

  private makeRunChips(): HTMLElement {
    const chips = element("div", { class: "chips", role: "group", "aria-label": "Runs" });
    if (this.runs.length < 2) return chips;
    this.runs.forEach((run, i) => {
      const chip = element("button", { type: "button", class: "chip", "aria-pressed": "true", title: `Show or hide ${run.label}` }, [
        element("span", { class: "dot", "data-run": String(i) }), run.label,
      ]);
      chip.addEventListener("click", () => {
        this.visible[i] = !this.visible[i];
        chip.setAttribute("aria-pressed", String(this.visible[i]));
        this.view?.setVisible(i, this.visible[i]);
        for (const card of this.cards) card.setVisible(this.visible);
        this.show();
      });
      chips.append(chip);
    });
    return chips;
  }

  private makeView(): HTMLElement {
    const box = element("div", { class: "view" });
    this.canvas = element("canvas", { tabindex: "0", role: "img", "aria-label": "Replay in 3-D; W A S D to orbit, Q and E to come closer and go away" });
    box.append(this.canvas);
    try {
      this.view = new View3D(this.canvas, this.runs);
    } catch {
      this.canvas.remove();
      box.append(element("p", { class: "empty" }, ["The replay needs WebGL, which this browser has not or has switched off. Plots and tables work all the same."]));
      return box;
    }
    if (!this.view.hasBodies()) {
      const why = this.live ? "The run says no shapes (--shape-every 0), so that the path alone is drawn." : "No shapes are in these results, so that the path alone is drawn: the run was made with --shape-every 0, or by a version that logged no shapes.";
      box.append(element("p", { class: "hint" }, [why]));
    }
    const { view } = this;
    this.followButton.addEventListener("click", () => this.setFollow(!view.follow));
    this.bars = colourBars(view, this.runs.length);
    box.append(
      viewTools(view, this.followButton, () => this.player.time, (byRun) => this.app.classList.toggle("by-run", byRun), () => this.showBars()),
      this.bars,
    );
    return box;
  }

  private makeTransport(): HTMLElement {
    this.playButton.addEventListener("click", () => this.toggle());
    this.slider.max = String(this.player.duration);
    this.slider.addEventListener("input", () => {
      const time = Number(this.slider.value); // a pause shows the player's own time
      this.player.pause();
      this.seek(time);
    });
    this.liveButton.addEventListener("click", () => this.followNewest(!this.following));
    for (const speed of kSpeeds) this.speed.append(element("option", { value: String(speed) }, [`${speed}×`]));
    this.speed.addEventListener("change", () => this.player.setSpeed(Number(this.speed.value)));
    const step = (by: number, text: string, title: string) => {
      const button = element("button", { type: "button", title, "aria-label": title }, [text]);
      button.addEventListener("click", () => this.step(by));
      return button;
    };
    const bar = element("div", { class: "transport" }, [
      this.playButton, step(-0.1, "‹", "0.1 s back (←)"), step(0.1, "›", "0.1 s ahead (→)"), this.slider, this.clock, this.speed,
      ...(this.live ? [this.liveButton] : []),
    ]);
    if (this.player.duration <= 0 && !this.live) {
      bar.replaceChildren(element("span", { class: "still" }, ["An equilibrium: nothing moves."]));
    }
    return bar;
  }

  // ---- what moves

  private step(by: number): void {
    this.player.pause();
    this.seek(this.player.time + by);
  }

  private seek(time: number): void {
    this.followNewest(false);
    this.player.seek(time);
  }

  private toggle(): void {
    const { following } = this;
    this.followNewest(false);
    if (!following) this.player.toggle(); // what goes on by itself is stopped by this alone
  }

  private followNewest(following: boolean): void {
    this.following = this.live && following;
    this.liveButton.setAttribute("aria-pressed", String(this.following));
    if (!this.following) return;
    this.player.pause();
    this.player.seek(this.player.duration);
  }

  private showBars(): void {
    if (this.view === null || this.bars === null) return;
    const bars = colourBars(this.view, this.runs.length);
    this.bars.replaceWith(bars);
    this.bars = bars;
  }

  /** The runs have grown: call it whenever something came. */
  grow(): void {
    const now = performance.now();
    this.player.begin = Math.min(...this.runs.map(beginOf));
    this.player.duration = Math.max(...this.runs.map(durationOf));
    this.slider.min = String(this.player.begin);
    this.slider.max = String(this.player.duration);
    if (now - this.grown > kGrow_ms) {
      this.grown = now;
      if (this.view?.refresh() === true) this.showBars();
    }
    if (now - this.replotted > kReplot_ms) {
      this.replotted = now;
      const plots = new Map(choosePlots(this.runs).map((plot): [string, Plot] => [plot.id, plot]));
      for (const card of this.cards) {
        const plot = plots.get(card.plot.id);
        if (plot !== undefined && plot.curves.length === card.plot.curves.length) card.update(plot);
      }
    }
    if (this.following) this.player.seek(this.player.duration);
    else this.show();
  }

  /** For films: the view alone fills the window. Gives the length of the replay [s], null without a view. */
  beginFilm(): number | null {
    if (this.view === null) return null;
    this.app.classList.add("film");
    this.player.pause();
    const { view } = this;
    const box = this.canvas!.parentElement!;
    box.append(this.filmClock);
    view.resize(box.clientWidth, box.clientHeight);
    view.look("oblique");
    return this.player.duration;
  }

  /** One picture of a film, drawn when the promise holds. */
  async showFilm(time: number): Promise<void> {
    this.player.seek(time);
    this.filmClock.textContent = `${time.toFixed(2)} s`;
    for (let i = 0; i < 2; ++i) await new Promise((drawn) => requestAnimationFrame(drawn));
  }

  /** Takes it off the page. */
  dispose(): void {
    this.ended.abort();
    this.view?.dispose();
    for (const card of this.cards) card.dispose();
    this.app.replaceChildren();
  }

  private setFollow(follow: boolean): void {
    this.view?.setFollow(follow);
    this.followButton.setAttribute("aria-pressed", String(follow));
  }

  private setDark(dark: boolean): void {
    this.dark = dark;
    keepTheme(dark);
    this.view?.setDark(dark);
    for (const dot of this.app.querySelectorAll<HTMLElement>(".dot")) dot.style.background = runColour(Number(dot.dataset.run), dark);
    for (const card of this.cards) card.draw(dark, this.visible);
    for (const figure of this.figures) figure.draw(dark);
    this.studies?.replaceChildren(...this.runs.filter((r) => r.kind === "study").flatMap((r) => studyCards(r, dark)));
    this.view?.setTime(this.player.time);
    for (const card of this.cards) card.setTime(this.player.time, true);
  }

  private show(): void {
    const { player } = this;
    const going = player.playing || this.following;
    this.playButton.textContent = going ? "❚❚" : "▶";
    this.playButton.setAttribute("aria-label", going ? "Pause" : "Play");
    this.slider.value = String(player.time);
    const text = this.live ? `${player.time.toFixed(2)} s` : `${player.time.toFixed(2)} / ${player.duration.toFixed(2)} s`;
    this.slider.setAttribute("aria-valuetext", `${player.time.toFixed(2)} s`);
    if (this.clock.textContent !== text) this.clock.textContent = text;
    if (this.speed.value !== String(player.speed)) this.speed.value = String(player.speed);
    this.view?.setTime(player.time);
    // Texts, which lay the page out anew, follow ten times a second; lines and picture every frame, but for
    // lines where the processor draws it all: what moves all over the page costs it a third of its frames.
    const now = performance.now();
    const texts = !player.playing || now - this.told > 100;
    if (texts) this.told = now;
    if (texts || this.view?.software !== true) for (const card of this.cards) card.setTime(player.time, texts);
    if (texts) for (const table of this.drives) table.setTime(player.time);
    this.app.dataset.time = player.time.toFixed(3);
  }

  private tick(now: number): void {
    if (this.ended.signal.aborted) return;
    const elapsed = Math.min((now - this.last) / 1000, 0.25);
    this.last = now;
    if (this.player.playing) this.view?.judge(elapsed);
    const playing = this.player.playing;
    this.player.advance(elapsed);
    if (this.live && playing && !this.player.playing) this.followNewest(true); // it has caught up
    if (this.view?.render() === true) this.app.dataset.frames = String(Number(this.app.dataset.frames ?? 0) + 1);
    requestAnimationFrame((next) => this.tick(next));
  }

  private listen(): void {
    const box = this.canvas?.parentElement;
    if (box != null) {
      new ResizeObserver(() => this.view?.resize(box.clientWidth, box.clientHeight)).observe(box);
      this.view?.resize(box.clientWidth, box.clientHeight);
      this.view?.look("oblique");
    }
    let width = window.innerWidth;
    window.addEventListener("resize", () => {
      if (window.innerWidth === width) return;
      width = window.innerWidth;
      for (const card of this.cards) card.resize();
    }, { signal: this.ended.signal });
    window.addEventListener("keydown", (event) => this.onKey(event), { signal: this.ended.signal });
  }

  private onKey(event: KeyboardEvent): void {
    if (this.help.open) return;
    const done = pressKey(event, this.slider, {
      toggle: () => this.toggle(),
      step: (seconds) => this.step(seconds),
      begin: () => this.seek(this.player.begin),
      end: () => (this.live ? this.followNewest(true) : this.seek(this.player.duration)),
      speed: (by) => this.player.shiftSpeed(by),
      follow: () => this.setFollow(!(this.view?.follow ?? false)),
      theme: () => this.setDark(!this.dark),
      help: () => this.help.showModal(),
      look: (from) => this.view?.look(from),
      turn: (azimuth, polar, zoom) => this.view?.turn(azimuth, polar, zoom),
    });
    if (done) event.preventDefault();
  }
}
