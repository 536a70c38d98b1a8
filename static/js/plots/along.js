// Along the own machine's track: the smallest clearance of its last work cycle if it stood elsewhere, over station.

import { C, hatch, size } from "../theme.js";
import { metres, number, ticks } from "../axis.js";
import { clear, label, legend, message, segment, swatches } from "../pen.js";
import { curve, frame, unknownBox } from "./chart.js";
import { inside } from "../geometry.js";
import { $, write } from "../words.js";
import { label as nameOf, machine, replaying, silence, state } from "../state.js";
import { ageText } from "../head.js";
import { page } from "../scene.js";

const AGAIN = 2000; // between two questions while it is shown [ms]
const OLD = 5; // of an image that comes every two seconds [s]

let on = false;
let asked = -Infinity;
let chart = null; // for the pointer
let send = () => {}, redraw = () => {};

/** Whether the strip is shown in the place of the last minute. */
export const shown = () => on && !replaying();

/** The name of a track that the own machine stands on or beside, or null. */
function track() {
  const p = machine(state.own)?.position;
  const found = p && (state.site?.gauge ?? []).filter((v) => v.kind === "track" && v.plan.some((area) => inside(p, area.exterior)));
  return found?.[0]?.name ?? null;
}

const newest = () => state.along.get(state.own) ?? null;
const imageAge = (image) => (image && state.snapshot ? Math.max(0, state.snapshot.time - image.header.state_time) + silence() : Infinity);

export function hide() {
  on = false;
}

export function startAlong(give, draw) {
  [send, redraw] = [give, draw];
  $("along-show").addEventListener("click", () => {
    on = !on;
    asked = -Infinity;
    redraw();
  });
}

/** Ten times a second: asks for the strip while it can be seen, and says what the button does. */
export function update() {
  const name = track();
  $("along-tools").hidden = replaying() || (!on && name === null);
  write($("along-show"), shown() ? "60 s" : `Along ${name ?? "track"}`);
  if (!shown()) return;
  write($("trends-title"), `Along ${newest()?.header.track ?? name ?? "track"}`);
  if (document.hidden || !$("trends").offsetParent || performance.now() - asked < AGAIN) return;
  asked = performance.now();
  send({ type: "along", page, machine: state.own });
  redraw();
}

const none = (g, width, height, text) => {
  chart = null;
  message(g, width, height, text);
  return { state: { kind: "along", own: state.own, bands: [] }, age: Infinity, label: `Along the track: ${text}` };
};

function band(g, { box, x }, { start, end, state: what }, dpr) {
  const x0 = Math.max(box.left, x(start)), x1 = Math.min(box.right, Math.max(x(end), x(start) + 2));
  if (what === "unknown") unknownBox(g, box, x0, x1);
  if (what !== "violates" && what !== "undecided") return;
  const bad = what === "violates";
  g.fillStyle = bad ? hatch(g, C.stopLine, dpr, 0.55) : hatch(g, C.undecided, dpr, 0.6, "checker");
  g.fillRect(x0, box.top, x1 - x0, box.bottom - box.top);
  for (const at of [x0, x1]) segment(g, at, box.top, at, box.bottom, bad ? C.stopLine : C.undecided, 1.5);
}

