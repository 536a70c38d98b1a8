// A machine's manoeuvre over a step: what was asked for, what the server says of it, its candidates, and the moment that is previewed.

import { get, post, send as request } from "../api.js";
import { holds, seat } from "../drive/driving.js";
import { replaying, state } from "../state.js";
import { makePreview } from "../trajectory/preview.js";

const SEEN = 400; // between two questions for what the sensors saw [ms]
const LATER = 1000; // before what could not be fetched is asked for again [ms]

let send = () => {};
let preview = null;
let picked = null; // {machine, name}: an obstacle of the site
let failure = "";
let acting = false, fetching = "", failed = -Infinity;
let fetched = null; // {plan, document, side}
let actual = null; // {plan, series, whole}
let asked = -Infinity, asking = false, serial = 0;

/** There is a server that looks for manoeuvres. */
export const possible = () => !replaying() && Boolean(state.snapshot?.surmounts);
/** A SurmountOffer of the own machine, or null. */
export const offer = () => (possible() ? state.snapshot.surmounts[state.own] ?? null : null);
export const planning = () => acting || offer()?.state === "planning";
const here = () => (fetched && fetched.plan === offer()?.plan ? fetched : null);
/** The SurmountDocument that is on offer or was, null before it was fetched. */
export const document = () => here()?.document ?? null;
/** Its SideView, null where there is none. */
export const side = () => here()?.side ?? null;
/** All candidates of the search, also while another of them is worked out. */
export function candidates() {
  const now = offer();
  return now && fetched && fetched.plan.split(".")[0] === now.plan.split(".")[0] ? fetched.document.candidates : [];
}
/** What this seat follows of the own machine's manoeuvres: a FollowModel, or null. */
export function follow() {
  const found = seat()?.follow?.[state.own] ?? null;
  return found && found.plan.startsWith(`${state.own}-over-`) ? found : null;
}
export const following = () => Boolean(follow()) && !follow().ended;
export const trouble = () => failure || (offer() ? seat()?.follow_refused?.[state.own] : "") || "";
export const mayAsk = () => Boolean(state.you) && state.you.role !== "viewer";
export const mayAccept = () => holds(state.own) && offer()?.state === "offered" && !following();

export const obstacle = () => (picked?.machine === state.own ? picked.name : null);
export function pick(name) {
  picked = { machine: state.own, name };
  failure = "";
}

async function act(what) {
  if (acting) return;
  acting = true;
  try {
    await what();
    failure = "";
  } catch (error) {
    failure = error.message;
  }
  acting = false;
}

const path = (...parts) => ["/api/surmount", ...parts.map(encodeURIComponent)].join("/");

/** name: of an obstacle, or step: {height, distance, depth}; payload [kg]; effort. */
export function find({ name, step, payload, effort }) {
  preview.stop();
  act(() => post(path(), { machine: state.own, ...(name ? { obstacle: name } : { step }), payload, effort }));
}

/** Works out another candidate in the place of this one. */
export function choose(candidate) {
  const now = offer();
  if (!now?.made || planning() || following() || now.candidate === candidate) return;
  preview.stop();
  act(() => post(path(state.own, now.plan, "choose"), { candidate }));
}

const say = (what) => send({ type: "follow", do: what, machine: state.own, plan: offer()?.plan ?? "" });

export function accept() {
  failure = "";
  say("accept");
}

export function drop() {
  preview.stop();
  if (follow()) say("drop");
  if (offer()) act(() => request("DELETE", path(state.own)));
}

export const duration = () => document()?.duration ?? 0;
export const shown = () => preview.shown();
export const playing = () => preview.playing();
/** The moment that is previewed [s]. */
export const time = () => preview.time();
export const seek = (t) => preview.seek(t);
export const pause = () => preview.pause();
export const stop = () => preview.stop();
/** The moment that is shown: of the machine where it follows, else of the preview. */
export const moment = () => (following() ? follow().at : time());
/** The phase of a moment, or null. */
export function phase(t) {
  const all = document()?.phases ?? [];
  return all.find(({ end }) => t <= end + 1e-9) ?? all[all.length - 1] ?? null;
}

/** What the sensors saw while it was followed, a FollowedSurmount; null before. */
export const seen = () => (actual && actual.plan === offer()?.plan && actual.series.at.length ? actual.series : null);
/** Counts whatever changes the plots but the moment. */
export const changes = () => serial;

async function fetchIt({ plan: name }) {
  fetching = name;
  try {
    const found = await get(path(state.own, name));
    const around = found.ok ? await get(path(state.own, name, "side")) : null;
    // Told from the edge, drawn from where the tracks' middle was first, as in Fig. 14.
    for (const point of found.figures?.com ?? []) point[0] += found.obstacle?.distance ?? 0;
    fetched = { plan: name, document: found, side: around };
    if (found.ok) preview.begin(name);
  } catch {
    failed = performance.now(); // dropped meanwhile, or the link is slow: once more
  }
  fetching = "";
  serial += 1;
}

async function fetchSeen({ plan: name }, whole) {
  asked = performance.now();
  asking = true;
  try {
    actual = { plan: name, series: await get(path(state.own, name, "followed")), whole };
    serial += 1;
  } catch {
    // dropped meanwhile
  }
  asking = false;
}

export function startModel(give) {
  send = give;
  preview = makePreview(give, () => (document()?.ok ? offer().plan : null), duration);
}

/** Ten times a second. open: whether the panel is. */
export function update(open) {
  const now = offer(), mine = follow();
  if (open && now?.made && fetched?.plan !== now.plan && !fetching && performance.now() - failed > LATER) fetchIt(now);
  const due = mine?.plan === now?.plan && (!mine?.ended || actual?.plan !== now.plan || actual.whole !== mine.ended);
  if (open && document() && mine && due && !asking && performance.now() - asked >= SEEN) fetchSeen(now, mine.ended);
  preview.update(open && !following()); // followed, the machine itself shows it
}
