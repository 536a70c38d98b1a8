// At which height of the bucket tip the reach image is made: the present one, or one picked here.

import { $, write } from "./words.js";
import { number } from "./axis.js";
import { exactImage, state } from "./state.js";
import { page } from "./scene.js";

const STEP = 0.25; // m
const picks = new Map(); // machine -> {height: m or null, since: ms}
let send = () => {};

export const picked = (name) => picks.get(name)?.height ?? null;

/** Seconds since a height was asked for that the image does not show yet; null when it shows it. */
export function picking(name, { height, picked: is }) {
  const pick = picks.get(name);
  if (!pick) return null;
  const arrived = pick.height === null ? !is : is && Math.abs(height - pick.height) < 0.01;
  return arrived ? null : (performance.now() - pick.since) / 1000;
}

function pick(height) {
  picks.set(state.own, { height, since: performance.now() });
  send({ type: "tip_height", page, machine: state.own, height });
  update();
}

function step(by) {
  const from = picked(state.own) ?? exactImage()?.header.reach?.height;
  if (!Number.isFinite(from)) return;
  pick(Math.round(from / STEP) * STEP + by);
}

/** A server that was started anew knows no heights. */
export function resend() {
  for (const [machine, { height }] of picks) if (height !== null) send({ type: "tip_height", page, machine, height });
}

export function update() {
  const height = picked(state.own);
  write($("tip-now"), height === null ? "now" : `${number(height, 2)} m`);
  $("tip-now").setAttribute("aria-pressed", String(height !== null));
}

export function startTip(give) {
  send = give;
  $("tip-down").addEventListener("click", () => step(-STEP));
  $("tip-up").addEventListener("click", () => step(STEP));
  $("tip-now").addEventListener("click", () => pick(null));
}
