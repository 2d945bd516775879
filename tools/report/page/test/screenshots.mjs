// Draws docs/images anew: node test/screenshots.mjs PROGRAM SCENES WORK CHROMIUM IMAGES [NAME...]
// (by tools/report/screenshots); only those NAMEs where some are given.
import { execFileSync, spawn } from "node:child_process";
import { mkdirSync } from "node:fs";
import { join, resolve } from "node:path";
import { chromium } from "playwright-core";

const [program, scenes, workFolder, executablePath, images, ...chosen] = process.argv.slice(2);
const work = resolve(workFolder);
mkdirSync(work, { recursive: true });
mkdirSync(images, { recursive: true });
const mantle = (...args) => execFileSync(program, args, { cwd: work, stdio: ["ignore", "ignore", "inherit"] });
const wanted = (name) => chosen.length === 0 || chosen.includes(name);
const done = new Set();
/** A run that several pictures share, made once. */
function run(out, scene, ...more) {
  if (done.has(out)) return;
  mantle("run", join(scenes, `${scene}.toml`), "--out", out, ...more, "--report");
  done.add(out);
}

const browser = await chromium.launch({ executablePath, args: ["--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader"] });
async function open(url, { width = 1280, height = 720, dark = false }) {
  const page = await browser.newPage({ viewport: { width, height }, colorScheme: dark ? "dark" : "light" });
  await page.goto(url);
  return page;
}
/** One picture of a report at a time, after some keys and what `prepare` does; of an element, or of the window. */
async function picture(report, name, { time = 0, keys = [], prepare = async () => {}, element = null, ...look }) {
  const page = await open(`file://${join(work, report)}`, look);
  await page.waitForSelector("#app[data-ready]");
  await page.evaluate((t) => {
    const slider = document.querySelector("input[type=range]");
    slider.value = String(t);
    slider.dispatchEvent(new Event("input"));
  }, time);
  for (const key of keys) await page.keyboard.press(key);
  await prepare(page);
  await page.waitForTimeout(800);
  await (element === null ? page : page.locator(element)).screenshot({ path: join(images, name) });
  await page.close();
}
const tick = async (page, layer) => {
  await page.locator(".layers summary").click();
  await page.locator(".layers label", { hasText: layer }).click();
  await page.locator(".layers summary").click();
};

if (wanted("report.png") || wanted("report_phone.png") || wanted("report_overlay.png")) run("mpc", "steer");
if (wanted("report.png")) await picture("mpc/report.html", "report.png", { time: 17 });
if (wanted("report_phone.png")) await picture("mpc/report.html", "report_phone.png", { time: 17, width: 390, height: 844 });
if (wanted("report_overlay.png")) {
  run("pursuit", "steer", "--controller", "pursuit");
  mantle("report", "mpc", "pursuit", "--out", "both.html");
  await picture("both.html", "report_overlay.png", { time: 25, keys: ["f"], dark: true });
}
if (wanted("report_paper.png") || wanted("report_figures.png")) run("paper", "paper");
if (wanted("report_paper.png")) await picture("paper/report.html", "report_paper.png", { time: 5 });
if (wanted("report_figures.png")) {
  await picture("paper/report.html", "report_figures.png", {
    height: 1000,
    prepare: async (page) => {
      // The figures alone.
      await page.addStyleTag({ content: "header, main, footer, .note, .tables > :not([data-figure]) { display: none !important }" });
    },
    element: ".tables",
  });
}
if (wanted("report_estimate.png")) {
  run("noise", "steer_noise", "--set", "time.duration=8");
  await picture("noise/report.html", "report_estimate.png", {
    time: 4.2,
    prepare: async (page) => {
      await tick(page, "drag of the water");
      await page.locator(".plot[data-plot=estimate_position]").scrollIntoViewIfNeeded();
      await page.evaluate(() => document.querySelector(".plot[data-plot=estimate_position]").scrollIntoView());
    },
  });
}
if (wanted("live.png")) {
  const live = spawn(program, ["live", join(scenes, "steer.toml"), "--out", "live", "--port", "18137"], { cwd: work, stdio: ["ignore", "pipe", "inherit"] });
  try {
    await new Promise((ready) => live.stdout.once("data", ready));
    const page = await open("http://127.0.0.1:18137/", {});
    // Asked from out here: the page's own policy lets nothing be evaluated in it.
    while (Number(await page.evaluate(() => document.getElementById("app").dataset.liveTime ?? 0)) < 14) await page.waitForTimeout(200);
    await page.screenshot({ path: join(images, "live.png") });
    await page.close();
  } finally {
    live.kill("SIGINT");
    await new Promise((ended) => live.once("exit", ended));
  }
}
await browser.close();
