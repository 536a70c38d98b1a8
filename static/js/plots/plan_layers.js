// What the plan shows, layer by layer. All points are in the site frame [m].

import { C, LEVEL_COLOUR, hatch, rgba, size } from "../theme.js";
import { grouped, metres, ticks } from "../axis.js";
import { label, segment } from "../pen.js";
import { cross } from "../glyphs.js";
import { edgeDistance, inside } from "../geometry.js";
import { isOwnTrack, volumes } from "../gauge/model.js";
import { atLeast, label as nameOf, machine, pair, partnerLevel, silence, state } from "../state.js";

/** Of the present drawing: at([E, N]) -> [x, y] and back(x, y) -> [E, N]; px per metre; box; view; where words stand. */
export const chart = { at: null, back: null, px: 1, box: null, view: null, words: [] };

/** Keeps the place of a text that was just drawn about (x, y), so that nothing less important covers it. */
function keep(g, text, x, y, high = size("tick")) {
  const half = g.measureText(text).width / 2;
  chart.words.push({ left: x - half, right: x + half, top: y - 0.6 * high, bottom: y + 0.6 * high });
}

export function zonePoints(entry) {
  const array = entry?.arrays.zone;
  if (!array) return [];
  const points = [];
  for (let i = 0; i + 1 < array.data.length; i += 2) points.push([array.data[i], array.data[i + 1]]);
  return points;
}

function trace(g, points) {
  g.beginPath();
  for (const p of points) g.lineTo(...chart.at(p));
  g.closePath();
}

export function drawZone(g, zone, dpr, colour) {
  if (zone.length < 3) return;
  trace(g, zone);
  g.fillStyle = rgba(colour, 0.35);
  g.fill();
  g.fillStyle = hatch(g, colour, dpr, 0.55);
  g.fill();
  g.lineWidth = 2;
  g.strokeStyle = colour;
  g.stroke();
}

/** Lines of equal easting and northing in the projected system; drawn through the site frame. */
export function gridLines(g) {
  const origin = state.site?.frame?.origin ?? [0, 0, 0];
  const step = { 20: 5, 30: 5, 50: 10, 100: 20 }[chart.view.width];
  const half = chart.view.width;
  const lines = [];
  for (const k of [0, 1]) {
    const centre = chart.view.centre[k] + origin[k];
    for (const value of ticks(centre - half, centre + half, 1e3, [step])) {
      const local = value - origin[k];
      const ends = [-1, 1].map((side) => (k === 0 ? [local, chart.view.centre[1] + side * half] : [chart.view.centre[0] + side * half, local]));
      const [[x0, y0], [x1, y1]] = ends.map(chart.at);
      segment(g, x0, y0, x1, y1, C.grid);
      lines.push({ k, value, x: x0, y: y0 });
    }
  }
  return { lines, origin };
}

/** Last three digits at the ticks; the rest of the coordinate stands once, in the corner. */
export function gridText(g, { lines, origin }, height, t) {
  let lastX = -Infinity;
  for (const { k, value, x, y } of lines) {
    const text = String(((Math.round(value) % 1000) + 1000) % 1000).padStart(3, "0");
    if (k === 0 && x > chart.box.left + t && x < chart.box.right - t && x - lastX > 2.4 * t) {
      label(g, text, x, chart.box.bottom + 3, { align: "center", base: "top" });
      lastX = x;
    }
    if (k === 1 && y > chart.box.top + t / 2 && y < chart.box.bottom - t / 2) label(g, text, chart.box.left - 3, y, { align: "right", base: "middle" });
  }
  const head = (k) => grouped(Math.floor((chart.view.centre[k] + origin[k]) / 1000)) + "\u202f…";
  label(g, `E ${head(0)}   N ${head(1)} m`, chart.box.left + 5, chart.box.top + 4, { base: "top", halo: true });
}

/** Where the operator of the own machine looks: along the arm. */
export function wedge(g, own) {
  if (!Number.isFinite(own.azimuth)) return;
  const from = own.swing_center ?? own.position;
  const at = (angle) => [from[0] + own.max_reach * Math.cos(angle), from[1] + own.max_reach * Math.sin(angle)];
  g.beginPath();
  g.moveTo(...chart.at(from));
  for (let i = -6; i <= 6; i++) g.lineTo(...chart.at(at(own.azimuth + (i * Math.PI) / 36)));
  g.closePath();
  g.fillStyle = "rgba(230, 234, 237, 0.07)";
  g.fill();
}

