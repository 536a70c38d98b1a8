// How firmly machines stand, on the plan: support polygon, zero-moment point, and a meter for the own machine.

import { C, LEVEL_COLOUR, hatch, size } from "../theme.js";
import { number } from "../axis.js";
import { fit, swatches } from "../pen.js";
import { label as nameOf, machine, names, silence, state } from "../state.js";
import { chart } from "./plan_layers.js";

const HOLDS = [2, 3]; // dashes
const MARK = { SLOW: "▲ ", STOP: "■ ", UNKNOWN: "? " };

/** What is known of a machine: null where nothing is judged, else with level and a reason when unknown. */
export function standing(name) {
  const found = state.snapshot?.stability?.[name];
  if (!found) return null;
  const reason = found.reason || (silence() > 1 ? "no news" : "");
  if (reason) return { reason, level: "UNKNOWN", percent: null };
  const concern = (state.snapshot.concerns ?? []).find((c) => c.name === "tip-over" && c.machine === name);
  return { ...found, level: concern?.level ?? "CLEAR" };
}

const percentText = ({ percent }) => `${number(Math.floor(percent ?? 0), 0)} %`;

/** From the fullest wording to the shortest. */
function wordings(name, found) {
  const who = nameOf(name);
  if (found.reason) return [`? ${who} tip-over unknown: ${found.reason}`, `? ${who} tip-over unknown`, "? tip-over"];
  if (found.level === "CLEAR") return [`${who} stands · margin ${percentText(found)}`, `stands ${percentText(found)}`, percentText(found)];
  return [`${MARK[found.level]}${who} tips over ${found.edge} · ${percentText(found)}`, `${MARK[found.level]}tips ${found.edge} ${percentText(found)}`, `${MARK[found.level]}${percentText(found)}`];
}

/** Points of a machine's own frame on the ground to the plan; its tilt is too small to be seen. */
function placer(m) {
  const c = Math.cos(m.yaw), s = Math.sin(m.yaw);
  return ([x, y]) => chart.at([m.position[0] + c * x - s * y, m.position[1] + s * x + c * y]);
}

function drawOne(g, name, found) {
  const m = machine(name), colour = LEVEL_COLOUR[found.level] ?? C.tipOver;
  if (!m?.position || !Number.isFinite(m.yaw) || !found.polygon) return;
  const place = placer(m);
  g.beginPath();
  for (const corner of found.polygon) g.lineTo(...place(corner));
  g.closePath();
  g.setLineDash([5, 2]);
  g.lineWidth = 1.5;
  g.strokeStyle = colour;
  g.stroke();
  g.setLineDash([]);
  if (!found.zmp) return;
  const [x, y] = place(found.zmp), r = name === state.own ? 4.5 : 3.5;
  g.beginPath();
  g.arc(x, y, r, 0, 2 * Math.PI);
  g.fillStyle = colour;
  g.fill();
  g.lineWidth = 1.5;
  g.strokeStyle = C.halo;
  g.stroke();
}

/** How far out the payload may be held, by direction; a gap where nowhere. */
function drawHolds(g, name, found) {
  const m = machine(name), holds = found.holds ?? [];
  if (!m?.swing_center || !Number.isFinite(m.yaw) || !holds.some(Number.isFinite)) return 0;
  g.beginPath();
  let pen = false;
  for (let i = 0; i <= holds.length; i++) {
    const r = holds[i % holds.length], angle = m.yaw - Math.PI + (2 * Math.PI * i) / holds.length;
    const known = Number.isFinite(r) && r !== null;
    if (known) g[pen ? "lineTo" : "moveTo"](...chart.at([m.swing_center[0] + r * Math.cos(angle), m.swing_center[1] + r * Math.sin(angle)]));
    pen = known;
  }
  g.setLineDash(HOLDS);
  g.lineWidth = 2;
  g.strokeStyle = C.tipOver;
  g.stroke();
  g.setLineDash([]);
  return holds.filter(Number.isFinite).length;
}

/** Of the legend, where the curve is drawn. */
export function stabilityKey() {
  const own = standing(state.own);
  if (!own || own.reason || !own.holds?.length) return [];
  return [[swatches.line(C.tipOver, HOLDS, 2), `holds ${number(own.payload, 0)} kg`]];
}

/** In the upper left corner, below the coordinates: the bar is as full as the margin, in horizontal hatch. */
function meter(g, found, dpr) {
  const t = size("tick"), { box } = chart;
  const left = box.left + 5, top = box.top + 4 + 1.5 * t, wide = Math.round(4.5 * t), high = Math.round(0.75 * t);
  const colour = LEVEL_COLOUR[found.level] ?? C.tipOver;
  g.fillStyle = C.outside;
  g.fillRect(left, top, wide, high);
  if (found.percent !== null) {
    g.fillStyle = hatch(g, colour, dpr, 0.9, "-");
    g.fillRect(left, top, (wide * Math.min(Math.max(found.percent, 0), 100)) / 100, high);
  }
  g.lineWidth = 1;
  g.setLineDash(found.reason ? [3, 2] : []);
  g.strokeStyle = colour;
  g.strokeRect(left + 0.5, top + 0.5, wide - 1, high - 1);
  g.setLineDash([]);
  const shown = fit(g, wordings(state.own, found), left + wide + 6, top + high / 2, box.right - left - wide - 3.2 * t, { base: "middle", colour: found.level === "CLEAR" ? C.second : colour, weight: found.level === "CLEAR" ? 400 : 700, halo: true });
  chart.words.push({ left, right: left + wide + 6 + g.measureText(shown).width, top: top - 3, bottom: top + high + 3 });
  return shown;
}

/** Draws all of it. Returns what is shown of the own machine; null where nothing is judged. */
export function drawStability(g, dpr) {
  for (const name of names()) {
    const found = standing(name);
    if (found && !found.reason) drawOne(g, name, found);
  }
  const own = standing(state.own);
  if (!own) return null;
  const holds = own.reason ? 0 : drawHolds(g, state.own, own);
  const words = meter(g, own, dpr);
  return { holds, level: own.level, percent: own.percent === null ? null : Math.floor(own.percent), edge: own.edge ?? "", words };
}

/** For who hears the page, and for the pointer. */
export function stabilityWords() {
  const own = standing(state.own);
  if (!own) return [];
  return [wordings(state.own, own)[0].replace(/^[▲■?] /, "")];
}
