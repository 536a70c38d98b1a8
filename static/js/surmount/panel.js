// The panel “Obstacle” in the place of the reach image: what to surmount, the search, its candidates, the preview, and following one.

import { deg, metres, number, seconds } from "../axis.js";
import { controllable, holds } from "../drive/driving.js";
import { label, state } from "../state.js";
import { followLines, named, stateWord } from "../trajectory/words.js";
import { $, make, mark, write } from "../words.js";
import { setOpen, startDrawing } from "./draw.js";
import * as model from "./model.js";
import * as obstacles from "./obstacles.js";
import { NAMES, kinds, next, surfaces, turn } from "./plots.js";
import { startSide } from "./side.js";

const FIELDS = { height: [0.3, -5, 5], distance: [2, 0.1, 100], payload: [0, 0, 1e6] };
const NUMBERS = ""; // the value of the choice "by numbers"
const MOST = 12; // candidates in the table
const KINDS = { room: "Too little room", reach: "Out of the arm's reach", torque: "Too little torque", stability: "It would tip", collision: "It would collide", simulation: "Not in the simulation" };

let open = false;
let redraw = () => {};
let plots = [];
let drawn = "", built = "", rows = "";
let used = false;

/** What the fields say; with the first that makes no sense. */
function entered() {
  const found = {};
  for (const [name, [usual, low, high]] of Object.entries(FIELDS)) {
    const field = $(`so-${name}`);
    const value = field.value.trim() === "" ? usual : Number(field.value);
    const wrong = !Number.isFinite(value) || value < low || value > high || (name === "height" && !model.obstacle() && Math.abs(value) < 0.01);
    mark(field, "wrong", wrong ? 1 : 0);
    if (wrong) return { wrong: `${field.title.split(":")[0]}: allowed is ${low} to ${high}` };
    found[name] = value;
  }
  return { ...found, effort: $("so-effort").value };
}

/** The step that is chosen: {height, distance, depth, why}; null while it is unknown. */
function chosen() {
  const name = model.obstacle();
  if (name) return obstacles.seen(name);
  const { wrong, height, distance } = entered();
  return wrong ? null : { height, distance, depth: null, why: "" };
}

const describe = (name) => {
  const step = obstacles.seen(name);
  if (!step) return name;
  return step.why ? `${name} · ${step.why}` : `${name} · ${metres(Math.abs(step.height))} ${step.height < 0 ? "down" : "high"}, ${metres(step.distance)} ahead`;
};

function build() {
  const texts = obstacles.names().map((name) => [name, describe(name)]);
  const key = JSON.stringify(texts);
  if (key !== built) {
    built = key;
    $("so-obstacle").replaceChildren(...texts.map(([value, text]) => make("option", { value, text })), make("option", { value: NUMBERS, text: "a step by its numbers" }));
  }
  const value = model.obstacle() ?? NUMBERS;
  if ($("so-obstacle").value !== value) $("so-obstacle").value = value;
}

/** Fields are to be seen while nothing is on offer that they could change. */
const asking = () => !model.planning() && !model.following() && !["offered", "unknown"].includes(model.offer()?.state);

const energyOf = (joules) => (joules >= 2000 ? `${number(joules / 1000, 2)} kJ` : `${number(joules, 1)} J`);

function result(offer) {
  const { duration, energy, checks, parameters: p } = offer;
  const tips = Number.isFinite(checks?.min_stability_margin) ? `${metres(checks.min_stability_margin)} to tipping` : "tipping not judged";
  const torque = Number.isFinite(checks?.worst_torque) ? `${number(100 * checks.worst_torque, 0)} % torque` : "torques not judged";
  const lengths = p ? `P1 ${number(p.p1, 2)} P2 ${number(p.p2, 2)} P3 ${number(p.p3, 2)} P4 ${number(p.p4, 2)} m, α_F ${number(deg(p.alpha_f), 1)}°` : "";
  return [`${Number.isFinite(energy) ? energyOf(energy) : "energy unknown"} · ${number(duration, 1)} s · ${tips} · ${torque}`, lengths, ...offer.notes.map(named)].filter(Boolean);
}

