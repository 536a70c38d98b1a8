// Figs. 6 and 7 of Yamashita and Kikuuwe 2025, live: swing rate and lift with the limits at which the machine tips, and the joints; the simple trajectory, the planned one, and what the sensors saw.

import { C, size } from "../theme.js";
import { deg, number, ticks } from "../axis.js";
import { clear, label, legend, legendWidth, message, segment, swatches } from "../pen.js";
import { curve, frame, points, upward } from "../plots/chart.js";
import { surface } from "../surface.js";
import { $ } from "../words.js";
import * as model from "./model.js";

const SIMPLE = [C.second, 1.5, [2, 3]], PLANNED = ["#FFFFFF", 2, null], LIMIT = [C.tipOver, 2, [8, 4]], ACTUAL = [C.remote, 3, null];
const INKS = ["#D2C394", "#9FB9CC", "#BFB0CF", "#A9C4AC", "#CDAFA3", "#E6EAED"];
const HIGHEST = { swing: 2.5, lift: 3 }; // times the largest value of the curves: where a limit is farther up it is told and not drawn

const KINDS = {
  swing: { title: "swing rate, °/s", unit: "°/s", of: (s) => s.swing.map((v) => deg(Math.abs(v))), limit: (s) => s.critical_swing.map((v) => (v === null ? NaN : deg(v))), name: "Ω_c" },
  lift: { title: "lift a_z, m/s²", unit: "m/s²", of: (s) => s.lift.map((v) => v ?? NaN), limit: (s) => s.critical_lift.map((v) => v ?? NaN), name: "a_cz" },
};

const charts = {};
const finite = (values) => values.filter(Number.isFinite);

/** The moment that is shown: of the machine where it follows, else of the preview. */
const moment = () => (model.following() ? model.follow().at : model.time());

function entries(g, width, height, list) {
  const t = size("tick");
  const rows = legendWidth(g, list, 6) > width - 8 ? [list.slice(0, Math.ceil(list.length / 2)), list.slice(Math.ceil(list.length / 2))] : [list];
  rows.forEach((row, k) => legend(g, 4, height - (rows.length - k - 0.4) * 1.15 * t, width - 6, row, 6));
  return rows.length;
}

function now(g, chart) {
  const at = chart.x(moment());
  segment(g, at, chart.box.top, at, chart.box.bottom, C.halo, 4);
  segment(g, at, chart.box.top, at, chart.box.bottom, "#FFFFFF", 1.5, [4, 2]);
}

const empty = (g, width, height, kind, text) => {
  clear(g, width, height);
  charts[kind] = null;
  message(g, width, height, text);
  return { state: { kind, plan: null }, age: 0, label: "No trajectory" };
};

/** The frame over the trajectory's time, with room for `rows` of a legend below. */
function plot(g, width, height, rows, up, title, unit, end) {
  const t = size("tick");
  const marks = ticks(0, end, Math.max(2, width / (5 * t)), [1, 2, 5, 10, 20, 50, 100]).map((v) => [v, `${number(v, 0)} s`]);
  return frame(g, { left: 2, right: width - 2, height: height - rows * 1.15 * t - 2 }, { from: 0, to: end, marks }, up, title, unit, 2.4);
}

function limited(kind) {
  const { title, unit, of, limit, name } = KINDS[kind];
  return (g, width, height) => {
    const document = model.document(), figures = document?.figures;
    if (!figures) return empty(g, width, height, kind, model.planning() ? "planning" : "no trajectory");
    clear(g, width, height);
    const { initial, planned } = figures, actual = model.seen();
    const first = of(initial), ours = of(planned), measured = actual ? of(actual) : [];
    const limits = limit(planned), known = finite(limits).length > 0;
    const most = Math.max(0.1, ...finite(first), ...finite(ours), ...finite(measured));
    const least = Math.min(0, ...finite(first), ...finite(ours), ...finite(measured));
    const lowest = Math.min(...finite(limits));
    const near = known && lowest <= HIGHEST[kind] * most;
    const high = near ? Math.max(most, Math.min(HIGHEST[kind] * most, Math.max(...finite(limits)))) : most;
    const told = !known ? `${name} none` : near ? name : `${name} ≥ ${number(lowest, kind === "lift" ? 1 : 0)}`;
    const list = [[swatches.line(...swap(PLANNED)), "plan"], [swatches.line(...swap(LIMIT)), told], [swatches.line(...swap(SIMPLE)), "simple"], ...(measured.length ? [[swatches.line(...swap(ACTUAL)), "actual"]] : [])];
    const rows = entries(g, width, height, list);
    const chart = (charts[kind] = plot(g, width, height, rows, upward(least, high, height < 150 ? 3 : 5), title, unit, Math.max(document.duration, initial.time[initial.time.length - 1])));
    const draw = (times, values, [colour, wide, dash]) => curve(g, chart, points(chart, times, values), colour, wide, dash);
    draw(initial.time, first, SIMPLE);
    draw(planned.time, limits.map((v) => (v > chart.y.to ? NaN : v)), LIMIT);
    if (measured.length) draw(actual.at, measured, ACTUAL);
    draw(planned.time, ours, PLANNED);
    now(g, chart);
    const over = exceeds(first, limit(initial));
    if (over) label(g, `simple: over ${name}`, chart.box.right - 3, chart.box.top + 2, { align: "right", base: "top", halo: true });
    return { state: { kind, plan: model.offer()?.plan, time: Math.round(moment() * 100) / 100, actual: measured.length, limit: known ? lowest : null, most: Math.max(...finite(ours), 0), over, within: !exceeds(ours, limits) }, age: 0, label: `${title}: planned at most ${number(Math.max(...finite(ours), 0), 1)}, limit ${known ? `at least ${number(lowest, 1)}` : "none"} ${unit}` };
  };
}

