// Working areas on the plan (Rasul 2021, Fig. 13), on sites that watch people: now, within a second, and at most.

import { C, rgba, size } from "../theme.js";
import { fit, segment } from "../pen.js";
import { label as nameOf, machine, names, silence, state } from "../state.js";
import { people } from "../people/model.js";
import { chart, circles, tint } from "./plan_layers.js";

const STEP = Math.PI / 60; // of an arc that is drawn as a line
const SPOKES = 11; // between two of the predicted area's spokes [px]

/** What is known of a machine's areas: null where nobody watches people or nothing was worked out. */
export function workingArea(name) {
  const m = machine(name);
  if (!people() || !m?.working_area) return null;
  const area = m.working_area;
  const reason = area.reason || (silence() > 1 ? "no news" : "");
  return reason || !area.predicted ? { reason: reason || "unknown" } : area;
}

const place = (center, r, angle) => chart.at([center[0] + r * Math.cos(angle), center[1] + r * Math.sin(angle)]);

function arc(g, center, r, from, to) {
  const count = Math.max(2, Math.ceil(Math.abs(to - from) / STEP));
  for (let i = 0; i <= count; i++) g.lineTo(...place(center, r, from + ((to - from) * i) / count));
}

/** The part of an area outside its disc; the disc alone when nothing is. */
function trace(g, center, { body, reach, start, end }) {
  g.beginPath();
  if (reach <= body || end - start >= 2 * Math.PI - 1e-6) return arc(g, center, Math.max(reach, body), -Math.PI, Math.PI);
  arc(g, center, reach, start, end);
  // Around the disc's other side: the outline holds both.
  arc(g, center, body, end, start + 2 * Math.PI);
  g.closePath();
}

function spokes(g, center, { body, reach, start, end }, colour) {
  if (reach <= body) return;
  const step = SPOKES / Math.max(reach * chart.px, 1);
  g.beginPath();
  for (let angle = start; angle <= end; angle += step) {
    g.moveTo(...place(center, body, angle));
    g.lineTo(...place(center, reach, angle));
  }
  g.lineWidth = 1;
  g.strokeStyle = colour;
  g.stroke();
}

function drawArea(g, name, { center, current, predicted, maximum }) {
  const own = name === state.own, colour = tint(name);
  const line = (area, width, alpha, dash) => {
    trace(g, center, area);
    g.setLineDash(dash);
    g.lineWidth = width;
    g.strokeStyle = rgba(colour, alpha);
    g.stroke();
    g.setLineDash([]);
  };
  g.lineJoin = "round";
  line(maximum, 1.2, own ? 0.75 : 0.6, [7, 5]);
  spokes(g, center, predicted, rgba(colour, own ? 0.4 : 0.3));
  line(predicted, 1.2, own ? 0.8 : 0.65, []);
  line(current, 2.4, own ? 0.95 : 0.8, []);
}

/** Of the legend; the predicted area is known by its spokes. */
export const areaKey = [
  [(g, x, y, w) => segment(g, x, y, x + w, y, C.text, 2.4), "works now"],
  [(g, x, y, w) => {
    for (let i = 0; i <= 4; i++) segment(g, x + (i * w) / 4, y - 4, x + (i * w) / 4, y + 4, rgba(C.text, 0.55), 1);
    for (const side of [-4, 4]) segment(g, x, y + side, x + w, y + side, C.text, 1.2);
  }, "within 1 s"],
  [(g, x, y, w) => segment(g, x, y, x + w, y, C.text, 1.2, [4, 3]), "at most"],
];

/** Above what the lower left corner says of the zone. */
function sayUnknown(g, unknown) {
  const t = size("tick"), { box } = chart, y = box.bottom - 2.7 * t;
  const whose = unknown.map(nameOf).join(", ");
  fit(g, [`? working area of ${whose} unknown`, `? area of ${whose} unknown`], box.left + 5, y, box.right - box.left - 10, { base: "top", colour: C.unknown, weight: 700, halo: true });
  chart.words.push({ ...box, top: y - 3, bottom: y + 1.3 * t });
}

/** Whether there are areas to draw: on sites that watch people. */
export const hasAreas = () => names().some((name) => workingArea(name));

/** Draws every machine's areas, or its plain circles where they are not known. */
export function drawAreas(g) {
  for (const name of names()) {
    const area = workingArea(name);
    if (area && !area.reason) drawArea(g, name, area);
    else circles(g, name);
  }
}

/** Says whose areas are not known. Returns by machine "" or why not; null on sites without areas. */
export function tellAreas(g) {
  if (!hasAreas()) return null;
  const told = Object.fromEntries(names().map((name) => [name, workingArea(name)?.reason ?? "never told"]));
  const unknown = names().filter((name) => told[name]);
  if (unknown.length) sayUnknown(g, unknown);
  return told;
}
