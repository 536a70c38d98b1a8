// Sticks on the screen, for fingers: each springs back when it is let go, and nothing moves unless ENABLE is held.

import { $, mark, write } from "../words.js";
import { isBlocked, isFree, percent } from "../plots/arrow.js";
import { outside, zero } from "./deflection.js";

const DEAD = 0.08; // of the way: a finger never rests exactly in the middle

const held = new Map(); // pointer -> {pad}
let deflection = zero();
const enablers = new Set(); // pointers on ENABLE
let cancelled = false;
let changed = () => {};

export const open = () => !$("screen-sticks").hidden;

/** `space`: the keyboard's dead-man, for who has a mouse and so one pointer only. */
export function read(space) {
  if (!open()) return { deflection: zero(), enable: false };
  const reading = { deflection: { ...deflection }, enable: enablers.size > 0 || space, cancelled };
  cancelled = false;
  return reading;
}

export function releaseAll() {
  if (held.size || enablers.size) cancelled = true;
  held.clear();
  enablers.clear();
  deflection = zero();
  draw();
}

function draw() {
  for (const pad of document.querySelectorAll("#screen-sticks .pad")) {
    const [x, y] = [pad.dataset.x, pad.dataset.y].map((name) => (name ? deflection[name] : 0));
    pad.firstElementChild.style.transform = `translate(${(x * 50).toFixed(1)}cqw, ${(-y * 50).toFixed(1)}cqh)`;
  }
  mark($("screen-enable"), "held", enablers.size ? 1 : 0);
}

/** Where a finger is on a pad, -1..1 each way. */
function follow(event) {
  const { pad } = held.get(event.pointerId);
  const box = pad.getBoundingClientRect();
  const share = (at, low, size) => outside((2 * (at - low)) / size - 1, DEAD);
  if (pad.dataset.x) deflection[pad.dataset.x] = share(event.clientX, box.left, box.width);
  if (pad.dataset.y) deflection[pad.dataset.y] = 0 - share(event.clientY, box.top, box.height);
  draw();
}

function capture(element, event) {
  event.preventDefault();
  element.setPointerCapture(event.pointerId);
}

function letGo(event) {
  const hold = held.get(event.pointerId);
  if (hold) {
    held.delete(event.pointerId);
    for (const name of [hold.pad.dataset.x, hold.pad.dataset.y]) if (name) deflection[name] = 0;
  } else if (!enablers.delete(event.pointerId)) return;
  if (event.type !== "pointerup") cancelled = true;
  draw();
  changed();
}

export function toggle(show = !open()) {
  if (!show && open()) releaseAll();
  $("screen-sticks").hidden = !show;
  mark(document.body, "sticks", show ? 1 : 0);
  changed();
}

/** Beside each way of a pad what it moves, and how much of it is allowed. */
export function label(levers) {
  if (!open()) return;
  for (const { lever, way, joint, word, allowed } of levers) {
    const place = document.querySelector(`#screen-sticks [data-lever="${lever}"] [data-way="${way}"]`);
    const free = isFree(allowed);
    write(place, `${lever.startsWith("track") ? word : `${joint} ${word}`}${free ? "" : isBlocked(allowed) ? " ✕" : ` ${percent(allowed)}`}`);
    mark(place, "limit", free ? "free" : isBlocked(allowed) ? "blocked" : "limited");
  }
}

export function startScreen(onChange) {
  changed = onChange;
  for (const pad of document.querySelectorAll("#screen-sticks .pad")) {
    pad.addEventListener("pointerdown", (event) => {
      if ([...held.values()].some((one) => one.pad === pad)) return; // a second finger changes nothing
      capture(pad, event);
      held.set(event.pointerId, { pad });
      follow(event);
    });
    pad.addEventListener("pointermove", (event) => held.has(event.pointerId) && follow(event));
  }
  const enable = $("screen-enable");
  enable.addEventListener("pointerdown", (event) => {
    capture(enable, event);
    enablers.add(event.pointerId);
    draw();
    changed();
  });
  for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) $("screen-sticks").addEventListener(type, letGo);
  $("screen-sticks").addEventListener("contextmenu", (event) => event.preventDefault());
}