/** What to say: the first line, and what stands small below. */
function lines() {
  const offer = model.offer(), follow = model.follow(), asked = entered();
  if (asking() && asked.wrong) return [asked.wrong];
  if (model.trouble() && !model.following()) return [named(model.trouble())];
  if (model.following()) {
    const [where, what] = followLines(follow);
    return [`${model.phase(follow.at)?.name ?? ""} · ${where}`, what];
  }
  if (follow?.ended && !follow.arrived && follow.plan === offer?.plan) return [`Ended: ${named(follow.ended)}`, offer?.state === "offered" ? "Accept takes it up where it was left" : "Find a way again"];
  if (offer?.progress) return [offer.progress.of ? `${offer.progress.words} ${offer.progress.done} of ${offer.progress.of}` : offer.progress.words || "starting", "Nothing moves by it"];
  if (model.planning()) return ["waits for its turn", "Nothing moves by it"];
  const step = chosen();
  if (!offer) return step?.why ? [`${model.obstacle()} is ${step.why}`] : ["Find a way: the arm lifts the machine over it", "Pick one here or on the plan. Nothing moves by it"];
  if (offer.state === "none") return [`${KINDS[offer.kind] ? `${KINDS[offer.kind]}: ` : ""}${named(offer.why)}`];
  if (offer.state === "void") return [`Void: ${named(offer.why)}`, "Find a way again"];
  if (offer.state === "unknown") return [`Not known: ${named(offer.why)}`];
  if (offer.state === "done") return [`${label(state.own)} is over it`];
  return [...result(offer), holds(state.own) ? "" : controllable(state.own) ? `To follow it, request ${label(state.own)} (R)` : ""].filter(Boolean);
}

/** The candidates with the least energy, and the one that is on offer. */
function best() {
  const all = model.candidates().map((one, k) => ({ ...one, k })).filter((one) => Number.isFinite(one.energy));
  all.sort((a, b) => a.energy - b.energy);
  const now = model.offer()?.candidate ?? null, first = all.slice(0, MOST);
  const mine = all.find(({ k }) => k === now);
  return mine && !first.includes(mine) ? [...first.slice(0, MOST - 1), mine] : first;
}

function table() {
  const list = best(), now = model.offer()?.candidate ?? null;
  const key = JSON.stringify([list, now, model.planning(), model.following()]);
  if (key === rows) return;
  rows = key;
  $("so-rows").replaceChildren(...list.map((one) => {
    const choose = make("button", { type: "button", text: number(one.energy, one.energy >= 100 ? 0 : 1), "aria-pressed": String(one.k === now), title: `P1 ${number(one.parameters.p1, 3)}, P2 ${number(one.parameters.p2, 3)}, P3 ${number(one.parameters.p3, 3)}, P4 ${number(one.parameters.p4, 3)} m, α_F ${number(deg(one.parameters.alpha_f), 2)}°${one.simulated ? ", simulated" : ", quasi-static: a lower bound"}` });
    choose.disabled = model.planning() || model.following() || !model.mayAsk();
    choose.addEventListener("click", () => model.choose(one.k));
    const cells = [number(one.duration, 1), number(one.min_stability_margin, 2), Number.isFinite(one.worst_torque) ? number(100 * one.worst_torque, 0) : "–", one.simulated ? "sim" : "est"];
    return make("tr", { "data-candidate": one.k, "data-shown": one.k === now ? 1 : 0 }, make("td", { text: one.k === now ? "▸" : "" }), make("td", {}, choose), ...cells.map((text) => make("td", { text })));
  }));
}

const setDisabled = (id, off) => {
  if ($(id).disabled !== off) $(id).disabled = off;
};

/** Keys go on to the levers. */
const keys = () => $("plan").focus();

function find() {
  const asked = entered();
  if (asked.wrong || !model.mayAsk() || !asking()) return;
  const { payload, effort, height, distance } = asked;
  model.find(model.obstacle() ? { name: model.obstacle(), payload, effort } : { step: { height, distance }, payload, effort });
  keys();
}

/** The nearest obstacle ahead. */
function suggest() {
  const ahead = obstacles.names().map((name) => [name, obstacles.seen(name)]).filter(([, step]) => step && !step.why);
  ahead.sort(([, a], [, b]) => a.distance - b.distance);
  return ahead[0]?.[0] ?? null;
}

export function openSurmount() {
  if (!model.possible()) return;
  open = true;
  setOpen(true);
  if (model.obstacle() === null && !model.offer()) model.pick(suggest());
  const counted = state.snapshot.stability?.[state.own]?.payload; // what the site says that it carries
  if (!used && Number.isFinite(counted)) $("so-payload").value = Math.round(counted);
  used = true;
  update();
  redraw();
}

export function closeSurmount() {
  if (!open) return;
  open = false;
  setOpen(false);
  model.stop();
  update();
  redraw();
}

export const isOpen = () => open;

