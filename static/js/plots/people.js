// People over time and on the TTC–x plane (Rasul 2021, Figs. 12 and 14), for the chosen own machine.

import { C, font, hatch, rgba, size } from "../theme.js";
import { grouped, number, ticks } from "../axis.js";
import { clear, fit, label, legend, message, segment, swatches } from "../pen.js";
import { curve, frame, unknownBox } from "./chart.js";
import { hide as hideAlong } from "./along.js";
import { COLOUR, ORDER, mark, overlap, riskLine, times } from "./plan_people.js";
import { $, write } from "../words.js";
import { label as nameOf, machine, state } from "../state.js";
import { ageText } from "../head.js";
import { AHEAD, PAST, age, boundaries, code, history, partners, people, region, risks, tracks, unknown } from "../people/model.js";

const HALVES = [5, 10, 20, 40, 80, 160]; // of the shown piece of ground [m]
const TTC = 6; // at which the plane ends [s]
const INDEX = [-1, 4]; // likewise
const GAP = 0.5; // between two places that no line joins [s]
const SAME = 7; // marks nearer than this share one label [px]

let on = false;
let charts = []; // for the pointer
const view = { own: null, middle: [0, 0], half: 0 };
const clamp = (v, low, high) => Math.min(Math.max(v, low), high);

/** Whether people are shown in the place of the last minute. */
export const shown = () => on && people() !== null;

export function startPeople(redraw) {
  $("people-show").addEventListener("click", () => {
    on = !on;
    if (on) hideAlong();
    redraw();
  });
  $("along-show").addEventListener("click", () => { on = false; });
}

export function update() {
  $("people-tools").hidden = people() === null;
  $("people-show").setAttribute("aria-pressed", String(shown()));
  if (shown()) write($("trends-title"), "People");
}

/** The ground that is shown lies about the own machine and holds all of the last 20 s. */
function settle() {
  const m = machine(state.own), from = m?.swing_center ?? m?.position;
  if (!from && view.own !== state.own) return false;
  if (from && (view.own !== state.own || Math.hypot(from[0] - view.middle[0], from[1] - view.middle[1]) > 10)) {
    Object.assign(view, { own: state.own, middle: from.slice(0, 2).map((v) => 5 * Math.round(v / 5)) });
  }
  const far = Math.max(0, ...tracks().flatMap((track) => [...history(track.id).map((h) => h.place), track.position]).flatMap((p) => [0, 1].map((k) => Math.abs(p[k] - view.middle[k]))));
  view.half = HALVES.find((half) => half >= far) ?? HALVES[HALVES.length - 1];
  return true;
}

const ink = ({ kind }) => (kind === "object" ? C.second : C.people);

/** Easting or northing over time: as it was, and as it was foretold a second before. */
function axisOverTime(g, place, k, now) {
  const origin = (state.site?.frame?.origin ?? [0, 0, 0])[k];
  const low = view.middle[k] - view.half, high = view.middle[k] + view.half;
  const marks = ticks(low + origin, high + origin, 4, [2, 5, 10, 20, 50, 100]).map((v) => [v - origin, String(((Math.round(v) % 1000) + 1000) % 1000).padStart(3, "0")]);
  const t = size("tick");
  const between = place.right - place.left > 13 * t ? [[-10, "−10"]] : [];
  const across = { from: -PAST, to: AHEAD, marks: [[-PAST, `−${PAST} s`], ...between, [0, "now"]] };
  const chart = frame(g, { ...place, right: place.right - 2.1 * t }, across, { from: low, to: high, marks }, `${"EN"[k]} ${grouped(Math.floor((view.middle[k] + origin) / 1000))}\u202f…, m`, "m");
  const { box, x, y } = chart;
  const at = (time, value) => [x(time - now), y(value)];
  segment(g, x(0), box.top, x(0), box.bottom, C.edge, 1);
  if (unknown()) unknownBox(g, box, x(Math.max(-PAST, -Math.min(age(), PAST))), x(0));
  const joined = (points, line) => points.flatMap((p, i) => (i && p.time - points[i - 1].time > GAP ? [null, line(p)] : [line(p)]));
  const places = [];
  for (const track of tracks()) {
    const points = history(track.id);
    curve(g, chart, joined(points, (p) => p.ahead && at(p.time + AHEAD, p.ahead[k])), ink(track), 1.6, [1.5, 3]);
    curve(g, chart, joined(points, (p) => at(p.time, p.place[k])), ink(track), 2);
    if (!unknown()) places.push({ track, x: x(0), y: clamp(y(track.position[k]), box.top + 6, box.bottom - 6), ahead: track.ahead?.position?.[k] });
  }
  g.save();
  g.beginPath();
  g.rect(box.left, box.top, box.right - box.left + 4, box.bottom - box.top);
  g.clip();
  for (const one of places) {
    if (Number.isFinite(one.ahead)) times(g, x(AHEAD) - 2, y(one.ahead), 3);
    mark(g, one.x, one.y, { ...one.track, r: 3.6 });
  }
  g.restore();
  // Names keep apart, from the top down.
  let free = box.top + 0.5 * t;
  for (const one of places.sort((a, b) => a.y - b.y)) {
    const height = Math.max(one.y, free);
    if (height < box.bottom + 0.5 * t) label(g, code(one.track), box.right + 5, height, { base: "middle", colour: C.text });
    free = height + 1.05 * t;
  }
  charts.push({ ...chart, kind: "time", k, now });
}

