// Keys as levers, by their place on the keyboard. They act only while the dead-man is held, so that the page's own keys stay.

import { clamp, zero } from "./deflection.js";

const GENTLE = 1 / 3; // of full deflection, with Shift
const LEVERS = {
  KeyW: ["left_y", 1], KeyS: ["left_y", -1], KeyA: ["left_x", -1], KeyD: ["left_x", 1],
  KeyI: ["right_y", 1], KeyK: ["right_y", -1], KeyJ: ["right_x", -1], KeyL: ["right_x", 1],
  ArrowUp: ["right_y", 1], ArrowDown: ["right_y", -1], ArrowLeft: ["right_x", -1], ArrowRight: ["right_x", 1],
  KeyR: ["track_left", 1], KeyF: ["track_left", -1], KeyT: ["track_right", 1], KeyG: ["track_right", -1],
};

const down = new Set();
let enable = false, override = false, gentle = false;

/** True when the key drives. A key that was held before the dead-man counts only when pressed anew. */
export function press(event) {
  gentle = event.shiftKey;
  if (event.code === "Space") {
    enable ||= !event.repeat;
    return true;
  }
  if (event.code === "KeyO") {
    override ||= !event.repeat;
    return true;
  }
  if (!enable) return false;
  if (!(event.code in LEVERS)) return event.code.startsWith("Shift");
  if (!event.repeat) down.add(event.code);
  return true;
}

export function release(event) {
  gentle = event.shiftKey;
  if (event.code === "Space") {
    enable = false;
    down.clear();
  } else if (event.code === "KeyO") override = false;
  else down.delete(event.code);
}

export function releaseAll() {
  down.clear();
  enable = override = false;
}

export const deadMan = () => enable;
export const overriding = () => override;

export function read() {
  const deflection = zero();
  for (const code of down) {
    const [name, way] = LEVERS[code];
    deflection[name] = clamp(deflection[name] + way);
  }
  if (gentle) for (const name of Object.keys(deflection)) deflection[name] *= GENTLE;
  return { deflection, enable };
}
