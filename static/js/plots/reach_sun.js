// Swing x reach: Sun's S^2 image (Sun 2020, Eq. (12), (13)), with the present arm as a star.

import { C, hatch, rgba, size } from "../theme.js";
import { deg, degrees, metres, number, scale, ticks } from "../axis.js";
import { clear, label, legend, message, segment, swatches } from "../pen.js";
import { star } from "../glyphs.js";
import { described, image, imageAge, imageStale, label as nameOf, machine, noImage, state, swingAt } from "../state.js";
import { ageText } from "../head.js";

const SEAM = (10 * Math.PI) / 180; // repeated on each side: 20 degrees in all
const TURN = 2 * Math.PI;

let azimuthAxis = false; // Sun's mode, 0 to 360 degrees
let box, mapX, mapY;

const modulo = (angle) => ((angle % TURN) + TURN) % TURN;
const place = (theta) => (azimuthAxis ? modulo(theta) : swingAt(state.own, theta));

/** Distance at which Sun's set starts at azimuth theta; null where it has no sample. */
export function blockedFrom(entry, theta) {
  const t = entry?.arrays.theta?.data, d = entry?.arrays.d?.data;
  if (!t || t.length < 2) return null;
  for (let j = 0; j + 1 < t.length; j++) {
    const width = t[j + 1] - t[j];
    const from = Math.min(t[j], t[j + 1]);
    const s = modulo(theta - from);
    if (s <= Math.abs(width)) {
      const f = width === 0 ? 0 : (width > 0 ? s : Math.abs(width) - s) / Math.abs(width);
      return d[j] + f * (d[j + 1] - d[j]);
    }
  }
  return null;
}

export function paint(g, width, height, dpr) {
  clear(g, width, height);
  const entry = image();
  const own = machine(state.own);
  if (!entry || !own) {
    message(g, width, height, noImage());
    return { state: { star: null, blocked: 0 }, age: Infinity, label: "Reach: no image yet" };
  }
  const { header, arrays } = entry;
  const age = imageAge(entry);
  const stale = imageStale(entry);
  const t = size("tick");
  const longest = own.max_reach ?? described(state.own)?.max_reach ?? 0;
  const top = longest + 0.5;
  box = { left: Math.round(1.9 * t), top: 4, right: width - 8, bottom: height - Math.round(2.9 * t) };
  mapX = azimuthAxis ? scale(0, TURN, box.left, box.right) : scale(Math.PI + SEAM, -Math.PI - SEAM, box.left, box.right);
  mapY = scale(0, top, box.bottom, box.top);
  const wide = box.right - box.left;

  const limit = mapY(longest);
  g.fillStyle = C.outside;
  g.fillRect(box.left, box.top, wide, box.bottom - box.top);
  g.fillStyle = C.free;
  g.fillRect(box.left, limit, wide, box.bottom - limit);

  for (const value of ticks(-190, 360, 5, [90]).filter((v) => (azimuthAxis ? v >= 0 : Math.abs(v) <= 180))) {
    const x = Math.round(mapX((value * Math.PI) / 180)) + 0.5;
    const seam = !azimuthAxis && Math.abs(value) === 180;
    segment(g, x, box.top, x, box.bottom, seam ? C.edge : C.grid, 1, seam ? [3, 3] : null);
    const text = azimuthAxis ? `${value}°` : value > 0 ? `+${value}°` : value < 0 ? `−${-value}°` : "0°";
    const align = x - box.left < 2 * t ? "left" : box.right - x < 2 * t ? "right" : "center";
    label(g, text, align === "left" ? Math.max(2, x - t) : align === "right" ? Math.min(width - 2, x + t) : x, box.bottom + 3, { align, base: "top" });
  }
  for (const value of ticks(0, top, 6)) {
    const y = Math.round(mapY(value)) + 0.5;
    segment(g, box.left, y, box.right, y, C.grid);
    label(g, number(value, 0), box.left - 5, y, { align: "right", base: "middle" });
  }

  const spans = blocked(g, arrays, limit, dpr);
  segment(g, box.left, Math.round(limit) + 0.5, box.right, Math.round(limit) + 0.5, C.edge);

  if (!spans) label(g, `${nameOf(state.partner)} is out of reach`, box.left + wide / 2, (limit + box.bottom) / 2, { align: "center", halo: true });
  const now = header.current ?? {};
  const x = place(now.theta ?? NaN);
  if (Number.isFinite(x) && Number.isFinite(now.d)) star(g, mapX(x), mapY(Math.min(now.d, top)), stale);
  label(g, "tip distance, m ↑", box.left + 5, box.top + 3, { base: "top", halo: true });
  label(g, azimuthAxis ? "azimuth from east →" : "← swing left", azimuthAxis ? box.right - 5 : box.left + 5, box.bottom - 4, { align: azimuthAxis ? "right" : "left", base: "bottom", halo: true });
  if (!azimuthAxis) label(g, "right →", box.right - 5, box.bottom - 4, { align: "right", base: "bottom", halo: true });
  label(g, `tip ${number(own.end_point?.[2], 1)} m high`, box.right - 4, box.top + 3, { align: "right", base: "top", halo: true });
  legend(g, 6, height - 0.65 * t, width - 8, [
    [swatches.area(hatch(g, C.partner, dpr), C.partner), `${nameOf(state.partner)} (Sun)`],
    [swatches.area(C.free, C.free), "free"],
    [swatches.area(C.outside, C.edge), "out of reach"],
  ]);
  if (stale) label(g, "STALE", box.left + wide / 2, box.bottom - 4, { align: "center", base: "bottom", colour: C.text, weight: 700, name: "t3", halo: true });
  return {
    state: {
      own: state.own, partner: state.partner, axis: azimuthAxis ? "azimuth" : "swing", star: [deg(x), now.d].map((v) => Math.round(v * 1e3) / 1e3), hollow: stale,
      collides: Boolean(now.collides), blocked: spans, max_reach: longest, state_time: header.state_time,
    },
    age,
    label: `Reach of ${nameOf(state.own)} against ${nameOf(state.partner)} (Sun): swing ${degrees(x)}, tip at ${metres(now.d)}, ${now.collides ? "inside" : "outside"} the blocked area; ${ageText(age)}`,
  };
}

