// The panel “Use case” over the plan and the images: choose, start, compare. The alarms, the scene and the levers stay as they are.

import { metres, number } from "../axis.js";
import { replaying, state } from "../state.js";
import { $, make, mark, write } from "../words.js";
import * as model from "./model.js";
import { STYLE, kinds, surfaces, turn } from "./plots.js";

let open = false;
let plots = [];
let drawn = "";
let built = "";

const mayStart = () => Boolean(state.you) && state.you.role !== "viewer";

function swatch(name) {
  const [colour, width, dash] = STYLE[name];
  const node = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  const line = document.createElementNS("http://www.w3.org/2000/svg", "line");
  for (const [attribute, value] of [["viewBox", "0 0 30 8"], ["aria-hidden", "true"]]) node.setAttribute(attribute, value);
  for (const [attribute, value] of [["x2", 30], ["y1", 4], ["y2", 4], ["stroke", colour], ["stroke-width", width + 0.5], ["stroke-dasharray", (dash ?? []).join(" ")]]) line.setAttribute(attribute, value);
  node.append(line);
  return node;
}

function cells(name) {
  const run = model.run(name), now = model.running();
  if (now?.method === name && now.name === model.chosen().name) return [`working it out, ${number(100 * now.progress, 0)} %`, "", "", ""];
  if (!run) return [model.queued(name) ? "waits" : "not run", "", "", ""];
  return [run.arrived === null ? "never" : `${number(run.arrived, 1)} s`, metres(run.nearest.distance), `${number(run.mean_error, 2)} / ${number(run.max_error, 2)} m`, String(run.vibration.sign_changes)];
}

function rows() {
  return model.methods().map(({ name, words }) => {
    const choose = make("button", { type: "button", "data-method": name }, swatch(name), words);
    choose.addEventListener("click", () => model.choose(name));
    return make("tr", { "data-row": name }, make("td", {}, choose), ...[0, 1, 2, 3].map(() => make("td")));
  });
}

function build() {
  const key = JSON.stringify([model.methods(), model.offered()]);
  if (key === built) return;
  built = key;
  $("uc-rows").replaceChildren(...rows());
  $("uc-name").replaceChildren(...model.offered().map((one) => make("option", { value: one.name, text: one.title })));
}

function words() {
  const offer = model.offer(), run = model.run();
  if (model.trouble() && !model.busy()) return model.trouble();
  if (model.busy()) return "working it out in simulated time";
  if (!run) return mayStart() ? `${offer?.label ?? ""} stands still meanwhile: a ghost moves` : "operators and supervisors can start it";
  const k = model.instant(run);
  const held = run.limited[k] ? run.scale[k] < 0.995 ? ` · cut to ${number(100 * run.scale[k], 0)} %` : " · held back" : "";
  return `${number(model.time(), 1)} of ${number(model.document().seconds, 0)} s · ${run.pairs[run.pair[k]]} ${number(run.distance[k], 2)} m${held}`;
}

export function openUseCases() {
  if (!model.offered().length || replaying()) return;
  open = true;
  update();
}

export function closeUseCases() {
  if (!open) return;
  model.halt();
  open = false;
  update();
}

/** gauge: closes its dialog, from which this one is opened. */
export function startUseCases(send, gauge) {
  model.startModel(send);
  plots = surfaces();
  $("use-cases-open").addEventListener("click", () => {
    gauge();
    openUseCases();
  });
  $("uc-close").addEventListener("click", closeUseCases);
  $("uc-name").addEventListener("change", () => model.choose(model.chosen().method, $("uc-name").value));
  $("uc-start").addEventListener("click", () => (model.shown() || model.busy() ? model.halt() : model.start()));
  $("uc-all").addEventListener("click", () => model.start(true));
  $("uc-pause").addEventListener("click", model.pause);
  $("uc-time").addEventListener("input", () => model.seek(Number($("uc-time").value)));
  $("uc-second").addEventListener("click", () => redraw(turn("second")));
  $("uc-third").addEventListener("click", () => redraw(turn("third")));
  return plots;
}

function redraw() {
  for (const one of plots) one.dirty = true;
}

/** Ten times a second. */
export function update() {
  model.update(open, $("gauge").open);
  $("use-cases-open").hidden = !model.offered().length;
  if (open && (replaying() || !model.offered().length)) return closeUseCases();
  $("use-cases").hidden = !open;
  if (!open) return undefined;
  build();
  const { name, method } = model.chosen(), run = model.run(), doc = model.document();
  const going = model.shown() || model.busy();
  write($("uc-start"), going ? "Stop" : "Start");
  $("uc-start").disabled = !going && !run && !mayStart();
  $("uc-all").disabled = model.busy() || (!mayStart() && model.methods().some((one) => !model.run(one.name)));
  $("uc-pause").disabled = !model.shown();
  write($("uc-pause"), model.playing() ? "Pause" : "Play");
  $("uc-name").value = name;
  $("uc-time").disabled = !run;
  if (doc) $("uc-time").max = doc.seconds;
  if (globalThis.document.activeElement !== $("uc-time") || model.playing()) $("uc-time").value = model.time();
  write($("uc-words"), words());
  mark($("uc-words"), "kind", model.trouble() && !model.busy() && model.trouble() !== "stopped" ? "error" : "");
  write($("uc-second"), kinds().second === "rates" ? "Angles" : "Rates");
  write($("uc-third"), kinds().next[0].toUpperCase() + kinds().next.slice(1));
  for (const row of $("uc-rows").rows) {
    const one = row.dataset.row;
    row.querySelector("button").setAttribute("aria-pressed", String(one === method));
    cells(one).forEach((text, k) => write(row.cells[k + 1], text));
    mark(row, "wide", cells(one)[1] ? 0 : 1);
  }
  const key = `${model.changes()} ${name} ${method} ${model.shown()} ${model.time().toFixed(2)} ${model.busy()}`;
  if (key !== drawn) redraw();
  drawn = key;
  return undefined;
}
