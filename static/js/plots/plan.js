// The plan view: grid coordinates, warning zone, workspaces, outlines, nearest points.

import { C, hatch, size } from "../theme.js";
import { degrees, metres, number } from "../axis.js";
import { clear, legend, message, playbackMark, swatches } from "../pen.js";
import { $, partName, write } from "../words.js";
import { staleText } from "../head.js";
import { edgeDistance, inside } from "../geometry.js";
import { image, imageAge, imageStale, label as nameOf, machine, names, pair, replaying, snapshotAge, state, zoneImage } from "../state.js";
import { shownZone } from "../view.js";
import { surface } from "../surface.js";
import {
  base, chart, drawZone, exitArrow, gauge, gridLines, gridText, iso, nearestLine, north, obstacles, outlines, wedge, zonePoints,
} from "./plan_layers.js";
import { drawing, paint as paintDrawing } from "../gauge/drawing.js";
import { drawTrajectory } from "../trajectory/draw.js";
import { drawSurmount } from "../surmount/draw.js";
import { inForce } from "../gauge/model.js";
import { insideWords } from "../people/model.js";
import { areaKey, drawAreas, hasAreas, tellAreas } from "./plan_areas.js";
import { drawPeople, peopleLines, personSwatch } from "./plan_people.js";
import { drawStability, stabilityKey, stabilityWords } from "./plan_stability.js";
import { distanceText, drawZones, outlineSun, view as zoneView, zoneExit, zoneLegend, zoneLines, zoneNote } from "./plan_zone.js";
import { around, aroundLegend, aroundLines, drawAround, freeExit, nearestNote, nearestText, view as aroundView } from "./plan_around.js";

const WIDTHS = [20, 30, 50, 100];

