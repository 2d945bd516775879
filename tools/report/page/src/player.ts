/// The clock of the replay: a value, moved by time that passes and by the reader's hand.

export const kSpeeds = [0.05, 0.1, 0.25, 0.5, 1, 2, 4, 8] as const;

export class Player {
  /** Simulated time [s]. */
  time = 0;
  playing = false;
  private speedIndex = kSpeeds.indexOf(1);
  private listeners: ((player: Player) => void)[] = [];

  /** From `begin` to `duration` seconds; both move on where a run grows. */
  constructor(
    public duration: number,
    public begin = 0,
  ) {}

  get speed(): number {
    return kSpeeds[this.speedIndex]!;
  }

  /** `listener` hears of every change. */
  listen(listener: (player: Player) => void): void {
    this.listeners.push(listener);
  }

  private tell(): void {
    for (const listener of this.listeners) listener(this);
  }

  seek(time: number): void {
    this.time = Math.min(Math.max(time, this.begin), this.duration);
    this.tell();
  }

  /** Starts again from the beginning where it stands at the end. */
  toggle(): void {
    this.playing = !this.playing && this.duration > 0;
    if (this.playing && this.time >= this.duration) this.time = this.begin;
    this.tell();
  }

  pause(): void {
    this.playing = false;
    this.tell();
  }

  /** One faster (+1) or slower (-1). */
  shiftSpeed(by: number): void {
    this.speedIndex = Math.min(Math.max(this.speedIndex + by, 0), kSpeeds.length - 1);
    this.tell();
  }

  setSpeed(speed: number): void {
    const index = kSpeeds.findIndex((s) => s === speed);
    if (index >= 0) this.speedIndex = index;
    this.tell();
  }

  /** `elapsed` seconds of the reader's time have passed. Stops at the end. */
  advance(elapsed: number): void {
    if (!this.playing) return;
    this.time += elapsed * this.speed;
    if (this.time >= this.duration) {
      this.time = this.duration;
      this.playing = false;
    }
    this.tell();
  }
}
