// Figs. 10-14 of Jayasekara and Arisumi 2015, live: joint angles, rates and torques with their limits, the energy, and the way of the centre of mass, with the phases as bands.

import { C, font, size } from "../theme.js";
import { deg, number, ticks } from "../axis.js";
import { clear, label, legend, segment, swatches } from "../pen.js";
import { star } from "../glyphs.js";
import { curve, frame, points, upward } from "../plots/chart.js";
import { INKS, at, empty, entries, needle, overTime, timeAt } from "../plots/over_time.js";
import { surface } from "../surface.js";
import { $ } from "../words.js";
import * as model from "./model.js";

const DASHES = [null, [7, 3], [3, 3], [9, 3, 2, 3], [1, 3], [12, 4]]; // by joint: colour is not the only sign
const BANDS = ["rgba(255, 255, 255, 0.05)", "rgba(0, 0, 0, 0.18)"];
const SHORT = { "sequence 1": "1", "sequence 2-1": "2-1", "sequence 2-2": "2-2" };
const HIGHEST = 2.5; // times the largest torque: where a limit is farther up it is told and not drawn

export const kinds = { first: "joints", second: "energy" };
const NEXT = { joints: "rates", rates: "torques", torques: "joints", energy: "com", com: "energy" };
export const NAMES = { joints: "Angles", rates: "Rates", torques: "Torques", energy: "Energy", com: "CoM" };
export const turn = (which) => {
  kinds[which] = NEXT[kinds[which]];
};
export const next = (which) => NAMES[NEXT[kinds[which]]];

const charts = {};
const finite = (values) => values.filter(Number.isFinite);
const column = (rows, j, of = (v) => v) => rows.map((row) => of(row[j]));
const rounded = (v, digits = 2) => Math.round(v * 10 ** digits) / 10 ** digits;

/** The phases as bands, named where there is room. */
function bands(g, { box, x }, phases) {
  g.font = font("tick");
  phases.forEach(({ name, start, end }, k) => {
    const left = Math.max(box.left, x(start)), right = Math.min(box.right, x(end));
    if (right <= left) return;
    g.fillStyle = BANDS[k % 2];
    g.fillRect(left, box.top, right - left, box.bottom - box.top);
    if (k) segment(g, left, box.top, left, box.bottom, C.edge, 1, [1, 3]);
    const short = name.replace(/^down /, "↓").replace(/sequence (\S+)/, (all, one) => SHORT[all] ?? one);
    // Half a name says nothing: hovering tells it.
    const text = [name, short].find((one) => g.measureText(one).width <= right - left - 5);
    if (text) label(g, text, left + 3, box.top + 2, { base: "top", halo: true });
  });
}

const nothing = (g, width, height, kind) => {
  charts[kind] = null;
  return empty(g, width, height, kind, model.planning() ? "looking for a way" : "no manoeuvre");
};

const told = (kind, more) => ({ kind, plan: model.offer()?.plan ?? null, time: rounded(model.moment()), ...more });

/** A joint's line: angles and rates in degrees, torques as absolute values (Fig. 13). */
const LINES = {
  joints: { title: "joint angles, °", unit: "°", digits: 1, rows: (f) => f.joints, of: deg },
  rates: { title: "joint rates, °/s", unit: "°/s", digits: 1, rows: (f) => f.rates, of: deg },
  torques: { title: "torques |τ|, N m", unit: "N m", digits: 1, rows: (f) => f.torques, of: Math.abs },
};
const LARGE = 2000; // N m, from which on it is kN m

/** How a kind is written: large torques in kN m. */
function written(kind, figures) {
  const line = LINES[kind];
  if (kind !== "torques" || Math.max(...figures.torques.flat().map(Math.abs)) < LARGE) return { ...line, limit: (v) => v };
  return { ...line, title: "torques |τ|, kN m", unit: "kN m", of: (v) => Math.abs(v) / 1000, limit: (v) => v / 1000 };
}

/** What the sensors saw of a joint, in the turns of the plan; none of rates and torques. */
function measured(kind, j, planned) {
  const actual = model.seen();
  if (kind !== "joints" || !actual) return [];
  const values = column(actual.joints, j, deg), turns = 360 * Math.round((values[0] - planned[0]) / 360);
  return values.map((v) => v - turns);
}

