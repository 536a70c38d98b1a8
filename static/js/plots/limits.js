// What limits the own machine: per joint and direction, the smallest allowed share of full speed. Advice only.

import { C, size } from "../theme.js";
import { clear, label, message, segment } from "../pen.js";
import { $ } from "../words.js";
import { described, label as nameOf, machine, severity, silence, snapshotAge, state, sunMap, swingSign } from "../state.js";
import { surface } from "../surface.js";
import { ageText } from "../head.js";

// Words for a lowering and a raising motion in Sun's sense (positive raises).
const WORDS = { boom: ["down", "up"], stick: ["in", "out"], bucket: ["curl", "dump"], tilt: ["left", "right"], rotate: ["left", "right"], travel: ["back", "ahead"] };

let cells = []; // for the pointer

/** [{role, sides: [{word, allowed, why}, ..]}] of the own machine, the most restrictive concern each. */
export function advice(name) {
  const joints = described(name)?.joints;
  if (!joints || !state.snapshot) return null;
  const concerns = (state.snapshot.concerns ?? []).filter((c) => c.machine === name);
  const smallest = (pick) => {
    let best = { allowed: 1, why: "" };
    for (const c of concerns) {
      const value = pick(c);
      if (Number.isFinite(value) && value < best.allowed) best = { allowed: value, why: c.reason || c.name };
    }
    return best;
  };
  // Without a verdict nothing is free.
  const unknown = silence() > 1 ? "no data" : machine(name)?.validity !== "VALID" ? "own pose is not valid" : concerns.length ? "" : "no verdict received";
  const side = (pick, word) => ({ word, ...(unknown ? { allowed: 0, why: unknown } : smallest(pick)) });
  const rows = joints.map((joint, i) => {
    const share = (c, k) => c.allowed?.[joint.role]?.[k ? "positive" : "negative"] ?? c.allowed?.[i]?.[k];
    const negative = (word) => side((c) => share(c, 0), word);
    const positive = (word) => side((c) => share(c, 1), word);
    if (joint.role === "swing") {
      return { role: "swing", sides: swingSign(name) > 0 ? [positive("left"), negative("right")] : [negative("left"), positive("right")] };
    }
    const [low, high] = WORDS[joint.role] ?? ["−", "+"];
    const raises = sunMap(name, joint.role).sign > 0;
    return { role: joint.role, sides: raises ? [negative(low), positive(high)] : [positive(low), negative(high)] };
  });
  if (concerns.some((c) => c.travel)) rows.push({ role: "travel", sides: [side((c) => c.travel?.backward ?? c.travel?.[0], "back"), side((c) => c.travel?.forward ?? c.travel?.[1], "ahead")] });
  return rows;
}

function paint(g, width, height) {
  clear(g, width, height);
  cells = [];
  const rows = advice(state.own);
  const age = snapshotAge();
  if (!rows) {
    message(g, width, height, "no data yet");
    return { state: {}, age: Infinity, label: "What limits: no data yet" };
  }
  const t3 = size("t3");
  const narrow = width < 400;
  const first = Math.round((narrow ? 3.9 : 4.4) * t3);
  const column = (width - first - 8) / 2;
  const pitch = (height - 4) / rows.length;
  rows.forEach(({ role, sides }, i) => {
    const y = pitch * (i + 0.5);
    if (i) segment(g, 8, Math.round(i * pitch) + 0.5, width - 8, Math.round(i * pitch) + 0.5, C.free);
    label(g, role, first - 10, y, { align: "right", base: "middle", colour: C.second, name: "t3" });
    sides.forEach((one, k) => {
      const x = first + k * column;
      arrow(g, x + 4, y, Math.round(1.7 * t3), Math.min(pitch * 0.62, t3), k === 0 ? -1 : 1, one.allowed);
      const blocked = one.allowed <= 0.005, free = one.allowed >= 0.995;
      const text = free ? one.word : blocked && !narrow ? `${one.word} blocked` : `${one.word} ${Math.round(100 * one.allowed)} %`;
      label(g, text, x + 2.2 * t3 + 4, y, { base: "middle", colour: free ? C.second : C.text, weight: free ? 400 : 700, name: "t3" });
      cells.push({ x0: x, x1: x + column, y0: y - pitch / 2, y1: y + pitch / 2, role, ...one });
    });
  });
  const worst = Math.max(0, ...(state.snapshot.concerns ?? []).filter((c) => c.machine === state.own).map((c) => severity[c.level] ?? 0));
  return {
    state: { own: state.own, enforced: false, level: Object.keys(severity)[worst], allowed: Object.fromEntries(rows.map((r) => [r.role, Object.fromEntries(r.sides.map((s) => [s.word, Math.round(100 * s.allowed)]))])) },
    age,
    label: `Advice for ${nameOf(state.own)}, not enforced: ${rows.flatMap((r) => r.sides.filter((s) => s.allowed < 0.995).map((s) => `${r.role} ${s.word} ${s.allowed <= 0.005 ? "blocked" : `${Math.round(100 * s.allowed)} %`}`)).join(", ") || "all free"}; ${ageText(age)}`,
  };
}

/** Outline: free. Half filled amber: limited. Red bar: blocked. */
function arrow(g, x, y, w, h, direction, allowed) {
  if (allowed <= 0.005) {
    g.fillStyle = C.stop;
    g.fillRect(x, y - h * 0.34, w, h * 0.68);
    g.lineWidth = 1.5;
    g.strokeStyle = "#FFFFFF";
    g.strokeRect(x + 0.75, y - h * 0.34 + 0.75, w - 1.5, h * 0.68 - 1.5);
    return;
  }
  const tip = direction > 0 ? x + w : x, tail = direction > 0 ? x : x + w;
  const neck = tip - direction * w * 0.45;
  const path = new Path2D();
  path.moveTo(tip, y);
  path.lineTo(neck, y - h / 2);
  path.lineTo(neck, y - h / 5);
  path.lineTo(tail, y - h / 5);
  path.lineTo(tail, y + h / 5);
  path.lineTo(neck, y + h / 5);
  path.lineTo(neck, y + h / 2);
  path.closePath();
  const limited = allowed < 0.995;
  if (limited) {
    g.save();
    g.beginPath();
    g.rect(direction > 0 ? x : x + w / 2, y - h, w / 2, 2 * h);
    g.clip();
    g.fillStyle = C.slow;
    g.fill(path);
    g.restore();
  }
  g.lineWidth = 1.5;
  g.strokeStyle = limited ? C.slow : C.second;
  g.stroke(path);
}

function probe(x, y) {
  const hit = cells.find((c) => x >= c.x0 && x < c.x1 && y >= c.y0 && y < c.y1);
  if (!hit) return null;
  return [`${hit.role} ${hit.word}: ${hit.allowed >= 0.995 ? "free" : hit.allowed <= 0.005 ? "blocked" : `${Math.round(100 * hit.allowed)} % of full speed`}`, ...(hit.why ? [hit.why] : []), "advice, not enforced by this page"];
}

export const limits = () => surface($("limits"), paint, probe);
