/// Meshes that change from frame to frame: a surface of revolution and a tapered tube, written into
/// arrays that are made once.

export interface Mesh {
  position: Float32Array;
  normal: Float32Array;
  colour: Float32Array;
  index: Uint32Array;
  rings: number;
  sides: number;
}

/** Rings of `sides` points, neighbours joined by triangles. The last point of a ring is the first. */
export function makeMesh(rings: number, sides: number): Mesh {
  const points = rings * (sides + 1);
  const index = new Uint32Array(6 * Math.max(rings - 1, 0) * sides);
  let at = 0;
  for (let i = 0; i + 1 < rings; ++i) {
    for (let k = 0; k < sides; ++k) {
      const a = i * (sides + 1) + k;
      const b = a + sides + 1;
      index.set([a, b, a + 1, b, b + 1, a + 1], at);
      at += 6;
    }
  }
  return {
    position: new Float32Array(3 * points),
    normal: new Float32Array(3 * points),
    colour: new Float32Array(3 * points),
    index,
    rings,
    sides,
  };
}

/** Colours ring `ring` as (r, g, b) of `from` at `at`. */
export function paintRing(mesh: Mesh, ring: number, from: Float32Array, at: number): void {
  const width = mesh.sides + 1;
  for (let k = 0; k < width; ++k) {
    const to = 3 * (ring * width + k);
    mesh.colour[to] = from[at]!;
    mesh.colour[to + 1] = from[at + 1]!;
    mesh.colour[to + 2] = from[at + 2]!;
  }
}

/** Surface of revolution about z of the outline (r, z), rings x 2. */
export function revolve(mesh: Mesh, outline: ArrayLike<number>): void {
  const width = mesh.sides + 1;
  for (let i = 0; i < mesh.rings; ++i) {
    const before = Math.max(i - 1, 0);
    const after = Math.min(i + 1, mesh.rings - 1);
    const dr = outline[2 * after]! - outline[2 * before]!;
    const dz = outline[2 * after + 1]! - outline[2 * before + 1]!;
    const length = Math.hypot(dr, dz) || 1;
    for (let k = 0; k < width; ++k) {
      const angle = (2 * Math.PI * k) / mesh.sides;
      const c = Math.cos(angle);
      const s = Math.sin(angle);
      const to = 3 * (i * width + k);
      mesh.position[to] = outline[2 * i]! * c;
      mesh.position[to + 1] = outline[2 * i]! * s;
      mesh.position[to + 2] = outline[2 * i + 1]!;
      mesh.normal[to] = (-dz / length) * c;
      mesh.normal[to + 1] = (-dz / length) * s;
      mesh.normal[to + 2] = dr / length;
    }
  }
}

/**
 * Tube of given radii about a centre line (rings x 3). Its sections are carried along the line
 * without turning about it (parallel transport), so that it does not twist where the line bends.
 */
export function tube(mesh: Mesh, line: ArrayLike<number>, radius: ArrayLike<number>): void {
  const width = mesh.sides + 1;
  let ux = 0;
  let uy = 0;
  let uz = 0;
  for (let i = 0; i < mesh.rings; ++i) {
    const before = 3 * Math.max(i - 1, 0);
    const after = 3 * Math.min(i + 1, mesh.rings - 1);
    let tx = line[after]! - line[before]!;
    let ty = line[after + 1]! - line[before + 1]!;
    let tz = line[after + 2]! - line[before + 2]!;
    const length = Math.hypot(tx, ty, tz) || 1;
    tx /= length;
    ty /= length;
    tz /= length;
    if (i === 0) {
      // Any direction across the line: the axis that the line follows least.
      if (Math.abs(tx) <= Math.abs(ty) && Math.abs(tx) <= Math.abs(tz)) ux = 1;
      else if (Math.abs(ty) <= Math.abs(tz)) uy = 1;
      else uz = 1;
    }
    const along = ux * tx + uy * ty + uz * tz;
    ux -= along * tx;
    uy -= along * ty;
    uz -= along * tz;
    const across = Math.hypot(ux, uy, uz) || 1;
    ux /= across;
    uy /= across;
    uz /= across;
    const vx = ty * uz - tz * uy;
    const vy = tz * ux - tx * uz;
    const vz = tx * uy - ty * ux;
    const r = radius[i]!;
    for (let k = 0; k < width; ++k) {
      const angle = (2 * Math.PI * k) / mesh.sides;
      const c = Math.cos(angle);
      const s = Math.sin(angle);
      const to = 3 * (i * width + k);
      const nx = c * ux + s * vx;
      const ny = c * uy + s * vy;
      const nz = c * uz + s * vz;
      mesh.normal[to] = nx;
      mesh.normal[to + 1] = ny;
      mesh.normal[to + 2] = nz;
      mesh.position[to] = line[3 * i]! + r * nx;
      mesh.position[to + 1] = line[3 * i + 1]! + r * ny;
      mesh.position[to + 2] = line[3 * i + 2]! + r * nz;
    }
  }
}

/** Value at each node of values between nodes: the mean of its neighbours. */
export function spansToNodes(spans: ArrayLike<number>, nodes: number, out: Float64Array): void {
  for (let i = 0; i < nodes; ++i) {
    const left = i > 0 ? spans[i - 1]! : spans[0]!;
    const right = i < nodes - 1 ? spans[i]! : spans[nodes - 2]!;
    out[i] = 0.5 * (left + right);
  }
}