const swap = ([colour, wide, dash]) => [colour, dash, wide];
const exceeds = (values, limits) => values.some((v, k) => v > limits[k]);

function joints(g, width, height) {
  const document = model.document();
  if (!document?.ok) return empty(g, width, height, "joints", model.planning() ? "planning" : "no trajectory");
  clear(g, width, height);
  const { roles, time } = document, actual = model.seen();
  const planned = roles.map((_, j) => document.joints.map((row) => deg(row[j])));
  const measured = roles.map((_, j) => (actual?.joints ?? []).map((row) => deg(row[j])));
  // The swing's sensors may count other turns than the plan.
  measured.forEach((values, j) => {
    if (values.length) {
      const turns = 360 * Math.round((values[0] - planned[j][0]) / 360);
      measured[j] = values.map((v) => v - turns);
    }
  });
  const all = [...planned.flat(), ...measured.flat()];
  const list = [...roles.map((role, j) => [swatches.line(INKS[j % 6], [4, 3], 1.5), role]), ...(actual?.at.length ? [[swatches.line(C.text, null, 2.5), "actual"]] : [])];
  const rows = entries(g, width, height, list);
  const chart = (charts.joints = plot(g, width, height, rows, upward(Math.min(...all), Math.max(...all), height < 150 ? 3 : 5), "joints, °; dashed: plan", "°", document.duration));
  roles.forEach((_, j) => {
    if (measured[j].length) curve(g, chart, points(chart, actual.at, measured[j]), INKS[j % 6], 2.5);
    curve(g, chart, points(chart, time, planned[j]), INKS[j % 6], 1.5, [4, 3]);
  });
  now(g, chart);
  return { state: { kind: "joints", plan: model.offer()?.plan, time: Math.round(moment() * 100) / 100, actual: actual?.at.length ?? 0 }, age: 0, label: "Joint angles, planned and as they were" };
}

const at = (times, values, t) => {
  let k = times.findIndex((one) => one > t);
  if (k < 0) k = times.length;
  return values[Math.max(0, k - 1)];
};

const probing = (kind, lines) => (px, py) => {
  const chart = charts[kind], document = model.document();
  if (!chart || !document) return null;
  const { box, x } = chart;
  if (px < box.left || px > box.right || py < box.top || py > box.bottom) return null;
  const t = x.inverse(px);
  return [`${number(t, 1)} s`, ...lines(t, document)];
};

const values = (kind) => {
  const { of, limit, unit, name } = KINDS[kind];
  return probing(kind, (t, { figures: { initial, planned } }) => {
    const actual = model.seen();
    const shown = (value) => (Number.isFinite(value) ? `${number(value, 2)} ${unit}` : "none");
    return [`plan ${shown(at(planned.time, of(planned), t))}`, `${name} ${shown(at(planned.time, limit(planned), t))}`, `simple ${shown(at(initial.time, of(initial), t))}`, ...(actual?.at.length ? [`actual ${shown(at(actual.at, of(actual), t))}`] : [])];
  });
};

/** The three surfaces in the place of the slices. */
export const surfaces = () => [
  surface($("tj-plot-swing"), limited("swing"), values("swing")),
  surface($("tj-plot-lift"), limited("lift"), values("lift")),
  surface($("tj-plot-joints"), joints, probing("joints", (t, { roles, time, joints: rows }) => {
    const row = at(time, rows, t), actual = model.seen();
    const is = actual?.at.length ? at(actual.at, actual.joints, t) : null;
    return roles.map((role, j) => `${role} ${number(deg(row[j]), 1)}°${is ? `, actual ${number(deg(is[j]), 1)}°` : ""}`);
  })),
];
