// The moment of a plan that is previewed: it plays, stands or is sought, and the 3D scene is told of it.

import { state } from "../state.js";
import { page } from "../scene.js";

const TOLD = 500; // between two words to the 3D scene, which forgets after some seconds [ms]

/** send: to the server; plan(), duration(): name of the plan whose document is here, or null, and how long it takes [s]. */
export function makePreview(send, plan, duration) {
  let play = null; // {plan, at, since, rate}
  let said = -Infinity, sent = false;

  const shown = () => play !== null && plan() !== null && play.plan === plan();
  /** [s] */
  function time() {
    if (!shown()) return 0;
    return Math.min(Math.max(play.at + (play.rate * (performance.now() - play.since)) / 1000, 0), duration());
  }
  const playing = () => shown() && play.rate > 0 && time() < duration();

  function tell() {
    said = performance.now();
    if (shown()) send({ type: "plan", page, machine: state.own, plan: play.plan, at: time(), rate: playing() ? play.rate : 0 });
    else if (sent) send({ type: "plan", page, machine: state.own, plan: null });
    sent = shown();
  }

  function from(at, rate) {
    if (plan() === null) return;
    play = { plan: plan(), at, since: performance.now(), rate };
    said = -Infinity;
  }

  return {
    shown, playing, time,
    seek: (t) => from(t, 0),
    pause() {
      const on = playing(), at = time();
      from(!on && at >= duration() ? 0 : at, on ? 0 : 1);
    },
    /** A plan that has not been seen yet plays at once. */
    begin(name) {
      if (play?.plan !== name) play = { plan: name, at: 0, since: performance.now(), rate: 1 };
    },
    /** Takes the ghost away. */
    stop() {
      play = null;
      tell();
    },
    /** Ten times a second. */
    update(wanted) {
      if (!wanted) play = null;
      if ((shown() || sent) && (performance.now() - said >= TOLD || shown() !== sent)) tell();
    },
  };
}

/** The row of a document that belongs to a moment [s]. */
export function rowAt(times, t) {
  let k = times.findIndex((one) => one > t + 1e-9);
  if (k < 0) k = times.length;
  return Math.max(0, k - 1);
}
