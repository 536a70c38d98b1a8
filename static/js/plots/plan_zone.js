// Exact driving zones on the plan: where the own base must not be, for the partner as it is, swinging, in any posture.

import { C, hatch, rgba, size } from "../theme.js";
import { metres } from "../axis.js";
import { label, swatches } from "../pen.js";
import { chart, drawArrow } from "./plan_layers.js";

export const view = { turning: false };

/** From the outermost, drawn first, to the one that holds now. */
const VARIANTS = [
  { name: "any_posture", text: "any posture", dash: [1.5, 4], width: 2 },
  { name: "any_swing", text: "any swing", dash: [7, 4], width: 1.8 },
  { name: "turning", text: "turning", dash: [9, 3, 1.5, 3], width: 1.5 },
  { name: "as_is", text: "as is", dash: [], width: 2 },
];

/** Rings [[[x, y], ..], ..] of a variant, holes among them. */
export function rings(entry, name) {
  const points = entry?.arrays[name]?.data, list = entry?.arrays[`${name}_rings`]?.data;
  if (!points || !list) return [];
  const found = [];
  for (let i = 0, at = 0; i + 1 < list.length; i += 2) {
    const ring = [];
    for (let k = 0; k < list[i]; k++, at++) ring.push([points[2 * at], points[2 * at + 1]]);
    found.push(ring);
  }
  return found;
}

export function path(shape) {
  const drawn = new Path2D();
  for (const ring of shape) {
    ring.forEach((p, i) => (i ? drawn.lineTo(...chart.at(p)) : drawn.moveTo(...chart.at(p))));
    drawn.closePath();
  }
  return drawn;
}

/** Returns per variant {rings, points, signed_distance}; null where it could not be computed. */
export function drawZones(g, entry, dpr, stale) {
  const colour = stale ? C.stale : C.partner;
  const drawn = {};
  for (const { name, dash, width } of VARIANTS) {
    const variant = entry.header.variants?.[name] ?? null;
    if (name === "turning" && !view.turning) continue;
    if (!variant) {
      drawn[name] = null;
      continue;
    }
    const shape = rings(entry, name);
    drawn[name] = { rings: shape.length, points: shape.reduce((n, ring) => n + ring.length, 0), signed_distance: variant.signed_distance };
    const p = path(shape);
    if (name === "as_is") {
      g.fillStyle = rgba(colour, 0.35);
      g.fill(p, "evenodd");
      g.fillStyle = hatch(g, colour, dpr, 0.55);
      g.fill(p, "evenodd");
    }
    g.setLineDash(dash);
    g.lineCap = name === "any_posture" ? "round" : "butt";
    g.lineWidth = width;
    g.strokeStyle = colour;
    g.stroke(p);
    g.setLineDash([]);
    g.lineCap = "butt";
  }
  return drawn;
}

/** The shortest way out for the base, in metres, when it is inside the zone as it is. */
export function zoneExit(g, entry, own) {
  const exit = entry.header.variants?.as_is?.exit;
  if (!exit || !own.position) return null;
  return drawArrow(g, own.position, [0, 1].map((k) => own.position[k] + exit.length * exit.direction[k]), exit.length);
}

export function distanceText(entry, name = "as_is", word = "as-is") {
  const d = entry?.header.variants?.[name]?.signed_distance;
  if (!Number.isFinite(d)) return `${word} zone unknown`;
  return `base ${metres(Math.abs(d))} ${d < 0 ? "inside" : "outside"} ${word} zone`;
}

export const zoneLegend = (g, dpr, stale, drawn) => [...VARIANTS].reverse().filter(({ name }) => drawn[name]).map(({ name, text, dash, width }) => {
  const colour = stale ? C.stale : C.partner;
  return [name === "as_is" ? swatches.area(hatch(g, colour, dpr, 0.8), colour) : swatches.line(colour, dash, width), text];
});

/** In the corner of the plan, in words. */
export function zoneNote(g, entry, stale) {
  const t = size("tick");
  label(g, stale ? "distance to the zone unknown" : distanceText(entry), chart.box.left + 5, chart.box.bottom - 0.45 * t, { colour: C.text, halo: true });
}

/** Even-odd over all rings. */
export function insideZone(point, entry, name, inside) {
  return rings(entry, name).filter((ring) => inside(point, ring)).length % 2 === 1;
}

export function zoneLines(entry, point, inside) {
  const lines = [];
  for (const { name, text } of VARIANTS.filter(({ name: n }) => n !== "turning" || view.turning).reverse()) {
    if (!entry.header.variants?.[name]) lines.push(`zone ${text}: unknown`);
    else if (insideZone(point, entry, name, inside)) lines.push(`inside the zone ${text}`);
  }
  return [...(lines.length ? lines : ["outside all zones"]), ...VARIANTS.filter(({ name }) => entry.header.variants?.[name] && (name !== "turning" || view.turning)).reverse().map(({ name, text }) => distanceText(entry, name, text))];
}

/** Sun's outline over the exact zones, to compare. */
export function outlineSun(g, zone) {
  if (zone.length < 3) return;
  const p = path([zone]);
  for (const [w, colour] of [[4, C.halo], [2, "#FFFFFF"]]) {
    g.lineWidth = w;
    g.strokeStyle = colour;
    g.stroke(p);
  }
}
