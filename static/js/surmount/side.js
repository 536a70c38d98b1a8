// The manoeuvre from the side: the step, the machine at the moment that is shown, its centre of mass and the bucket's pivot, true to scale.

import { C, rgba, size } from "../theme.js";
import { metres, number, ticks } from "../axis.js";
import { clear, label, legend, message, swatches } from "../pen.js";
import { ring, star } from "../glyphs.js";
import { curve, frame } from "../plots/chart.js";
import { described, machine, state } from "../state.js";
import { surface } from "../surface.js";
import { at } from "../plots/over_time.js";
import { $ } from "../words.js";
import { rowAt } from "../trajectory/preview.js";
import * as model from "./model.js";

const PARTS = { tracks: 0.85, upper: 0.3 }; // how opaque; the rest in between
const rounded = (v) => Math.round(v * 100) / 100;
let chart = null;
let wanted = () => null; // the step that the fields say

/** The step: {height, distance, depth} from where P_b was first. */
const stepOf = () => model.document()?.obstacle ?? model.offer()?.obstacle ?? wanted();

/** The ground's line through a step. */
function profile({ height, distance, depth }, from, to) {
  const end = depth === null || depth === undefined ? to + 1 : distance + depth;
  return [[from - 1, 0], [distance, 0], [distance, height], [end, height], [end, 0], [to + 1, 0]];
}

/** The machine as the snapshot tells it, before there is a manoeuvre: its tracks and the end point. */
function present() {
  const m = machine(state.own), length = described(state.own)?.tracks?.length;
  if (!m?.position || !m.end_point || !Number.isFinite(m.yaw)) return null;
  const d = [m.end_point[0] - m.position[0], m.end_point[1] - m.position[1]];
  const tip = [d[0] * Math.cos(m.yaw) + d[1] * Math.sin(m.yaw), m.end_point[2] - m.position[2]];
  const half = (length ?? 2) / 2;
  return { tip, tracks: [[-half, 0], [half, 0], [half, 0.2 * half], [-half, 0.2 * half]] };
}

const spread = (points, k) => [Math.min(...points.map((p) => p[k])), Math.max(...points.map((p) => p[k]))];
const kept = { side: null, room: null };

/** What the largest of all moments needs: width, low and high [m]. The window goes along with the machine, its scale stays. */
function room(side) {
  if (kept.side === side) return kept.room;
  let width = 0, low = -0.1, high = 1;
  for (const [k, outlines] of side.outlines.entries()) {
    const points = [...outlines.flat(), ...side.pivots[k]];
    const [a, b] = spread(points, 0), [c, d] = spread(points, 1);
    [width, low, high] = [Math.max(width, b - a), Math.min(low, c), Math.max(high, d)];
  }
  Object.assign(kept, { side, room: { width: 1.15 * width, low: low - 0.1, high: high + 0.1 } });
  return kept.room;
}

/** The window: {width, low, high, middle} [m], of the moment in row k, or of the machine as it stands before the step. */
function view(side, k, step, now) {
  if (side) {
    const [a, b] = spread([...side.outlines[k].flat(), ...side.pivots[k]], 0);
    return { ...room(side), middle: (a + b) / 2 };
  }
  const points = [...now.tracks, now.tip, ...(step ? [[step.distance + 0.5, step.height]] : [])];
  const [a, b] = spread(points, 0), [c, d] = spread(points, 1);
  return { width: 1.1 * (b - a), low: Math.min(c, 0) - 0.2, high: Math.max(d, 1) + 0.2, middle: (a + b) / 2 };
}

function fill(g, { x, y }, points, colour, width = 1.2) {
  g.beginPath();
  for (const [a, b] of points) g.lineTo(x(a), y(b));
  g.closePath();
  g.fillStyle = colour;
  g.fill();
  g.lineWidth = width;
  g.strokeStyle = C.text;
  g.stroke();
}