/** Draws theta-set x {d > CO_d}, unrolled over the seam; returns the number of samples. */
function blocked(g, arrays, limit, dpr) {
  const theta = arrays.theta?.data, d = arrays.d?.data;
  if (!theta || !d || theta.length < 2) return 0;
  const start = place(theta[0]);
  const path = new Path2D();
  const edge = new Path2D();
  for (const turn of [-TURN, 0, TURN]) {
    const at = (j) => mapX(start + (theta[j] - theta[0]) + turn);
    const last = theta.length - 1;
    path.moveTo(at(0), limit);
    for (let j = 0; j <= last; j++) path.lineTo(at(j), Math.max(limit, mapY(d[j])));
    path.lineTo(at(last), limit);
    path.closePath();
    edge.addPath(path);
  }
  g.save();
  g.beginPath();
  g.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
  g.clip();
  g.fillStyle = rgba(C.partner, 0.35);
  g.fill(path);
  g.fillStyle = hatch(g, C.partner, dpr);
  g.fill(path);
  g.lineWidth = 2;
  g.strokeStyle = C.partner;
  g.stroke(edge);
  g.restore();
  return theta.length;
}

export function probe(x, y) {
  const entry = image();
  const own = machine(state.own);
  if (!entry || !own || !box || x < box.left || x > box.right || y < box.top || y > box.bottom) return null;
  const angle = mapX.inverse(x), d = mapY.inverse(y);
  const theta = azimuthAxis ? angle : angle - swingAt(state.own, 0);
  const from = blockedFrom(entry, theta);
  const verdict = d > own.max_reach ? "out of reach" : from !== null && d > from ? `${nameOf(state.partner)} from ${metres(from)} (Sun)` : from !== null ? `free up to ${metres(from)} (Sun)` : "free (Sun)";
  const now = entry.header.current ?? {};
  return [`${azimuthAxis ? "azimuth" : "swing"} ${degrees(angle)}, distance ${number(d, 2)} m`, verdict, `now ${degrees(place(now.theta))}, ${number(now.d, 2)} m`, `${ageText(imageAge(entry))} old`];
}

/** The other axis; returns how it is named. */
export function turnAxis() {
  azimuthAxis = !azimuthAxis;
  return azimuthAxis ? "0–360" : "±180";
}