function plane(g, place, dpr) {
  const t = size("tick");
  const { ttc: times_, index: indices } = boundaries();
  const written = (values, end) => values.filter((v) => v < end - 0.5).map((v) => [v, number(v, v % 1 ? 1 : 0)]);
  const across = { from: 0, to: TTC, marks: [[0, "0"], ...written(times_, TTC), [TTC, `≥ ${TTC} s`]] };
  const up = { from: INDEX[0], to: INDEX[1], marks: [[INDEX[0], "≤ −1"], ...written([...new Set([0, ...indices])], INDEX[1]), [INDEX[1], "≥ 4"]] };
  const chart = frame(g, place, across, up, `x over TTC, ${nameOf(state.own)}`, "x", 2.5);
  const { box, x, y } = chart;
  const area = (what, k) => {
    g.beginPath();
    g.moveTo(box.left, box.top);
    for (const [u, v] of [[times_[k], INDEX[1]], [times_[k], indices[k]], [TTC, indices[k]], [TTC, INDEX[0]]]) g.lineTo(x(u), y(v));
    g.lineTo(box.left, box.bottom);
    g.closePath();
    g.fillStyle = C.free;
    g.fill();
    g.fillStyle = rgba(COLOUR[what], 0.16);
    g.fill();
    g.fillStyle = hatch(g, COLOUR[what], dpr, 0.22, what === "WARNING" ? "/" : "x");
    g.fill();
    for (const [a, b] of [[[times_[k], INDEX[1]], [times_[k], indices[k]]], [[times_[k], indices[k]], [TTC, indices[k]]]]) segment(g, x(a[0]), y(a[1]), x(b[0]), y(b[1]), COLOUR[what], 1.5);
  };
  area("WARNING", 1);
  area("EMERGENCY", 0);
  const names = [["SAFE", times_[1], indices[1]], ["WARNING", times_[1], indices[0]], ["EMERGENCY", times_[0], INDEX[0]]];
  for (const [what, u, v] of names) fit(g, [what], x(u) + 4, y(v) - 3, box.right - x(u) - 6, { colour: COLOUR[what], weight: 600, halo: true });
  if (unknown()) {
    fit(g, [`? ${unknown()}`, "? unknown"], box.left + 4, box.top + 3, box.right - box.left - 8, { base: "top", colour: C.unknown, weight: 700, halo: true });
    charts.push({ ...chart, kind: "plane", spots: [] });
    return [];
  }
  const at = (ttc, index) => [clamp(x(clamp(ttc, 0, TTC)), box.left + 5, box.right - 5), clamp(y(clamp(index, ...INDEX)), box.top + 5, box.bottom - 5)];
  const spot = (name, r, shape) => ({ name, risk: r, shape, now: at(r.ttc, r.index), later: at(r.ttc_ahead, r.index_ahead) });
  const spots = [
    ...tracks().flatMap((track) => risks(track.id, state.own).map((r) => spot(code(track), r, ring))),
    ...partners(state.own).map((r) => spot(nameOf(r.other), r, square)),
  ];
  const inkOf = ({ shape }) => (shape === square ? C.partner : C.people);
  for (const one of spots) segment(g, ...one.now, ...one.later, rgba(inkOf(one), 0.55), 1.2, [4, 3]);
  for (const { later } of spots) times(g, ...later, 4.5);
  for (const { now, shape } of spots) shape(g, ...now);
  // Marks in one place, above all in the far corner, share a label; in a crowd the worst keep theirs.
  spots.sort((a, b) => ORDER.indexOf(a.risk.level) - ORDER.indexOf(b.risk.level) || a.risk.ttc_ahead - b.risk.ttc_ahead || 0);
  const groups = [];
  for (const spot of spots) {
    const near = groups.find(({ place: p }) => Math.hypot(p[0] - spot.now[0], p[1] - spot.now[1]) < SAME);
    if (near) near.spots.push(spot);
    else groups.push({ place: spot.now, spots: [spot] });
  }
  const taken = [];
  for (const { place: [px, py], spots: list } of groups) {
    const right = px > (box.left + box.right) / 2;
    const text = list.length > 3 ? `${list.slice(0, 2).map((s) => s.name).join(" ")} +${list.length - 2}` : list.map((s) => s.name).join(" ");
    g.font = font("tick", 700);
    const w = g.measureText(text).width, left = right ? px - 9 - w : px + 9, middle = clamp(py, box.top + 0.6 * t, box.bottom - 0.6 * t);
    const place = { left, right: left + w, top: middle - 0.5 * t, bottom: middle + 0.5 * t };
    if (taken.some((other) => overlap(place, other))) continue;
    taken.push(place);
    label(g, text, right ? px - 9 : px + 9, middle, { align: right ? "right" : "left", base: "middle", halo: true, weight: 700, colour: C.text });
  }
  charts.push({ ...chart, kind: "plane", spots });
  return spots.map(({ name, risk: r }) => ({ code: name, level: r.level, ttc: r.ttc, index: r.index, ttc_ahead: r.ttc_ahead, index_ahead: r.index_ahead, now: region(r.ttc, r.index), later: region(r.ttc_ahead, r.index_ahead) }));
}

