// The recorder of the live view: its state, a note, and keeping the last ten minutes.

import { $, mark, write } from "./words.js";
import { get, post } from "./api.js";
import { number } from "./axis.js";
import { wallClock } from "./clock.js";
import { replaying, state } from "./state.js";

const MINUTES = 10;
// Words and shapes; colour only adds to them.
const SAY = { on: ["● REC", "N: note"], trouble: ["✕ REC", "in trouble"], off: ["○ no REC", "not recorded"] };

let busy = false;

const known = () => (replaying() ? null : state.snapshot?.recording ?? null);

function answer(text, kind = "") {
  write($("rec-answer"), text);
  mark($("rec-answer"), "kind", kind);
}

async function details() {
  write($("rec-details"), "");
  try {
    const r = await get("/api/recording");
    const parts = [r.folder, Number.isFinite(r.bytes) ? `${number(r.bytes / 1e6, 1)} MB` : "", Number.isFinite(r.oldest) ? `since ${wallClock(r.oldest)}` : ""];
    write($("rec-details"), parts.filter(Boolean).join(" · "));
  } catch {
    // the state above says enough
  }
}

export function openRecording() {
  if (!known()) return;
  const dialog = $("rec-dialog");
  answer("");
  if (!dialog.open) dialog.show();
  $("rec-note").focus();
  details();
}

export function closeRecording() {
  const dialog = $("rec-dialog");
  if (dialog.open) dialog.close();
}

async function act(working, run) {
  if (busy) return;
  busy = true;
  answer(working);
  try {
    answer(await run());
  } catch (error) {
    answer(error.message, "error");
  }
  busy = false;
}

const addNote = () => {
  const text = $("rec-note").value.trim();
  if (!text) return answer("A note needs words.", "error");
  return act("saving the note", async () => {
    await post("/api/recording/marker", { text });
    $("rec-note").value = "";
    return `Noted at ${wallClock(Date.now() / 1000)}: ${text}`;
  });
};

const pin = () => act(`keeping the last ${MINUTES} minutes`, async () => {
  const { folder } = await post("/api/recording/pin", { name: "", minutes: MINUTES });
  return `Kept: ${folder}`;
});

export function startRecording() {
  $("rec").addEventListener("click", () => ($("rec-dialog").open ? closeRecording() : openRecording()));
  $("rec-pin").addEventListener("click", pin);
  $("rec-close").addEventListener("click", closeRecording);
  $("rec-dialog").addEventListener("keydown", (event) => event.key === "Escape" && closeRecording());
  $("rec-form").addEventListener("submit", (event) => {
    event.preventDefault();
    addNote();
  });
}

/** Ten times a second. */
export function update() {
  const r = known();
  $("rec").hidden = !r;
  if (r) mark(document.body, "recording", r.state);
  else delete document.body.dataset.recording;
  if (!r) return closeRecording();
  const [word, hint] = SAY[r.state] ?? SAY.trouble;
  mark($("rec"), "state", r.state);
  write($("rec-word"), word);
  write($("rec-hint"), hint);
  const text = r.text || { on: "Everything is recorded.", off: "Nothing is recorded.", trouble: "The recorder is in trouble." }[r.state] || r.state;
  $("rec").title = `${text} Click or N: note, keep the last ${MINUTES} min.`;
  $("rec").setAttribute("aria-label", `Recording: ${text}`);
  write($("rec-text"), text);
  for (const id of ["rec-pin", "rec-note"]) if ($(id).disabled !== (r.state === "off")) $(id).disabled = r.state === "off";
  return undefined;
}
