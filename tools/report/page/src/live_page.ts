/// The page of `mantle live`: a report of a run that grows, from the server's events; its state in words; its
/// buttons. Where the server goes away, the page keeps what it has and goes on when there is one again.

import { element } from "./dom";
import type { LiveFrame, LiveRows } from "./live_frame";
import { LiveRun } from "./live_run";
import { Report } from "./report";

interface ServerState {
  viewers: number;
  url: string;
  messages: boolean;
  /** Messages that were none of ours, or not consistent. */
  refused: number;
  quiet_s: number | null;
  two_runs: boolean;
  stop: { possible: boolean; why: string };
  recording: { on: boolean; possible: boolean; folder: string; note: string };
  run: { ended: boolean; status: number | null } | null;
}

const kQuiet_s = 2;
/** A page is laid out anew at most so often, whatever comes. */
const kRebuild_ms = 500;
/** After the server has turned the page away. */
const kAgain_ms = 3000;
/** Runs show nothing before they have two rows. */
const kBegin_rows = 2;

export class LivePage {
  private readonly root = element("div", { class: "report" });
  private readonly state = element("p", { class: "live-state", role: "status" }, ["Connecting…"]);
  private readonly details = element("p", { class: "live-details" });
  private readonly stop = element("button", { type: "button", class: "stop", disabled: "" }, ["Stop (safe)"]);
  private readonly record = element("button", { type: "button", class: "record", disabled: "", "aria-pressed": "false" }, ["Record"]);
  private source: EventSource | null = null;
  private connected = false;
  private server: ServerState | null = null;
  private run: LiveRun | null = null;
  private report: Report | null = null;
  private before: LiveRows[] = [];
  private built = Number.NEGATIVE_INFINITY;

  constructor(
    private readonly app: HTMLElement,
    private readonly url: string,
    private readonly madeBy: string,
  ) {
    document.title = "Mantle live";
    app.append(
      element("section", { class: "live-bar", "aria-label": "Live" }, [
        element("div", { class: "live-words" }, [this.state, this.details]), this.record, this.stop,
      ]),
      this.root,
    );
    this.stop.addEventListener("click", () => void this.press("stop", this.stop));
    this.record.addEventListener("click", () => void this.press("record", this.record));
    this.connect();
    this.tell();
    app.dataset.live = "true";
  }

  private connect(): void {
    const source = new EventSource("/events");
    this.source = source;
    source.addEventListener("open", () => this.setConnected(true));
    source.addEventListener("error", () => {
      this.setConnected(false);
      // The browser tries again by itself, but where the server answered with a refusal.
      if (source.readyState !== EventSource.CLOSED || this.source !== source) return;
      this.source = null;
      setTimeout(() => this.connect(), kAgain_ms);
    });
    source.addEventListener("server", (event) => {
      this.server = JSON.parse((event as MessageEvent<string>).data) as ServerState;
      this.tell();
    });
    source.addEventListener("history", (event) => {
      this.before = JSON.parse((event as MessageEvent<string>).data) as LiveRows[];
    });
    source.addEventListener("frame", (event) => this.onFrame(JSON.parse((event as MessageEvent<string>).data) as LiveFrame));
  }

  private setConnected(connected: boolean): void {
    this.connected = connected;
    this.app.dataset.connected = String(connected);
    this.tell();
  }

  private onFrame(frame: LiveFrame): void {
    if (this.run !== null && this.run.fits(frame)) {
      // What this page missed while the server was there and it was not.
      for (const rows of this.before) if ((rows.trajectory?.["time_s"] ?? 0) < frame.time) this.run.addMissed(rows);
      this.before = [];
      this.run.add(frame);
      this.report?.grow();
    } else {
      const now = performance.now();
      if (now - this.built < kRebuild_ms) return;
      this.begin(frame, now);
    }
    this.app.dataset.liveTime = frame.time.toFixed(3);
  }

  private begin(frame: LiveFrame, now: number): void {
    const goesOn = this.run !== null && frame.time >= this.run.time;
    const run = new LiveRun(frame, [...(goesOn ? this.run!.rows() : []), ...this.before]);
    this.run = run;
    this.before = [];
    if (run.length < kBegin_rows) return;
    this.built = now;
    this.report?.dispose();
    this.report = new Report(this.root, { runs: [run.run], madeBy: this.madeBy, live: true });
  }

  private async press(name: "stop" | "record", button: HTMLButtonElement): Promise<void> {
    button.disabled = true;
    try {
      const answer = await fetch(`/press/${name}`, { method: "POST", headers: { "X-Mantle": "live" } });
      const { done, why } = answer.ok ? ((await answer.json()) as { done: boolean; why: string }) : { done: false, why: await answer.text() };
      if (!done && why !== "") this.details.textContent = `${name}: ${why}`;
    } catch {
      this.details.textContent = `${name}: the server does not answer`;
    }
    button.disabled = false;
  }

  /** The state in words. */
  private tell(): void {
    const { server } = this;
    const words: string[] = [];
    let bad = false;
    if (!this.connected) {
      words.push("The server does not answer; what it said last is shown. Trying again…");
      bad = true;
    } else if (server === null || !server.messages) {
      words.push(`Waiting for a run on ${this.url}`);
    } else if (server.run?.ended === true) {
      words.push(server.run.status === 0 ? "The run has ended" : `The run has ended with status ${server.run.status}: what it reached is in its folder`);
    } else if (server.quiet_s !== null && server.quiet_s >= kQuiet_s) {
      words.push(`Nothing heard for ${server.quiet_s} s`);
      bad = true;
    } else {
      words.push("Live");
    }
    if (server?.two_runs === true) {
      words.push("two runs speak on this address: what is shown is of both");
      bad = true;
    }
    this.setText(this.state, words.join("; "));
    this.state.classList.toggle("bad", bad);
    if (server === null) return;
    const { recording, stop } = server;
    const details = [`${server.viewers} ${server.viewers === 1 ? "viewer" : "viewers"}`];
    if (recording.on) details.push(`recording into ${recording.folder}`);
    else if (recording.folder !== "") details.push(`recorded in ${recording.folder}`);
    if (recording.note !== "") details.push(`the recording ended: ${recording.note}`);
    if (server.refused > 0) details.push(`${server.refused} messages refused`);
    this.setText(this.details, details.join("; "));
    this.stop.disabled = !this.connected || !stop.possible;
    this.stop.title = stop.possible ? "Ends the run as Ctrl-C does: drives stopped, results kept" : `Not possible: ${stop.why}`;
    this.record.disabled = !this.connected || !recording.possible;
    this.record.title = "What is heard, as a log to be looked at by mantle report";
    this.record.setAttribute("aria-pressed", String(recording.on));
    this.setText(this.record, recording.on ? "End recording" : "Record");
  }

  private setText(where: HTMLElement, text: string): void {
    if (where.textContent !== text) where.textContent = text;
  }
}
