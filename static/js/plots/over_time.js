// What plots of a plan over its time share: frame, legend, the moment that is shown, values under the pointer.

import { C, size } from "../theme.js";
import { number, ticks } from "../axis.js";
import { clear, legend, legendWidth, message, segment } from "../pen.js";
import { frame } from "./chart.js";

export const INKS = ["#D2C394", "#9FB9CC", "#BFB0CF", "#A9C4AC", "#CDAFA3", "#E6EAED"];

/** A legend in one row, or two where one is not enough; how many. */
export function entries(g, width, height, list) {
  const t = size("tick");
  const rows = legendWidth(g, list, 6) > width - 8 ? [list.slice(0, Math.ceil(list.length / 2)), list.slice(Math.ceil(list.length / 2))] : [list];
  rows.forEach((row, k) => legend(g, 4, height - (rows.length - k - 0.4) * 1.15 * t, width - 6, row, 6));
  return rows.length;
}

/** The frame over `end` seconds, with room for `rows` of a legend below. */
export function overTime(g, width, height, rows, up, title, unit, end, left = 2.4) {
  const t = size("tick");
  const marks = ticks(0, end, Math.max(2, width / (5 * t)), [1, 2, 5, 10, 20, 50, 100]).map((v) => [v, `${number(v, 0)} s`]);
  return frame(g, { left: 2, right: width - 2, height: height - rows * 1.15 * t - 2 }, { from: 0, to: end, marks }, up, title, unit, left);
}

/** The moment that is shown [s]. */
export function needle(g, { box, x }, moment) {
  const at = x(moment);
  segment(g, at, box.top, at, box.bottom, C.halo, 4);
  segment(g, at, box.top, at, box.bottom, "#FFFFFF", 1.5, [4, 2]);
}

export function empty(g, width, height, kind, text) {
  clear(g, width, height);
  message(g, width, height, text);
  return { state: { kind, plan: null }, age: 0, label: text };
}

/** The value that belongs to a moment. */
export const at = (times, values, t) => {
  let k = times.findIndex((one) => one > t);
  if (k < 0) k = times.length;
  return values[Math.max(0, k - 1)];
};

/** The moment under the pointer, null outside. */
export function timeAt(chart, px, py) {
  if (!chart) return null;
  const { box, x } = chart;
  return px < box.left || px > box.right || py < box.top || py > box.bottom ? null : x.inverse(px);
}
