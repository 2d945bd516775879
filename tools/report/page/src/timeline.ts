/// Times of samples, and where a time lies among them.

/** Between which samples a time lies: sample `i`, `i + 1` at most, and the share of the way. */
export interface Place {
  i: number;
  j: number;
  share: number;
}

/** Place of time `t` among ascending times; beyond the ends, the end. `times` is not empty. */
export function locate(times: Float64Array, t: number): Place {
  const last = times.length - 1;
  if (!(t > times[0]!)) return { i: 0, j: 0, share: 0 };
  if (t >= times[last]!) return { i: last, j: last, share: 0 };
  let low = 0;
  let high = last;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle]! <= t) low = middle;
    else high = middle;
  }
  const span = times[high]! - times[low]!;
  return { i: low, j: high, share: span > 0 ? (t - times[low]!) / span : 0 };
}

/** Index of the last sample at or before `t`; -1 where there is none. */
export function latest(times: Float64Array | number[], t: number): number {
  let low = -1;
  let high = times.length;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle]! <= t + 1e-9) low = middle;
    else high = middle;
  }
  return low;
}

/** Linear interpolation of component `k` of rows of `width` values. */
export function mix(values: Float64Array, width: number, place: Place, k: number): number {
  const a = values[place.i * width + k]!;
  if (place.share === 0) return a;
  return a + place.share * (values[place.j * width + k]! - a);
}

/** Rotation (w, x, y, z) between two samples, the shorter way round, of unit length. */
export function mixQuaternion(values: Float64Array, place: Place): [number, number, number, number] {
  const a = [0, 1, 2, 3].map((k) => values[4 * place.i + k]!);
  const b = [0, 1, 2, 3].map((k) => values[4 * place.j + k]!);
  const sign = a.reduce((sum, x, k) => sum + x * b[k]!, 0) < 0 ? -1 : 1;
  // Frames are close: the chord's direction is the arc's to second order.
  const q = a.map((x, k) => x + place.share * (sign * b[k]! - x));
  const norm = Math.hypot(...q);
  return [q[0]! / norm, q[1]! / norm, q[2]! / norm, q[3]! / norm];
}
