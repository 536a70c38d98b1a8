// The bar below the page in PLAYBACK: buttons, clock, status. Keys are in keys.js.

import { shown as along } from "./plots/along.js";
import { shown as people } from "./plots/people.js";
import { $, mark, slowText, write } from "./words.js";
import { number } from "./axis.js";
import { clock, day, wallClock } from "./clock.js";
import { replaying } from "./state.js";
import * as player from "./player.js";
import * as sheets from "./sheets.js";
import { problems, session } from "./session.js";
import { busyText, failure, startReport } from "./report.js";
import { widest } from "./headers.js";

const PLAY = "M3 1v14l11-7z", PAUSE = "M3 1h4v14H3zM9 1h4v14H9z";
let status, time, wallTime;

export function startTransport() {
  const on = (id, act) => $(id).addEventListener("click", act);
  on("t-previous", player.previousEvent);
  on("t-back", player.back);
  on("t-play", player.toggle);
  on("t-step", player.step);
  on("t-next", player.nextEvent);
  on("t-slower", player.slower);
  on("t-speed", () => player.setSpeed(1));
  on("t-faster", player.faster);
  on("t-loop", player.toggleLoop);
  for (const button of $("t-sources").children) button.addEventListener("click", () => player.setSource(button.dataset.source));
  on("t-report", startReport);
  for (const name of ["compare", "export", "session"]) on(`t-${name}`, () => sheets.toggle(name));
  status = slowText($("t-status"));
  time = slowText($("t-time"));
  wallTime = slowText($("t-wall"));
  // After a click the keys belong to the player again: Space must not press the button once more.
  document.addEventListener("click", (event) => {
    if (replaying() && event.detail > 0) event.target.closest?.("button")?.blur();
  });
}

export const speedText = (speed) => `${number(speed, speed < 1 ? 1 : 0)}×`;

/** What matters most of what goes on, from the fullest wording to the shortest. */
function news() {
  const building = session.document?.index?.state === "building" ? `indexing ${number(100 * session.document.index.progress, 0)} %` : "";
  if (failure()) return ["error", [failure()]];
  if (busyText()) return ["busy", [busyText()]];
  if (session.problem) return ["error", [session.problem]];
  if (player.playback().catching_up) return ["busy", ["catching up: slower than asked", "catching up"]];
  if (building) return ["busy", [building]];
  return ["", [""]];
}

function disabled(id, off) {
  if ($(id).disabled !== off) $(id).disabled = off;
}

/** Ten times a second. */
export function update() {
  const on = replaying();
  $("transport").hidden = !on;
  $("trends-tools").hidden = !on || people();
  $("regions").hidden = on || along() || people();
  if (!people() && (on || !along())) write($("trends-title"), on ? "Session" : "Last 60 s");
  $("timeline").setAttribute("role", on ? "slider" : "img");
  const p = player.playback();
  if (!p) return;
  const at = player.cursor();
  const playing = player.current("playing");
  const canvas = $("timeline");
  canvas.setAttribute("aria-valuemin", "0");
  canvas.setAttribute("aria-valuemax", p.duration.toFixed(1));
  canvas.setAttribute("aria-valuenow", at.toFixed(1));
  canvas.setAttribute("aria-valuetext", clock(at));
  // Standing still, every cycle counts; playing, digits change twice a second at most.
  const seeking = player.seeking();
  const still = seeking || !playing;
  time(`${seeking ? "→ " : ""}${clock(at, still ? 2 : 0)}`, still ? at : "playing");
  $("t-time").style.minWidth = `${0.56 * clock(p.duration, 2).length + 1.3}em`;
  mark($("t-time"), "seeking", seeking ? 1 : 0);
  write($("t-duration"), ` / ${clock(p.duration, 0)}`);
  wallTime(wallClock(p.wall - p.time + at), still ? at : "playing");
  $("t-wall").title = `Clock on the wall of what is shown: ${day(p.wall)}`;
  mark($("t-play"), "playing", playing ? 1 : 0);
  const path = $("t-play").querySelector("path");
  if (path.getAttribute("d") !== (playing ? PAUSE : PLAY)) path.setAttribute("d", playing ? PAUSE : PLAY);
  $("t-play").setAttribute("aria-label", playing ? "Pause" : "Play");
  const speed = player.current("speed");
  write($("t-speed"), speedText(speed));
  disabled("t-slower", speed <= player.SPEEDS[0]);
  disabled("t-faster", speed >= player.SPEEDS[player.SPEEDS.length - 1]);
  $("t-loop").setAttribute("aria-pressed", String(Boolean(player.current("loop"))));
  const source = player.current("source");
  const offered = p.sources ?? ["recorded"];
  for (const button of $("t-sources").children) {
    button.setAttribute("aria-pressed", String(button.dataset.source === source));
    const off = !offered.includes(button.dataset.source);
    if (button.disabled !== off) button.disabled = off;
  }
  disabled("t-compare", offered.length < 2);
  const many = problems().length;
  mark($("t-session"), "problems", many);
  write($("t-session"), many ? `▲ ${many} problem${many === 1 ? "" : "s"}` : "Session");
  mark($("t-report"), "busy", busyText() ? 1 : 0);
  $("t-report").setAttribute("aria-busy", String(Boolean(busyText())));
  const [kind, texts] = news();
  mark($("t-status"), "kind", kind);
  $("t-status").title = texts[0];
  status(widest($("t-status"), texts, $("t-status").clientWidth - 4) || texts[texts.length - 1], `${kind} ${texts[0].replace(/\d/g, "")}`);
}