export const tint = (name) => (machine(name).validity !== "VALID" ? C.stale : name === state.own ? C.text : C.partnerLine);

export function circles(g, name) {
  const m = machine(name);
  if (!m?.swing_center) return;
  const [x, y] = chart.at(m.swing_center);
  const stale = m.validity !== "VALID";
  const ring = (radius, dash, width) => {
    if (!Number.isFinite(radius)) return;
    g.beginPath();
    g.arc(x, y, radius * chart.px, 0, 2 * Math.PI);
    g.setLineDash(dash);
    g.lineWidth = width;
    g.strokeStyle = rgba(tint(name), name === state.own ? 0.75 : 0.6);
    g.stroke();
    g.setLineDash([]);
  };
  ring(m.reach, stale ? [1, 4] : [], 1.6);
  ring(m.max_reach, stale ? [1, 4] : [7, 5], 1.2);
}

export function outlines(g, name) {
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

/** The rectangle of an upright box on the ground. */
export function footprint({ center, rotation, half_extents: half }) {
  if (!center || !half) return null;
  const R = rotation ?? [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  return [[1, 1], [-1, 1], [-1, -1], [1, -1]].map(([a, b]) => [0, 1].map((k) => center[k] + a * half[0] * R[k][0] + b * half[1] * R[k][1]));
}

export function obstacles(g) {
  for (const obstacle of state.site?.obstacles ?? []) {
    const outline = obstacle.outline ?? footprint(obstacle);
    if (!outline?.length) continue;
    trace(g, outline);
    g.fillStyle = "rgba(62, 142, 120, 0.45)";
    g.fill();
    g.lineWidth = 2;
    g.strokeStyle = "#3E8E78";
    g.stroke();
    const [x, y] = chart.at(outline[0]);
    label(g, obstacle.name ?? "", x + 4, y, { halo: true });
  }
}

/** The working gauge from above. A ceiling is everywhere and so is not drawn. */
export function gauge(g) {
  const middle = chart.view.centre;
  for (const volume of volumes()) {
    if (volume.idle || volume.kind === "ceiling") continue;
    const own = isOwnTrack(volume.name);
    let named = null;
    g.beginPath();
    for (const { exterior, holes } of volume.plan) {
      for (const ring of [exterior, ...holes]) {
        ring.forEach((point, k) => {
          g[k ? "lineTo" : "moveTo"](...chart.at(point));
          const far = Math.hypot(point[0] - middle[0], point[1] - middle[1]);
          if (!named || far < named.far) named = { point, far };
        });
        g.closePath();
      }
    }
    if (!named) continue;
    // What the own machine stands on does not hold for it.
    g.fillStyle = rgba(C.site, own ? 0.04 : 0.14);
    g.fill("evenodd");
    g.setLineDash(own ? [1.5, 4] : [6, 3]);
    g.lineWidth = 1.2;
    g.strokeStyle = C.site;
    g.stroke();
    g.setLineDash([]);
    label(g, own ? `${volume.name} (own track)` : volume.name, ...chart.at(named.point), { halo: true });
  }
}

/** ISO 5006: the visibility circle of 12 m radius and the rectangle 1 m outside the machine. */
export function iso(g, own) {
  const [x, y] = chart.at(own.swing_center ?? own.position);
  g.setLineDash([2, 3]);
  g.lineWidth = 1.2;
  g.strokeStyle = C.second;
  g.beginPath();
  g.arc(x, y, 12 * chart.px, 0, 2 * Math.PI);
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
export function exitArrow(g, own, zone) {
  if (zone.length < 3 || !own.position || !inside(own.position, zone)) return null;
  const { distance, point } = edgeDistance(own.position, zone);
  return drawArrow(g, own.position, point, distance);
}

export function drawArrow(g, from, to, distance) {
  const [x0, y0] = chart.at(from), [x1, y1] = chart.at(to);
  const a = Math.atan2(y1 - y0, x1 - x0);
  for (const [w, colour] of [[5, C.halo], [2.5, C.text]]) {
    segment(g, x0, y0, x1, y1, colour, w);
    g.beginPath();
    g.moveTo(x1 - 9 * Math.cos(a - 0.5), y1 - 9 * Math.sin(a - 0.5));
    g.lineTo(x1, y1);
    g.lineTo(x1 - 9 * Math.cos(a + 0.5), y1 - 9 * Math.sin(a + 0.5));
    g.stroke();
  }
  const left = x1 < (chart.box.left + chart.box.right) / 2;
  const clampX = Math.min(Math.max(x1 + (left ? -6 : 6), chart.box.left + 60), chart.box.right - 60);
  const clampY = Math.min(Math.max(y1 + (y1 < y0 ? -6 : 14), chart.box.top + 16), chart.box.bottom - 8);
  label(g, `out ${metres(distance)}`, clampX, clampY, { align: left ? "right" : "left", colour: C.text, halo: true });
  return Math.round(distance * 1000) / 1000;
}

export function nearestLine(g) {
  const p = pair(state.own, state.partner);
  if (!p) return null;
  if (p.distance === null && atLeast(p) !== null && silence() <= 1) return null; // far apart: no points to join
  const distance = silence() > 1 ? null : p.distance;
  if (!p.points || distance === null) {
    const a = machine(state.own)?.swing_center, b = machine(state.partner)?.swing_center;
    if (a && b) {
      const [[x0, y0], [x1, y1]] = [chart.at(a), chart.at(b)];
      segment(g, x0, y0, x1, y1, C.unknown, 2, [5, 5]);
      label(g, "? clearance unknown", (x0 + x1) / 2, (y0 + y1) / 2 - 6, { align: "center", colour: C.text, weight: 700, halo: true });
    }
    return null;
  }
  const [[x0, y0], [x1, y1]] = p.points.map(chart.at);
  const colour = LEVEL_COLOUR[partnerLevel(distance)] ?? C.text;
  const a = Math.atan2(y1 - y0, x1 - x0) + Math.PI / 2;
  for (const [w, style] of [[5, C.halo], [2.5, colour]]) {
    segment(g, x0, y0, x1, y1, style, w);
    for (const [x, y] of [[x0, y0], [x1, y1]]) segment(g, x - 5 * Math.cos(a), y - 5 * Math.sin(a), x + 5 * Math.cos(a), y + 5 * Math.sin(a), style, w);
  }
  const mx = Math.min(Math.max((x0 + x1) / 2, chart.box.left + 30), chart.box.right - 30);
  const my = Math.min(Math.max((y0 + y1) / 2 - 12, chart.box.top + 16), chart.box.bottom - 4);
  label(g, metres(distance), mx, my, { align: "center", colour, weight: 700, name: "t3", halo: true });
  keep(g, metres(distance), mx, my - 0.4 * size("t3"), size("t3"));
  return distance;
}

export function base(g, name) {
  const m = machine(name);
  if (!m?.position) return;
  const [x, y] = chart.at(m.position);
  cross(g, x, y, name === state.own ? "#FFFFFF" : tint(name), name === state.own ? 7 : 5);
  const above = state.partner && m.position[1] >= Math.max(...[state.own, state.partner].map((k) => machine(k)?.position?.[1] ?? -Infinity));
  const r = (m.max_reach ?? 4) * 0.36 * chart.px + size("tick");
  // Outwards, so that the distance has its place between the two names.
  const other = machine(name === state.own ? state.partner : state.own);
  const out = other?.position && machine(name) !== other ? Math.sign(x - chart.at(other.position)[0]) * 1.2 * size("tick") : 0;
  const at = { x: x + out, y: above ? y - r : y + r };
  label(g, nameOf(name), at.x, at.y, { align: "center", base: "middle", colour: tint(name), weight: 600, halo: true });
  keep(g, nameOf(name), at.x, at.y);
}

export function north(g, turn) {
  const x = chart.box.right - 16, y = chart.box.top + 24;
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
  label(g, "N", x - 18, y, { align: "center", base: "middle", halo: true });
}
