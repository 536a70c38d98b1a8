// What the snapshot says of driving, and what this page's seat may do. Nothing in playback.

import { replaying, state } from "../state.js";

export const driving = () => (replaying() ? null : state.snapshot?.driving ?? null);
export const seat = () => driving()?.seats?.[state.you?.seat] ?? null;
export const supervisor = () => state.you?.role === "supervisor";
const drives = () => supervisor() || state.you?.role === "operator";

/** {machine: console} of this seat. */
export const consoles = () => (drives() ? seat()?.consoles ?? {} : {});
export const seated = () => Object.keys(consoles()).length > 0;
export const holds = (name) => consoles()[name]?.held === true;
export const remote = (name) => driving()?.machines?.[name] ?? null;

/** The machine's controls are shown: this seat has it, or may ask for it. */
export const controllable = (name) => Boolean(driving()) && drives() && (holds(name) || remote(name)?.agent === true);

/** The console that has the machine, whoever's it is. */
export function consoleOf(name) {
  const all = Object.values(driving()?.seats ?? {}).map((one) => one.consoles?.[name]);
  return all.find((one) => one?.held) ?? null;
}

const stopped = (all) => Object.values(all ?? {}).some((one) => one.state === "Stop");

/** A stop stands until it is reset, by who has the machine. */
export const latched = () => Object.values(driving()?.seats ?? {}).some((one) => stopped(one.consoles));
export const mayReset = () => stopped(consoles());

export const pattern = () => (seat()?.pattern === "SAE" ? "SAE" : "ISO");
/** What shapes the wish before the limiter: braking is the limiter alone. */
export const method = () => seat()?.method ?? "braking";
export const decision = (name) => (holds(name) ? seat()?.decision?.[name] ?? null : null);
