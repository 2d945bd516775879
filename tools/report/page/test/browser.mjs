// The report in a browser: node test/browser.mjs PROGRAM SCENES WORK CHROMIUM
// Runs short scenes, makes reports and opens them from the disk: nothing is requested from anywhere, nothing is
// complained of, the picture moves, plots follow, runs are laid over one another, a phone can show it.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, rmSync } from "node:fs";
import { join, resolve } from "node:path";
import { chromium } from "playwright-core";

const [program, scenes, workFolder, browserPath] = process.argv.slice(2);
const work = resolve(workFolder);
rmSync(work, { recursive: true, force: true });
mkdirSync(work, { recursive: true });
const mantle = (...args) => execFileSync(program, args, { cwd: work, stdio: ["ignore", "pipe", "inherit"], encoding: "utf8" });

const short = ["--set", "time.duration=1.5"];
mantle("run", join(scenes, "steer.toml"), ...short, "--out", "mpc");
mantle("run", join(scenes, "steer.toml"), ...short, "--controller", "pid", "--out", "pid");
mantle("run", join(scenes, "arm_dynamic.toml"), "--set", "time.duration=0.2", "--shape-every", "0", "--out", "bare");
mantle("static", join(scenes, "mantle_static.toml"), "--out", "static");
mantle("run", join(scenes, "reach_noise.toml"), "--set", "time.duration=0.5", "--out", "noise", "--report");
mantle("run", join(scenes, "paper.toml"), "--set", "time.duration=2", "--out", "paper", "--report");
mantle("tune", join(scenes, "reach.toml"), "--set", "time.duration=0.3", "--evaluations", "4", "--out", "tuned", "--report");
mantle("report", "mpc");
mantle("report", "mpc", "pid", "--out", "both.html");
mantle("report", "bare");
mantle("report", "static");

