// The recorded session that is played: what the server says of it. Others only read.

import { get, post } from "./api.js";
import { current, cursor, playback } from "./player.js";
import { replaying, state } from "./state.js";

const BUSY = 700, RETRY = 2500; // ms between two questions: while something grows, after a failure
const POINTS = 600;

export const session = {
  document: null,
  problem: "", // why there is none, in words
  series: { recorded: null, evaluated: null }, // as /api/session/series answers, with `from` and `to`
  seriesProblem: "",
  diff: { state: "none", progress: 0, result: null },
  diffProblem: "",
  span: null, // length of the window of the series [s]; null is all
  start: 0, // of that window
};

const polls = {};

/** Calls `ask` unless it is under way or not yet due again; it says when it wants to be asked again [ms]. */
function poll(name, ask) {
  const p = (polls[name] ??= { busy: false, due: 0 });
  if (p.busy || performance.now() < p.due) return;
  p.busy = true;
  ask().catch(() => RETRY).then((wait) => {
    p.busy = false;
    p.due = performance.now() + wait;
  });
}

const never = Infinity;
const hurry = (name) => {
  if (polls[name]) polls[name].due = 0;
};

async function askDocument() {
  try {
    session.document = await get("/api/session");
    session.problem = "";
    return session.document.index?.state === "building" ? BUSY : never;
  } catch (error) {
    session.problem = `session: ${error.message}`;
    return RETRY;
  }
}

async function askDiff() {
  try {
    session.diff = await get("/api/session/diff");
    // Why it could not be started stays to be read while none runs.
    if (session.diff.state === "failed") session.diffProblem = session.diff.error || "it failed";
    else if (session.diff.state !== "none") session.diffProblem = "";
    return session.diff.state === "running" ? BUSY : never;
  } catch (error) {
    if (session.diff.state === "running") session.diffProblem = error.message;
    return session.diff.state === "running" ? RETRY : never;
  }
}

export async function startDiff() {
  session.diffProblem = "";
  session.diff = { state: "running", progress: 0, result: null };
  try {
    await post("/api/session/diff");
    hurry("diff");
  } catch (error) {
    session.diff = { state: "none", progress: 0, result: null };
    session.diffProblem = error.message;
  }
}

/** [start, end] of what the series show; pages along when the cursor leaves it. */
export function shownSpan() {
  const duration = playback()?.duration ?? 0;
  if (!session.span || session.span >= duration) return [0, duration];
  const at = cursor();
  if (at < session.start || at > session.start + session.span) session.start = at - 0.1 * session.span;
  session.start = Math.min(Math.max(session.start, 0), duration - session.span);
  return [session.start, session.start + session.span];
}

/** A window of `span` seconds (null: all) that keeps time `about` at the same share of its width. */
export function zoom(span, about = cursor()) {
  const [a, b] = shownSpan();
  const duration = playback()?.duration ?? 0;
  const share = Math.min(Math.max((about - a) / Math.max(b - a, 1e-9), 0), 1);
  session.span = span === null || span >= duration ? null : Math.max(2, span);
  session.start = about - share * (session.span ?? 0);
}

/** The sources whose series are drawn: what is played, and both once they were compared. */
export const sources = () => (session.diff.state === "done" ? ["recorded", "evaluated"] : [current("source") ?? "recorded"]);

async function askSeries(source, key, from, to) {
  try {
    const query = new URLSearchParams({ start: from.toFixed(3), end: to.toFixed(3), points: POINTS, source });
    session.series[source] = { ...(await get(`/api/session/series?${query}`)), key, from, to };
    session.seriesProblem = "";
    return 100;
  } catch (error) {
    session.seriesProblem = error.message;
    return RETRY;
  }
}

/** Ten times a second. */
export function refresh() {
  if (!replaying() || !playback()) return;
  poll("document", askDocument);
  poll("diff", askDiff);
  const [from, to] = shownSpan();
  if (!(to > from)) return;
  for (const source of sources()) {
    const key = `${from.toFixed(2)} ${to.toFixed(2)} ${session.document?.index?.state} ${Math.floor(10 * (session.document?.index?.progress ?? 1))}`;
    if (session.series[source]?.key !== key) poll(source, () => askSeries(source, key, from, to));
  }
}

/** The server may be another one, playing another session. */
export function reconnected() {
  session.series = { recorded: null, evaluated: null };
  for (const name of Object.keys(polls)) hurry(name);
}

export const problems = () => [...(session.problem ? [session.problem] : []), ...(session.document?.problems ?? [])];
export const note = () => playback()?.note || session.document?.note || "";
export const title = () => playback()?.title || session.document?.title || state.site?.title || "";
const NONE = [];
export const events = () => session.document?.events ?? NONE;
