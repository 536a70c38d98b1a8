// What detection makes of the LiDARs' points: coloured in the 3D scene, counted here. While it is off, nothing is asked for.

import { get } from "../api.js";
import { degrees, grouped, seconds } from "../axis.js";
import { page } from "../scene.js";
import { replaying } from "../state.js";
import { $, make, write } from "../words.js";
import { people } from "./model.js";

const AGAIN = 1000; // between two questions while it is shown [ms]
const LATE = 3000; // without an answer, what was told counts no more [ms]

/** What can be shown: name, marks with the colours and shapes they have in the scene, words. */
const ROWS = [
  ["outside", [["●", "#5B6B78"]], "outside the region"],
  ["machine", [["◆", "#C0B8D9"]], "machines' own"],
  ["ground", [["●", "#8F8168"]], "ground"],
  ["object", [["■", "#71E25A"], ["■", "#97B2ED"], ["■", "#C65AE2"]], "objects"],
  ["left", [["✦", "#E6EAED"]], "left over"],
  ["plane", [["▦", "#8F8168"]], "ground plane"],
  ["boxes", [["□", "#97B2ED"]], "boxes before tracking"],
];
const ALL = ROWS.map(([name]) => name);
const POINTS = 5; // of the rows count points

let on = false;
let shown = new Set(ALL);
let told = null, failure = "";
let asked = -Infinity, answered = -Infinity, busy = false;
let send = () => {};

const possible = () => people() !== null && !replaying();
const tell = () => send({ type: "stages", page, shown: on ? [...shown] : [] });

async function ask() {
  asked = performance.now();
  tell(); // again and again: it holds for some seconds, in this window only
  if (busy) return;
  busy = true;
  try {
    [told, failure] = [await get("/api/stages"), ""];
    answered = performance.now();
  } catch (error) {
    [told, failure] = [null, error.message];
  }
  busy = false;
  if (on) show();
}

function choose(names) {
  shown = new Set(names);
  tell();
  show();
}

function row([name, marks, words]) {
  const box = make("input", { type: "checkbox", "data-stage": name });
  box.addEventListener("change", () => choose(ALL.filter((other) => (other === name ? box.checked : shown.has(other)))));
  const only = make("button", { type: "button", "data-only": name, text: "only", "aria-label": `Only ${words}`, title: "This one alone; again: all" });
  only.addEventListener("click", () => choose(alone(name) ? ALL : [name]));
  const key = make("span", { class: "marks", "aria-hidden": "true" }, ...marks.map(([glyph, colour]) => {
    const sign = make("span", { text: glyph });
    sign.style.color = colour;
    return sign;
  }));
  return make("tr", {}, make("td", {}, make("label", {}, box, key, words)), make("td", { "data-count": name }), make("td", {}, only));
}

const alone = (name) => shown.size === 1 && shown.has(name);

export function startStages(give) {
  send = give;
  $("stages-rows").append(...ROWS.map(row));
  $("stages-show").addEventListener("click", () => turn(!on));
  $("stages-close").addEventListener("click", () => turn(false));
}

function turn(value) {
  on = value;
  [told, failure, shown, asked] = [null, "", new Set(ALL), -Infinity];
  if (!on) tell();
  update();
}

/** The scan in words: how many points, how old; or why there is none. */
function summary() {
  if (failure) return failure;
  if (!told || performance.now() - answered > LATE) return told ? "no answer from the server" : "waiting for a scan";
  if (told.reason) return told.reason;
  return `${grouped(told.points)} points, ${grouped(told.drawn)} drawn, ${seconds(told.age)} old`;
}

function count(name, k) {
  if (!told?.counts || performance.now() - answered > LATE) return "—";
  if (k < POINTS) return grouped(told.counts[name]);
  if (name === "boxes") return String(told.objects);
  return told.slope === null ? "none found" : `${degrees(told.slope, 1)} steep`;
}

function show() {
  const text = summary();
  write($("stages-words"), text[0].toUpperCase() + text.slice(1));
  ROWS.forEach(([name], k) => {
    write(document.querySelector(`[data-count="${name}"]`), count(name, k));
    document.querySelector(`[data-stage="${name}"]`).checked = shown.has(name);
    document.querySelector(`[data-only="${name}"]`).setAttribute("aria-pressed", String(alone(name)));
  });
}

/** Ten times a second. */
export function update() {
  $("stages-tools").hidden = !possible();
  if (on && !possible()) turn(false);
  $("stages-show").setAttribute("aria-pressed", String(on));
  $("stages").hidden = !on;
  if (!on || document.hidden) return;
  if (performance.now() - asked >= AGAIN) ask();
  show();
}
