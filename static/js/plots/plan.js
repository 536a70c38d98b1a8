// The plan view: grid coordinates, warning zone, workspaces, outlines, nearest points.

import { C, LEVEL_COLOUR, hatch, rgba, size } from "../theme.js";
import { degrees, grouped, metres, number, scale, ticks } from "../axis.js";
import { clear, label, legend, message, polygon, segment, swatches } from "../pen.js";
import { cross } from "../glyphs.js";
import { $, partName, write } from "../words.js";
import { image, imageAge, label as nameOf, machine, names, pair, partnerLevel, silence, snapshotAge, state } from "../state.js";
import { surface } from "../surface.js";
import { edgeDistance, inside } from "../geometry.js";

const WIDTHS = [20, 30, 50, 100];

const view = { width: null, centre: null, tracksUp: false, iso: false, subject: "" };
let map = null; // {x(E, N), y(E, N), back(px, py)}
let box = null;

/** The view is chosen once per pair and moved only when a machine leaves its middle part. */
function settle() {
  const shown = [machine(state.own), machine(state.partner)].filter((m) => m?.position);
  if (!shown.length) return false;
  const subject = `${state.own} ${state.partner}`;
  const middle = [0, 1].map((k) => Math.round(shown.reduce((sum, m) => sum + (m.swing_center ?? m.position)[k], 0) / shown.length));
  if (view.width === null) {
    const need = Math.max(...shown.map((m) => Math.max(...[0, 1].map((k) => Math.abs(m.position[k] - middle[k]))) + (m.max_reach ?? 4)));
    view.width = WIDTHS.find((w) => w >= 2 * need + 0.5) ?? 100;
  }
  const strayed = view.centre && shown.some((m) => Math.hypot(m.position[0] - view.centre[0], m.position[1] - view.centre[1]) > 0.42 * view.width);
  if (!view.centre || subject !== view.subject || strayed) view.centre = middle;
  view.subject = subject;
  write($("plan-scale"), `${view.width} m`);
  return true;
}

function paint(g, width, height, dpr) {
  clear(g, width, height);
  const own = machine(state.own);
  if (!own || !settle()) {
    message(g, width, height, "no position yet");
    return { state: { own: state.own, zone: 0 }, age: Infinity, label: "Plan: no position yet" };
  }
  const t = size("tick");
  box = { left: Math.round(2.2 * t), top: 4, right: width - 4, bottom: height - Math.round(2.9 * t) };
  const px = Math.min(box.right - box.left, box.bottom - box.top) / view.width;
  const cx = (box.left + box.right) / 2, cy = (box.top + box.bottom) / 2;
  const turn = view.tracksUp ? Math.PI / 2 - own.yaw : 0;
  const c = Math.cos(turn), s = Math.sin(turn);
  map = {
    px,
    at: ([e, n]) => [cx + px * (c * (e - view.centre[0]) - s * (n - view.centre[1])), cy - px * (s * (e - view.centre[0]) + c * (n - view.centre[1]))],
    back: (x, y) => {
      const u = (x - cx) / px, v = (cy - y) / px;
      return [view.centre[0] + c * u + s * v, view.centre[1] - s * u + c * v];
    },
  };
  g.save();
  g.beginPath();
  g.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
  g.clip();
  g.fillStyle = C.free;
  g.fillRect(box.left, box.top, box.right - box.left, box.bottom - box.top);
  const grid = gridLines(g);
  wedge(g, own);
  const entry = image();
  const zone = zonePoints(entry);
  drawZone(g, zone, dpr);
  for (const name of names()) circles(g, name);
  obstacles(g);
  for (const name of names()) if (name !== state.own) outlines(g, name);
  outlines(g, state.own);
  if (view.iso) iso(g, own);
  const exit = exitArrow(g, own, zone);
  const nearest = nearestLine(g);
  for (const name of names()) base(g, name);
  north(g, turn);
  g.restore();
  if (!view.tracksUp) gridText(g, grid, height, t);
  const age = Math.max(snapshotAge(), entry ? imageAge(entry) : 0);
  legend(g, 6, height - 0.65 * t, width - 8, [
    [swatches.area(hatch(g, C.partner, dpr), C.partner), "zone for ✚"],
    [swatches.line(C.text), "reach now"],
    [swatches.line(C.text, [4, 3], 1.5), "max"],
  ]);
  return {
    state: {
      own: state.own, partner: state.partner, width: view.width, centre: view.centre, up: view.tracksUp ? "tracks" : "north",
      base: own.position?.slice(0, 2), zone: zone.length, exit, nearest, machines: names().filter((name) => machine(name)?.outlines).length,
    },
    age,
    label: `Plan of ${view.width} m: ${nameOf(state.own)} base at ${own.position_projected ? own.position_projected.slice(0, 2).map((v) => v.toFixed(1)).join(", ") : "unknown"}; nearest distance to ${nameOf(state.partner)} ${nearest === null ? "unknown" : metres(nearest)}${exit ? `; base inside the warning zone by ${metres(exit)}` : ""}`,
  };
}

