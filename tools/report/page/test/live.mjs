// The live page in a browser: node test/live.mjs PROGRAM SCENES WORK CHROMIUM
// A run in real time, watched by two viewers: it moves, survives a restart of the server, can be walked through by
// the keyboard, is recorded and stopped; nothing is asked of anybody but the server, nothing complained of.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { existsSync, mkdirSync, readFileSync, readdirSync, rmSync } from "node:fs";
import { createServer } from "node:net";
import { join, resolve } from "node:path";
import { chromium } from "playwright-core";

const [program, scenes, workFolder, browserPath] = process.argv.slice(2);
const work = resolve(workFolder);
rmSync(work, { recursive: true, force: true });
mkdirSync(work, { recursive: true });

const freePort = () =>
  new Promise((done) => {
    const server = createServer();
    server.listen(0, "127.0.0.1", () => {
      const { port } = server.address();
      server.close(() => done(port));
    });
  });
const port = await freePort();
const url = `udpm://239.255.76.67:${await freePort()}?ttl=0`;
const page0 = `http://127.0.0.1:${port}/`;

/** A child, and its exit status once it has ended. */
function start(...args) {
  const child = spawn(program, args, { cwd: work, stdio: ["ignore", "pipe", "inherit"] });
  let out = "";
  child.stdout.on("data", (data) => (out += data));
  return { child, out: () => out, ended: new Promise((done) => child.on("exit", (code) => done(code))) };
}
async function until(claim, what, seconds = 30) {
  const end = Date.now() + 1000 * seconds;
  while (!(await claim())) {
    assert.ok(Date.now() < end, `waited ${seconds} s in vain for ${what}`);
    await new Promise((done) => setTimeout(done, 50));
  }
}
async function check(name, claim) {
  const begin = Date.now();
  await claim();
  console.log(`ok - ${name} (${Date.now() - begin} ms)`);
}
async function serve() {
  const live = start("live", "--lcm", url, "--port", String(port), "--record-to", "recordings");
  await until(() => live.out().includes(page0), "the server");
  return live;
}

const complaints = [];
let restarting = false;
async function open(browser, width, height) {
  const page = await browser.newPage({ viewport: { width, height } });
  page.on("console", (m) => {
    if (!["error", "warning"].includes(m.type()) || /GPU stall|swiftshader|software WebGL/i.test(m.text())) return;
    if (restarting && /ERR_CONNECTION_REFUSED|ERR_INCOMPLETE_CHUNKED_ENCODING|ERR_CONNECTION_RESET/.test(m.text())) return;
    complaints.push(m.text());
  });
  page.on("pageerror", (e) => complaints.push(e.message));
  page.on("request", (r) => !r.url().startsWith(page0) && !/^(data|blob):/.test(r.url()) && complaints.push(`asks for ${r.url()}`));
  await page.goto(page0);
  return page;
}
const data = (page, name) => page.evaluate((key) => document.getElementById("app").dataset[key] ?? "", name);
const liveTime = async (page) => Number(await data(page, "liveTime"));
const shownTime = (page) => page.evaluate(() => Number(document.querySelector(".report").dataset.time));
const picture = async (page) => (await page.locator(".view canvas").screenshot()).toString("base64");
const state = (page) => page.locator(".live-state").innerText();

