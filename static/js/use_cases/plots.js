// The figures of Mäkinen 2021, Chapter 4, live: distance, joint rates or angles, path error or position, over the run's time.

import { C, size } from "../theme.js";
import { deg, metres, number, ticks } from "../axis.js";
import { clear, label, legend, message, segment, swatches } from "../pen.js";
import { curve, frame, points, upward } from "../plots/chart.js";
import { surface } from "../surface.js";
import { $ } from "../words.js";
import * as model from "./model.js";

/** How each method is drawn: colour, width, dashes. */
export const STYLE = {
  none: [C.stale, 1.5, [2, 3]],
  scaling: [C.remote, 2, null],
  potential: [C.partnerLine, 2, [7, 3]],
  constrained: [C.text, 2, [12, 3, 2, 3]],
};
const INKS = ["#D2C394", "#9FB9CC", "#BFB0CF", "#A9C4AC", "#CDAFA3", "#E6EAED"];
const DASHES = [null, [8, 3], [3, 3], null, [8, 3], [3, 3]];
const TOP = 2; // m of distance shown at most

const THIRD = ["error", "position", "attitude"];
const POSE = { position: [0, (v) => v, ["x along", "y left", "z up"], "m", 2], attitude: [3, deg, ["yaw", "pitch", "roll"], "°", 1] };

let second = "rates", third = "error"; // what the lower two show
export const kinds = () => ({ second, third, next: THIRD[(THIRD.indexOf(third) + 1) % THIRD.length] });
export function turn(which) {
  if (which === "second") second = second === "rates" ? "angles" : "rates";
  else third = THIRD[(THIRD.indexOf(third) + 1) % THIRD.length];
}

const charts = {};

const every = () => model.methods().map(({ name, words }) => ({ name, words, run: model.run(name) })).filter(({ run }) => run);

/** The lowest one alone writes times below itself: all three have the same. */
function plot(g, width, height, up, title, unit, lowest = false) {
  const { seconds } = model.document();
  const t = size("tick");
  const marks = ticks(0, seconds, Math.max(2, width / (5 * t)), [1, 2, 5, 10]).map((v) => [v, lowest ? `${number(v, 0)} s` : ""]);
  return frame(g, { left: 4, right: width - 4, height: lowest ? height : height + 0.8 * t }, { from: 0, to: seconds, marks }, up, title, unit, 2.6);
}

/** The moment that is shown, and the values there. */
function now(g, chart, marks) {
  if (!model.shown()) return;
  const { box, x, y } = chart;
  const at = x(model.time());
  segment(g, at, box.top, at, box.bottom, C.halo, 4);
  segment(g, at, box.top, at, box.bottom, "#FFFFFF", 1.5);
  for (const [value, colour] of marks) {
    g.beginPath();
    g.arc(at, y(Math.min(Math.max(value, y.from), y.to)), 4, 0, 2 * Math.PI);
    [g.fillStyle, g.strokeStyle, g.lineWidth] = [colour, C.halo, 1.5];
    g.fill();
    g.stroke();
  }
}

const empty = (g, width, height, kind) => {
  clear(g, width, height);
  charts[kind] = null;
  message(g, width, height, model.busy() ? "working it out" : "start a run");
  return { state: { kind, runs: [] }, age: 0, label: "No run yet" };
};

/** Curves of all methods that have run, the chosen one last and widest. */
function overlaid(g, chart, all, values) {
  const { method } = model.chosen();
  for (const { name, run } of [...all].sort((a, b) => (a.name === method) - (b.name === method))) {
    const [colour, wide, dash] = STYLE[name];
    curve(g, chart, points(chart, run.times, values(run)), colour, name === method ? wide + 1 : wide - 0.5, dash);
  }
}

function told(kind, all, at) {
  const { name, method } = model.chosen();
  return { kind, name, method, runs: all.map((one) => one.name), time: Math.round(model.time() * 100) / 100, playing: model.playing(), at };
}

function distance(g, width, height) {
  const all = every(), doc = model.document();
  if (!all.length) return empty(g, width, height, "distance");
  clear(g, width, height);
  const low = Math.min(0, ...all.map(({ run }) => run.nearest.distance));
  const high = Math.min(TOP, Math.max(1, ...all.flatMap(({ run }) => run.distance)));
  const chart = (charts.distance = plot(g, width, height, upward(low, high, height < 130 ? 3 : 6), `shortest distance, m${doc.own ? "" : ", to the limits"} · ${doc.figures}`, "m"));
  const { box, y } = chart;
  if (low < 0) {
    g.fillStyle = "rgba(255, 107, 94, 0.10)";
    g.fillRect(box.left, y(0), box.right - box.left, box.bottom - y(0));
  }
  for (const [value, text, align] of [[doc.upper, `p_u ${number(doc.upper, 1)} m`, "right"], [doc.lower, `p_l ${number(doc.lower, 1)} m`, "left"]]) {
    const level = Math.round(y(value)) + 0.5;
    segment(g, box.left, level, box.right, level, C.edge, 1.5, [4, 4]);
    label(g, text, align === "right" ? box.right - 4 : box.left + 4, level - 2, { align, halo: true });
  }
  overlaid(g, chart, all, (run) => run.distance);
  const run = model.run();
  const k = run ? model.instant(run) : 0;
  if (run) now(g, chart, [[run.distance[k], STYLE[run.method][0]]]);
  const at = run ? { distance: run.distance[k], pair: run.pairs[run.pair[k]] } : null;
  return { state: { ...told("distance", all, at), upper: doc.upper, lower: doc.lower }, age: 0, label: `Shortest distance over time: ${all.map((one) => `${one.words} ${metres(one.run.nearest.distance)}`).join(", ")}` };
}

