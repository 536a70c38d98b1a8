// The last 60 s: clearance to the partner, the age of the joint data of the two machines, and the own machine's round trip.

import { C, size } from "../theme.js";
import { metres, number, ticks } from "../axis.js";
import { clear, label, legend, message, segment, swatches } from "../pen.js";
import { FAR, OLD, STALE_JOINTS, curve, frame, limits, unknownBox } from "./chart.js";
import { $ } from "../words.js";
import { label as nameOf, replaying, silence, snapshotAge, state } from "../state.js";
import { surface } from "../surface.js";
import { ageText } from "../head.js";
import * as along from "./along.js";
import * as people from "./people.js";
import * as series from "./series.js";

const SPAN = 60;

let frames = []; // the two plots, for the pointer

const timeMarks = ticks(-SPAN, 0, 4, [20]).map((value) => [value, value === 0 ? "now" : `−${-value} s`]);
const half = (g, left, right, height, top, unit, marks, title) =>
  frame(g, { left, right, height }, { from: -SPAN, to: 0, marks: timeMarks }, { from: 0, to: top, marks: marks.map((value) => [value, number(value, unit === "s" ? 1 : 0)]) }, title, unit);

const line = (g, chart, now, value, ...style) => curve(g, chart, state.history.map((point) => {
  const v = value(point);
  return v === null || v === undefined ? null : [chart.x(point.time - now), chart.y(Math.min(v, chart.y.to))];
}), ...style);

function unknown(g, { box, x }, now) {
  let from = null;
  const end = (to) => {
    if (from === null) return;
    const x0 = Math.max(box.left, x(from - now)), x1 = Math.min(box.right, x(to - now));
    unknownBox(g, box, x0, x1);
    from = null;
  };
  for (const p of state.history) {
    if (p.distance === null) from ??= p.time;
    else end(p.time);
  }
  if (silence() > 1) from ??= state.history[state.history.length - 1]?.time ?? now;
  end(now);
}

function below(g, { box, x, y }, now, threshold, colour) {
  const h = state.history;
  g.lineWidth = 3;
  g.strokeStyle = colour;
  g.beginPath();
  for (let i = 1; i < h.length; i++) {
    const a = h[i - 1].distance, b = h[i].distance;
    if (a === null || b === null || Math.min(a, b) >= threshold) continue;
    g.moveTo(Math.max(box.left, x(h[i - 1].time - now)), y(Math.min(Math.max(a, 0), FAR)));
    g.lineTo(Math.max(box.left, x(h[i].time - now)), y(Math.min(Math.max(b, 0), FAR)));
  }
  g.stroke();
}

function paint(g, width, height) {
  clear(g, width, height);
  const s = state.snapshot;
  if (!s) {
    message(g, width, height, "no data yet");
    return { state: {}, age: Infinity, label: "Trends: no data yet" };
  }
  const now = s.time + Math.min(silence(), SPAN);
  const t = size("tick");
  const middle = Math.round(width / 2);
  const { slow_below: slow, stop_below: stop } = limits();
  const clearance = half(g, 4, middle - 4, height, FAR, "m", [0, 1, 2, 3, 4, 5], `clearance to ${nameOf(state.partner)}, m`);
  const ages = half(g, middle + 4, width - 4, height, OLD, "s", [0, 0.1, 0.2, 0.3, 0.4, 0.5], "joint age, s");
  frames = [clearance, ages];
  for (const [value, text, shift] of [[slow, "slow", 0], [stop, "stop", 4.6 * t]]) {
    const y = Math.round(clearance.y(value)) + 0.5;
    segment(g, clearance.box.left, y, clearance.box.right, y, C.edge, 1, [4, 4]);
    label(g, `${text} ${number(value, 1)}`, clearance.box.left + 4 + shift, y - 2, { halo: true });
  }
  line(g, clearance, now, (p) => p.distance, C.text, 2);
  below(g, clearance, now, slow, C.slow);
  below(g, clearance, now, stop, C.stopLine);
  unknown(g, clearance, now);
  const y = Math.round(ages.y(STALE_JOINTS)) + 0.5;
  segment(g, ages.box.left, y, ages.box.right, y, C.edge, 1, [4, 4]);
  label(g, "stale 0.2", ages.box.left + 4, y - 2, { halo: true });
  const styles = [[state.own, C.text, 2, null], [state.partner, C.partnerLine, 2, [5, 3]]].filter(([name]) => name);
  for (const [name, colour, w, dash] of [...styles].reverse()) line(g, ages, now, (p) => p.ages[name] ?? OLD, colour, w, dash);
  const driven = state.history.some((p) => p.trip !== null);
  if (driven) line(g, ages, now, (p) => p.trip, C.remote, 2, [2, 2]);
  const trip = driven ? [[swatches.line(C.remote, [2, 2], 2), "round trip"]] : [];
  legend(g, ages.box.left + 6.6 * t, 1 + 0.55 * t, ages.box.right - ages.box.left - 6.6 * t, [...styles.map(([name, colour, w, dash]) => [swatches.line(colour, dash, w), nameOf(name)]), ...trip]);
  const last = state.history[state.history.length - 1];
  const age = snapshotAge();
  const known = state.history.map((p) => p.distance).filter((d) => d !== null);
  return {
    state: { own: state.own, partner: state.partner, points: state.history.length, clearance: last?.distance ?? null, ages: last?.ages ?? {}, trip: last?.trip ?? null },
    age,
    label: `Clearance over 60 s: now ${last?.distance === null || !last ? "unknown" : metres(last.distance)}, least ${known.length ? metres(Math.min(...known)) : "unknown"}; ${ageText(age)}`,
  };
}

function probe(x, y) {
  const hit = frames.find(({ box }) => x >= box.left && x <= box.right && y >= box.top && y <= box.bottom);
  if (!hit || !state.history.length) return null;
  const ago = hit.x.inverse(x);
  const now = state.snapshot.time + Math.min(silence(), SPAN);
  const p = state.history.reduce((a, b) => (Math.abs(b.time - now - ago) < Math.abs(a.time - now - ago) ? b : a));
  const lines = [`${number(now - p.time, 1)} s ago`];
  if (hit.unit === "m") lines.push(`clearance ${p.distance === null ? "unknown" : metres(p.distance)}`);
  else for (const [name, age] of Object.entries(p.ages)) lines.push(`${nameOf(name)} joints ${age === null ? "never received" : `${number(age * 1000, 0)} ms old`}`);
  if (hit.unit !== "m" && p.trip !== null) lines.push(`${nameOf(state.own)} commands ${number(p.trip * 1000, 0)} ms there and back`);
  return lines;
}

/** Live the last minute, people, or the strip along the track; of a recorded session whatever part of it is asked for, or people. */
const shown = () => (people.shown() ? people : replaying() ? series : along.shown() ? along : { paint, probe });
export const trends = () => surface($("trends"), (...given) => shown().paint(...given), (x, y) => shown().probe(x, y));
