// The dialog “Working gauge”: every limit volume, why it holds or not, its switch, and areas to draw.

import { post, send } from "../api.js";
import { $, make, mark, write } from "../words.js";
import { machine, replaying, state } from "../state.js";
import * as drawing from "./drawing.js";
import * as model from "./model.js";

export { drawKey } from "./drawing.js";
export { forget } from "./model.js";

const BELOW = 3, ABOVE = 10; // m from the own machine's ground: what is proposed for a new area
const WORDS = { keep_out: "keep-out", keep_in: "keep-in" };

let busy = false;
let built = "";

const mayChange = () => Boolean(state.you) && state.you.role !== "viewer" && !replaying();

function answer(text, kind = "") {
  write($("gauge-answer"), text);
  mark($("gauge-answer"), "kind", kind);
}

async function act(run, done) {
  if (busy) return;
  busy = true;
  try {
    model.take(await run());
    answer(done);
  } catch (error) {
    answer(error.message, "error");
  }
  busy = false;
}

/** Why a volume holds or not, in words. */
function reason(volume) {
  const on = model.standingOn(volume.name);
  if (volume.idle) return `idle: ${volume.idle.replace(/^is /, "")}`;
  return `in force${volume.switched ? ", switched on" : ""}${on.length ? `; ${on.join(" and ")} ${on.length > 1 ? "stand" : "stands"} on it` : ""}`;
}

const told = (volume) => `${WORDS[volume.kind] ?? volume.kind} · ${reason(volume)}`;

function buttons(volume) {
  if (!mayChange()) return [];
  const one = (word, on) => {
    const pressed = volume.switched === on;
    const button = make("button", { type: "button", text: word, "aria-pressed": String(pressed), "aria-label": `${volume.name} ${word.toLowerCase()}`, title: pressed ? "Again: as its state says" : on ? "Holds whatever its state, also for who stands on it" : "Holds for nobody" });
    button.addEventListener("click", () => act(() => send("PUT", "/api/gauge/switch", { name: volume.name, on: pressed ? null : on }), `${volume.name}: ${pressed ? "as its state says" : on ? "on" : "off"}`));
    return button;
  };
  const erase = make("button", { type: "button", text: "Delete", "aria-label": `Delete ${volume.name}` });
  erase.addEventListener("click", () => act(() => send("DELETE", `/api/gauge/drawn/${encodeURIComponent(volume.name)}`), `${volume.name} is deleted`));
  return [one("On", true), one("Off", false), ...(volume.drawn ? [erase] : [])];
}

function rows() {
  return model.volumes().map((volume) => make("tr", { "data-name": volume.name, "data-held": volume.idle ? "0" : "1" },
    make("td", { text: volume.name }), make("td", { text: told(volume) }), make("td", {}, ...buttons(volume))));
}

function hint() {
  if (drawing.drawing()) return `${drawing.count()} corner${drawing.count() === 1 ? "" : "s"} on the plan. Enter or a double click closes, Esc cancels.`;
  if (drawing.drawn()) return "Name the area; heights are above the site's origin.";
  return mayChange() ? "" : "Operators and supervisors can change it.";
}

/** After every step of a drawing. */
function drawingChanged() {
  const area = drawing.drawn();
  const form = $("gauge-form");
  if (area && form.hidden) {
    const ground = machine(state.own)?.position?.[2] ?? 0;
    const taken = new Set(model.volumes().map((v) => v.name));
    let k = 1;
    while (taken.has(`area ${k}`)) k += 1;
    $("gauge-name").value = `area ${k}`;
    $("gauge-bottom").value = (ground - BELOW).toFixed(1);
    $("gauge-top").value = (ground + ABOVE).toFixed(1);
    form.hidden = false;
    openGauge();
    $("gauge-name").focus();
    $("gauge-name").select();
  } else if (!area) form.hidden = true;
  write($("gauge-hint"), hint());
}

async function keep() {
  const area = drawing.drawn();
  const name = $("gauge-name").value.trim();
  if (!area) return;
  if (!name) return void answer("An area needs a name.", "error");
  const height = (id) => ($(id).value === "" ? null : Number($(id).value));
  await act(async () => {
    const document = await post("/api/gauge/drawn", { name, ...area, bottom: height("gauge-bottom"), top: height("gauge-top") });
    drawing.giveUp();
    return document;
  }, `${name} is kept and holds`);
}

export function openGauge() {
  if (!model.known() || replaying()) return;
  if (!$("gauge").open) {
    answer("");
    built = "";
    $("gauge").show(); // not modal: the alarm line and the plan stay in reach
  }
  update();
}

export function closeGauge() {
  drawing.giveUp();
  if ($("gauge").open) $("gauge").close();
}

export function startGauge() {
  drawing.startDrawing(drawingChanged);
  $("gauge-open").addEventListener("click", () => ($("gauge").open ? closeGauge() : openGauge()));
  $("gauge-close").addEventListener("click", closeGauge);
  $("gauge-out").addEventListener("click", () => drawing.begin("keep_out"));
  $("gauge-in").addEventListener("click", () => drawing.begin("keep_in"));
  $("gauge-discard").addEventListener("click", drawing.giveUp);
  $("gauge-form").addEventListener("submit", (event) => {
    event.preventDefault();
    keep();
  });
  $("gauge").addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    if (drawing.drawing() || drawing.drawn()) drawing.giveUp();
    else closeGauge();
    event.stopPropagation();
    event.preventDefault();
  });
}

/** Ten times a second; builds anew only what changed. */
export function update() {
  model.update();
  const usable = model.known() && !replaying();
  if ($("gauge-open").hidden === usable) $("gauge-open").hidden = !usable;
  const { open } = $("gauge");
  if (open && !usable) return closeGauge();
  $("gauge-open").setAttribute("aria-expanded", String(open));
  if (!open) return undefined;
  for (const id of ["gauge-out", "gauge-in"]) $(id).hidden = !mayChange();
  write($("gauge-hint"), hint());
  const volumes = model.volumes();
  const key = JSON.stringify([mayChange(), volumes.map((v) => [v.name, v.kind, v.idle, v.switched, v.drawn])]);
  if (key === built) {
    // Who stands on a track can change at any time: a button being pressed stays where it is.
    volumes.forEach((volume, k) => write($("gauge-list").rows[k].cells[1], told(volume)));
    return undefined;
  }
  built = key;
  const focused = document.activeElement?.getAttribute("aria-label");
  $("gauge-list").replaceChildren(...rows());
  if (focused && document.activeElement === document.body) [...$("gauge-list").querySelectorAll("button")].find((b) => b.getAttribute("aria-label") === focused)?.focus();
  return undefined;
}
