// One bar per joint: what is free and blocked if only this joint moves, stopping distances, and margins in words.

import { C, size } from "../theme.js";
import { deg, degrees, number, scale } from "../axis.js";
import { clear, fit, label, legend, segment, swatches } from "../pen.js";
import { count, fade, jointKind, paintBytes, swatch } from "../layers.js";
import { barByte, cellLines, counts, fromLeft, layerWord, presentLayers, stopsInBlocked, toLeft } from "../exact.js";
import { described, exactImage, imageAge, imageStale, label as nameOf, machine, snapshotAge, state } from "../state.js";
import { levelMark, octagon, ring } from "../glyphs.js";
import { cannotStop, goesThere, told, wayLines, ways, wayTexts } from "../margins.js";
import { ageText, staleText } from "../head.js";
import { pinnedFrom } from "../ghost.js";
import { row } from "./bars_sun.js";
import { tee } from "./stopping.js";

const rasters = new Map(); // role -> canvas
let rows = [];

/** A joint's own value from the bar's (the swing bar counts left positive). */
const value = (r, shownValue) => (r.role === "swing" ? fromLeft(state.own, shownValue, r.q) : shownValue);

/** The whole height of a bar shows its cell's byte. */
function cells(g, entry, r, left, right, y, thick, dpr, old) {
  const w = Math.round((right - left) * dpr), h = Math.round(thick * dpr);
  let raster = rasters.get(r.role);
  if (!raster) rasters.set(r.role, (raster = { canvas: document.createElement("canvas"), key: "" }));
  const key = `${state.own} ${entry.serial} ${entry.header.state_time} ${w} ${h} ${old}`;
  if (raster.key !== key) {
    raster.key = key;
    raster.canvas.width = w;
    raster.canvas.height = h;
    const line = Uint8Array.from({ length: w }, (_, i) => barByte(entry, r.role, value(r, r.map.inverse(left + (i + 0.5) / dpr))));
    const bytes = new Uint8Array(w * h);
    for (let k = 0; k < h; k++) bytes.set(line, k * w);
    const pixels = new ImageData(w, h);
    const bits = new Uint32Array(pixels.data.buffer);
    paintBytes(bytes, w, h, bits, dpr, jointKind);
    if (old) fade(bits);
    raster.canvas.getContext("2d").putImageData(pixels, 0, 0);
  }
  g.drawImage(raster.canvas, left, y - thick / 2, w / dpr, h / dpr);
}

/** Pixels of a distance from now; clamped to the bar. */
function reached(r, by, left, right) {
  const way = r.role === "swing" ? r.sign * by : by;
  return Math.min(right, Math.max(left, r.map(r.now + way)));
}

function stops(g, entry, r, left, right, y, thick) {
  const { now, full } = entry.header.stopping?.[r.role] ?? {};
  const x = r.map(r.now);
  if (Number.isFinite(full)) {
    const [a, b] = [-Math.abs(full), Math.abs(full)].map((by) => Math.round(reached(r, by, left, right)) + 0.5);
    for (const [w, colour, dash] of [[3, "#000000", null], [1.2, C.text, [3, 2]]]) {
      g.setLineDash(dash ?? []);
      g.lineWidth = w;
      g.strokeStyle = colour;
      g.strokeRect(Math.min(a, b), Math.round(y - thick / 2) - 1.5, Math.abs(b - a), thick + 3);
    }
    g.setLineDash([]);
  }
  if (!Number.isFinite(now) || Math.abs(now) < 0.002) return null;
  const red = stopsInBlocked((q) => barByte(entry, r.role, q), r.q, now);
  tee(g, x, y, reached(r, now, left, right), y, red, thick / 2 - 1);
  return { now: Math.round(now * 1e4) / 1e4, red };
}

