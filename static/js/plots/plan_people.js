// People and objects on the plan: where they are, were a moment ago, will be in a second, and were last seen.

import { C, font, rgba, size } from "../theme.js";
import { metres, number } from "../axis.js";
import { fit, label, segment } from "../pen.js";
import { partName } from "../words.js";
import { label as nameOf, state } from "../state.js";
import { age, areaWords, code, ellipse, heading, history, inside, level, lost, people, risks, tracks, unknown } from "../people/model.js";
import { chart } from "./plan_layers.js";

const TAIL = 3; // s
const NEAR = 12; // of the pointer to a mark [px]
export const COLOUR = { SAFE: C.people, WARNING: C.slow, EMERGENCY: C.stopLine };

export const ORDER = ["EMERGENCY", "WARNING", "SAFE"];

const radius = () => 0.36 * size("tick");

/** The outline of a level: triangle or octagon around the mark. */
function levelRing(g, x, y, r, what) {
  g.beginPath();
  if (what === "WARNING") {
    g.moveTo(x, y - 2.5 * r); g.lineTo(x + 2.4 * r, y + 1.6 * r); g.lineTo(x - 2.4 * r, y + 1.6 * r); g.closePath();
  } else for (let i = 0; i < 9; i++) g.lineTo(x + 2.2 * r * Math.cos(Math.PI / 8 + (i * Math.PI) / 4), y + 2.2 * r * Math.sin(Math.PI / 8 + (i * Math.PI) / 4));
  g.closePath();
  for (const [width, style] of [[5, C.halo], [2.5, COLOUR[what]]]) {
    g.lineWidth = width;
    g.strokeStyle = style;
    g.stroke();
  }
}

/** Person ● or object ■: hollow while tentative, dashed while it is only foretold, dotted and grey when old. */
export function mark(g, x, y, { kind, status, old = false, what = "SAFE", r = radius() }) {
  g.lineJoin = "round";
  if (what !== "SAFE" && !old) levelRing(g, x, y, r, what);
  const colour = old ? C.stale : C.people;
  const shape = () => {
    g.beginPath();
    if (kind === "object") g.rect(x - 0.9 * r, y - 0.9 * r, 1.8 * r, 1.8 * r);
    else g.arc(x, y, r, 0, 2 * Math.PI);
  };
  shape();
  g.lineWidth = 4;
  g.strokeStyle = C.halo;
  g.stroke();
  g.fillStyle = status === "confirmed" && !old ? colour : C.halo;
  g.fill();
  g.setLineDash(old ? [1.5, 2.5] : status === "coasting" ? [3, 2.5] : []);
  g.lineWidth = 1.6;
  g.strokeStyle = colour;
  g.stroke();
  g.setLineDash([]);
}

export function times(g, x, y, r, colour = C.people) {
  for (const [width, style] of [[4, C.halo], [1.8, colour]]) {
    segment(g, x - r, y - r, x + r, y + r, style, width);
    segment(g, x - r, y + r, x + r, y - r, style, width);
  }
}

function tail(g, track) {
  const now = state.snapshot.time;
  g.beginPath();
  let before = null;
  for (const { time, place } of history(track.id)) {
    if (time < now - TAIL) continue;
    g[before !== null && time - before < 0.5 ? "lineTo" : "moveTo"](...chart.at(place));
    before = time;
  }
  g.lineTo(...chart.at(track.position));
  g.lineWidth = 2;
  g.strokeStyle = rgba(C.people, 0.45);
  g.stroke();
}

function foretold(g, track) {
  const place = track.ahead?.position;
  if (!place || track.status === "tentative") return;
  const [x0, y0] = chart.at(track.position), [x, y] = chart.at(place);
  segment(g, x0, y0, x, y, rgba(C.people, 0.7), 1.2);
  const shape = ellipse(track);
  if (shape) {
    g.beginPath();
    for (let i = 0; i <= 36; i++) {
      const a = (i * Math.PI) / 18, u = shape.long * Math.cos(a), v = shape.wide * Math.sin(a);
      const c = Math.cos(shape.angle), s = Math.sin(shape.angle);
      g.lineTo(...chart.at([place[0] + c * u - s * v, place[1] + s * u + c * v]));
    }
    g.lineWidth = 1.2;
    g.strokeStyle = rgba(C.people, 0.8);
    g.stroke();
  }
  times(g, x, y, 0.7 * radius());
}

