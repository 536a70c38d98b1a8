// Driving: wires its modules, and its keys.

import { $, make } from "../words.js";
import { state } from "../state.js";
import { controllable, driving } from "./driving.js";
import * as asks from "./asks.js";
import * as controls from "./controls.js";
import * as editor from "./editor.js";
import * as keyboard from "./keyboard.js";
import * as loss from "./loss.js";
import * as operator from "./operator.js";
import * as panel from "./panel.js";
import { enterScene, leaveScene } from "./focus.js";

export function startDriving(give) {
  asks.startAsks(give);
  operator.startOperator(give, $("scene"));
  panel.startPanel();
  controls.startControls();
  editor.startEditor();
  // The page leaves the keys of text fields alone.
  for (const id of ["controls", "mapping"]) $(id).addEventListener("keydown", (event) => event.key === "Escape" && closeDialogs());
}

/** Of the window of the scene, besides its keys. */
export const sceneListeners = { keyup: onKeyUp, focus: enterScene, blur: leaveScene };

export const { chosen, request } = asks;

/** True when the key was meant for a machine. Text fields and dialogs keep theirs. */
export function driveKey(event) {
  if (!driving() || event.target?.closest?.("dialog, input, select, textarea")) return false;
  if (event.code === "Backspace") {
    if (!event.repeat) operator.stop();
    return true;
  }
  if (operator.press(event)) return true;
  if (event.repeat) return false;
  if (event.code === "KeyR") return asks.request();
  if (event.code === "KeyP") return asks.pause();
  return false;
}

export function onKeyUp(event) {
  if (!driving()) return;
  // Space let go on a button would press it.
  if (event.code === "Space" && keyboard.deadMan()) event.preventDefault();
  operator.release(event);
}

export function closeDialogs() {
  controls.closeControls();
  editor.closeMapping();
}

/** With every snapshot: what this page had and lost, before the alarms are read. */
export const seen = loss.update;

/** Who is signed in here, and the way out. */
function me() {
  if (!state.you || $("me").childElementCount) return;
  $("me").replaceChildren(`Signed in as ${state.you.who}, ${state.you.role}. `, make("a", { href: "/login", text: "Sign out" }));
}

/** Ten times a second. */
export function update() {
  me();
  panel.update();
  controls.update();
  editor.update();
  if ($("mapping").open && !controllable(state.own)) editor.closeMapping();
}
