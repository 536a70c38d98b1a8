// The last 60 s: clearance to the partner, and the age of the joint data of the two machines.

import { C, size } from "../theme.js";
import { metres, number, scale, ticks } from "../axis.js";
import { clear, label, legend, message, segment, swatches } from "../pen.js";
import { $ } from "../words.js";
import { label as nameOf, silence, snapshotAge, state } from "../state.js";
import { surface } from "../surface.js";
import { ageText } from "../head.js";

const SPAN = 60;
const FAR = 5; // m
const OLD = 0.5; // s
const STALE_JOINTS = 0.2; // s

let frames = []; // the two plots, for the pointer

function frame(g, left, right, height, top, unit, marks, title) {
  const t = size("tick");
  const box = { left: left + Math.round(2 * t), right: right - 4, top: 2 + Math.round(1.3 * t), bottom: height - Math.round(1.4 * t) };
  const y = scale(0, top, box.bottom, box.top);
  const x = scale(-SPAN, 0, box.left, box.right);
  g.fillStyle = C.free;
  g.fillRect(box.left, box.top, box.right - box.left, box.bottom - box.top);
  for (const value of marks) {
    const at = Math.round(y(value)) + 0.5;
    segment(g, box.left, at, box.right, at, C.grid);
    label(g, number(value, unit === "s" ? 1 : 0), box.left - 5, at, { align: "right", base: "middle" });
  }
  for (const value of ticks(-SPAN, 0, 4, [20])) {
    const at = Math.round(x(value)) + 0.5;
    if (value < 0) segment(g, at, box.top, at, box.bottom, C.grid);
    label(g, value === 0 ? "now" : `−${-value} s`, value === 0 ? box.right : value === -SPAN ? box.left : at, box.bottom + 2, { align: value === 0 ? "right" : value === -SPAN ? "left" : "center", base: "top" });
  }
  label(g, title, box.left, 1, { base: "top", colour: C.second });
  return { box, x, y, unit };
}

function curve(g, { box, x, y }, now, value, colour, width, dash = null) {
  g.save();
  g.beginPath();
  g.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
  g.clip();
  g.beginPath();
  let pen = false;
  for (const point of state.history) {
    const v = value(point);
    if (v === null || v === undefined) {
      pen = false;
      continue;
    }
    const px = x(point.time - now), py = y(Math.min(v, y.to));
    if (pen) g.lineTo(px, py);
    else g.moveTo(px, py);
    pen = true;
  }
  if (dash) g.setLineDash(dash);
  g.lineWidth = width;
  g.strokeStyle = colour;
  g.lineJoin = "round";
  g.stroke();
  g.restore();
}

/** Where the clearance was unknown: dashed above, with question marks, never an empty good-looking gap. */
function unknown(g, { box, x }, now) {
  let from = null;
  const end = (to) => {
    if (from === null) return;
    const x0 = Math.max(box.left, x(from - now)), x1 = Math.min(box.right, x(to - now));
    g.fillStyle = "rgba(255, 107, 94, 0.10)";
    g.fillRect(x0, box.top, x1 - x0, box.bottom - box.top);
    g.setLineDash([5, 4]);
    g.lineWidth = 1.5;
    g.strokeStyle = C.unknown;
    g.strokeRect(x0 + 1, box.top + 1, Math.max(0, x1 - x0 - 2), box.bottom - box.top - 2);
    g.setLineDash([]);
    if (x1 - x0 > 12) label(g, "?", (x0 + x1) / 2, (box.top + box.bottom) / 2, { align: "center", base: "middle", name: "t3", colour: C.unknown, weight: 700 });
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
  const half = Math.round(width / 2);
  const { slow_below: slow, stop_below: stop } = s && state.site?.safety ? state.site.safety : { slow_below: 0.8, stop_below: 0.2 };
  const clearance = frame(g, 4, half - 4, height, FAR, "m", [0, 1, 2, 3, 4, 5], `clearance to ${nameOf(state.partner)}, m`);
  const ages = frame(g, half + 4, width - 4, height, OLD, "s", [0, 0.1, 0.2, 0.3, 0.4, 0.5], "joint age, s");
  frames = [clearance, ages];
  for (const [value, text, shift] of [[slow, "slow", 0], [stop, "stop", 4.6 * t]]) {
    const y = Math.round(clearance.y(value)) + 0.5;
    segment(g, clearance.box.left, y, clearance.box.right, y, C.edge, 1, [4, 4]);
    label(g, `${text} ${number(value, 1)}`, clearance.box.left + 4 + shift, y - 2, { halo: true });
  }
  curve(g, clearance, now, (p) => p.distance, C.text, 2);
  below(g, clearance, now, slow, C.slow);
  below(g, clearance, now, stop, C.stopLine);
  unknown(g, clearance, now);
  const y = Math.round(ages.y(STALE_JOINTS)) + 0.5;
  segment(g, ages.box.left, y, ages.box.right, y, C.edge, 1, [4, 4]);
  label(g, "stale 0.2", ages.box.left + 4, y - 2, { halo: true });
  const styles = [[state.own, C.text, 2, null], [state.partner, C.partnerLine, 2, [5, 3]]].filter(([name]) => name);
  for (const [name, colour, w, dash] of [...styles].reverse()) curve(g, ages, now, (p) => p.ages[name] ?? OLD, colour, w, dash);
  legend(g, ages.box.left + 6.6 * t, 1 + 0.55 * t, ages.box.right - ages.box.left - 6.6 * t, styles.map(([name, colour, w, dash]) => [swatches.line(colour, dash, w), nameOf(name)]));
  const last = state.history[state.history.length - 1];
  const age = snapshotAge();
  const known = state.history.map((p) => p.distance).filter((d) => d !== null);
  return {
    state: { own: state.own, partner: state.partner, points: state.history.length, clearance: last?.distance ?? null, ages: last?.ages ?? {} },
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
  return lines;
}

export const trends = () => surface($("trends"), paint, probe);
