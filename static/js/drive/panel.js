// The control panel in the place of the limits, and STOP in the top bar.

import { $, mark, write } from "../words.js";
import { label, state } from "../state.js";
import { consoleShape } from "../glyphs.js";
import { widest } from "../headers.js";
import * as asks from "./asks.js";
import { controllable, driving, holds, latched, mayReset, pattern, remote, seat } from "./driving.js";
import { input, override, still, stop } from "./operator.js";
import { levers } from "./levers.js";
import * as say from "./say.js";
import * as screen from "./screen.js";
import { openControls } from "./controls.js";
import { openMapping } from "./editor.js";

let shape = "";

const enabled = (node, on) => {
  if (node.disabled === on) node.disabled = !on;
};

function pressLease() {
  if (holds(state.own)) asks.lease("release");
  else asks.request();
}

/** A button that acts while it is held, by pointer or by Enter. */
function hold(button, act) {
  button.addEventListener("pointerdown", (event) => {
    button.setPointerCapture(event.pointerId);
    act(true);
  });
  for (const type of ["pointerup", "pointercancel", "lostpointercapture", "blur"]) button.addEventListener(type, () => act(false));
  button.addEventListener("keydown", (event) => event.key === "Enter" && act(true));
  button.addEventListener("keyup", (event) => event.key === "Enter" && act(false));
}

export function startPanel() {
  $("stop").addEventListener("click", stop);
  $("reset").addEventListener("click", asks.reset);
  $("lease").addEventListener("click", pressLease);
  $("pattern").addEventListener("click", () => still() && asks.setting({ pattern: pattern() === "ISO" ? "SAE" : "ISO" }));
  $("fine").addEventListener("click", () => asks.setting({ fine: !seat()?.fine }));
  $("sticks-open").addEventListener("click", () => screen.toggle());
  $("mapping-open").addEventListener("click", openMapping);
  $("controls-open").addEventListener("click", openControls);
  hold($("drive-override"), override);
}

function stopButton() {
  const can = Boolean(driving());
  for (const id of ["stop-word", "stop-note"]) $(id).hidden = can;
  $("stop").hidden = !can;
  const on = can && latched();
  $("reset").hidden = !(can && mayReset());
  mark($("stop"), "latched", on ? 1 : 0);
  mark(document.body, "latched", on ? 1 : 0);
  write($("stop-state"), on ? "STOPPED" : "STOP");
  $("stop").title = "Stops every machine driven from here (Backspace). Not a safety-rated emergency stop: it goes through this browser and the radio.";
}

function leaseButton(mine) {
  const r = remote(state.own) ?? {};
  const offered = r.offered_to && r.offered_to === state.you?.who;
  write($("lease"), mine ? "Release" : offered ? "Accept (R)" : "Request (R)");
  mark($("lease"), "wish", mine ? 0 : 1);
  $("lease").title = mine ? `Give ${label(state.own)} back` : `Ask to drive ${label(state.own)}`;
}

/** Ten times a second. */
export function update() {
  mark(document.body, "driving", driving() ? 1 : 0);
  stopButton();
  const shown = controllable(state.own);
  mark($("limits-panel"), "drive", shown ? 1 : 0);
  for (const id of ["console-lamp", "console-state", "drive-words", "drive-tools"]) $(id).toggleAttribute("hidden", !shown);
  const mine = shown && holds(state.own);
  if (!mine && screen.open()) screen.toggle(false);
  mark($("limits-note"), "enforced", mine ? 1 : 0);
  const note = $("limits-note");
  if (mine !== (note.childElementCount === 0)) {
    if (mine) note.textContent = "enforced";
    else note.replaceChildren(Object.assign(document.createElement("span"), { className: "wide", textContent: "advice, " }), "not enforced");
  }
  if (!shown) return;
  const word = say.stateWord(state.own);
  write($("console-state"), word);
  mark($("limits-panel"), "state", word);
  if (shape !== word) {
    shape = word;
    $("console-lamp").replaceChildren(...consoleShape(word));
  }
  const room = $("drive-words").clientWidth - 14;
  const wordings = say.lines(state.own);
  const line = $("drive-line");
  write(line, widest(line, wordings, room) || wordings[wordings.length - 1]);
  line.title = wordings[0];
  const cause = say.cause(state.own);
  write($("drive-cause"), cause);
  $("drive-cause").title = cause;
  screen.label(levers(state.own).all);
  leaseButton(mine);
  const overriding = mine && Boolean(seat()?.override);
  $("drive-override").hidden = !overriding;
  mark($("drive-override"), "on", input().override ? 1 : 0);
  // The override needs the room; releasing is then in “More…”.
  $("lease").hidden = overriding;
  for (const id of ["pattern", "fine", "sticks-open"]) $(id).hidden = !mine;
  write($("pattern"), pattern());
  enabled($("pattern"), still());
  write($("fine"), seat()?.fine ? "Fine" : "Normal");
  $("fine").setAttribute("aria-pressed", String(Boolean(seat()?.fine)));
  $("sticks-open").setAttribute("aria-pressed", String(screen.open()));
}