export function paint(g, width, height, dpr) {
  clear(g, width, height);
  const entry = exactImage();
  const { header, arrays } = entry;
  const joints = described(state.own).joints.filter(({ role }) => header.bars.some((bar) => bar.joint === role));
  const m = machine(state.own);
  const t3 = size("t3"), t = size("tick");
  const left = Math.round(3.9 * t3 + 3.2 * t), right = width - Math.round(4.5 * t3 + 3 * t);
  const foot = Math.round(1.25 * t);
  const pitch = (height - foot) / joints.length;
  const thick = Math.round(Math.min(0.9 * t3, pitch - t - 6)); // a line of text stands below each
  const stale = m.validity !== "VALID", old = imageStale(entry);
  const drawn = {};
  rows = joints.map((joint, i) => {
    const r = row(joint);
    const y = Math.round(pitch * i + thick / 2 + 4);
    r.q = m.joints[r.role];
    r.sign = r.role === "swing" ? Math.sign(fromLeft(state.own, 1) - fromLeft(state.own, 0)) || 1 : 1;
    r.map = r.reversed ? scale(r.upper, r.lower, left, right) : scale(r.lower, r.upper, left, right);
    cells(g, entry, r, left, right, y, thick, dpr, old);
    g.lineWidth = 1;
    g.strokeStyle = C.edge;
    if (!r.full) g.strokeRect(left + 0.5, y - thick / 2 + 0.5, right - left - 1, thick - 1);
    const stop = stops(g, entry, r, left, right, y, thick);
    const x = Math.min(right, Math.max(left, r.map(r.now)));
    segment(g, x, y - thick / 2 - 4, x, y + thick / 2 + 4, "#000000", 6);
    segment(g, x, y - thick / 2 - 3, x, y + thick / 2 + 3, stale ? C.stale : "#FFFFFF", 3, stale ? [3, 2] : null);
    const pin = pinnedFrom(`bars ${r.role}`);
    if (pin) ring(g, Math.min(right, Math.max(left, r.map(r.role === "swing" ? toLeft(state.own, pin[r.role]) : pin[r.role]))), y, 5);
    const text = (v) => (r.reversed && v > 0 ? "+" : "") + degrees(v);
    const ends = r.reversed ? [r.upper, r.lower] : [r.lower, r.upper];
    label(g, r.role, 3.7 * t3, y, { align: "right", base: "middle", colour: C.text, name: "t3" });
    label(g, text(ends[0]), left - 5, y, { align: "right", base: "middle" });
    label(g, text(ends[1]), right + 5, y, { base: "middle" });
    label(g, `${number(deg(r.now), 1)}°`, width - 8, y, { align: "right", base: "middle", colour: stale ? C.stale : C.text, name: "t3", weight: 600 });
    const given = told() ? ways(state.own, r.role) : [];
    const bytes = counts(arrays[`bar${header.bars.findIndex((bar) => bar.joint === r.role)}`], jointKind, count);
    drawn[r.role] = { ...bytes, stop, margins: given.map((way) => (Number.isFinite(way?.free) ? [Math.round(way.free * 1e4) / 1e4, way.hits] : null)), cannot_stop: given.map(cannotStop) };
    return { ...r, y, ways: given, stop };
  });
  // After all bars: the dashed box of the next one must not cross the words.
  for (const r of rows) r.ways.forEach((way, k) => margin(g, way, k, k ? right : left, Math.round(r.y + thick / 2 + 2), (right - left) / 2 - 12, t));
  const has = (name) => Object.values(drawn).some((d) => d[name]);
  const layers = presentLayers(Object.fromEntries(jointKind.layers.map(({ name }) => [name, has(name)])));
  legend(g, 8, height - 0.65 * t, width - 12, [
    ...(old ? [[swatches.area(C.stale, C.stale), `cells ${staleText(imageAge(entry))}`]] : []),
    [swatches.glyph((c, x, y) => segment(c, x, y - 6, x, y + 6, "#FFFFFF", 3)), "now"],
    ...layers.map((layer) => [swatch.layer(g, layer, dpr), layerWord(layer, header)]),
    ...(has("undecided") ? [[swatch.undecided(g, dpr), "undecided"]] : []),
    [swatches.line(C.text, [3, 2], 1.5), "full-speed stop"],
  ]);
  const age = Math.max(snapshotAge(), old ? imageAge(entry) : 0);
  const values = Object.fromEntries(rows.map((r) => [r.role, Math.round(deg(r.now) * 100) / 100]));
  return { state: { own: state.own, kind: "exact", joints: values, unit: "deg", bars: drawn, eta: header.eta, state_time: header.state_time, hollow: old }, age, label: `Joints of ${nameOf(state.own)}: ${rows.map((r) => `${r.role} ${degrees(r.now)}${r.ways.length ? ` (${r.ways.map((way) => wayTexts(state.own, way)[0]).join(", ")})` : ""}`).join("; ")}; ${ageText(age)}` };
}

/**
 * A margin under its end of the bar, with an arrow outwards. An octagon where a stop from full speed would come
 * too late; filled, and the words red, when the joint moves there now. At rest nothing is filled.
 */
function margin(g, way, side, x, y, width, t) {
  const late = cannotStop(way), red = late && goesThere(way);
  const arrow = side ? " ▸" : "◂ ";
  const texts = wayTexts(state.own, way).map((text) => (side ? text + arrow : arrow + text));
  const shift = late ? t + 3 : 0;
  const mark = [side ? x - t / 2 : x + t / 2, y + 0.45 * t, 0.5 * t];
  if (red) levelMark(g, "STOP", ...mark);
  else if (late) octagon(g, ...mark);
  fit(g, texts, side ? x - shift : x + shift, y, width - shift, { align: side ? "right" : "left", base: "top", colour: red ? C.stopLine : C.second, weight: red ? 700 : 400, halo: true });
}

const nearest = (y) => rows.reduce((a, b) => (Math.abs(b.y - y) < Math.abs(a.y - y) ? b : a));
const inside = (r, at) => at >= Math.min(r.lower, r.upper) && at <= Math.max(r.lower, r.upper);

export function probe(x, y) {
  const entry = exactImage();
  if (!entry || !rows.length) return null;
  const r = nearest(y);
  const at = r.map.inverse(x);
  const words = r.role === "swing" ? ["left", "right"] : ["towards lower", "towards upper"];
  return [
    ...(inside(r, at) ? [`${r.role} at ${degrees(at, 1)}, the other joints as now:`, ...cellLines(barByte(entry, r.role, value(r, at)), entry.header, jointKind).map((line) => `   ${line}`)] : []),
    `${r.role} now ${degrees(r.now, 1)}, ${number(deg(r.velocity), 1)} °/s · ${r.full ? "turns without limit" : `limits ${degrees(r.lower)} to ${degrees(r.upper)}`}${r.sun === null ? "" : ` · Sun ${degrees(r.sun, 0)}`}`,
    ...(told() ? r.ways.flatMap((way, k) => wayLines(state.own, way, words[k])) : []),
    `bodies grown by ${(100 * entry.header.eta).toFixed(0)} cm · ${ageText(imageAge(entry))}`,
  ];
}

export function aim(x, y) {
  if (!exactImage() || !rows.length) return null;
  const r = nearest(y);
  const at = r.map.inverse(x);
  if (!inside(r, at)) return null;
  return { machine: state.own, joints: { ...machine(state.own).joints, [r.role]: value(r, at) }, from: `bars ${r.role}` };
}