export function paint(g, width, height, dpr) {
  clear(g, width, height);
  const image = newest();
  if (!image) return none(g, width, height, track() === null ? `${nameOf(state.own)} stands on no track` : "computing the strip");
  const { header, arrays } = image;
  if (header.reason || !header.closest.length) return none(g, width, height, `unknown: ${header.reason || "no station"}`);
  const edges = arrays.edges.data, clearance = arrays.clearance.data;
  const count = clearance.length, from = edges[0], to = edges[2 * count - 1];
  const t = size("tick");
  const low = Math.min(0, ...clearance.filter(Number.isFinite));
  const floor = low < -0.05 ? -Math.min(1, Math.ceil(-low * 2) / 2) : 0;
  const marks = ticks(from, to, Math.max(2, width / (5 * t)), [1, 2, 5, 10, 20, 50, 100]).map((v) => [v, `${number(v, 0)} m`]);
  const up = { from: floor, to: header.cap, marks: ticks(floor, header.cap, 5, [0.5, 1, 2]).map((v) => [v, number(v, 1)]) };
  chart = frame(g, { left: 4, right: width - 4, height }, { from, to, marks }, up, `clearance of the last ${number(header.seconds, 0)} s at other stations, m · ${number(imageAge(image), 0)} s old`, "m", 2.6);
  const { box, x, y } = chart;
  for (const item of header.bands) band(g, chart, item, dpr);
  const eta = Math.round(y(header.eta)) + 0.5;
  segment(g, box.left, eta, box.right, eta, C.stopLine, 1, [4, 4]);
  label(g, `violates below ${number(header.eta, 2)}`, box.right - 4, eta - 2, { align: "right", halo: true });
  curve(g, chart, [...clearance].map((v, i) => {
    const at = x((edges[2 * i] + edges[2 * i + 1]) / 2);
    const unknown = header.bands.some((b) => b.state === "unknown" && edges[2 * i] >= b.start - 1e-3 && edges[2 * i + 1] <= b.end + 1e-3);
    return unknown ? null : [at, y(Number.isFinite(v) ? Math.min(Math.max(v, floor), header.cap) : header.cap)];
  }), C.text, 2);
  if (header.station !== null) {
    segment(g, x(header.station), box.top, x(header.station), box.bottom, C.halo, 4);
    segment(g, x(header.station), box.top, x(header.station), box.bottom, "#FFFFFF", 1.5);
    label(g, "now", Math.min(x(header.station) + 4, box.right - 2 * t), box.bottom - 3, { halo: true });
  }
  const worst = header.bands.filter((b) => b.clearance !== null).sort((a, b) => a.clearance - b.clearance)[0];
  if (worst) label(g, `least ${metres(worst.clearance)} · ${worst.part} ↔ ${worst.limit} · at ${number(worst.at, 1)} m`, box.left + 4, box.top + 2, { base: "top", halo: true, colour: C.text });
  const old = imageAge(image);
  if (old > OLD) label(g, `STALE ${number(old, 0)} s`, box.right - 4, box.top + 2, { align: "right", base: "top", halo: true, colour: C.unknown, weight: 700 });
  const kinds = new Set(header.bands.map((b) => b.state));
  const bad = [["violates", swatches.area(hatch(g, C.stopLine, dpr), C.stopLine)], ["undecided", swatches.area(hatch(g, C.undecided, dpr, 0.6, "checker"), C.undecided)]].filter(([kind]) => kinds.has(kind));
  legend(g, box.right - 13 * t, 1 + 0.55 * t, 13 * t, bad.map(([kind, draw]) => [draw, kind]));
  return {
    state: { kind: "along", own: header.own, track: header.track, station: header.station, postures: header.postures, bands: header.bands.map((b) => [b.state, b.start, b.end]), least: worst?.clearance ?? null, limit: worst?.limit ?? "" },
    age: old,
    label: `Along ${header.track}: ${header.bands.map((b) => `${b.state} from ${number(b.start, 1)} to ${number(b.end, 1)} m`).join(", ")}; ${ageText(old)}`,
  };
}

export function probe(px, py) {
  const image = newest();
  if (!chart || !image) return null;
  const { box, x } = chart;
  if (px < box.left || px > box.right || py < box.top || py > box.bottom) return null;
  const s = x.inverse(px), { header, arrays } = image, edges = arrays.edges.data;
  const i = [...arrays.clearance.data].findIndex((_, k) => s >= edges[2 * k] && s <= edges[2 * k + 1]);
  if (i < 0) return null;
  const v = arrays.clearance.data[i], least = arrays.at_least.data[i];
  const what = header.bands.find((b) => s >= b.start && s <= b.end)?.state ?? "";
  if (what === "unknown") return [`${header.track} at ${number(s, 1)} m`, "unknown: the track's height or the limits are not known"];
  const lines = [`${header.track} at ${number(s, 1)} m: ${what}`, Number.isFinite(v) ? `clearance ${metres(v)}, ${header.closest[i]}` : `more than ${metres(header.cap)}`];
  if (Number.isFinite(least) && what === "clear") lines.push(`nowhere here below ${metres(least)}, between postures and stations, too`);
  return lines;
}
