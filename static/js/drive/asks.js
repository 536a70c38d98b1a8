// What the operator asks of the server besides the sticks and STOP.

import { state } from "../state.js";
import { controllable, holds, method, pattern, seat } from "./driving.js";
import * as loss from "./loss.js";

let send = () => {};

export const startAsks = (give) => {
  send = give;
};

/** request, release, hand_over or take_over of the own machine. */
export function lease(what, more = {}) {
  if (what === "release" || what === "hand_over") loss.gave(state.own, more.to);
  send({ type: "lease", do: what, machine: state.own, to: "", reason: "", ...more });
}

/** R: asks for the own machine, or accepts it. */
export function request() {
  if (!controllable(state.own) || holds(state.own)) return false;
  lease("request");
  return true;
}

export function pause() {
  if (!holds(state.own)) return false;
  send({ type: "pause" });
  return true;
}

export const reset = () => send({ type: "reset" });
export const setting = (changes) => send({ type: "setting", pattern: pattern(), fine: Boolean(seat()?.fine), method: method(), ...changes });
export const overrideReason = (reason) => send({ type: "override", reason });

/** The own machine was chosen: where this seat has it, the sticks follow. */
export function chosen(name) {
  if (holds(name) && seat()?.driven !== name) send({ type: "drive", machine: name });
}
