// A polygon drawn on the plan: click corners, Enter or a double click closes it, Esc gives it up. No machine moves by it.

import { C, rgba } from "../theme.js";
import { $, mark } from "../words.js";
import { chart } from "../plots/plan_layers.js";

const SAME = 5, CLOSING = 9; // px: of a double click; to the first corner
const MOST = 40; // corners, as the server allows

let corners = []; // [[E, N], ..] in the site frame [m]
let kind = "";
let open = false; // still being drawn
let pointer = null;
let changed = () => {};

export const drawing = () => open;
export const drawn = () => (open || !corners.length ? null : { kind, polygon: corners });
export const count = () => corners.length;

export function begin(what) {
  corners = [];
  kind = what;
  open = true;
  tell();
  // Keys go on to the levers, and Enter must not press the button again.
  $("plan").focus();
}

export function giveUp() {
  corners = [];
  open = false;
  tell();
}

function close() {
  if (corners.length < 3) return;
  open = false;
  tell();
}

function tell() {
  mark(document.body, "drawing", open ? 1 : 0);
  changed();
}

const apart = (corner, [x, y]) => {
  const [u, v] = chart.at(corner);
  return Math.hypot(u - x, v - y);
};

function onClick(event) {
  if (!open || !chart.at) return;
  const box = $("plan").getBoundingClientRect();
  const at = [event.clientX - box.left, event.clientY - box.top];
  const { left, right, top, bottom } = chart.box;
  if (at[0] < left || at[0] > right || at[1] < top || at[1] > bottom) return;
  if (corners.length > 2 && apart(corners[0], at) < CLOSING) close();
  else if (event.detail > 1 && corners.length && apart(corners[corners.length - 1], at) < SAME) close();
  else if (corners.length < MOST) {
    corners = [...corners, chart.back(...at)];
    tell();
  }
}

/** True when the key was meant for the drawing. */
export function drawKey(event) {
  if (!open || event.target?.closest?.("dialog")) return false;
  if (event.key === "Enter") close();
  else if (event.key === "Escape") giveUp();
  else return false;
  event.preventDefault();
  return true;
}

export function paint(g) {
  if (!corners.length) return;
  const points = corners.map(chart.at);
  g.beginPath();
  for (const p of points) g.lineTo(...p);
  if (open && pointer) g.lineTo(...pointer);
  if (!open) g.closePath();
  g.fillStyle = rgba(C.site, 0.25);
  g.fill();
  g.lineWidth = 2;
  g.strokeStyle = C.text;
  g.stroke();
  g.fillStyle = C.text;
  for (const [x, y] of points) g.fillRect(x - 3, y - 3, 6, 6);
}

export function startDrawing(onChange) {
  changed = onChange;
  const canvas = $("plan");
  canvas.tabIndex = -1;
  canvas.addEventListener("click", onClick);
  canvas.addEventListener("pointermove", (event) => {
    const box = canvas.getBoundingClientRect();
    pointer = [event.clientX - box.left, event.clientY - box.top];
  });
  canvas.addEventListener("pointerleave", () => { pointer = null; });
}