function zonePoints(entry) {
  const array = entry?.arrays.zone;
  if (!array) return [];
  const points = [];
  for (let i = 0; i + 1 < array.data.length; i += 2) points.push([array.data[i], array.data[i + 1]]);
  return points;
}

function trace(g, points) {
  g.beginPath();
  for (const p of points) g.lineTo(...map.at(p));
  g.closePath();
}

function drawZone(g, zone, dpr) {
  if (zone.length < 3) return;
  trace(g, zone);
  g.fillStyle = rgba(C.partner, 0.35);
  g.fill();
  g.fillStyle = hatch(g, C.partner, dpr, 0.55);
  g.fill();
  g.lineWidth = 2;
  g.strokeStyle = C.partner;
  g.stroke();
}

/** Lines of equal easting and northing in the projected system; drawn through the site frame. */
function gridLines(g) {
  const origin = state.site?.frame?.origin ?? [0, 0, 0];
  const step = { 20: 5, 30: 5, 50: 10, 100: 20 }[view.width];
  const half = view.width;
  const lines = [];
  for (const k of [0, 1]) {
    const centre = view.centre[k] + origin[k];
    for (const value of ticks(centre - half, centre + half, 1e3, [step])) {
      const local = value - origin[k];
      const ends = [-1, 1].map((side) => (k === 0 ? [local, view.centre[1] + side * half] : [view.centre[0] + side * half, local]));
      const [[x0, y0], [x1, y1]] = ends.map(map.at);
      segment(g, x0, y0, x1, y1, C.grid);
      lines.push({ k, value, x: x0, y: y0 });
    }
  }
  return { lines, origin };
}

/** Last three digits at the ticks; the rest of the coordinate stands once, in the corner. */
function gridText(g, { lines, origin }, height, t) {
  let lastX = -Infinity;
  for (const { k, value, x, y } of lines) {
    const text = String(((Math.round(value) % 1000) + 1000) % 1000).padStart(3, "0");
    if (k === 0 && x > box.left + t && x < box.right - 8.2 * t && x - lastX > 2.4 * t) {
      label(g, text, x, box.bottom + 3, { align: "center", base: "top" });
      lastX = x;
    }
    if (k === 1 && y > box.top + t / 2 && y < box.bottom - t / 2) label(g, text, box.left - 3, y, { align: "right", base: "middle" });
  }
  const head = (k) => grouped(Math.floor((view.centre[k] + origin[k]) / 1000)) + "\u202f…";
  label(g, `E ${head(0)}  N ${head(1)} m`, box.right, box.bottom + 3, { align: "right", base: "top" });
}

/** Where the operator of the own machine looks: along the arm. */
function wedge(g, own) {
  if (!Number.isFinite(own.azimuth)) return;
  const from = own.swing_center ?? own.position;
  const at = (angle) => [from[0] + own.max_reach * Math.cos(angle), from[1] + own.max_reach * Math.sin(angle)];
  g.beginPath();
  g.moveTo(...map.at(from));
  for (let i = -6; i <= 6; i++) g.lineTo(...map.at(at(own.azimuth + (i * Math.PI) / 36)));
  g.closePath();
  g.fillStyle = "rgba(230, 234, 237, 0.07)";
  g.fill();
}

const tint = (name) => (machine(name).validity !== "VALID" ? C.stale : name === state.own ? C.text : C.partnerLine);

function circles(g, name) {
  const m = machine(name);
  if (!m?.swing_center) return;
  const [x, y] = map.at(m.swing_center);
  const stale = m.validity !== "VALID";
  const ring = (radius, dash, width) => {
    if (!Number.isFinite(radius)) return;
    g.beginPath();
    g.arc(x, y, radius * map.px, 0, 2 * Math.PI);
    g.setLineDash(dash);
    g.lineWidth = width;
    g.strokeStyle = rgba(tint(name), name === state.own ? 0.75 : 0.6);
    g.stroke();
    g.setLineDash([]);
  };
  ring(m.reach, stale ? [1, 4] : [], 1.6);
  ring(m.max_reach, stale ? [1, 4] : [7, 5], 1.2);
}

