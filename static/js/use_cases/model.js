// Use cases of the working gauge: what the server offers, the runs that were fetched, and the moment that is shown.

import { get, post, send as request } from "../api.js";
import { replaying } from "../state.js";
import { page } from "../scene.js";

const AGAIN = 2000, BUSY = 300; // between two questions while the panel is open, and while a run is worked out [ms]
const TOLD = 500; // between two words to the 3D scene, which forgets after some seconds [ms]

let told = null; // a UseCaseStateDocument
let failure = "";
let asked = -Infinity, asking = false, acting = false;
let name = "", method = "scaling";
let waiting = []; // methods still to be worked out, in order
let play = null; // {at, since, rate}: of the run that is shown
let said = -Infinity, sent = false;
let send = () => {};
const documents = new Map(); // name -> UseCaseDocument without runs
const runs = new Map(); // "name method" -> RunModel
let serial = 0;

const key = (one, other) => `${one} ${other}`;

export const offered = () => (replaying() ? [] : told?.offered ?? []);
export const offer = () => offered().find((one) => one.name === name) ?? null;
export const methods = () => told?.methods ?? [];
export const document = () => documents.get(name) ?? null;
export const run = (which = method) => runs.get(key(name, which)) ?? null;
export const chosen = () => ({ name, method });
/** {method, progress} of what is worked out now, or null. */
export const running = () => told?.running ?? null;
export const queued = (which) => waiting.includes(which);
export const trouble = () => failure || told?.trouble || "";
/** Counts whatever changes the plots but the moment. */
export const changes = () => serial;
export const shown = () => play !== null && run() !== null;
export const playing = () => shown() && play.rate > 0 && time() < document().seconds - document().step;
export const busy = () => waiting.length > 0 || running() !== null;

/** The moment of the run that is shown [s]. */
export function time() {
  if (!play) return 0;
  if (play.since === Infinity) return play.at;
  const t = play.at + (play.rate * (performance.now() - play.since)) / 1000;
  return Math.min(Math.max(t, 0), document()?.seconds ?? 0);
}

/** The instant of a run that belongs to the moment. */
export const instant = (one) => Math.min(one.times.length - 1, Math.round(time() / (document()?.step ?? 1)));

async function act(what) {
  if (acting) return;
  acting = true;
  try {
    [told, failure] = [await what(), ""];
  } catch (error) {
    failure = error.message;
    waiting = [];
  }
  acting = false;
  serial += 1;
}

async function ask() {
  asked = performance.now();
  if (asking) return;
  asking = true;
  try {
    [told, failure] = [await get("/api/use-case"), ""];
    if (!offer()) name = offered()[0]?.name ?? "";
    // One that is done already, perhaps on another page, is fetched, so that it can be compared.
    for (const one of told.done) {
      if (one.name === name && !runs.has(key(one.name, one.method))) {
        const { runs: [found], ...rest } = await get(`/api/use-case/${one.name}/${one.method}`);
        documents.set(one.name, rest);
        runs.set(key(one.name, one.method), found);
        serial += 1;
      }
    }
  } catch (error) {
    if (told) failure = error.message; // a server without use cases has none to offer
  }
  asking = false;
}

/** Another method, or another use case; what was shown goes on at the same moment. */
export function choose(which, other = name) {
  if (other !== name) halt();
  [name, method] = [other, which];
  serial += 1;
  said = -Infinity;
}

/** Works out what is not known yet, one after another, and shows the chosen one from its beginning. */
export function start(all = false) {
  halt();
  play = { at: 0, since: Infinity, rate: 0 }; // begins once it is there
  if (told) told.trouble = failure = "";
  waiting = (all ? methods().map((one) => one.name) : [method]).filter((one) => !run(one));
  serial += 1;
}

export function halt() {
  play = null;
  waiting = [];
  if (running()?.name === name) act(() => request("DELETE", "/api/use-case"));
  say();
}

export function seek(t) {
  play = { at: t, since: performance.now(), rate: 0 };
  said = -Infinity;
}

export function pause() {
  if (!shown()) return;
  const at = time();
  play = { at: playing() || at < document().seconds - document().step ? at : 0, since: performance.now(), rate: playing() ? 0 : 1 };
  said = -Infinity;
}

function say() {
  said = performance.now();
  if (!shown()) {
    if (sent) send({ type: "use_case", page, name: null });
    sent = false;
    return;
  }
  send({ type: "use_case", page, name, method, at: time(), rate: playing() ? play.rate : 0 });
  sent = true;
}

export function startModel(give) {
  send = give;
}

/** Ten times a second. open: whether anybody looks. */
export function update(open, near) {
  if (replaying() || globalThis.document.hidden) return;
  const period = running() || waiting.length ? BUSY : AGAIN;
  if ((open || (near && !told)) && performance.now() - asked >= period) ask();
  if (!open) return;
  if (told?.trouble && !running() && !acting && waiting.length) [waiting, play] = [[], null];
  waiting = waiting.filter((one) => !run(one));
  const next = waiting[0];
  if (next && told && !running() && !acting && !asking && !told.done.some((one) => one.name === name && one.method === next)) act(() => post("/api/use-case", { name, method: next }));
  if (play?.since === Infinity && run() && !busy()) {
    play = { at: 0, since: performance.now(), rate: 1 };
    said = -Infinity;
  }
  if (performance.now() - said >= TOLD && (shown() || sent)) say();
}
