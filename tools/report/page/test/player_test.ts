import assert from "node:assert/strict";
import test from "node:test";
import { Player } from "../src/player";

test("it plays at its speed and stops at the end", () => {
  const player = new Player(2);
  player.toggle();
  player.shiftSpeed(1); // 2x
  player.advance(0.5);
  assert.equal(player.time, 1);
  player.advance(10);
  assert.equal(player.time, 2);
  assert.equal(player.playing, false);
});

test("play at the end begins again", () => {
  const player = new Player(2);
  player.seek(5);
  assert.equal(player.time, 2);
  player.toggle();
  assert.equal(player.time, 0);
  assert.equal(player.playing, true);
});

test("what stands still cannot be played", () => {
  const player = new Player(0);
  player.toggle();
  assert.equal(player.playing, false);
});

test("listeners hear of every change, and a pause lets time stand", () => {
  const player = new Player(2);
  let heard = 0;
  player.listen(() => ++heard);
  player.seek(1);
  player.advance(1);
  assert.equal(player.time, 1);
  player.shiftSpeed(-100);
  assert.ok(player.speed > 0);
  assert.equal(heard, 2);
});
