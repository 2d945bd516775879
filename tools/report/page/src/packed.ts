/// Arrays as the program packs them (tools/report/packed_array.h): numbers of one quantity, row by
/// row, little-endian in base64.

/** One array. `u16`: value = lo + step * u, 65535 where there is none. */
export type Packed =
  | { k: "u16"; n: number; lo: number; step: number; d: string }
  | { k: "f32"; n: number; d: string }
  | { k: "f64"; n: number; d: string }
  | { k: "c"; n: number; v: number | null };

const kNone = 65535;

/** Bytes of a base64 text. */
export function decodeBase64(text: string): Uint8Array {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

/** The numbers of an array; NaN where there is none. Throws where its bytes are not `n` numbers. */
export function unpack(array: Packed): Float64Array {
  if (array.k === "c") return new Float64Array(array.n).fill(array.v ?? Number.NaN);
  const bytes = decodeBase64(array.d);
  const size = array.k === "u16" ? 2 : array.k === "f32" ? 4 : 8;
  if (bytes.length !== size * array.n) {
    throw new Error(`a packed array has ${bytes.length} bytes, must be ${size * array.n}`);
  }
  const view = new DataView(bytes.buffer);
  const out = new Float64Array(array.n);
  for (let i = 0; i < array.n; ++i) {
    if (array.k === "f64") {
      out[i] = view.getFloat64(8 * i, true);
    } else if (array.k === "f32") {
      out[i] = view.getFloat32(4 * i, true);
    } else {
      const u = view.getUint16(2 * i, true);
      out[i] = u === kNone ? Number.NaN : array.lo + array.step * u;
    }
  }
  return out;
}