const browser = await chromium.launch({
  executablePath: browserPath,
  args: ["--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader"],
});
const complaints = [];
/** Waits from out here: the page's own policy lets nothing be evaluated in it. */
async function until(claim) {
  const end = Date.now() + 20_000;
  while (!(await claim())) {
    assert.ok(Date.now() < end, "waited 20 s in vain");
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}
const frames = (page) => page.evaluate(() => Number(document.getElementById("app").dataset.frames ?? 0));
async function open(file, width, height, draws = true) {
  const page = await browser.newPage({ viewport: { width, height } });
  page.on("console", (m) => ["error", "warning"].includes(m.type()) && !/GPU stall|swiftshader|software WebGL/i.test(m.text()) && complaints.push(`${file}: ${m.text()}`));
  page.on("pageerror", (e) => complaints.push(`${file}: ${e.message}`));
  page.on("request", (r) => !/^(file|data|blob):/.test(r.url()) && complaints.push(`${file}: asks for ${r.url()}`));
  await page.goto(`file://${join(work, file)}`);
  await page.waitForSelector("#app[data-ready]");
  if (draws) await until(async () => (await frames(page)) > 0);
  return page;
}
const time = (page) => page.evaluate(() => Number(document.getElementById("app").dataset.time));
const picture = async (page) => (await page.locator(".view canvas").screenshot()).toString("base64");
async function check(name, claim) {
  const begin = Date.now();
  await claim();
  console.log(`ok - ${name} (${Date.now() - begin} ms)`);
}

try {
  const page = await open("mpc/report.html", 1280, 720);
  await check("it draws the bodies", async () => {
    const png = await picture(page);
    const seen = await page.evaluate(async (data) => {
      const image = new Image();
      image.src = `data:image/png;base64,${data}`;
      await image.decode();
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [image.width, image.height];
      const context = canvas.getContext("2d");
      context.drawImage(image, 0, 0);
      const pixels = context.getImageData(image.width * 0.25, image.height * 0.2, image.width * 0.5, image.height * 0.6).data;
      const colours = new Set();
      for (let i = 0; i < pixels.length; i += 4) colours.add((pixels[i] << 16) | (pixels[i + 1] << 8) | pixels[i + 2]);
      return colours.size;
    }, png);
    assert.ok(seen > 200, `the middle of the view has ${seen} colours`); // shaded bodies have thousands, a grid has few
  });
  await check("it plays, and the plots follow", async () => {
    const before = await picture(page);
    const now = () => page.locator(".plot[data-plot=position] .plot-now").evaluate((e) => e.style.transform);
    const at = await now();
    await page.locator(".view canvas").focus();
    await page.keyboard.press(" ");
    await until(async () => (await time(page)) > 0.4);
    await page.keyboard.press(" ");
    assert.notEqual(await now(), at);
    assert.notEqual(await picture(page), before);
    const stopped = await time(page);
    await page.waitForTimeout(200);
    assert.equal(await time(page), stopped);
  });
  await check("it draws 12 frames a second at least without a GPU, on a machine that is busy with other tests", async () => {
    await page.keyboard.press("Home");
    await page.keyboard.press("-"); // half speed: 3 s of replay
    const first = await frames(page);
    await page.keyboard.press(" ");
    await page.waitForTimeout(2000);
    const rate = ((await frames(page)) - first) / 2;
    await page.keyboard.press(" ");
    console.log(`   ${rate.toFixed(0)} frames a second`);
    assert.ok(rate > 12, `${rate} frames a second`);
  });
  await check("keys move time, and a click into a plot goes there", async () => {
    await page.keyboard.press("Home");
    assert.equal(await time(page), 0);
    await page.keyboard.press("Shift+ArrowRight");
    assert.equal(await time(page), 1);
    await page.keyboard.press("End");
    assert.equal(await time(page), 1.5);
    const box = await page.locator(".plot[data-plot=position] .u-over").boundingBox();
    await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
    assert.ok(Math.abs((await time(page)) - 0.75) < 0.1, `${await time(page)}`);
  });
  await check("drives are told in words", async () => {
    assert.match(await page.locator("text=Drives: mpc").locator("..").innerText(), /operation enabled/);
  });
  await check("light and dark differ", async () => {
    const light = await page.evaluate(() => getComputedStyle(document.body).backgroundColor);
    await page.keyboard.press("t");
    assert.notEqual(await page.evaluate(() => getComputedStyle(document.body).backgroundColor), light);
  });
  await page.close();

  const both = await open("both.html", 1280, 720);
  await check("two runs are laid over one another, and one can be hidden", async () => {
    assert.equal(await both.locator(".chip").count(), 2);
    const legend = both.locator(".plot[data-plot=error] .legend-row");
    assert.equal(await legend.count(), 2);
    const before = await picture(both);
    await both.locator(".chip").nth(1).click();
    await both.waitForTimeout(200);
    assert.equal(await legend.nth(1).isVisible(), false);
    assert.notEqual(await picture(both), before);
  });
  await both.close();

  const phone = await open("mpc/report.html", 390, 844);
  await check("a phone shows it without scrolling sideways", async () => {
    const [wide, window] = await phone.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
    assert.ok(wide <= window, `${wide} pixels in a window of ${window}`);
  });
  await phone.close();

  const noise = await open("noise/report.html", 1280, 720);
  await check("the estimator's errors stand between three deviations", async () => {
    const names = await noise.locator(".plot[data-plot=estimate_rate] .legend-row .name").allInnerTexts();
    assert.deepEqual(names.slice(0, 3), ["x", "x +3σ", "x −3σ"]);
  });
  await check("the estimated root is drawn beside the true one", async () => {
    assert.equal(await noise.locator(".line-key .estimate").count(), 1);
    const before = await picture(noise);
    await noise.locator(".layers summary").click();
    await noise.locator(".layers label", { hasText: "estimated root" }).click();
    await noise.locator(".layers summary").click();
    await until(async () => (await picture(noise)) !== before);
  });
  await check("arrows of the drag are there on request alone", async () => {
    await noise.keyboard.press("End");
    assert.equal(await noise.locator(".line-key .drag").count(), 0);
    const before = await picture(noise);
    await noise.locator(".layers summary").click();
    await noise.locator(".layers label", { hasText: "drag of the water" }).click();
    await noise.locator(".layers summary").click();
    await until(async () => (await picture(noise)) !== before);
    assert.equal(await noise.locator(".line-key .drag").count(), 1);
  });
  await noise.close();
  const paper = await open("paper/report.html", 1280, 720);
  await check("the paper's scene has the paper's figures, as far as the run goes", async () => {
    const pictures = paper.locator("[data-figure=snapshots] img");
    assert.equal(await pictures.count(), 2); // at 0 and 1.5 s of 2 s
    const sources = await pictures.evaluateAll((list) => list.map((p) => p.src));
    assert.ok(sources.every((s) => s.startsWith("data:image/png") && s.length > 5000));
    assert.notEqual(sources[0], sources[1]);
    assert.equal(await paper.locator("[data-figure=powers] canvas").count(), 1);
    assert.equal(await paper.evaluate(() => Number(document.getElementById("app").dataset.time)), 0, "the replay stands where it was");
  });
  await paper.close();
  const tuned = await open("tuned/report.html", 1280, 720, false);
  await check("what was tuned is told, with the search's way", async () => {
    assert.equal(await tuned.locator("[data-figure=search] canvas").count(), 1);
    assert.match(await tuned.locator("text=Tuned on reach").locator("..").innerText(), /Cost before/);
  });
  await tuned.close();
  const bare = await open("bare/report.html", 1280, 720);
  await check("results without shapes say why there are no bodies", async () => {
    assert.match(await bare.locator(".hint").innerText(), /--shape-every 0/);
  });
  await bare.close();
  const still = await open("static/report.html", 1280, 720);
  await check("an equilibrium is drawn, with its path", async () => {
    assert.ok((await still.locator(".plot").count()) >= 2);
    assert.match(await still.locator(".transport").innerText(), /nothing moves/);
  });
  await still.close();
  assert.deepEqual(complaints, []);
  console.log("ok - nothing is complained of, nothing asked for");
} finally {
  await browser.close();
}
