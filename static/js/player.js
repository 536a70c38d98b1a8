// What the operator asks of the player. Each message names what is wanted, so that asking twice does no harm.

import { replaying, state } from "./state.js";

const PERIOD = 100; // ms between two seeks, the latest wins
const PATIENCE = 1500; // ms that the page shows what was asked for before the player does it
const NEAR = 0.3; // s
export const SPEEDS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50];
const AROUND = 5; // s each way of a loop that was not marked

let send = () => {};
const asked = new Map(); // playing, speed, source, loop -> {value, since}
let target = null; // {time, since} of a seek the player has not reached
let dragged = false;
let lastSeek = -Infinity, timer = null;
let lastLoop = null;

export const startPlayer = (give) => {
  send = give;
};

export const playback = () => (replaying() ? state.snapshot?.playback ?? null : null);

function tell(what, value) {
  if (playback()) send({ type: "playback", do: what, ...(value === undefined ? {} : { value }) });
}

const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

/** playing, speed, source or loop: as asked for just now, else as the player says. */
export function current(what) {
  const said = playback()?.[what];
  const ask = asked.get(what);
  if (ask && !same(ask.value, said) && performance.now() - ask.since < PATIENCE) return ask.value;
  asked.delete(what);
  return said;
}

function ask(what, value) {
  asked.set(what, { value, since: performance.now() });
}

/** Where the cursor is drawn: at the target until the player is there. */
export function cursor() {
  const p = playback();
  if (!p) return NaN;
  if (target && !dragged) {
    const waited = performance.now() - target.since;
    const way = p.time - target.time;
    const played = p.playing ? (p.speed * waited) / 1000 : 0;
    const there = timer === null && state.arrival > target.since && way > -NEAR && way < NEAR + played;
    if (there || waited > PATIENCE) target = null;
  }
  return target ? target.time : p.time;
}

export const dragging = () => dragged;
/** True while the player has not reached what was asked for. */
export const seeking = () => Number.isFinite(cursor()) && target !== null;

function flush() {
  timer = null;
  if (!target) return;
  lastSeek = performance.now();
  tell("seek", Math.round(target.time * 1000) / 1000);
}

const within = (time) => Math.min(Math.max(time, 0), playback()?.duration ?? 0);

/** Seconds since the beginning. `held`: the pointer is still down. */
export function seek(time, held = false) {
  if (!playback() || !Number.isFinite(time)) return;
  dragged = held;
  target = { time: within(time), since: performance.now() };
  if (timer === null) timer = setTimeout(flush, Math.max(0, lastSeek + PERIOD - performance.now()));
}

export function drop() {
  dragged = false;
  if (target) target.since = performance.now();
}

export const jump = (by) => seek(cursor() + by);
export const toEnd = () => seek(playback()?.duration);

export function toggle() {
  if (!playback()) return;
  const playing = !current("playing");
  ask("playing", playing);
  tell(playing ? "play" : "pause");
}

function stepping(what) {
  target = null;
  ask("playing", false);
  tell(what);
}
export const step = () => stepping("step");
export const back = () => stepping("back");

function toEvent(what) {
  target = null;
  tell(what);
}
export const nextEvent = () => toEvent("next");
export const previousEvent = () => toEvent("previous");

export function setSpeed(value) {
  ask("speed", value);
  tell("speed", value);
}
export const faster = () => setSpeed(SPEEDS.find((s) => s > current("speed") + 1e-9) ?? SPEEDS[SPEEDS.length - 1]);
export const slower = () => setSpeed(SPEEDS.findLast((s) => s < current("speed") - 1e-9) ?? SPEEDS[0]);

export function setSource(value) {
  ask("source", value);
  tell("source", value);
}

export function setLoop(section) {
  const ends = section && section.map((t) => Math.round(within(t) * 1000) / 1000).sort((a, b) => a - b);
  if (ends && ends[1] - ends[0] < 0.1) return;
  if (ends) lastLoop = ends;
  ask("loop", ends);
  tell("loop", ends);
}

/** Off, or on again where it was; the first time around the cursor. */
export function toggleLoop() {
  if (current("loop")) setLoop(null);
  else if (playback()) setLoop(lastLoop ?? [cursor() - AROUND, cursor() + AROUND]);
}
