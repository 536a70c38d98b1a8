// The mapping editor: live axes and buttons, and which of them is which function.

import { $, make, mark, write } from "../words.js";
import { number } from "../axis.js";
import { DEAD_MOST, BUTTONS, buttonWord, read } from "./mapping.js";
import { NAMES } from "./deflection.js";
import { changeMapping, slots } from "./operator.js";
import * as pads from "./pads.js";
import * as store from "./store.js";

const AXIS_WORDS = { left_x: "left stick, right", left_y: "left stick, forwards", right_x: "right stick, right", right_y: "right stick, forwards", track_left: "left track", track_right: "right track" };
const BUTTON_WORDS = { enable: "dead-man (hold)", stop: "STOP", override: "override (hold)", track_left_ahead: "left track ahead", track_left_back: "left track back", track_right_ahead: "right track ahead", track_right_back: "right track back" };

let built = "";
const outputs = new Map(); // function -> <output>

export function openMapping() {
  built = "";
  if (!$("mapping").open) $("mapping").show();
  update();
  $("mapping-close").focus();
}

export function closeMapping() {
  if ($("mapping").open) $("mapping").close();
}

/** Changes one entry and keeps it. */
function change(kind, name, entry) {
  const mapping = structuredClone(store.mapping(slots));
  Object.assign(mapping[kind][name], entry);
  changeMapping(mapping);
}

function select(options, value, label, act) {
  const node = make("select", { "aria-label": label }, ...options.map(([given, text]) => make("option", { value: String(given), text })));
  node.value = String(value);
  node.addEventListener("change", () => act(node.value === "null" ? null : Number(node.value)));
  return node;
}

const DEVICES = [[0, "1"], [1, "2"]];
const most = (what, chosen) => Math.max(what === "axes" ? 4 : 16, ...slots.map((pad) => pad?.[what].length ?? 0), ...(chosen === null ? [] : [chosen + 1]));
const numbered = (what, chosen, word) => [["null", "none"], ...Array.from({ length: most(what, chosen) }, (_, i) => [i, word(i)])];
const row = (...cells) => make("tr", {}, ...cells.map((cell) => make("td", {}, cell)));

function axisRow(name, { slot, axis, invert, dead }) {
  const word = AXIS_WORDS[name];
  const inverted = make("input", { type: "checkbox", "aria-label": `${word}: inverted` });
  inverted.checked = invert;
  inverted.addEventListener("change", () => change("axes", name, { invert: inverted.checked }));
  const zone = make("input", { type: "number", min: "0", max: String(DEAD_MOST), step: "0.01", "aria-label": `${word}: dead zone`, "data-dead": name });
  zone.value = String(dead);
  zone.addEventListener("change", () => {
    const value = Math.min(Math.max(Number(zone.value) || 0, 0), DEAD_MOST);
    zone.value = String(value);
    change("axes", name, { dead: value });
  });
  const output = make("output", {});
  outputs.set(name, output);
  return row(word, select(DEVICES, slot, `${word}: device`, (value) => change("axes", name, { slot: value })), select(numbered("axes", axis, (i) => `axis ${i}`), axis, `${word}: axis`, (value) => change("axes", name, { axis: value })), inverted, zone, output);
}

function buttonRow(name, { slot, button }) {
  const word = BUTTON_WORDS[name];
  const output = make("output", {});
  outputs.set(name, output);
  return row(word, select(DEVICES, slot, `${word}: device`, (value) => change("buttons", name, { slot: value })), select(numbered("buttons", button, (i) => buttonWord(slots, { slot, button: i })), button, `${word}: button`, (value) => change("buttons", name, { button: value })), output);
}

function head(...words) {
  return make("tr", {}, ...words.map((text) => make("th", { text, scope: "col" })));
}

export function startEditor() {
  $("mapping-close").addEventListener("click", closeMapping);
  $("mapping-reset").addEventListener("click", () => {
    changeMapping(null);
    built = "";
    update();
  });
}

function live() {
  const mapping = store.mapping(slots);
  const shown = read(slots, mapping);
  for (const name of NAMES) write(outputs.get(name), number(shown.deflection[name], 2));
  for (const name of BUTTONS) {
    const { slot, button } = mapping.buttons[name];
    const given = button === null ? null : slots[slot]?.buttons?.[button];
    write(outputs.get(name), given ? (given.pressed ? "■ on" : number(given.value, 2)) : "–");
    mark(outputs.get(name), "on", given?.pressed ? 1 : 0);
  }
  const of = (pad, i) => {
    const on = pad.buttons.flatMap((b, k) => (b.pressed ? [buttonWord(slots, { slot: i, button: k })] : []));
    return `${i + 1}: axes ${[...pad.axes].map((v) => number(v, 2)).join("  ")} · pressed: ${on.join(", ") || "none"}`;
  };
  write($("mapping-live"), slots.flatMap((pad, i) => (pad ? [of(pad, i)] : [])).join("\n"));
}

/** Ten times a second. */
export function update() {
  if (!$("mapping").open) return;
  const devices = slots.map((pad, i) => (pad ? `${i + 1}: ${pad.id}` : "")).filter(Boolean);
  write($("mapping-devices"), devices.join(" · ") || pads.unavailable() || "No gamepad seen yet: press one of its buttons.");
  write($("mapping-answer"), store.complaint || (store.own() ? "Your own mapping, kept in this browser." : "Default mapping."));
  const key = `devices ${devices.join()}`;
  if (key !== built) {
    built = key;
    const mapping = store.mapping(slots);
    $("mapping-axes").replaceChildren(head("Function", "Device", "Axis", "Invert", "Dead zone", "Now"), ...NAMES.map((name) => axisRow(name, mapping.axes[name])));
    $("mapping-buttons").replaceChildren(head("Function", "Device", "Button", "Now"), ...BUTTONS.map((name) => buttonRow(name, mapping.buttons[name])));
  }
  live();
}
