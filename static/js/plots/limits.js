// What limits the own machine: per joint and direction, the smallest allowed share of full speed. Advice only.

import { C, size } from "../theme.js";
import { clear, label, message, segment } from "../pen.js";
import { $ } from "../words.js";
import { label as nameOf, snapshotAge, state } from "../state.js";
import { surface } from "../surface.js";
import { ageText } from "../head.js";
import { controllable } from "../drive/driving.js";
import { advice, worstLevel } from "./advice.js";
import { arrow, isBlocked, isFree, shareText } from "./arrow.js";
import * as sticks from "./sticks.js";

let cells = []; // for the pointer

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
      arrow(g, x + 4 + 0.85 * t3, y, Math.round(1.7 * t3), Math.min(pitch * 0.62, t3), k === 0 ? "left" : "right", one.allowed);
      const blocked = isBlocked(one.allowed), free = isFree(one.allowed);
      const text = free ? one.word : blocked && !narrow ? `${one.word} blocked` : `${one.word} ${Math.round(100 * one.allowed)} %`;
      label(g, text, x + 2.2 * t3 + 4, y, { base: "middle", colour: free ? C.second : C.text, weight: free ? 400 : 700, name: "t3" });
      cells.push({ x0: x, x1: x + column, y0: y - pitch / 2, y1: y + pitch / 2, role, ...one });
    });
  });
  return {
    state: { own: state.own, enforced: false, level: worstLevel(state.own), allowed: Object.fromEntries(rows.map((r) => [r.role, Object.fromEntries(r.sides.map((s) => [s.word, Math.round(100 * s.allowed)]))])) },
    age,
    label: `Advice for ${nameOf(state.own)}, not enforced: ${rows.flatMap((r) => r.sides.filter((s) => !isFree(s.allowed)).map((s) => `${r.role} ${s.word} ${isBlocked(s.allowed) ? "blocked" : `${Math.round(100 * s.allowed)} %`}`)).join(", ") || "all free"}; ${ageText(age)}`,
  };
}

function probe(x, y) {
  const hit = cells.find((c) => x >= c.x0 && x < c.x1 && y >= c.y0 && y < c.y1);
  if (!hit) return null;
  return [`${hit.role} ${hit.word}: ${shareText(hit.allowed)}`, ...(hit.why ? [hit.why] : []), "advice, not enforced by this page"];
}

/** The sticks in the place of the advice where this page may drive. */
export function limits() {
  const driven = () => controllable(state.own);
  return surface($("limits"), (...given) => (driven() ? sticks.paint : paint)(...given), (x, y) => (driven() ? sticks.probe : probe)(x, y));
}
