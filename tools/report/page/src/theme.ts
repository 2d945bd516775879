/// Light or dark, as the reader chose or the system says.

const kKey = "mantle-theme";

/** Whether it is dark. */
export function readTheme(): boolean {
  let kept: string | null = null;
  try {
    kept = localStorage.getItem(kKey);
  } catch {
    // A page from the disk may have no storage.
  }
  return kept === null ? window.matchMedia("(prefers-color-scheme: dark)").matches : kept === "dark";
}

export function keepTheme(dark: boolean): void {
  document.documentElement.dataset.theme = dark ? "dark" : "light";
  try {
    localStorage.setItem(kKey, dark ? "dark" : "light");
  } catch {
    // A page from the disk may have no storage.
  }
}
