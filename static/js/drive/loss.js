// Alarms this page raises about its own control: it was passed on or ended, or the machine is locked.

import { label, state } from "../state.js";
import { wallClock } from "../clock.js";
import { driving, holds, remote } from "./driving.js";

const SHOWN = 60; // s

let had = null; // the machines this page had
let lost = null; // {name, line, detail, since}
const given = new Map(); // machine -> {to, at}: let go of on this page
const ANSWER = 3000; // ms that the server has for a release

/** The operator gave it back, or to somebody: no alarm when that is what happens. */
export const gave = (name, to = "") => given.set(name, { to, at: performance.now() });

function expected(name, other) {
  const gift = given.get(name);
  return Boolean(gift) && (gift.to ? other === gift.to : performance.now() - gift.at < ANSWER);
}

const stop = (name, machine, line, detail, since) => ({ level: "STOP", name, machine, line: `STOP · ${line}`, detail, since, active: true });

function watch() {
  const s = state.snapshot;
  for (const name of Object.keys(driving()?.machines ?? {})) {
    if (holds(name)) continue;
    const other = remote(name)?.holder;
    if (had?.has(name) && !expected(name, other)) {
      const [what, detail] = other && other !== state.you?.who ? ["passed on", `${other} drives ${label(name)}.`] : ["ended", ""];
      lost = { name, line: `${label(name)} control ${what} · ${wallClock(s.wall)}`, detail: `Your sticks are off. ${detail} Request: R.`.replace(/ {2}/g, " "), since: s.time };
    }
  }
  had = new Set(Object.keys(driving()?.machines ?? {}).filter(holds));
  for (const name of [...given.keys()]) if (!had.has(name)) given.delete(name);
  if (lost && (holds(lost.name) || s.time - lost.since > SHOWN || s.time < lost.since)) lost = null;
}

const lockedSince = new Map();

/** With every snapshot. */
export function update() {
  if (!driving()) {
    state.raised = [];
    return;
  }
  watch();
  const raised = lost ? [stop("control", lost.name, lost.line, lost.detail, lost.since)] : [];
  for (const name of had) {
    const why = remote(name)?.locked;
    if (!why) {
      lockedSince.delete(name);
      continue;
    }
    if (!lockedSince.has(name)) lockedSince.set(name, state.snapshot.time);
    const [what, rest = "motion is locked"] = why.split(": ");
    raised.push(stop("locked", name, `${label(name)} locked · ${what}`, `${rest[0].toUpperCase()}${rest.slice(1)}. Release everything; wait until it is better.`, lockedSince.get(name)));
  }
  state.raised = raised;
}