/** plan: draws the plan view anew; others: closes what else stands in this place. Returns the surfaces of its plots. */
export function startSurmount(send, plan, others) {
  const change = () => {
    update();
    redraw();
  };
  plots = [...surfaces(), startSide(chosen)];
  redraw = () => {
    plan();
    for (const one of plots) one.dirty = true;
  };
  model.startModel(send);
  startDrawing(change);
  $("surmount-open").addEventListener("click", () => toggleSurmount(others));
  $("so-close").addEventListener("click", closeSurmount);
  $("so-obstacle").addEventListener("change", () => {
    model.pick($("so-obstacle").value || null);
    change();
  });
  $("so-find").addEventListener("click", find);
  for (const [id, act] of [["accept", model.accept], ["drop", model.drop]]) {
    $(`so-${id}`).addEventListener("click", () => {
      act();
      keys();
    });
  }
  $("so-pause").addEventListener("click", model.pause);
  $("so-time").addEventListener("input", () => model.seek(Number($("so-time").value)));
  for (const which of ["first", "second"]) {
    $(`so-${which}`).addEventListener("click", () => {
      turn(which);
      change();
    });
  }
  for (const name of Object.keys(FIELDS)) {
    $(`so-${name}`).addEventListener("input", change);
    $(`so-${name}`).addEventListener("keydown", (event) => {
      if (event.key === "Enter") find();
      else if (event.key === "Escape") keys();
    });
  }
  return plots;
}

export function toggleSurmount(others) {
  if (open) closeSurmount();
  else {
    others();
    openSurmount();
  }
}

/** Ten times a second. */
export function update() {
  const possible = model.possible();
  if ($("surmount-open").hidden === possible) $("surmount-open").hidden = !possible;
  if (open && !possible) return closeSurmount();
  model.update(open);
  $("surmount-open").setAttribute("aria-pressed", String(open));
  $("surmount").hidden = !open;
  const known = model.document()?.ok === true, offer = model.offer();
  $("so-plots").hidden = !open;
  mark($("so-plots"), "only", known ? 0 : 1);
  mark(document.body, "surmount", open ? 1 : 0);
  if (!open) return undefined;
  build();
  const asked = entered(), ask = asking();
  $("so-ask").hidden = !ask;
  $("so-offer").hidden = ask;
  $("so-numbers").hidden = Boolean(model.obstacle());
  write($("so-who"), label(state.own));
  const word = stateWord(model);
  write($("so-state"), word);
  mark($("surmount"), "state", word);
  const busy = model.planning();
  $("so-find").hidden = !ask;
  setDisabled("so-find", !model.mayAsk() || Boolean(asked.wrong) || !chosen() || Boolean(chosen()?.why));
  setDisabled("so-accept", !model.mayAccept());
  setDisabled("so-drop", (!offer && !model.follow()) || !model.mayAsk());
  write($("so-drop"), busy ? "Cancel" : "Drop");
  const progress = offer?.progress;
  $("so-progress").hidden = !busy;
  if (progress?.of) {
    $("so-progress").max = progress.of;
    $("so-progress").value = progress.done;
  } else $("so-progress").removeAttribute("value");
  const [first = "", ...others] = lines();
  write($("so-line"), first);
  $("so-line").title = first;
  write($("so-more"), others.join(" · "));
  $("so-more").title = others.join(" · ");
  table();
  $("so-table").hidden = ask || !best().length;
  for (const which of ["first", "second"]) {
    write($(`so-${which}-name`), NAMES[kinds[which]]);
    write($(`so-${which}`), next(which));
  }
  const watched = ["offered", "unknown"].includes(offer?.state) && Number.isFinite(offer.age);
  for (const node of $("so-plots").querySelectorAll(".age")) write(node, watched ? seconds(offer.age) : "");
  $("so-play").hidden = !known;
  setDisabled("so-pause", model.following());
  setDisabled("so-time", model.following());
  write($("so-pause"), model.playing() ? "Pause" : "Play");
  const at = model.moment();
  if (known) $("so-time").max = model.duration();
  if (document.activeElement !== $("so-time") || model.playing()) $("so-time").value = at;
  write($("so-at"), known ? `${number(at, 1)} s ${model.phase(at)?.name ?? ""}` : "");
  const step = chosen();
  const key = `${offer?.plan} ${offer?.state} ${at.toFixed(2)} ${known} ${model.changes()} ${step?.height} ${step?.distance?.toFixed(2)} ${model.obstacle()}`;
  if (key !== drawn) redraw();
  drawn = key;
  return undefined;
}
