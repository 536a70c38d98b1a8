// What each operator chose of pictures and machines, kept in this browser.

import { state } from "../state.js";

// shown: null until somebody chose. A simulation draws its pictures on the computer that shows them.
const START = { shown: null, machines: "two", large: "", picks: {} };
const key = () => `cameras ${state.you?.who ?? ""}`;

let who = null;
export let prefs = { ...START };
export const shown = () => prefs.shown ?? state.site?.mode !== "DEMO";

/** Once it is known who sits here: what they left. True when it is another than before. */
export function recall() {
  if (state.you?.who === who) return false;
  who = state.you?.who;
  let kept = null;
  try {
    kept = JSON.parse(localStorage.getItem(key()));
  } catch {
    // this browser keeps nothing, or not what was put there
  }
  prefs = { ...START };
  if (kept && typeof kept === "object") {
    if (typeof kept.shown === "boolean") prefs.shown = kept.shown;
    if (kept.machines === "one") prefs.machines = "one";
    if (kept.picks && typeof kept.picks === "object") prefs.picks = { ...kept.picks };
  }
  return true;
}

export function change(changes) {
  prefs = { ...prefs, ...changes };
  try {
    localStorage.setItem(key(), JSON.stringify({ ...prefs, large: "" }));
  } catch {
    // this browser keeps nothing
  }
}