function outlined(g, colour, path) {
  for (const [width, style] of [[5, C.halo], [2.2, colour]]) {
    g.beginPath();
    path();
    g.lineWidth = width;
    g.strokeStyle = style;
    g.stroke();
  }
}

const ring = (g, x, y) => outlined(g, C.people, () => g.arc(x, y, 5, 0, 2 * Math.PI));
const square = (g, x, y) => outlined(g, C.partner, () => g.rect(x - 4.5, y - 4.5, 9, 9));

export function paint(g, width, height, dpr) {
  clear(g, width, height);
  charts = [];
  if (!settle()) {
    message(g, width, height, `${nameOf(state.own)} has no position yet`);
    return { state: { kind: "people", own: state.own, tracks: [] }, age: Infinity, label: "People: no position yet" };
  }
  const t = size("tick");
  const third = Math.round(0.3 * width);
  const foot = Math.round(1.35 * t); // for the legend
  const now = state.snapshot.time;
  axisOverTime(g, { left: 4, right: third, height: height - foot }, 0, now);
  axisOverTime(g, { left: third + 4, right: 2 * third, height: height - foot }, 1, now);
  const seen = plane(g, { left: 2 * third + 6, right: width - 4, height: height - foot }, dpr);
  legend(g, 6, height - 0.6 * t, width - 10, [
    [swatches.line(C.people), "as it was"],
    [swatches.line(C.people, [1.5, 3], 1.6), "foretold 1 s before"],
    [swatches.glyph((c, x, y) => ring(c, x, y)), "now"],
    [swatches.glyph((c, x, y) => times(c, x, y, 4.5)), "in 1 s"],
    [swatches.line(C.second), "object"],
    [swatches.glyph((c, x, y) => square(c, x, y)), "machine"],
  ]);
  const worst = seen.filter(({ level }) => level !== "SAFE").map((s) => `${s.code} ${s.level}`);
  return {
    state: {
      kind: "people", own: state.own, half: view.half, unknown: unknown(), plane: seen,
      tracks: tracks().map((track) => ({ code: code(track), points: history(track.id).length, place: track.position.slice(0, 2), ahead: track.ahead?.position ?? null })),
    },
    age: age(),
    label: unknown() ? `People unknown: ${unknown()}` : `${tracks().length} people and objects over ${PAST} s and on the TTC–x plane of ${nameOf(state.own)}: ${worst.join(", ") || "all safe"}; ${ageText(age())}`,
  };
}

export function probe(px, py) {
  const hit = charts.find(({ box }) => px >= box.left && px <= box.right && py >= box.top && py <= box.bottom);
  if (!hit) return null;
  if (hit.kind === "plane") {
    const near = hit.spots.filter(({ now, later }) => [now, later].some(([u, v]) => Math.hypot(u - px, v - py) < 10));
    if (near.length) return near.slice(0, 3).flatMap(({ name, risk: r }) => [name, ...riskLine(r)]);
    const ttc = hit.x.inverse(px), index = hit.y.inverse(py);
    return [`TTC ${number(ttc, 1)} s, x ${number(index, 1)}: ${region(ttc, index)}`, "○ now, × in 1 s; the lower of the two counts"];
  }
  const s = Math.min(hit.x.inverse(px), 0), value = hit.y.inverse(py), k = hit.k;
  const origin = (state.site?.frame?.origin ?? [0, 0, 0])[k];
  const lines = [`${number(-s, 1)} s ago, ${"EN"[k]} ${number(value + origin, 1)} m`];
  for (const track of tracks().slice(0, 6)) {
    const points = history(track.id);
    const nearest = (t) => points.reduce((best, p) => (Math.abs(p.time - t) < Math.abs((best?.time ?? Infinity) - t) ? p : best), null);
    const was = nearest(hit.now + s), told = nearest(hit.now + s - AHEAD);
    if (!was || Math.abs(was.time - hit.now - s) > GAP) continue;
    const apart = told?.ahead && Math.abs(told.time + AHEAD - hit.now - s) < GAP ? `, foretold ${number(Math.hypot(told.ahead[0] - was.place[0], told.ahead[1] - was.place[1]), 2)} m off` : "";
    lines.push(`${code(track)} ${number(was.place[k] + origin, 2)} m${apart}`);
  }
  return lines;
}