function lines(g, width, height, kind) {
  const document = model.document(), figures = document?.figures;
  if (!figures?.time.length) return nothing(g, width, height, kind);
  clear(g, width, height);
  const { title, unit, rows, of, limit: sized } = written(kind, figures), { roles } = document;
  const curves = roles.map((_, j) => column(rows(figures), j, of));
  const actual = model.seen(), was = curves.map((values, j) => measured(kind, j, values));
  // Each joint's limit as far up as matters; the swing turns on its bearing and carries nothing.
  const limits = kind === "torques" ? roles.map((_, j) => sized(figures.torque_limits[j] ?? NaN)) : [];
  const most = Math.max(...finite(curves.flat()), 0);
  const drawn = limits.map((limit) => (limit <= HIGHEST * most ? limit : NaN));
  const all = [...curves.flat(), ...was.flat(), ...drawn].filter(Number.isFinite);
  const share = limits.length ? Math.max(...finite(curves.map((values, j) => Math.max(...values) / limits[j])), 0) : null;
  const list = [
    ...roles.map((role, j) => [swatches.line(INKS[j % 6], DASHES[j % 6], 2), role]),
    ...(limits.length ? [[swatches.line(C.slow, [2, 2], 1.5), `limit, most ${number(100 * share, 0)} %`]] : []),
    ...(was.flat().length ? [[swatches.line(C.remote, null, 3), "actual"]] : []),
  ];
  const legends = entries(g, width, height, list);
  const chart = (charts[kind] = overTime(g, width, height, legends, upward(Math.min(...all), Math.max(...all), height < 150 ? 3 : 5), title, unit, document.duration, 2.4));
  bands(g, chart, document.phases);
  drawn.forEach((limit, j) => {
    if (!Number.isFinite(limit)) return;
    segment(g, chart.box.left, chart.y(limit), chart.box.right, chart.y(limit), C.slow, 1.5, [2, 2]);
    // Below the names of the phases where the limit is as far up as these.
    const below = Math.max(chart.y(limit) + 2, chart.box.top + 1.4 * size("tick"));
    label(g, `${roles[j]} limit`, chart.box.right - 3, below, { align: "right", base: "top", halo: true });
  });
  was.forEach((values) => values.length && curve(g, chart, points(chart, actual.at, values), C.remote, 3));
  curves.forEach((values, j) => curve(g, chart, points(chart, figures.time, values), INKS[j % 6], 2, DASHES[j % 6]));
  needle(g, chart, model.moment());
  return {
    state: told(kind, { most: rounded(most), share: share === null ? null : rounded(share, 3), actual: was.flat().length ? actual.at.length : 0, phases: document.phases.length }),
    age: 0,
    label: `${title}: at most ${number(most, 1)} ${unit}${share === null ? "" : `, ${number(100 * share, 0)} % of the limit`}`,
  };
}

/** (19): of the sequences alone, from the energy of everything. */
function ofSequences({ energy: all, phase }, phases) {
  let sum = 0;
  return all.map((v, k) => {
    if (k && /sequence/.test(phases[phase[k]]?.name ?? "")) sum += v - all[k - 1];
    return sum;
  });
}

function energy(g, width, height) {
  const document = model.document(), figures = document?.figures;
  if (!figures?.time.length) return nothing(g, width, height, "energy");
  clear(g, width, height);
  const { energy_potential: least, energy_quasi_static: slow } = document, mine = ofSequences(figures, document.phases);
  const bounds = [[least, "heights", [2, 3]], [slow, "slowly", [7, 4]]].filter(([v]) => Number.isFinite(v));
  const most = Math.max(...finite(figures.energy), ...bounds.map(([v]) => v), 1e-6), total = mine[mine.length - 1];
  const big = most >= 2000, k = big ? 1e-3 : 1, unit = big ? "kJ" : "J", told_ = (v) => number(k * v, big ? 2 : 1);
  const list = [[swatches.line("#FFFFFF"), `sequences ${told_(total)}`], [swatches.line(C.second, [2, 3], 1.5), "with moves"], ...bounds.map(([v, name, dash]) => [swatches.line(C.tipOver, dash, 2), `${name} ${told_(v)}`])];
  const legends = entries(g, width, height, list);
  const chart = (charts.energy = overTime(g, width, height, legends, upward(0, k * most, height < 150 ? 3 : 5), `energy ∑|τ Δθ|, ${unit}`, unit, document.duration, 2.4));
  bands(g, chart, document.phases);
  for (const [v, , dash] of bounds) segment(g, chart.box.left, chart.y(k * v), chart.box.right, chart.y(k * v), C.tipOver, 2, dash);
  curve(g, chart, points(chart, figures.time, figures.energy.map((v) => k * v)), C.second, 1.5, [2, 3]);
  curve(g, chart, points(chart, figures.time, mine.map((v) => k * v)), "#FFFFFF", 2);
  needle(g, chart, model.moment());
  return { state: told("energy", { total: rounded(total), whole: rounded(figures.energy[figures.energy.length - 1]), bounds: bounds.map(([, name]) => name) }), age: 0, label: `Energy over time: ${told_(total)} ${unit} in the sequences, ${told_(most)} ${unit} in all` };
}