function paint(g, width, tall) {
  clear(g, width, tall);
  const side = model.side(), step = stepOf(), now = side ? null : present();
  if (!side && !now) {
    chart = null;
    message(g, width, tall, "place unknown");
    return { state: { kind: "side", plan: null }, age: Infinity, label: "Side view: the machine's place is unknown" };
  }
  const t = size("tick");
  const moment = model.moment(), k = side ? rowAt(side.time, moment) : 0;
  const { width: wide, low, high, middle } = view(side, k, step, now);
  const bottom = tall - 1.15 * t - 2;
  const inner = { w: width - 4 - 2.2 * t - 4, h: bottom - 2.7 * t - 2 };
  // One scale for both, or a step looks higher than it is.
  const px = Math.min(inner.w / wide, inner.h / (high - low));
  const half = inner.w / px / 2, from = [middle - half, low], to = [middle + half, low + inner.h / px];
  const axis = (n, most) => {
    const list = ticks(from[n], to[n], most, [0.1, 0.2, 0.5, 1, 2, 5, 10]);
    return { from: from[n], to: to[n], marks: list.map((v) => [v, number(v, list.length > 1 && list[1] - list[0] < 0.99 ? 1 : 0)]) };
  };
  chart = frame(g, { left: 2, right: width - 2, height: bottom }, axis(0, Math.max(2, width / (4 * t))), axis(1, 5), "along →, height ↑, m", "m", 2.2);
  const { box, x, y } = chart;
  g.save();
  g.beginPath();
  g.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
  g.clip();
  const line = step ? profile(step, from[0], to[0]) : [[from[0] - 1, 0], [to[0] + 1, 0]];
  g.beginPath();
  for (const [a, b] of [...line, [to[0] + 1, from[1] - 1], [from[0] - 1, from[1] - 1]]) g.lineTo(x(a), y(b));
  g.closePath();
  g.fillStyle = "rgba(62, 142, 120, 0.45)";
  g.fill();
  g.restore();
  curve(g, chart, line.map(([a, b]) => [x(a), y(b)]), C.site, 2);
  let com = null, pivot = null, parts = 0;
  if (side) {
    const figures = model.document()?.figures;
    g.save();
    g.beginPath();
    g.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
    g.clip();
    side.outlines[k].forEach((outline, p) => {
      parts += 1;
      fill(g, chart, outline, side.parts[p] === "tracks" ? rgba("#0F1418", 0.8) : rgba(C.partnerLine, PARTS[side.parts[p]] ?? 0.45));
    });
    g.restore();
    if (figures?.com.length) {
      curve(g, chart, figures.com.map(([a, b]) => [x(a), y(b)]), C.second, 1.2, [2, 3]);
      com = at(figures.time, figures.com, moment);
      star(g, x(com[0]), y(com[1]), false, 7);
    }
    pivot = side.pivots[k][side.pivots[k].length - 2];
    ring(g, x(pivot[0]), y(pivot[1]), 4);
  } else {
    fill(g, chart, now.tracks, rgba(C.second, 0.5));
    ring(g, x(now.tip[0]), y(now.tip[1]), 4);
  }
  if (step) label(g, `step ${metres(Math.abs(step.height))} ${step.height < 0 ? "down" : "up"}`, box.left + 4, box.top + 2, { base: "top", halo: true });
  const swatch = (draw) => swatches.glyph(draw);
  legend(g, 4, tall - 0.6 * t, width - 6, [...(side ? [[swatch((c, px_, py) => star(c, px_, py, false, 6)), "CoM"]] : []), [swatch((c, px_, py) => ring(c, px_, py, 4)), side ? "bucket pivot" : "end point"], [swatches.line(C.site, null, 2), "ground"]], 6);
  return {
    state: { kind: "side", plan: model.offer()?.plan ?? null, step: step && { height: step.height, distance: step.distance }, window: [rounded(from[0]), rounded(to[0])], time: rounded(moment), parts, com, pivot, scale: Math.round(px) },
    age: 0,
    label: `Side view, true to scale${step ? `: a step ${metres(Math.abs(step.height))} ${step.height < 0 ? "down" : "high"}, ${metres(step.distance)} ahead` : ""}${com ? `; centre of mass ${metres(com[0])} along, ${metres(com[1])} up` : ""}`,
  };
}

function probe(px, py) {
  if (!chart) return null;
  const { box, x, y } = chart;
  if (px < box.left || px > box.right || py < box.top || py > box.bottom) return null;
  return [`${number(x.inverse(px), 2)} m along, ${number(y.inverse(py), 2)} m up from where the tracks' middle was first`];
}

/** step: what the fields say, {height, distance, depth}, or null. */
export function startSide(step) {
  wanted = step;
  return surface($("so-plot-side"), paint, probe);
}
