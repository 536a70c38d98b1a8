// The operator's input, read 40 times a second and at once when something is let go, and what is sent of it.

import { silence, state } from "../state.js";
import * as compose from "./compose.js";
import { neutral } from "./deflection.js";
import * as focus from "./focus.js";
import * as keyboard from "./keyboard.js";
import * as pads from "./pads.js";
import * as screen from "./screen.js";
import * as store from "./store.js";
import { read as readMapped, used } from "./mapping.js";
import { driving, seat, seated, supervisor } from "./driving.js";

const PERIOD = 25; // ms
const BLIND = 1; // s without a snapshot: nobody drives what cannot be seen

let send = () => {};
let seq = 0;
let now = compose.start();
let remapped = false, stopPressed = false, holdOverride = false;
export let slots = [null, null];

/** What is in use, and why nothing moves. */
export const input = () => now;

/** Nothing is deflected or held, here and as the server knows it. */
export const still = () => neutral(now.deflection) && neutral(seat()?.sticks) && !now.enable;

/** The mapping was changed: what it makes of the present axes is nobody's wish. */
export function changeMapping(changed) {
  if (changed) store.save(changed);
  else store.reset();
  remapped = true;
  pump();
}

/** The override's button on the page. */
export function override(on) {
  holdOverride = on;
  pump();
}

export const stop = () => driving() && send({ type: "stop" });

function fault() {
  if (remapped) return "the mapping was changed";
  if (state.socket !== "open" || silence() > BLIND) return "no data arrive";
  return "";
}

function readGamepad() {
  slots = pads.read();
  const mapping = store.mapping(slots);
  const gone = pads.gone(slots);
  const reading = readMapped(slots, mapping);
  // Half of two joysticks is none.
  const vanished = used(mapping).some((slot) => gone[slot]);
  return vanished ? { ...compose.NOTHING, stop: false, override: false, vanished } : reading;
}

function pump(periodic = false) {
  if (!driving()) {
    now = compose.start();
    return;
  }
  store.load(state.you?.who ?? "");
  const gamepad = readGamepad();
  if (gamepad.stop && !stopPressed) stop();
  stopPressed = gamepad.stop;
  const keys = keyboard.read();
  // While the sticks on the screen are open the keyboard's dead-man is theirs.
  const readings = {
    gamepad,
    keyboard: screen.open() ? compose.NOTHING : keys,
    screen: screen.read(keys.enable),
  };
  const mayOverride = supervisor() && Boolean(seat()?.override);
  const before = now;
  const wanted = keyboard.overriding() || holdOverride || (gamepad.override && before.source === "gamepad");
  now = compose.compose(before, readings, { focus: focus.here(), fault: fault(), override: mayOverride && wanted });
  remapped = false;
  const changed = ["enable", "focus", "gamepad", "override", "hold"].some((name) => before[name] !== now[name]);
  if (seated() && (periodic || changed)) {
    const { deflection, enable, focus: looking, gamepad: there, source, override: over } = now;
    send({ type: "sticks", seq: ++seq, ...deflection, enable, focus: looking, gamepad: there, source, override: over });
  }
}

/** A key: true when it was meant for the machine. */
export function press(event) {
  if (!seated() || !keyboard.press(event)) return false;
  pump();
  return true;
}

export function release(event) {
  keyboard.release(event);
  pump();
}

export function startOperator(give, scene) {
  send = give;
  focus.startFocus(scene, () => {
    keyboard.releaseAll();
    screen.releaseAll();
    pump();
  });
  screen.startScreen(pump);
  for (const type of ["gamepadconnected", "gamepaddisconnected"]) addEventListener(type, () => pump());
  setInterval(() => pump(true), PERIOD);
}