function outlines(g, name) {
  const m = machine(name);
  if (!m?.outlines) return;
  const stale = m.validity !== "VALID";
  const colour = tint(name);
  for (const part of ["tracks", "upper", "boom", "stick", "bucket", "tilt", "rotate"]) {
    const points = m.outlines[part];
    if (!points?.length) continue;
    trace(g, points);
    g.fillStyle = part === "tracks" ? "rgba(15, 20, 24, 0.75)" : rgba(colour, stale ? 0.08 : part === "upper" ? 0.22 : 0.4);
    g.fill();
    if (stale) g.setLineDash([2, 3]);
    g.lineWidth = part === "tracks" ? 1 : 1.4;
    g.strokeStyle = part === "tracks" ? rgba(colour, 0.6) : colour;
    g.stroke();
    g.setLineDash([]);
  }
}

function obstacles(g) {
  for (const { outline, name } of state.site?.obstacles ?? []) {
    if (!outline?.length) continue;
    trace(g, outline);
    g.fillStyle = "rgba(62, 142, 120, 0.45)";
    g.fill();
    g.lineWidth = 2;
    g.strokeStyle = "#3E8E78";
    g.stroke();
    const [x, y] = map.at(outline[0]);
    label(g, name ?? "", x + 4, y, { halo: true });
  }
}

/** ISO 5006: the visibility circle of 12 m radius and the rectangle 1 m outside the machine. */
function iso(g, own) {
  const [x, y] = map.at(own.swing_center ?? own.position);
  g.setLineDash([2, 3]);
  g.lineWidth = 1.2;
  g.strokeStyle = C.second;
  g.beginPath();
  g.arc(x, y, 12 * map.px, 0, 2 * Math.PI);
  g.stroke();
  const tracks = state.site?.machines[state.own]?.tracks;
  if (tracks && own.position) {
    const a = tracks.length / 2 + 1, b = (tracks.gauge + tracks.shoe) / 2 + 1;
    const c = Math.cos(own.yaw), s = Math.sin(own.yaw);
    trace(g, [[a, b], [-a, b], [-a, -b], [a, -b]].map(([u, v]) => [own.position[0] + c * u - s * v, own.position[1] + s * u + c * v]));
    g.stroke();
  }
  g.setLineDash([]);
}

/** The shortest way out of the warning zone for the base point, when it is inside. */
function exitArrow(g, own, zone) {
  if (zone.length < 3 || !own.position || !inside(own.position, zone)) return null;
  const { distance, point } = edgeDistance(own.position, zone);
  const [x0, y0] = map.at(own.position), [x1, y1] = map.at(point);
  const a = Math.atan2(y1 - y0, x1 - x0);
  for (const [w, colour] of [[5, C.halo], [2.5, C.text]]) {
    segment(g, x0, y0, x1, y1, colour, w);
    g.beginPath();
    g.moveTo(x1 - 9 * Math.cos(a - 0.5), y1 - 9 * Math.sin(a - 0.5));
    g.lineTo(x1, y1);
    g.lineTo(x1 - 9 * Math.cos(a + 0.5), y1 - 9 * Math.sin(a + 0.5));
    g.stroke();
  }
  const left = x1 < (box.left + box.right) / 2;
  const clampX = Math.min(Math.max(x1 + (left ? -6 : 6), box.left + 60), box.right - 60);
  const clampY = Math.min(Math.max(y1 + (y1 < y0 ? -6 : 14), box.top + 16), box.bottom - 8);
  label(g, `out ${metres(distance)}`, clampX, clampY, { align: left ? "right" : "left", colour: C.text, halo: true });
  return Math.round(distance * 1000) / 1000;
}

