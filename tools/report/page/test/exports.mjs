// Exports opened by other programs' own readers: node test/exports.mjs PROGRAM SCENES WORK
import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { mkdirSync, readFileSync, rmSync } from "node:fs";
import { join, resolve } from "node:path";
import { McapStreamReader } from "@mcap/core";
import { AnimationMixer } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";

const [program, scenes, workFolder] = process.argv.slice(2);
const work = resolve(workFolder);
rmSync(work, { recursive: true, force: true });
mkdirSync(work, { recursive: true });
const mantle = (...args) => execFileSync(program, args, { cwd: work, stdio: ["ignore", "pipe", "inherit"], encoding: "utf8" });
mantle("run", join(scenes, "vehicle.toml"), "--set", "time.duration=0.4", "--out", "run");
const rows = readFileSync(join(work, "run/trajectory.csv"), "utf8").trim().split("\n");
const titles = rows[0].split(",");
const last = Object.fromEntries(rows.at(-1).split(",").map((cell, i) => [titles[i], Number(cell)]));
const shapes = rows.length - 1;

{
  mantle("export", "run", "--format", "mcap");
  const reader = new McapStreamReader();
  reader.append(readFileSync(join(work, "run.mcap")));
  const schemas = new Map();
  const channels = new Map();
  const messages = { "/mantle/shape": [], "/mantle/trajectory": [] };
  let before = 0n;
  for (let record = reader.nextRecord(); record !== undefined; record = reader.nextRecord()) {
    if (record.type === "Schema") schemas.set(record.id, JSON.parse(new TextDecoder().decode(record.data)) && record.name);
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type === "Statistics") assert.equal(record.messageCount, BigInt(2 * shapes));
    if (record.type !== "Message") continue;
    assert.ok(record.logTime >= before);
    before = record.logTime;
    messages[channels.get(record.channelId).topic].push(JSON.parse(new TextDecoder().decode(record.data)));
  }
  assert.ok(reader.done());
  assert.deepEqual([...schemas.values()], ["foxglove.SceneUpdate", "mantle.Trajectory"]);
  assert.equal(messages["/mantle/shape"].length, shapes);
  assert.equal(messages["/mantle/trajectory"].at(-1).root_z_m, last.root_z_m);
  const entities = messages["/mantle/shape"].at(-1).entities;
  assert.deepEqual(entities.map((e) => e.id), ["mantle", "arms", "rigid body", "cables"]);
  const mesh = entities[0].triangles[0];
  assert.ok(mesh.indices.every((i) => i >= 0 && i < mesh.points.length));
  console.log(`ok - mcap: ${shapes} shapes and rows, read by @mcap/core`);
}

{
  mantle("export", "run", "--format", "gltf", "--shapes", "5");
  const bytes = readFileSync(join(work, "run.glb"));
  globalThis.self ??= globalThis;
  const gltf = await new GLTFLoader().parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), "");
  const meshes = [];
  gltf.scene.traverse((object) => object.isMesh && meshes.push(object));
  assert.equal(meshes.length, 3); // mantle, arm, rigid body
  const clip = gltf.animations[0];
  assert.ok(Math.abs(clip.duration - 0.4) < 1e-6);
  const mixer = new AnimationMixer(gltf.scene);
  mixer.clipAction(clip).play();
  mixer.setTime(0.4 - 1e-7);
  // The apex of the mantle is its first vertex: on the root's axis, where the table says the root is.
  const mantle0 = meshes[0];
  const position = mantle0.geometry.attributes.position;
  const influences = mantle0.morphTargetInfluences;
  const apex = [0, 1, 2].map((k) => position.getComponent(0, k) +
    influences.reduce((sum, w, t) => sum + w * mantle0.geometry.morphAttributes.position[t].getComponent(0, k), 0));
  const far = Math.hypot(...["root_x_m", "root_y_m", "root_z_m"].map((name, k) => apex[k] - last[name]));
  assert.ok(far < 0.005, `${far} m from the root`);
  console.log("ok - gltf: meshes and their motion, read by three's GLTFLoader");
}

{
  // A film, read by ffmpeg's own tool; where Chromium or ffmpeg is missing the program says so.
  const film = spawnSync(program, ["export", "run", "--format", "mp4", "--fps", "10", "--picture", "320x240"], { cwd: work, encoding: "utf8" });
  if (film.status === 2 && /is not in PATH/.test(film.stderr)) {
    console.log(`skipped - mp4: ${film.stderr.trim()}`);
  } else {
    assert.equal(film.status, 0, film.stderr);
    const probe = ["-v", "error", "-select_streams", "v", "-show_entries", "stream=codec_name,width,height,nb_frames", "-of", "csv=p=0", "run.mp4"];
    assert.equal(execFileSync("ffprobe", probe, { cwd: work, encoding: "utf8" }).trim(), "h264,320,240,5");
    const picture = (seconds) =>
      execFileSync("ffmpeg", ["-v", "error", "-ss", String(seconds), "-i", "run.mp4", "-frames:v", "1", "-f", "rawvideo", "-pix_fmt", "gray", "-"], { cwd: work });
    const [first, later] = [picture(0), picture(0.4)];
    assert.equal(first.length, 320 * 240);
    const changed = first.filter((v, i) => Math.abs(v - later[i]) > 40).length;
    assert.ok(changed > 100, `${changed} pixels differ between the first picture and the last`);
    console.log("ok - mp4: pictures that move, read by ffmpeg");
  }
}
