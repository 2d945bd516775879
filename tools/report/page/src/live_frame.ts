/// What the server of `mantle live` sends (tools/live/live_frame.h), once for each instant.

export type Row = Record<string, number | null>;
export type Numbers = (number | null)[];
export interface LiveRows {
  trajectory?: Row;
  estimate?: Row;
  energy?: Row;
  counters?: Row;
}
export interface LiveShape {
  root_position: Numbers;
  root_quaternion: Numbers;
  arms: { name: string; nodes: number; radius: Numbers; position: Numbers; curvature: Numbers }[];
  mantle: { name: string; nodes: number; half_thickness: number; profile: Numbers; hoop: Numbers } | null;
  rigid: [number, number][];
  cables: { name: string; points: number; position: Numbers; tension: number | null }[];
}
export interface LivePlan {
  time: number;
  knots: number;
  arms: number;
  ahead: Numbers;
  root: Numbers;
  tips: Numbers;
  solve_ms: number;
}
export interface LiveDrives {
  motors: string[];
  nodes: number[];
  statusword: number[];
  torque_permille: number[];
  target_torque_permille: number[];
  temperature_celsius: Numbers;
  reeled_length: Numbers;
}
export interface LiveSession {
  scene: string;
  version: string;
  controller: string;
  bus: string;
  real_time: boolean;
  duration: number;
  body_length: number;
  goal: string;
  waypoints: { at_m: number[] }[];
  tolerance: number;
  host: string;
  process: number;
  results: string;
}
export interface LiveFrame {
  time: number;
  rows: LiveRows;
  shape?: LiveShape;
  drag?: { nodes: Numbers; body: Numbers };
  drives?: LiveDrives;
  status?: { control_mode: string; solver_status: string; text: string };
  plan?: LivePlan;
  session?: LiveSession;
}