function joints(g, width, height) {
  const run = model.run(), doc = model.document();
  if (!run) return empty(g, width, height, "joints");
  clear(g, width, height);
  const rows = second === "rates" ? run.rates : run.joints;
  const values = doc.roles.map((_, j) => rows.map((row) => deg(row[j])));
  const low = Math.min(0, ...values.flat()), high = Math.max(0, ...values.flat());
  const title = second === "rates" ? "joint rates, °/s" : "joint angles, °";
  const chart = (charts.joints = plot(g, width, height, upward(low, high, height < 130 ? 3 : 6), title, "°"));
  values.forEach((series, j) => curve(g, chart, points(chart, run.times, series), INKS[j % 6], 1.7, DASHES[j % 6]));
  const k = model.instant(run);
  now(g, chart, values.map((series, j) => [series[k], INKS[j % 6]]));
  const t = size("tick");
  const left = chart.box.left + 0.62 * t * title.length;
  legend(g, left, 1 + 0.55 * t, chart.box.right - left, doc.roles.map((role, j) => [swatches.line(INKS[j % 6], DASHES[j % 6], 2), role]), 7);
  const at = Object.fromEntries(doc.roles.map((role, j) => [role, Math.round(values[j][k] * 100) / 100]));
  return { state: { ...told(second, [run].map(({ method: name }) => ({ name })), at) }, age: 0, label: `${title} of ${run.words}` };
}

function error(g, width, height) {
  const all = every();
  if (!all.length) return empty(g, width, height, "error");
  clear(g, width, height);
  const high = Math.max(0.1, ...all.map(({ run }) => run.max_error));
  const chart = (charts.error = plot(g, width, height, upward(0, high, height < 130 ? 3 : 6), "path error of the tool, m", "m", true));
  overlaid(g, chart, all, (run) => run.error);
  const run = model.run();
  const k = run ? model.instant(run) : 0;
  if (run) now(g, chart, [[run.error[k], STYLE[run.method][0]]]);
  return { state: told("error", all, run ? { error: run.error[k] } : null), age: 0, label: `Path error: ${all.map((one) => `${one.words} at most ${metres(one.run.max_error)}`).join(", ")}` };
}

/** Fig. 4.8: where the tool is and how it lies, and how that was meant to be. */
function pose(g, width, height) {
  const run = model.run();
  if (!run) return empty(g, width, height, third);
  clear(g, width, height);
  const [first, shown, axes, unit] = POSE[third];
  const series = (rows) => axes.map((_, a) => rows.map((row) => shown(row[first + a])));
  const is = series(run.tool), meant = series(run.designed), all = [...is, ...meant].flat();
  const title = `tool, ${unit} · dashed: as meant`;
  const chart = (charts.error = plot(g, width, height, upward(Math.min(...all), Math.max(...all), height < 130 ? 3 : 6), title, unit, true));
  meant.forEach((values, a) => curve(g, chart, points(chart, run.times, values), INKS[a], 1.5, [4, 4]));
  is.forEach((values, a) => curve(g, chart, points(chart, run.times, values), INKS[a], 2));
  const k = model.instant(run);
  now(g, chart, is.map((values, a) => [values[k], INKS[a]]));
  const t = size("tick");
  const left = chart.box.left + 0.58 * t * title.length;
  legend(g, left, 1 + 0.55 * t, chart.box.right - left, axes.map((text, a) => [swatches.line(INKS[a], null, 2), text]), 7);
  return { state: told(third, [{ name: run.method }], { tool: is.map((values) => values[k]) }), age: 0, label: `The tool's ${third} and as it was meant` };
}

const probing = (kind, lines) => (px, py) => {
  const chart = charts[kind], doc = model.document();
  if (!chart || !doc) return null;
  const { box, x } = chart;
  if (px < box.left || px > box.right || py < box.top || py > box.bottom) return null;
  const t = x.inverse(px), k = (run) => Math.min(run.times.length - 1, Math.max(0, Math.round(t / doc.step)));
  return [`${number(t, 1)} s`, ...lines(k, doc)];
};
const perRun = (value) => (k) => every().map(({ words, run }) => `${words}: ${value(run, k(run))}`);
const probes = {
  distance: probing("distance", perRun((run, k) => `${number(run.distance[k], 2)} m, ${run.pairs[run.pair[k]]}${run.limited[k] ? ", held back" : ""}`)),
  joints: probing("joints", (k, doc) => doc.roles.map((role, j) => `${role} ${second === "rates" ? `${number(deg(model.run().rates[k(model.run())][j]), 1)} °/s` : `${number(deg(model.run().joints[k(model.run())][j]), 1)}°`}`)),
  error: probing("error", (k) => {
    if (third === "error") return perRun((run, i) => `${number(run.error[i], 2)} m off, ${number(deg(run.turn_error[i]), 1)}° turned`)(k);
    const run = model.run(), i = k(run), [first, shown, axes, unit, decimals] = POSE[third];
    return [["is", run.tool[i]], ["meant", run.designed[i]]].map(([word, row]) => `${word} ${axes.map((axis, n) => `${axis.split(" ")[0]} ${number(shown(row[first + n]), decimals)}`).join(", ")} ${unit}`);
  }),
};

/** The three surfaces of the panel. */
export const surfaces = () => [
  surface($("uc-distance"), distance, probes.distance),
  surface($("uc-joints"), joints, probes.joints),
  surface($("uc-error"), (...given) => (third === "error" ? error : pose)(...given), probes.error),
];
