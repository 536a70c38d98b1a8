// As it was against judged now: where distances, levels and first warnings differ. A click on a time goes there.

import { make } from "./words.js";
import { metres, number } from "./axis.js";
import { clock } from "./clock.js";
import { label as nameOf } from "./state.js";
import { playback, seek } from "./player.js";
import { session, startDiff } from "./session.js";

const MOST = 8; // rows of a table

export const compareKey = () => JSON.stringify([session.diff.state, Math.round(100 * (session.diff.progress ?? 0)), session.diffProblem, session.diff.result !== null]);

function timeButton(t) {
  if (!Number.isFinite(t)) return make("span", { class: "dim", text: "never" });
  const button = make("button", { type: "button", text: clock(t), title: "Go there" });
  button.addEventListener("click", () => seek(t));
  return button;
}

/** Differences are small: millimetres below a metre. */
const small = (d) => (!Number.isFinite(d) ? "unknown" : d < 1 ? `${number(1000 * d, 0)} mm` : metres(d));

const level = (name) => make("b", { "data-level": name, text: name });

function table(headings, rows) {
  const body = rows.slice(0, MOST).map((cells) => make("tr", {}, ...cells.map((cell) => make("td", {}, cell))));
  const more = rows.length > MOST ? [make("p", { class: "dim", text: `and ${rows.length - MOST} more, shorter ones` })] : [];
  return [make("table", {}, make("thead", {}, make("tr", {}, ...headings.map((text) => make("th", { text })))), make("tbody", {}, ...body)), ...more];
}

const pairText = (key) => key.split("|").map(nameOf).join(" ↔ ");

function later(recorded, evaluated) {
  if (!Number.isFinite(recorded) || !Number.isFinite(evaluated)) return "";
  const by = evaluated - recorded;
  return Math.abs(by) < 0.05 ? "same time" : `${number(Math.abs(by), 1)} s ${by < 0 ? "earlier" : "later"}`;
}

function result({ distance, levels, first_warnings: warnings }) {
  const pairs = Object.entries(distance?.pairs ?? {}).sort(([, a], [, b]) => b.max_abs - a.max_abs);
  const spans = [...(levels?.differences ?? [])].sort((a, b) => b.end - b.start - (a.end - a.start));
  const agree = levels?.agree;
  return [
    make("h4", { text: "Distances" }),
    ...(pairs.length ? table(["machines", "largest difference", "at", "rms"], pairs.map(([key, d]) => [pairText(key), small(d.max_abs), Number.isFinite(d.at) ? timeButton(d.at) : "–", small(d.rms)])) : [make("p", { text: "No distance to compare." })]),
    // Never "100 %" while something differs.
    make("h4", { text: `Levels agree ${Number.isFinite(agree) ? `${number(Math.floor(1000 * agree + 1e-6) / 10, 1)} % of the time` : "–"}${spans.length ? `, ${spans.length} stretch${spans.length === 1 ? "" : "es"} differ${spans.length === 1 ? "s" : ""}` : ""}` }),
    ...(spans.length ? table(["machine", "from", "for", "as it was", "judged now"], spans.map((d) => [nameOf(d.machine), timeButton(d.start), `${number(d.end - d.start, 1)} s`, level(d.recorded), level(d.evaluated)])) : []),
    make("h4", { text: "First warnings" }),
    ...(warnings?.length ? table(["machine", "warning", "as it was", "judged now", ""], warnings.map((w) => [nameOf(w.machine), make("span", {}, level(w.level), ` ${w.name}`), timeButton(w.recorded), timeButton(w.evaluated), make("span", { class: "dim", text: later(w.recorded, w.evaluated) })])) : [make("p", { text: "No warning in either." })]),
  ];
}

export function compareSheet() {
  const { state, progress } = session.diff;
  const error = session.diffProblem ? [make("p", { class: "error", text: `Comparison: ${session.diffProblem}` })] : [];
  if (state === "running") return [make("p", { text: `Judging the whole session anew: ${number(100 * (progress ?? 0), 0)} %` }), make("progress", { max: "1", value: String(progress ?? 0) }), ...error];
  const button = make("button", { type: "button", id: "diff-start", text: state === "done" ? "Compare again" : "Compare" });
  button.addEventListener("click", startDiff);
  const again = make("div", { class: "choices" }, button);
  if (state === "done" && session.diff.result) return [...result(session.diff.result), ...error];
  const length = playback() ? ` (${clock(playback().duration, 0)} of it)` : "";
  return [make("p", { text: `Judges the whole session${length} with today's software and settings, and lists what comes out differently.` }), again, ...error];
}