function tick(g, track, x, y, colour) {
  const a = heading(track);
  if (!Number.isFinite(a)) return;
  const [u, v] = chart.at([track.position[0] + Math.cos(a), track.position[1] + Math.sin(a)]);
  const d = Math.hypot(u - x, v - y) || 1, r = radius();
  const end = [x + ((u - x) / d) * 2 * r, y + ((v - y) / d) * 2 * r];
  for (const [width, style] of [[5, C.halo], [2.2, colour]]) segment(g, x, y, ...end, style, width);
}

export const overlap = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
const around = (x, y, gap) => ({ left: x - gap, right: x + gap, top: y - gap, bottom: y + gap });

/** The place of a label at a mark that covers least of what is in `taken` yet: to the right, to the left, above or below. Returns what draws it. */
function beside(g, text, x, y, gap, taken, options) {
  const t = size("tick"), { box } = chart;
  g.font = font("tick", options.weight);
  const w = g.measureText(text).width;
  const middle = Math.min(Math.max(x - w / 2, box.left + 3), box.right - 3 - w);
  const places = [[x + gap, y], [x - gap - w, y], [middle, y - gap - 0.6 * t], [middle, y + gap + 0.6 * t], [middle, y - gap - 1.8 * t], [middle, y + gap + 1.8 * t]].map(([left, at]) => ({ left, right: left + w, top: at - 0.6 * t, bottom: at + 0.6 * t, at }));
  const inBox = places.filter((p) => p.left >= box.left + 2 && p.right <= box.right - 2 && p.top >= box.top && p.bottom <= box.bottom);
  const covered = (p) => taken.filter((other) => overlap(p, other)).length;
  const place = [...inBox].sort((a, b) => covered(a) - covered(b))[0] ?? places[2];
  taken.push(place);
  return () => label(g, text, place.left, place.at, { base: "middle", halo: true, ...options });
}

const ago = ({ seen }) => `last seen ${number(seen, seen < 9.95 ? 1 : 0)} s ago`;

function gone(g, one) {
  const [x, y] = chart.at(one.position), r = 1.5 * radius();
  g.beginPath();
  g.arc(x, y, r, 0, 2 * Math.PI);
  g.fillStyle = rgba(C.halo, 0.8);
  g.fill();
  g.setLineDash([3, 2.5]);
  g.lineWidth = 1.6;
  g.strokeStyle = C.people;
  g.stroke();
  g.setLineDash([]);
  label(g, "?", x, y + 0.5, { align: "center", base: "middle", colour: C.people, weight: 700 });
}

/** What a track is called on the plan: its distance too where it matters. */
function title(track, what) {
  const near = risks(track.id)[0];
  return what === "SAFE" || !near ? code(track) : `${code(track)} ${metres(near.distance)}`;
}