function nearestLine(g) {
  const p = pair(state.own, state.partner);
  if (!p) return null;
  const distance = silence() > 1 ? null : p.distance;
  if (!p.points || distance === null) {
    const a = machine(state.own)?.swing_center, b = machine(state.partner)?.swing_center;
    if (a && b) {
      const [[x0, y0], [x1, y1]] = [map.at(a), map.at(b)];
      segment(g, x0, y0, x1, y1, C.unknown, 2, [5, 5]);
      label(g, "? clearance unknown", (x0 + x1) / 2, (y0 + y1) / 2 - 6, { align: "center", colour: C.text, weight: 700, halo: true });
    }
    return null;
  }
  const [[x0, y0], [x1, y1]] = p.points.map(map.at);
  const colour = LEVEL_COLOUR[partnerLevel(distance)] ?? C.text;
  const a = Math.atan2(y1 - y0, x1 - x0) + Math.PI / 2;
  for (const [w, style] of [[5, C.halo], [2.5, colour]]) {
    segment(g, x0, y0, x1, y1, style, w);
    for (const [x, y] of [[x0, y0], [x1, y1]]) segment(g, x - 5 * Math.cos(a), y - 5 * Math.sin(a), x + 5 * Math.cos(a), y + 5 * Math.sin(a), style, w);
  }
  const mx = Math.min(Math.max((x0 + x1) / 2, box.left + 30), box.right - 30);
  const my = Math.min(Math.max((y0 + y1) / 2 - 12, box.top + 16), box.bottom - 4);
  label(g, metres(distance), mx, my, { align: "center", colour, weight: 700, name: "t3", halo: true });
  return distance;
}

function base(g, name) {
  const m = machine(name);
  if (!m?.position) return;
  const [x, y] = map.at(m.position);
  cross(g, x, y, name === state.own ? "#FFFFFF" : tint(name), name === state.own ? 7 : 5);
  const above = state.partner && m.position[1] >= Math.max(...[state.own, state.partner].map((k) => machine(k)?.position?.[1] ?? -Infinity));
  const r = (m.max_reach ?? 4) * 0.36 * map.px + size("tick");
  label(g, nameOf(name), x, above ? y - r : y + r, { align: "center", base: "middle", colour: tint(name), weight: 600, halo: true });
}

function north(g, turn) {
  const x = box.right - 16, y = box.top + 24;
  const dx = -Math.sin(turn), dy = -Math.cos(turn);
  g.lineJoin = "round";
  g.beginPath();
  g.moveTo(x + 12 * dx, y + 12 * dy);
  g.lineTo(x - 8 * dx + 6 * dy, y - 8 * dy - 6 * dx);
  g.lineTo(x - 4 * dx, y - 4 * dy);
  g.lineTo(x - 8 * dx - 6 * dy, y - 8 * dy + 6 * dx);
  g.closePath();
  g.lineWidth = 3;
  g.strokeStyle = C.halo;
  g.stroke();
  g.fillStyle = C.second;
  g.fill();
  label(g, "N", x - 19 * dx * 0 - 18, y, { align: "center", base: "middle", halo: true });
}

function probe(x, y) {
  const own = machine(state.own);
  if (!map || !own || x < box.left || x > box.right || y < box.top || y > box.bottom) return null;
  const [e, n] = map.back(x, y);
  const origin = state.site?.frame?.origin ?? [0, 0, 0];
  const lines = [`E ${(e + origin[0]).toFixed(1)} m, N ${(n + origin[1]).toFixed(1)} m`];
  const zone = zonePoints(image());
  if (zone.length > 2) lines.push(inside([e, n], zone) ? `inside ${nameOf(state.own)}'s warning zone (${nameOf(state.partner)})` : `free for ${nameOf(state.own)}'s base (Sun)`);
  const from = own.swing_center ?? own.position;
  if (from) lines.push(`${number(Math.hypot(e - from[0], n - from[1]), 2)} m from ${nameOf(state.own)}, azimuth ${degrees(Math.atan2(n - from[1], e - from[0]))}`);
  if (zone.length > 2 && own.position) {
    const { distance } = edgeDistance(own.position, zone);
    lines.push(`base ✚ ${metres(distance)} ${inside(own.position, zone) ? "inside" : "outside"} the zone`);
  }
  const p = pair(state.own, state.partner);
  if (p && p.distance !== null) lines.push(`nearest: ${partName(p.body_a)} ↔ ${nameOf(p.b)} ${partName(p.body_b)} ${metres(p.distance)}`);
  return lines;
}

export function plan() {
  const s = surface($("plan"), paint, probe);
  const redraw = () => { s.dirty = true; s.last = -Infinity; };
  $("plan-scale").addEventListener("click", () => {
    view.width = WIDTHS[(WIDTHS.indexOf(view.width) + 1) % WIDTHS.length];
    redraw();
  });
  $("plan-up").addEventListener("click", () => {
    view.tracksUp = !view.tracksUp;
    write($("plan-up"), view.tracksUp ? "Tracks" : "N");
    redraw();
  });
  $("plan-iso").addEventListener("click", (event) => {
    view.iso = !view.iso;
    event.currentTarget.setAttribute("aria-pressed", String(view.iso));
    redraw();
  });
  return s;
}
