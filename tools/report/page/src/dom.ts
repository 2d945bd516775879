/// Small helpers for the document.

/** An element with attributes and children; texts are texts, never markup. */
export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Record<string, string> = {},
  children: (Node | string)[] = [],
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

/** A number on a plot that spans `span`: to a five thousandth of it, so that round-off is 0. */
export function formatWithin(value: number, span: number): string {
  if (!Number.isFinite(value)) return "–";
  if (!(span > 0)) return formatNumber(value, 4);
  const digits = Math.min(Math.max(Math.ceil(-Math.log10(span / 5000)), 0), 12);
  if (digits > 6) return formatNumber(value, 3);
  return String(Number(value.toFixed(digits))).replace(/^-0$/, "0");
}

/** A number with so many significant digits, without zeros at its end. */
export function formatNumber(value: number | null | undefined, digits: number): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) return value.toExponential(Math.max(digits - 2, 1)).replace("e+", "e");
  return String(Number(value.toPrecision(digits)));
}
