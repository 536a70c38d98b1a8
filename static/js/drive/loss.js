// Alarms this page raises about its own control: it was passed on or ended, or the machine is locked.

import { label, state } from "../state.js";
import { wallClock } from "../clock.js";
import { driving, holds, remote } from "./driving.js";

const SHOWN = 60; // s

let had = null; // the machines this page had
let lost = null; // {name, line, detail, since}
const given = new Set(); // machines this page let go of itself

/** The operator gave it away: no alarm. */
export const gave = (name) => given.add(name);

const stop = (name, machine, line, detail, since) => ({ level: "STOP", name, machine, line: `STOP · ${line}`, detail, since, active: true });

function watch() {
  const s = state.snapshot;
  for (const name of Object.keys(driving()?.machines ?? {})) {
    if (holds(name)) continue;
    if (had?.has(name) && !given.has(name)) {
      const other = remote(name)?.holder;
      const [what, detail] = other && other !== state.you?.who ? ["passed on", `${other} drives ${label(name)}.`] : ["ended", ""];
      lost = { name, line: `${label(name)} control ${what} · ${wallClock(s.wall)}`, detail: `Your sticks are off. ${detail} Request: R.`.replace(/ {2}/g, " "), since: s.time };
    }
  }
  had = new Set(Object.keys(driving()?.machines ?? {}).filter(holds));
  for (const name of [...given]) if (!had.has(name)) given.delete(name);
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
