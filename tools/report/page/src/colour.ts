/// Colours that a colour-blind reader can tell apart. Scales: viridis (curvature) and cividis
/// (tension) for what starts at 0, a blue-white-orange one for what has a sign. Runs and channels:
/// the palette of Okabe and Ito.

export type Rgb = [number, number, number];

const kViridis = ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"];
const kCividis = ["#00224e", "#123570", "#3b496c", "#575d6d", "#707173", "#8a8678", "#a59c74", "#c3b369", "#fee838"];
const kSigned = ["#08519c", "#3182bd", "#6baed6", "#bdd7e7", "#dddcd6", "#fdd0a2", "#fd8d3c", "#d94801", "#8c2d04"];

export const kScales = { viridis: kViridis, cividis: kCividis, signed: kSigned } as const;
export type ScaleName = keyof typeof kScales;

/** Okabe and Ito, without black and yellow: all can be told on light and on dark ground. */
export const kPalette = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6bb1", "#7f7f7f"];
/** The same for dark ground, lighter where contrast asks for it. */
export const kPaletteDark = ["#4ba3e3", "#ff8a4c", "#2fc79a", "#e8a5c8", "#ffc04d", "#8fd3ff", "#b79ee0", "#b0b0b0"];

export function parseColour(text: string): Rgb {
  const n = Number.parseInt(text.slice(1), 16);
  return [((n >> 16) & 255) / 255, ((n >> 8) & 255) / 255, (n & 255) / 255];
}

const kParsed = Object.fromEntries(
  Object.entries(kScales).map(([name, list]) => [name, list.map(parseColour)]),
) as Record<ScaleName, Rgb[]>;

/** Colour of a share in [0, 1] of a scale, into out[at ...]; grey where the share is no number. */
export function colourInto(scale: ScaleName, share: number, out: Float32Array, at: number): void {
  if (!Number.isFinite(share)) {
    out[at] = out[at + 1] = out[at + 2] = 0.5;
    return;
  }
  const list = kParsed[scale];
  const x = Math.min(Math.max(share, 0), 1) * (list.length - 1);
  const i = Math.min(Math.floor(x), list.length - 2);
  const a = list[i]!;
  const b = list[i + 1]!;
  for (let k = 0; k < 3; ++k) out[at + k] = a[k as 0]! + (x - i) * (b[k as 0]! - a[k as 0]!);
}

/** CSS gradient of a scale, low to high. */
export function gradient(scale: ScaleName): string {
  return `linear-gradient(to right, ${kScales[scale].join(", ")})`;
}

export function runColour(index: number, dark: boolean): string {
  const palette = dark ? kPaletteDark : kPalette;
  return palette[index % palette.length]!;
}
