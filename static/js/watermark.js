// PLAYBACK across the scene: what is seen there was recorded, and how it is judged.

import { $, mark, write } from "./words.js";
import { day, wallClock } from "./clock.js";
import { mode, replaying } from "./state.js";
import { current, cursor, playback } from "./player.js";
import { note } from "./session.js";

/** "as it was", "judged now" */
export const sourceWord = () => (current("source") === "evaluated" ? "judged now" : "as it was");

/** Ten times a second. */
export function update() {
  const on = replaying();
  mark(document.body, "mode", mode());
  $("watermark").hidden = !on;
  const p = playback();
  if (!p) return;
  const when = p.wall - p.time + cursor();
  write($("watermark-what"), `PLAYBACK · ${sourceWord()} · recorded ${day(when)} ${wallClock(when)}${current("playing") ? "" : " · paused"}`);
  write($("watermark-note"), note());
}
