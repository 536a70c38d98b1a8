// The obstacle and the way over it on the plan view; a click on an obstacle picks it. No machine moves by a click.

import { C } from "../theme.js";
import { cross } from "../glyphs.js";
import { chart } from "../plots/plan_layers.js";
import { drawing } from "../gauge/drawing.js";
import { $ } from "../words.js";
import { rowAt } from "../trajectory/preview.js";
import * as model from "./model.js";
import * as obstacles from "./obstacles.js";

let open = false;
let changed = () => {};

export const setOpen = (on) => {
  open = on;
};

function trace(g, points, closed) {
  g.beginPath();
  for (const point of points) g.lineTo(...chart.at(point));
  if (closed) g.closePath();
}

function stroke(g, points, colour, width, dash = [], closed = false) {
  if (points.length < 2) return;
  g.save();
  g.lineJoin = "round";
  for (const [w, ink] of [[width + 2.5, C.halo], [width, colour]]) {
    trace(g, points, closed);
    g.setLineDash(w > width ? [] : dash);
    g.lineWidth = w;
    g.strokeStyle = ink;
    g.stroke();
  }
  g.restore();
}

/** Returns what it drew, or null. */
export function drawSurmount(g) {
  if (!open) return null;
  const document = model.document(), offer = model.offer();
  const name = offer ? offer.obstacle.name : model.obstacle();
  for (const outline of name ? obstacles.outlines(name) : []) stroke(g, outline, "#FFFFFF", 2.5, [], true);
  const stale = Boolean(offer) && ["void", "unknown", "none"].includes(offer.state);
  const base = document?.ok ? document.base : [];
  stroke(g, base, stale ? C.stale : "#FFFFFF", 2.5, stale ? [6, 5] : []);
  let at = null;
  if (base.length && (model.shown() || model.following())) {
    at = base[rowAt(document.time, model.moment())];
    cross(g, ...chart.at(at), model.following() ? C.remote : C.text, 6);
  }
  return { plan: offer?.plan ?? null, state: offer?.state ?? null, obstacle: name ?? null, base: base.length, at: at?.slice(0, 2) ?? null, px: chart.px, middle: chart.at(chart.view.centre) };
}

function onClick(event) {
  if (!open || drawing() || !chart.at || model.offer() || !model.mayAsk()) return;
  const box = $("plan").getBoundingClientRect();
  const [x, y] = [event.clientX - box.left, event.clientY - box.top];
  const { left, right, top, bottom } = chart.box;
  if (x < left || x > right || y < top || y > bottom) return;
  const name = obstacles.at(chart.back(x, y));
  if (!name) return;
  model.pick(name);
  changed();
}

export function startDrawing(onChange) {
  changed = onChange;
  $("plan").addEventListener("click", onClick);
}
