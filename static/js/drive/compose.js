// From all devices to one record of deflections. One device is in use at a time; a fault holds everything at zero
// until what is in use was let go.

import { clean, neutral, zero } from "./deflection.js";

export const SOURCES = ["gamepad", "keyboard", "screen"];
export const NOTHING = { deflection: zero(), enable: false };

export const start = () => ({ source: "", hold: "", why: "", lost: false, held: {}, enable: false, override: false, focus: true, gamepad: true, deflection: zero(), ignored: [] });

/**
 * `readings`: per source {deflection, enable, vanished, cancelled}. `fault`: what stands against any input, in words.
 * A source is taken by pressing its dead-man with its sticks in neutral while no other's is held.
 */
export function compose(before, readings, { focus, fault, override }) {
  let { source, hold } = before;
  const reading = (name) => readings[name] ?? NOTHING;
  const pressed = (name) => reading(name).enable && !before.held[name];
  if (!hold && !reading(source).enable) {
    source = SOURCES.find((name) => name !== source && pressed(name) && !reading(name).vanished && neutral(reading(name).deflection)) ?? source;
  }
  const used = reading(source);
  const lost = Boolean(used.vanished);
  const changed = source === before.source && lost !== before.lost;
  if (!focus) hold = "the window lost the focus";
  else if (fault) hold = fault;
  else if (used.cancelled) hold = "the touch was cut off";
  else if (changed) hold = lost ? "the gamepad is gone" : "the gamepad is back";
  else if (hold && !used.enable && neutral(used.deflection)) hold = "";
  const off = hold || lost || !source;
  return {
    source,
    hold,
    why: hold || (lost ? "the gamepad is gone" : ""),
    lost,
    held: Object.fromEntries(SOURCES.map((name) => [name, reading(name).enable])),
    enable: !off && used.enable,
    override: !hold && Boolean(override),
    focus,
    gamepad: !lost,
    deflection: off ? zero() : clean(used.deflection),
    ignored: SOURCES.filter((name) => name !== source && reading(name).enable),
  };
}
