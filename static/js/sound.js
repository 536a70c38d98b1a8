// Alarm sounds: STOP three pulses every 2 s, UNKNOWN a falling pair, SLOW one tone. Off until a click allows it.

import { $, mark, write } from "./words.js";
import { replaying, state } from "./state.js";

let context = null;
let on = false;
let silenced = new Set(); // keys of alarms that were acknowledged
let lastKey = "";
let lastTime = -Infinity;

function tone(frequency, start, length, volume = 0.22) {
  const at = context.currentTime + start;
  const oscillator = context.createOscillator();
  const gain = context.createGain();
  oscillator.type = "triangle";
  oscillator.frequency.value = frequency;
  gain.gain.setValueAtTime(0, at);
  gain.gain.linearRampToValueAtTime(volume, at + 0.012);
  gain.gain.setValueAtTime(volume, at + length - 0.03);
  gain.gain.linearRampToValueAtTime(0, at + length);
  oscillator.connect(gain).connect(context.destination);
  oscillator.start(at);
  oscillator.stop(at + length);
}

const PATTERNS = {
  STOP: () => [0, 0.22, 0.44].forEach((t) => tone(880, t, 0.14)),
  UNKNOWN: () => { tone(660, 0, 0.25); tone(440, 0.28, 0.35); },
  SLOW: () => tone(520, 0, 0.3, 0.16),
};

function show() {
  write($("sound-word"), on ? "SOUND ON" : "SOUND OFF");
  write($("sound-hint"), on ? "M: mute" : lastMode === "PLAYBACK" ? "in playback" : context ? "M: unmute" : "click to allow");
  $("sound").setAttribute("aria-pressed", String(on));
  mark(document.body, "sound", on ? "on" : "off");
}

export function toggleSound() {
  context ??= new AudioContext();
  context.resume();
  on = !on;
  show();
}

let lastMode = "";

/** A recorded alarm is nobody's alarm: in playback the sound starts off, and says so. */
export function soundFor(mode) {
  if (mode === lastMode) return;
  if (mode === "PLAYBACK") on = false;
  lastMode = mode;
  show();
}

export const keyOf = (alarm) => `${alarm.name} ${alarm.machine} ${alarm.level}`;
export const acknowledged = (alarm) => silenced.has(keyOf(alarm));

export function acknowledge(alarms) {
  for (const alarm of alarms) silenced.add(keyOf(alarm));
}

/** Called a few times a second with the alarms that are on, the severest first. */
export function sound(alarms, approaching) {
  const present = new Set(alarms.map(keyOf));
  silenced = new Set([...silenced].filter((key) => present.has(key))); // one that went and came back sounds again
  const loud = alarms.find((alarm) => !acknowledged(alarm));
  if (!loud) {
    lastKey = "";
    return;
  }
  const now = performance.now();
  const key = keyOf(loud);
  const repeats = loud.level === "STOP" ? 2000 : loud.level === "UNKNOWN" ? 6000 : Infinity;
  if (key === lastKey && now - lastTime < repeats) return;
  // People walk by themselves: they sound whether or not anybody pushes.
  if (loud.level === "SLOW" && !approaching && loud.name !== "people") return;
  lastKey = key;
  lastTime = now;
  if (on && !(replaying() && !state.snapshot.playback?.playing) && context?.state === "running") PATTERNS[loud.level]?.();
}

export function startSound() {
  $("sound").addEventListener("click", toggleSound);
  show();
}