/** Fig. 14: the way of the centre of mass, over the ground. */
function com(g, width, height) {
  const document = model.document(), figures = document?.figures;
  if (!figures?.com.length) return nothing(g, width, height, "com");
  clear(g, width, height);
  const t = size("tick"), across = column(figures.com, 0), up = column(figures.com, 1);
  const [from, to] = [Math.min(...across), Math.max(...across)];
  const wide = Math.max(to - from, 0.1);
  const marks = ticks(from - 0.05 * wide, to + 0.05 * wide, Math.max(2, width / (4 * t)), [0.02, 0.05, 0.1, 0.2, 0.5, 1, 2]);
  const digits = marks.length > 1 && marks[1] - marks[0] < 0.095 ? 2 : 1;
  const chart = (charts.com = frame(g, { left: 2, right: width - 2, height: height - 1.15 * t - 2 }, { from: from - 0.05 * wide, to: to + 0.05 * wide, marks: marks.map((v) => [v, number(v, digits)]) }, upward(Math.min(...up), Math.max(...up), height < 150 ? 3 : 5), "CoM: along →, height ↑, m", "m", 2.4));
  const pixels = figures.com.map(([a, b]) => [chart.x(a), chart.y(b)]);
  // Each phase in its own dash, with its short name where it begins.
  document.phases.forEach(({ name, start, end }, k) => {
    const mine = pixels.filter((_, i) => figures.time[i] >= start - 1e-9 && figures.time[i] <= end + 1e-9);
    if (mine.length < 2) return;
    const sequence = /sequence/.test(name);
    curve(g, chart, mine, sequence ? "#FFFFFF" : C.second, sequence ? 2 : 1.5, sequence ? null : [2, 3]);
    if (sequence) label(g, SHORT[name.replace(/^down /, "")] ?? String(k), mine[0][0] + 4, mine[0][1] - 3, { halo: true });
  });
  const now = at(figures.time, pixels, model.moment());
  star(g, now[0], now[1], false, 8);
  legend(g, 4, height - 0.6 * t, width - 6, [[swatches.line("#FFFFFF"), "sequences"], [swatches.line(C.second, [2, 3], 1.5), "moves"], [swatches.glyph((c, x, y) => star(c, x, y, false, 6)), "now"]], 6);
  const value = at(figures.time, figures.com, model.moment());
  return { state: told("com", { com: value.map((v) => rounded(v, 3)), rise: rounded(up[up.length - 1] - up[0], 3) }), age: 0, label: `Centre of mass: ${number(value[0], 2)} m along, ${number(value[1], 2)} m up` };
}

const DRAW = { joints: lines, rates: lines, torques: lines, energy, com };

function probing(which) {
  return (px, py) => {
    const kind = kinds[which], document = model.document(), figures = document?.figures, chart = charts[kind];
    if (!figures || !chart) return null;
    if (kind === "com") {
      const { box, x, y } = chart;
      return px < box.left || px > box.right || py < box.top || py > box.bottom ? null : [`${number(x.inverse(px), 2)} m along, ${number(y.inverse(py), 2)} m up`];
    }
    const t = timeAt(chart, px, py);
    if (t === null) return null;
    const head = [`${number(t, 1)} s · ${model.phase(t)?.name ?? ""}`];
    if (kind === "energy") return [...head, `sequences ${number(at(figures.time, ofSequences(figures, document.phases), t), 1)} J`, `with moves ${number(at(figures.time, figures.energy, t), 1)} J so far`];
    const { unit, rows, of, digits, limit: sized } = written(kind, figures), row = at(figures.time, rows(figures), t);
    const limit = (j) => (kind === "torques" && Number.isFinite(figures.torque_limits[j]) ? ` of ${number(sized(figures.torque_limits[j]), digits)}` : "");
    return [...head, ...document.roles.map((role, j) => `${role} ${number(of(row[j]), digits)}${limit(j)} ${unit}`)];
  };
}

/** The two plots that can be switched. */
export const surfaces = () => ["first", "second"].map((which) => surface($(`so-plot-${which}`), (g, width, height) => DRAW[kinds[which]](g, width, height, kinds[which]), probing(which)));
