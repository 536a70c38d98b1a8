// Keys of the player and the recorder; main.js has the others.

import { replaying } from "./state.js";
import * as player from "./player.js";
import { openRecording } from "./recording.js";

const LEAP = 5; // s

const PLAYER = {
  " ": player.toggle,
  ArrowLeft: ({ shiftKey }) => (shiftKey ? player.jump(-LEAP) : player.back()),
  ArrowRight: ({ shiftKey }) => (shiftKey ? player.jump(LEAP) : player.step()),
  PageUp: player.previousEvent,
  PageDown: player.nextEvent,
  "[": player.previousEvent,
  "]": player.nextEvent,
  "-": player.slower,
  "+": player.faster,
  "=": player.faster,
  l: player.toggleLoop,
  Home: () => player.seek(0),
  End: player.toEnd,
};
// A key held down must not toggle back and forth.
const ONCE = new Set([" ", "l"]);

/** True when the key was meant for the player or the recorder. */
export function sessionKey(event) {
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  if (!replaying()) {
    if (key !== "n") return false;
    openRecording();
    return true;
  }
  // Who walks through the buttons by keyboard presses them with Space.
  if (key === " " && event.target?.closest?.("button")) return false;
  const act = PLAYER[key];
  if (!act || (event.repeat && ONCE.has(key))) return Boolean(act);
  act(event);
  return true;
}
