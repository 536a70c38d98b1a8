// Driving: wires its modules, and its keys.

import { $ } from "../words.js";
import { state } from "../state.js";
import { controllable, driving, holds, seat } from "./driving.js";
import * as controls from "./controls.js";
import * as editor from "./editor.js";
import * as keyboard from "./keyboard.js";
import * as loss from "./loss.js";
import * as operator from "./operator.js";
import * as panel from "./panel.js";
import { leaveScene } from "./focus.js";

let send = () => {};

export function startDriving(give) {
  send = give;
  operator.startOperator(give, $("scene"));
  panel.startPanel(give);
  controls.startControls(give);
  editor.startEditor();
  // The page leaves the keys of text fields alone.
  for (const id of ["controls", "mapping"]) $(id).addEventListener("keydown", (event) => event.key === "Escape" && closeDialogs());
}

/** Of the window of the scene, besides its keys. */
export const sceneListeners = { keyup: onKeyUp, blur: leaveScene };

/** The own machine was chosen: where this seat has it, the sticks follow. */
export function chosen(name) {
  if (holds(name) && seat()?.driven !== name) send({ type: "drive", machine: name });
}

/** True when the key was meant for a machine. Text fields and dialogs keep theirs. */
export function driveKey(event) {
  if (!driving() || event.target?.closest?.("dialog, input, select, textarea")) return false;
  if (event.code === "Backspace") {
    if (!event.repeat) operator.stop();
    return true;
  }
  if (operator.press(event)) return true;
  if (event.repeat) return false;
  if (event.code === "KeyR") return panel.request();
  if (event.code === "KeyP") return panel.pause();
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

/** Ten times a second. */
export function update() {
  panel.update();
  controls.update();
  editor.update();
  if ($("mapping").open && !controllable(state.own)) editor.closeMapping();
}
