// A machine's trajectory: what was asked for, what the server says of it, what this page follows, and the moment that is previewed.

import { get, post, send as request } from "../api.js";
import { holds, seat } from "../drive/driving.js";
import { described, machine, replaying, state } from "../state.js";
import { makePreview, rowAt } from "./preview.js";

const SEEN = 400; // between two questions for what the sensors saw [ms]
const LATER = 1000; // before a plan that could not be fetched is asked for again [ms]

let send = () => {};
let goal = null; // {machine, at: [E, N]}: in the site frame [m]
let failure = "";
let acting = false, fetching = "", failed = -Infinity;
let fetched = null; // {plan, document}
let preview = null;
let actual = null; // {plan, series}
let asked = -Infinity, asking = false, serial = 0;

/** There is a server that plans. */
export const possible = () => !replaying() && Boolean(state.snapshot?.plans);
/** A PlanOffer of the own machine, or null. */
export const offer = () => (possible() ? state.snapshot.plans[state.own] ?? null : null);
export const planning = () => acting || offer()?.state === "planning";
/** The PlanDocument that is on offer or was, null before it was fetched. */
export const document = () => (fetched && fetched.plan === offer()?.plan ? fetched.document : null);
/** What this seat follows with the own machine: a FollowModel, or null. */
export const follow = () => seat()?.follow?.[state.own] ?? null;
export const following = () => Boolean(follow()) && !follow().ended;
export const trouble = () => failure || seat()?.follow_refused?.[state.own] || "";
export const picked = () => (goal?.machine === state.own ? goal.at : null);
export const mayAsk = () => Boolean(state.you) && state.you.role !== "viewer";
export const mayAccept = () => holds(state.own) && offer()?.state === "offered" && !following();

export function pick(at) {
  goal = { machine: state.own, at };
  failure = "";
}

/** Shares of the machine's own limits, as the server wants them; none where the share is whole. */
function limits(speed, acceleration) {
  const joints = described(state.own)?.joints ?? [];
  const part = (share, name) => (share < 1 ? Object.fromEntries(joints.map((joint) => [joint.role, share * joint[name]]).filter(([, value]) => value > 0)) : {});
  return { joint_velocities: part(speed, "max_velocity"), joint_accelerations: part(acceleration, "max_acceleration") };
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

/** height: of the end point above the ground that the machine stands on [m]; payload [kg]; lift, clearance [m]; speed, acceleration: shares of the machine's. */
export function plan({ height, payload, lift, clearance, speed, acceleration, ground }) {
  const at = picked(), below = machine(state.own)?.position?.[2];
  if (!at || !Number.isFinite(below)) return;
  stop();
  act(() => post("/api/plan", { machine: state.own, goal: { end_point: [...at, below + height] }, payload, lift, clearance, ground, limits: limits(speed, acceleration) }));
}

const say = (what) => send({ type: "follow", do: what, machine: state.own, plan: offer()?.plan ?? "" });

export function accept() {
  failure = "";
  say("accept");
}

export function drop() {
  stop();
  if (follow()) say("drop");
  if (offer()) act(() => request("DELETE", `/api/plan/${encodeURIComponent(state.own)}`));
}

export const duration = () => document()?.duration ?? 0;
export const shown = () => preview.shown();
export const playing = () => preview.playing();
/** The moment of the trajectory that is previewed [s]. */
export const time = () => preview.time();
export const seek = (t) => preview.seek(t);
export const pause = () => preview.pause();
/** Takes the ghost away. */
export const stop = () => preview.stop();

/** The row of the document that belongs to a moment [s]. */
export const row = (t) => rowAt(document().time, t);

/** What the sensors saw while it was followed, a FollowedSeries; null before. */
export const seen = () => (actual && actual.plan === offer()?.plan && actual.series.at.length ? actual.series : null);

async function fetchSeen({ plan: name }) {
  asked = performance.now();
  asking = true;
  try {
    actual = { plan: name, series: await get(`/api/plan/${encodeURIComponent(state.own)}/${encodeURIComponent(name)}/followed`) };
    serial += 1;
  } catch {
    // dropped meanwhile
  }
  asking = false;
}

/** Counts whatever changes the plots but the moment. */
export const changes = () => serial;

async function fetchIt({ plan: name }) {
  fetching = name;
  try {
    fetched = { plan: name, document: await get(`/api/plan/${encodeURIComponent(state.own)}/${encodeURIComponent(name)}`) };
    preview.begin(name);
  } catch {
    failed = performance.now(); // dropped meanwhile, or the link is slow: once more
  }
  fetching = "";
  serial += 1;
}

export function startModel(give) {
  send = give;
  preview = makePreview(give, () => (document() ? offer().plan : null), duration);
}

/** Ten times a second. open: whether the panel is. */
export function update(open) {
  const now = offer();
  if (now && now.duration !== null && fetched?.plan !== now.plan && !fetching && open && performance.now() - failed > LATER) fetchIt(now);
  const mine = follow();
  if (open && document() && mine?.plan === now.plan && !asking && performance.now() - asked >= SEEN && (!mine.ended || actual?.plan !== now.plan || actual.whole !== mine.ended)) {
    const { ended } = mine;
    fetchSeen(now).then(() => { if (actual) actual.whole = ended; });
  }
  preview.update(open && !following()); // followed, the machine itself shows it
}
