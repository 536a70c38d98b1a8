// Two sticks and two tracks as they are deflected, and beside each direction what is allowed of it.

import { C, font, size } from "../theme.js";
import { clear, label, segment } from "../pen.js";
import { snapshotAge, state } from "../state.js";
import { ageText } from "../head.js";
import { input, slots } from "../drive/operator.js";
import { holds, pattern, seat } from "../drive/driving.js";
import { levers } from "../drive/levers.js";
import { mapping } from "../drive/store.js";
import { worstLevel } from "./advice.js";
import { arrow, isBlocked, isFree, percent, shareText } from "./arrow.js";

const WAYS = ["up", "left", "right", "down"];

let cells = []; // for the pointer

/** The dead zone of the source in use, as shares of the way: of the sticks on the screen it is their own affair. */
function deadZone(name) {
  return input().source === "gamepad" ? mapping(slots).axes[name].dead : 0;
}

/** The present place of a lever: filled where the server has it, a ring where this page's device is. */
function knob(g, x, y, r, sent, applied) {
  g.lineWidth = 2;
  g.strokeStyle = C.text;
  g.beginPath();
  g.arc(x(sent[0]), y(sent[1]), r, 0, 2 * Math.PI);
  g.stroke();
  if (!applied) return;
  g.fillStyle = C.text;
  g.beginPath();
  g.arc(x(applied[0]), y(applied[1]), 0.6 * r, 0, 2 * Math.PI);
  g.fill();
}

function stick(g, side, box, now, applied) {
  const middle = [box.x + box.w / 2, box.y + box.w / 2];
  const half = box.w / 2 - 7;
  const x = (value) => middle[0] + value * half, y = (value) => middle[1] - value * half;
  g.lineWidth = 1;
  g.strokeStyle = C.edge;
  g.strokeRect(box.x + 0.5, box.y + 0.5, box.w - 1, box.w - 1);
  segment(g, middle[0], box.y + 4, middle[0], box.y + box.w - 4, C.grid);
  segment(g, box.x + 4, middle[1], box.x + box.w - 4, middle[1], C.grid);
  const [dx, dy] = [deadZone(`${side}_x`) * half, deadZone(`${side}_y`) * half];
  if (dx || dy) {
    g.setLineDash([3, 2]);
    g.strokeStyle = C.second;
    g.strokeRect(middle[0] - dx, middle[1] - dy, 2 * dx, 2 * dy);
    g.setLineDash([]);
  }
  const pick = (from) => [from[`${side}_x`] ?? 0, from[`${side}_y`] ?? 0];
  knob(g, x, y, 6, pick(now), applied && pick(applied));
}

function words(g, ways, x, y, width, pitch) {
  const tick = size("tick");
  ways.forEach((one, i) => {
    const at = y + pitch * (i + 0.5);
    arrow(g, x + 0.6 * tick, at, 1.15 * tick, 0.85 * tick, one.way, one.allowed);
    const free = isFree(one.allowed);
    const share = isBlocked(one.allowed) ? "blocked" : percent(one.allowed);
    g.font = font("tick", free ? 400 : 700);
    const texts = free ? [`${one.joint} ${one.word}`] : [`${one.joint} ${one.word} ${share}`, `${one.word} ${share}`, `${one.word} ${percent(one.allowed)}`];
    const text = texts.find((t) => g.measureText(t).width <= width - 1.4 * tick) ?? texts[texts.length - 1];
    label(g, text, x + 1.4 * tick, at, { base: "middle", colour: free ? C.second : C.text, weight: free ? 400 : 700 });
    cells.push({ x0: x, x1: x + width, y0: at - pitch / 2, y1: at + pitch / 2, ...one });
  });
}

function track(g, box, value, applied, ways) {
  const middle = box.y + box.h / 2;
  const end = 0.85 * box.w; // of the arrows
  g.strokeStyle = C.edge;
  g.lineWidth = 1;
  g.strokeRect(box.x + 0.5, box.y + end + 2.5, box.w - 1, box.h - 2 * end - 5);
  segment(g, box.x, middle, box.x + box.w, middle, C.edge);
  const half = box.h / 2 - end - 3;
  g.fillStyle = C.text;
  g.fillRect(box.x + 3, Math.min(middle, middle - applied * half), box.w - 6, Math.abs(applied * half));
  segment(g, box.x, middle - value * half, box.x + box.w, middle - value * half, C.text, 2);
  for (const one of ways) {
    const up = one.way === "up";
    arrow(g, box.x + box.w / 2, up ? box.y + end / 2 : box.y + box.h - end / 2, end, box.w, one.way, one.allowed);
    cells.push({ x0: box.x - 2, x1: box.x + box.w + 2, y0: up ? box.y : middle, y1: up ? middle : box.y + box.h, ...one });
  }
}

export function paint(g, width, height) {
  clear(g, width, height);
  cells = [];
  const { all, enforced } = levers(state.own);
  const now = input();
  const mine = seat()?.driven === state.own && holds(state.own);
  const applied = mine ? seat()?.sticks ?? null : null;
  const wide = width >= 400;
  const bar = wide ? 14 : 11, between = wide ? 8 : 4;
  const tracks = 2 * bar + between;
  const half = (width - tracks - 8 - 2 * between) / 2;
  const side = Math.min(height - 4, wide ? 96 : 66);
  const top = Math.max(2, (height - side) / 2);
  const pitch = side / 4;
  const sent = now.deflection;
  ["left", "right"].forEach((lever, k) => {
    const x = k ? width - 4 - half : 4;
    stick(g, lever, { x, y: top, w: side }, sent, applied);
    words(g, WAYS.map((way) => all.find((one) => one.lever === lever && one.way === way)), x + side + 5, top, half - side - 5, pitch);
  });
  ["track_left", "track_right"].forEach((lever, k) => {
    const x = 4 + half + between + k * (bar + between);
    track(g, { x, y: top, w: bar, h: side }, sent[lever], applied?.[lever] ?? 0, all.filter((one) => one.lever === lever));
  });
  const age = snapshotAge();
  const shown = (one) => [`${one.joint} ${one.word}`, isBlocked(one.allowed) ? 0 : Math.round(100 * one.allowed)];
  const restricted = all.filter((one) => !isFree(one.allowed));
  return {
    state: { own: state.own, sticks: true, enforced, level: worstLevel(state.own), pattern: pattern(), sent, applied, levers: Object.fromEntries(all.map((one) => [`${one.lever} ${one.way}`, shown(one)])) },
    age,
    label: `Sticks, pattern ${pattern()}, limits ${enforced ? "enforced" : "not enforced"}: ${restricted.map((one) => `${one.joint} ${one.word} ${shareText(one.allowed)}`).join(", ") || "all free"}; ${ageText(age)}`,
  };
}

export function probe(x, y) {
  const hit = cells.find((c) => x >= c.x0 && x < c.x1 && y >= c.y0 && y < c.y1);
  if (!hit) return null;
  return [`${hit.joint} ${hit.word}: ${shareText(hit.allowed)}`, ...(hit.why ? [hit.why] : []), holds(state.own) ? "enforced" : "advice, not enforced by this page"];
}
