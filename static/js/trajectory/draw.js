// A trajectory on the plan view, and the goal that is clicked there. No machine moves by a click.

import { C } from "../theme.js";
import { label, segment } from "../pen.js";
import { number } from "../axis.js";
import { chart } from "../plots/plan_layers.js";
import { drawing } from "../gauge/drawing.js";
import { $ } from "../words.js";
import * as model from "./model.js";

let open = false;
let height = 0; // of the goal over the ground that the machine stands on [m]
let changed = () => {};

export const setOpen = (on) => {
  open = on;
};
export const setHeight = (metres) => {
  height = metres;
};

function line(g, points, colour, width, dash = null) {
  if (points.length < 2) return;
  g.save();
  g.lineJoin = "round";
  for (const [w, ink] of [[width + 2.5, C.halo], [width, colour]]) {
    g.beginPath();
    for (const point of points) g.lineTo(...chart.at(point));
    g.setLineDash(w > width ? [] : dash ?? []);
    g.lineWidth = w;
    g.strokeStyle = ink;
    g.stroke();
  }
  g.restore();
}

function dot(g, point, radius, fill) {
  const [x, y] = chart.at(point);
  g.beginPath();
  g.arc(x, y, radius, 0, 2 * Math.PI);
  [g.fillStyle, g.strokeStyle, g.lineWidth] = [fill, C.halo, 2];
  g.fill();
  g.stroke();
}

/** The goal: a ring with a cross, and its height in words. */
function target(g, point, text) {
  const [x, y] = chart.at(point);
  for (const [w, ink] of [[5, C.halo], [2, "#FFFFFF"]]) {
    g.beginPath();
    g.arc(x, y, 8, 0, 2 * Math.PI);
    g.lineWidth = w;
    g.strokeStyle = ink;
    g.stroke();
    segment(g, x - 13, y, x + 13, y, ink, w - 1);
    segment(g, x, y - 13, x, y + 13, ink, w - 1);
  }
  const right = x < 0.65 * chart.box.right;
  label(g, text, x + (right ? 11 : -11), y + 9, { align: right ? "left" : "right", base: "top", colour: C.text, halo: true });
}

/** Fig. 5 of Yamashita and Kikuuwe 2025, on the plan: the simple way, and the one that was planned. Returns what it drew, or null. */
export function drawTrajectory(g) {
  if (!open) return null;
  const document = model.document(), offer = model.offer(), picked = model.picked();
  const path = document?.ok ? document.end_point : [];
  const simple = document?.figures?.initial.end_point ?? [];
  const stale = Boolean(offer) && ["void", "unknown", "none"].includes(offer.state);
  line(g, simple, C.second, 1.5, [2, 4]);
  line(g, path, stale ? C.stale : "#FFFFFF", 2.5, stale ? [6, 5] : null);
  const goal = picked ?? offer?.goal ?? null;
  if (goal) target(g, goal, `goal ${number(height, 1)} m up`);
  const follow = model.follow();
  let at = null;
  if (path.length && follow && follow.plan === offer.plan && !follow.arrived) at = path[model.row(follow.at)];
  else if (path.length && model.shown()) at = path[model.row(model.time())];
  if (at) dot(g, at, 5, follow ? C.remote : C.text);
  return { plan: offer?.plan ?? null, state: offer?.state ?? null, goal, path: path.length, simple: simple.length, at, px: chart.px, middle: chart.at(chart.view.centre) };
}

function onClick(event) {
  if (!open || drawing() || !chart.at || model.following() || !model.mayAsk()) return;
  const box = $("plan").getBoundingClientRect();
  const [x, y] = [event.clientX - box.left, event.clientY - box.top];
  const { left, right, top, bottom } = chart.box;
  if (x < left || x > right || y < top || y > bottom) return;
  model.pick(chart.back(x, y));
  changed();
}

export function startDrawing(onChange) {
  changed = onChange;
  $("plan").addEventListener("click", onClick);
}
