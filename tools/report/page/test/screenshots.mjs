// Draws docs/images anew: node test/screenshots.mjs PROGRAM SCENES WORK CHROMIUM IMAGES (by tools/report/screenshots)
import { execFileSync } from "node:child_process";
import { mkdirSync } from "node:fs";
import { join, resolve } from "node:path";
import { chromium } from "playwright-core";

const [program, scenes, workFolder, executablePath, images] = process.argv.slice(2);
const work = resolve(workFolder);
mkdirSync(work, { recursive: true });
mkdirSync(images, { recursive: true });
const mantle = (...args) => execFileSync(program, args, { cwd: work, stdio: ["ignore", "ignore", "inherit"] });
mantle("run", join(scenes, "steer.toml"), "--out", "mpc", "--report");
mantle("run", join(scenes, "steer.toml"), "--controller", "pursuit", "--out", "pursuit");
mantle("run", join(scenes, "paper.toml"), "--out", "paper", "--report");
mantle("report", "mpc", "pursuit", "--out", "both.html");

const browser = await chromium.launch({ executablePath, args: ["--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader"] });
/** One picture of a report at a time, after some keys. */
async function picture(report, name, { width = 1280, height = 720, dark = false, time = 0, keys = [] }) {
  const page = await browser.newPage({ viewport: { width, height }, colorScheme: dark ? "dark" : "light" });
  await page.goto(`file://${join(work, report)}`);
  await page.waitForSelector("#app[data-ready]");
  await page.evaluate((t) => {
    const slider = document.querySelector("input[type=range]");
    slider.value = String(t);
    slider.dispatchEvent(new Event("input"));
  }, time);
  for (const key of keys) await page.keyboard.press(key);
  await page.waitForTimeout(800);
  await page.screenshot({ path: join(images, name) });
  await page.close();
}
await picture("mpc/report.html", "report.png", { time: 17 });
await picture("both.html", "report_overlay.png", { time: 25, keys: ["f"], dark: true });
await picture("paper/report.html", "report_paper.png", { time: 5 });
await picture("mpc/report.html", "report_phone.png", { time: 17, width: 390, height: 844 });
await browser.close();