let live = await serve();
const run = start("run", join(scenes, "steer.toml"), "--set", "time.duration=600", "--realtime", "--lcm", url, "--out", "out");
const browser = await chromium.launch({ executablePath: browserPath, args: ["--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader"] });
try {
  const page = await open(browser, 1280, 720);
  await check("a run that begins is shown, and the robot moves", async () => {
    await until(async () => (await page.locator(".view canvas").count()) === 1 && (await liveTime(page)) > 0.5, "the robot");
    const before = [await picture(page), await liveTime(page)];
    await until(async () => (await liveTime(page)) > before[1] + 1, "time to go on");
    assert.notEqual(await picture(page), before[0]);
    assert.ok(Math.abs((await shownTime(page)) - (await liveTime(page))) < 1, "the newest is shown");
    assert.match(await page.locator("h1").innerText(), /steer/);
    assert.equal(await state(page), "Live");
  });
  await check("plots grow, plans, drives and the estimator are there", async () => {
    const value = page.locator(".plot[data-plot=position] .value").first();
    const before = await value.innerText();
    await until(async () => ![before, "–"].includes(await value.innerText()), "a value to change");
    assert.ok((await page.locator(".plot[data-plot=tension]").count()) === 1);
    assert.ok((await page.locator(".plot[data-plot=estimate_position]").count()) === 1);
    assert.match(await page.locator("text=Drives: steer").locator("..").innerText(), /operation enabled/);
    await until(async () => (await page.locator(".line-key .plan").count()) === 1, "a plan");
  });
  const phone = await open(browser, 390, 844);
  await check("a second viewer, on a phone, sees it too, and does not scroll sideways", async () => {
    await until(async () => (await liveTime(phone)) > 0 && (await phone.locator(".view canvas").count()) === 1, "the robot");
    const [wide, window] = await phone.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
    assert.ok(wide <= window, `${wide} pixels in a window of ${window}`);
    await until(async () => /2 viewers/.test(await page.locator(".live-details").innerText()), "both to be counted");
  });
  await phone.close();
  await check("the keyboard reaches every control, and each has a name", async () => {
    await page.locator(".live-bar").evaluate(() => document.activeElement?.blur());
    const names = [];
    for (let i = 0; i < 24; ++i) {
      await page.keyboard.press("Tab");
      names.push(
        await page.evaluate(() => {
          const here = document.activeElement;
          const seen = getComputedStyle(here).outlineStyle !== "none";
          return `${here.getAttribute("aria-label") ?? here.textContent.trim()}|${seen}`;
        }),
      );
    }
    for (const name of ["Record", "Stop (safe)", "Theme", "Keys", "Follow", "Layers", "PNG", "Pause", "Time", "Live"]) {
      assert.ok(names.some((n) => n.startsWith(`${name}|`)), `${name} is not among ${names.join(", ")}`);
    }
    assert.ok(names.every((n) => /^.+\|true$/.test(n)), `without a name, or a mark of the focus: ${names.filter((n) => !/^.+\|true$/.test(n)).join(", ")}`);
  });
  await check("keys hold the picture while the run goes on, step back, and follow the newest again", async () => {
    await page.locator(".view canvas").focus();
    await page.keyboard.press(" ");
    const [held, at] = [await shownTime(page), await liveTime(page)];
    await until(async () => (await liveTime(page)) > at + 0.5, "the run to go on");
    assert.equal(await shownTime(page), held);
    await page.keyboard.press("ArrowLeft");
    assert.ok(Math.abs((await shownTime(page)) - (held - 0.1)) < 1e-6);
    await page.keyboard.press("End");
    await until(async () => (await shownTime(page)) > at + 0.4, "the newest");
    await page.keyboard.press("?");
    assert.ok(await page.locator("dialog").isVisible());
    await page.keyboard.press("Escape");
    assert.equal(await page.locator("dialog").isVisible(), false);
    for (const key of ["1", "2", "3", "4", "w", "a", "s", "d", "q", "e", "f", "f", "t"]) await page.keyboard.press(key);
  });
  await check("arrows of the drag are drawn where they are asked for", async () => {
    await page.keyboard.press(" ");
    const before = await picture(page);
    await page.locator(".layers summary").click();
    await page.locator(".layers label", { hasText: "drag of the water" }).click();
    await page.locator(".layers summary").click();
    await until(async () => (await picture(page)) !== before, "the arrows");
    assert.match(await page.locator(".line-key").innerText(), /drag, at most/);
    await page.locator(".view canvas").focus();
    await page.keyboard.press("End");
  });
  await check("the server is restarted: the page says so, and goes on with what it has", async () => {
    const first = await page.evaluate(() => document.querySelector("input[type=range]").min);
    restarting = true;
    live.child.kill("SIGINT");
    assert.equal(await live.ended, 0);
    await until(async () => /does not answer/.test(await state(page)), "the page to notice");
    assert.ok(await page.locator(".stop").isDisabled());
    const at = await liveTime(page);
    live = await serve();
    await until(async () => (await data(page, "connected")) === "true" && (await liveTime(page)) > at + 0.5, "the page to go on");
    restarting = false;
    assert.equal(await page.evaluate(() => document.querySelector("input[type=range]").min), first, "its past is there");
  });
  await check("a recording is made by the keyboard, and is a report's", async () => {
    await until(async () => !(await page.locator(".record").isDisabled()), "the button");
    await page.locator(".record").focus();
    await page.keyboard.press("Enter");
    await until(async () => (await page.locator(".record").innerText()) === "End recording", "the recording");
    const at = await liveTime(page);
    await until(async () => (await liveTime(page)) > at + 0.5, "something to record");
    await page.locator(".record").focus();
    await page.keyboard.press("Enter");
    await until(async () => (await page.locator(".record").innerText()) === "Record", "its end");
    const [folder] = readdirSync(join(work, "recordings"));
    assert.match(execFileSync(program, ["report", join("recordings", folder)], { cwd: work, encoding: "utf8" }), /A recording/);
  });
  await check("stop ends the run as Ctrl-C does, and its results are kept", async () => {
    await until(async () => !(await page.locator(".stop").isDisabled()), "the button");
    await page.locator(".stop").click();
    assert.equal(await run.ended, 3);
    const summary = JSON.parse(readFileSync(join(work, "out.partial", "summary.json"), "utf8"));
    assert.equal(summary.reason, "interrupted");
    assert.ok(existsSync(join(work, "out.partial", "telemetry.lcmlog")));
    await until(async () => /Nothing heard/.test(await state(page)), "the page to notice");
  });
  await page.close();
  assert.deepEqual(complaints, []);
  console.log("ok - nothing is complained of, nothing asked of others");
} finally {
  await browser.close();
  run.child.kill("SIGKILL");
  live.child.kill("SIGKILL");
}