const view = { width: null, centre: null, tracksUp: false, iso: false, subject: "" };
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
  const rows = hasAreas() ? 2 : 1; // of the legend
  box = { left: Math.round(2.2 * t), top: 4, right: width - 4, bottom: height - Math.round((rows > 1 ? 4.2 : 2.9) * t) };
  const px = Math.min(box.right - box.left, box.bottom - box.top) / view.width;
  const cx = (box.left + box.right) / 2, cy = (box.top + box.bottom) / 2;
  const turn = view.tracksUp ? Math.PI / 2 - (own.yaw ?? 0) : 0;
  const c = Math.cos(turn), s = Math.sin(turn);
  Object.assign(chart, {
    px,
    box,
    view,
    words: [],
    at: ([e, n]) => [cx + px * (c * (e - view.centre[0]) - s * (n - view.centre[1])), cy - px * (s * (e - view.centre[0]) + c * (n - view.centre[1]))],
    back: (x, y) => {
      const u = (x - cx) / px, v = (cy - y) / px;
      return [view.centre[0] + c * u + s * v, view.centre[1] - s * u + c * v];
    },
  });
  g.save();
  g.beginPath();
  g.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
  g.clip();
  g.fillStyle = C.free;
  g.fillRect(box.left, box.top, box.right - box.left, box.bottom - box.top);
  const grid = gridLines(g);
  wedge(g, own);
  const how = shownZone();
  const exact = how === "sun" ? null : zoneImage();
  const zone = zonePoints(image());
  const entry = exact ?? image();
  const stale = imageStale(entry);
  const layers = how === "sun" ? [] : around();
  const below = drawAround(g, layers.filter(({ name }) => name === "site"), dpr);
  const zones = exact ? drawZones(g, exact, dpr, stale) : null;
  if (!exact) drawZone(g, zone, dpr, stale ? C.stale : C.partner);
  else if (how === "difference") outlineSun(g, zone);
  const drawn = { ...below, ...drawAround(g, layers.filter(({ name }) => name !== "site"), dpr) };
  if (replaying()) playbackMark(g, box);
  drawAreas(g);
  gauge(g);
  obstacles(g);
  for (const name of names()) if (name !== state.own) outlines(g, name);
  outlines(g, state.own);
  if (view.iso) iso(g, own);
  const exit = layers.length && exact ? freeExit(g, exact, stale, layers, own, inside) : exact ? zoneExit(g, exact, own) : exitArrow(g, own, zone) ?? freeExit(g, null, true, layers, own, inside);
  const nearest = nearestLine(g);
  for (const name of names()) base(g, name);
  const stability = drawStability(g, dpr);
  const areas = tellAreas(g);
  const seen = drawPeople(g);
  north(g, turn);
  const note = layers.length ? nearestNote(g, exact, stale, layers) : null;
  if (exact && !layers.length) zoneNote(g, exact, stale);
  const trajectory = drawTrajectory(g), surmount = drawSurmount(g);
  paintDrawing(g);
  g.restore();
  if (!view.tracksUp) gridText(g, grid, height, t);
  if (rows > 1) legend(g, 6, height - 1.95 * t, width - 8, areaKey);
  const age = Math.max(snapshotAge(), entry ? imageAge(entry) : 0);
  const staleZone = `zone ${staleText(imageAge(entry))}`;
  const whose = aroundLegend(g, dpr, layers, drawn);
  const [first, ...others] = exact && !stale ? zoneLegend(g, dpr, stale, zones) : [];
  legend(g, 6, height - 0.65 * t, width - 8, [
    ...(exact && how === "difference" ? [[swatches.line("#FFFFFF"), "Sun"]] : []),
    ...(exact ? stale ? [[zoneLegend(g, dpr, stale, { as_is: 1 })[0][0], staleZone], ...whose] : [...(first ? [first] : []), ...whose, ...others]
      : [[swatches.area(hatch(g, stale ? C.stale : C.partner, dpr), stale ? C.stale : C.partner), stale ? staleZone : "zone for ✚ (Sun)"], ...whose]),
    ...(rows > 1 ? [] : [[swatches.line(C.text), "reach now"], [swatches.line(C.text, [4, 3], 1.5), "max"]]),
    ...stabilityKey(),
    ...(seen?.tracks.length ? [[swatches.glyph(personSwatch), "person"]] : []),
  ]);
  return {
    state: {
      own: state.own, partner: state.partner, playback: replaying(), width: view.width, centre: view.centre, up: view.tracksUp ? "tracks" : "north",
      base: own.position?.slice(0, 2), zone: zone.length, zones, around: drawn, note, shown: how, zone_stale: stale, exit, nearest, people: seen, areas, stability, gauge: inForce(), trajectory, surmount, machines: names().filter((name) => machine(name)?.outlines).length,
    },
    age,
    label: `Plan of ${view.width} m: ${nameOf(state.own)} base at ${own.position_projected ? own.position_projected.slice(0, 2).map((v) => v.toFixed(1)).join(", ") : "unknown"}; nearest distance to ${nameOf(state.partner)} ${nearest === null ? "unknown" : metres(nearest)}${exit ? `; base inside the warning zone by ${metres(exit)}` : ""}${layers.length ? `; ${nearestText(exact, stale, layers)}` : exact ? `; ${distanceText(exact)}` : ""}${[...stabilityWords(), ...insideWords()].map((words) => `; ${words}`).join("")}`,
  };
}

function probe(x, y) {
  const own = machine(state.own);
  if (!box || !own || drawing() || x < box.left || x > box.right || y < box.top || y > box.bottom) return null;
  const [e, n] = chart.back(x, y);
  const origin = state.site?.frame?.origin ?? [0, 0, 0];
  const near = peopleLines(x, y);
  if (near.length) return near;
  const lines = [`E ${(e + origin[0]).toFixed(1)} m, N ${(n + origin[1]).toFixed(1)} m`];
  const exact = shownZone() === "sun" ? null : zoneImage();
  const zone = exact ? [] : zonePoints(image());
  if (exact) lines.push(...zoneLines(exact, [e, n], inside));
  if (shownZone() !== "sun") lines.push(...aroundLines(around(), [e, n], inside));
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
  s.turning = () => {
    zoneView.turning = !zoneView.turning;
    redraw();
  };
  s.around = () => {
    aroundView.shown = !aroundView.shown;
    redraw();
  };
  $("plan-up").addEventListener("click", () => {
    view.tracksUp = !view.tracksUp;
    write($("plan-up"), view.tracksUp ? "Trk" : "N");
    redraw();
  });
  $("plan-iso").addEventListener("click", (event) => {
    view.iso = !view.iso;
    event.currentTarget.setAttribute("aria-pressed", String(view.iso));
    redraw();
  });
  return s;
}