/** Draws all; returns what is drawn, null where the site has no LiDAR. */
export function drawPeople(g) {
  const p = people();
  if (!p) return null;
  const old = unknown();
  if (!old) for (const track of tracks()) tail(g, track);
  if (!old) for (const track of tracks()) foretold(g, track);
  for (const one of lost()) gone(g, one);
  const marks = tracks().map((track) => {
    const what = level(track.id), [x, y] = chart.at(track.position);
    return { track, what, x, y, gap: (what === "SAFE" ? 1.7 : 2.6) * radius() };
  });
  const worstFirst = [...marks].sort((a, b) => ORDER.indexOf(a.what) - ORDER.indexOf(b.what));
  for (const { track, what, x, y } of [...worstFirst].reverse()) {
    if (!old) tick(g, track, x, y, C.people);
    mark(g, x, y, { ...track, old: Boolean(old), what });
  }
  const t = size("tick"), { box } = chart;
  const corners = [{ ...box, right: box.left + 12 * t, bottom: box.top + 1.3 * t }, { ...box, right: box.left + 14 * t, top: box.bottom - 1.3 * t }];
  if (old) {
    fit(g, [`? people unknown: ${old}`, "? people unknown"], box.left + 5, box.top + 4 + 1.3 * t, box.right - box.left - 48, { base: "top", colour: C.unknown, weight: 700, halo: true });
    corners.push({ ...box, bottom: box.top + 2.7 * t });
  }
  const taken = [...chart.words, ...corners, ...[...marks, ...lost().map((one) => ({ x: chart.at(one.position)[0], y: chart.at(one.position)[1], gap: 1.5 * radius() }))].map((m) => around(m.x, m.y, m.gap))];
  // Whose level is worst has the first choice of place, and lies on top.
  const labels = worstFirst.map(({ track, what, x, y, gap }) =>
    beside(g, title(track, what), x, y, gap + 3, taken, { colour: old ? C.stale : COLOUR[what], weight: what === "SAFE" ? 400 : 700 }));
  for (const one of lost()) labels.push(beside(g, `${code(one)} ${ago(one)}`, ...chart.at(one.position), 1.5 * radius() + 4, taken, { colour: C.text, weight: 400 }));
  for (const draw of labels.reverse()) draw();
  return { tracks: marks.map(({ track, what }) => [code(track), track.status, old ? "" : what]), lost: lost().map((one) => `${code(one)} ${ago(one)}`), unknown: old };
}

export const personSwatch = (g, x, y) => mark(g, x, y, { kind: "person", status: "confirmed", r: 4.5 });

const limited = (v, most) => (Number.isFinite(v) ? (v > most ? `over ${most}` : number(v, 1)) : "none");

/** What one track means for one machine, in words. */
export function riskLine(r) {
  const ttc = (v) => `TTC ${limited(v, 99)}${Number.isFinite(v) ? " s" : ""}`;
  const index = (v) => `x ${Number.isFinite(v) ? (v < -9 ? "below −9" : limited(v, 99)) : "no braking"}`;
  const where = r.body ? ` ${partName(r.body)}` : "";
  return [`${r.level} · ${nameOf(r.machine)}${where}${r.distance === undefined ? "" : ` ${metres(r.distance)}`}`, `  now ${ttc(r.ttc)}, ${index(r.index)}; in 1 s ${ttc(r.ttc_ahead)}, ${index(r.index_ahead)}`];
}

const STATUS = { confirmed: "seen", coasting: "not seen now, foretold", tentative: "perhaps" };

/** Lines on one track. */
export function trackLines(track) {
  const speed = Math.hypot(...track.velocity), far = ellipse(track);
  const size_ = track.size?.every(Number.isFinite) ? `, ${track.size.map((v) => number(v, 1)).join(" × ")} m` : "";
  return [
    `${code(track)} ${track.kind}, ${STATUS[track.status] ?? track.status}${size_}`,
    `${number(speed, 1)} m/s, ±${number(track.sigma, 2)} m, detected ${number(track.unseen, 1)} s ago`,
    ...(far ? [`in 1 s within ±${number(far.long, 1)} m (95 %)`] : []),
    ...risks(track.id).flatMap(riskLine),
    ...inside(track.id).map(areaWords),
  ];
}

/** Lines for the pointer, or nothing when nobody is near it. */
export function peopleLines(x, y) {
  const by = (one) => Math.hypot(...chart.at(one.position).map((v, k) => v - [x, y][k]));
  const nearest = [...tracks(), ...lost()].sort((a, b) => by(a) - by(b))[0];
  if (!nearest || by(nearest) > NEAR) return [];
  if (!("velocity" in nearest)) return [`${code(nearest)} ${ago(nearest)}`, "look there before you move"];
  const old = unknown();
  return old ? [`people unknown: ${old}`, `${code(nearest)} was here ${number(age(), 1)} s ago`] : trackLines(nearest);
}
