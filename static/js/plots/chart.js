// The frame of a small chart over time, and the scales that live and recorded trends share.

import { C, size } from "../theme.js";
import { number, scale, ticks } from "../axis.js";
import { label, segment } from "../pen.js";
import { state } from "../state.js";

export const FAR = 5; // m
export const OLD = 0.5; // s
export const STALE_JOINTS = 0.2; // s

/** Distances of the levels [m]. */
export const limits = () => state.site?.safety ?? { slow_below: 0.8, stop_below: 0.2 };

/** Draws the frame; each axis is {from, to, marks: [[value, text], ..]}. Returns {box, x, y, unit}. */
export function frame(g, { left, right, height }, across, up, title, unit, width = 2) {
  const t = size("tick");
  const box = { left: left + Math.round(width * t), right: right - 4, top: 2 + Math.round(1.3 * t), bottom: height - Math.round(1.4 * t) };
  const y = scale(up.from, up.to, box.bottom, box.top);
  const x = scale(across.from, across.to, box.left, box.right);
  g.fillStyle = C.free;
  g.fillRect(box.left, box.top, box.right - box.left, box.bottom - box.top);
  for (const [value, text] of up.marks) {
    const at = Math.round(y(value)) + 0.5;
    segment(g, box.left, at, box.right, at, C.grid);
    label(g, text, box.left - 5, at, { align: "right", base: "middle" });
  }
  for (const [value, text] of across.marks) {
    const at = Math.round(x(value)) + 0.5;
    if (at > box.left + 1 && at < box.right - 1) segment(g, at, box.top, at, box.bottom, C.grid);
    const last = at > box.right - t, first = at < box.left + t;
    label(g, text, last ? box.right : first ? box.left : at, box.bottom + 2, { align: last ? "right" : first ? "left" : "center", base: "top" });
  }
  label(g, title, box.left, 1, { base: "top", colour: C.second });
  return { box, x, y, unit };
}

/** Round ticks of at most `most` from low to high, and the ends moved out to them. */
export function upward(low, high, most) {
  const steps = [0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000];
  const step = steps.find((s) => (high - low) / s <= most) ?? 10000;
  const from = Math.floor(low / step + 1e-6) * step, to = Math.max(from + step, Math.ceil(high / step - 1e-6) * step);
  return { from, to, marks: ticks(from, to, most + 2, [step]).map((v) => [v, number(v, step < 0.1 ? 2 : step < 1 ? 1 : 0)]) };
}

/** Points of a series, thinned to one a pixel, broken where there is none. */
export function points({ box, x, y }, times, values) {
  const step = Math.max(1, Math.floor(times.length / Math.max(1, box.right - box.left)));
  const found = [];
  for (let i = 0; i < times.length; i += step) found.push(Number.isFinite(values[i]) ? [x(times[i]), y(Math.min(Math.max(values[i], y.from), y.to))] : null);
  return found;
}

/** A curve through points [x, y] in pixels, broken at nulls, clipped to the box. */
export function curve(g, { box }, points, colour, width, dash = null) {
  g.save();
  g.beginPath();
  g.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
  g.clip();
  g.beginPath();
  let pen = false;
  for (const point of points) {
    if (point === null) pen = false;
    else if (pen) g.lineTo(point[0], point[1]);
    else {
      g.moveTo(point[0], point[1]);
      pen = true;
    }
  }
  if (dash) g.setLineDash(dash);
  g.lineWidth = width;
  g.strokeStyle = colour;
  g.lineJoin = "round";
  g.stroke();
  g.restore();
}

/** Where something was unknown: dashed, with a question mark, never an empty good-looking gap. */
export function unknownBox(g, box, x0, x1) {
  g.fillStyle = "rgba(255, 107, 94, 0.10)";
  g.fillRect(x0, box.top, x1 - x0, box.bottom - box.top);
  g.setLineDash([5, 4]);
  g.lineWidth = 1.5;
  g.strokeStyle = C.unknown;
  g.strokeRect(x0 + 1, box.top + 1, Math.max(0, x1 - x0 - 2), box.bottom - box.top - 2);
  g.setLineDash([]);
  if (x1 - x0 > 12) label(g, "?", (x0 + x1) / 2, (box.top + box.bottom) / 2, { align: "center", base: "middle", name: "t3", colour: C.unknown, weight: 700 });
}
