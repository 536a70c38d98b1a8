// Which axis or button of which device is which function. A device is a slot: 0 is the first seen, 1 the second.

import { NAMES, clamp, outside } from "./deflection.js";

export const DEAD_MOST = 0.5;
export const BUTTONS = ["enable", "stop", "override", "track_left_ahead", "track_left_back", "track_right_ahead", "track_right_back"];
const DEAD = 0.12;

const axis = (slot, number, invert = false) => ({ slot, axis: number, invert, dead: DEAD });
const button = (slot, number) => ({ slot, button: number });

/** Browsers count forwards as negative. */
const PAD = {
  axes: { left_x: axis(0, 0), left_y: axis(0, 1, true), right_x: axis(0, 2), right_y: axis(0, 3, true), track_left: axis(0, null), track_right: axis(0, null) },
  buttons: { enable: button(0, 4), stop: button(0, 1), override: button(0, 3), track_left_ahead: button(0, 6), track_left_back: button(0, 13), track_right_ahead: button(0, 7), track_right_back: button(0, 0) },
};
const JOYSTICKS = {
  axes: { left_x: axis(0, 0), left_y: axis(0, 1, true), right_x: axis(1, 0), right_y: axis(1, 1, true), track_left: axis(0, null), track_right: axis(1, null) },
  buttons: { enable: button(0, 0), stop: button(1, 1), override: button(1, 0), track_left_ahead: button(0, 3), track_left_back: button(0, 2), track_right_ahead: button(1, 3), track_right_back: button(1, 2) },
};

/** The default for what is connected: two sticks of their own, or one pad with both. */
export function standard(slots) {
  const two = slots[0] && slots[1] && slots[0].mapping !== "standard";
  return structuredClone(two ? JOYSTICKS : PAD);
}

const count = (value, most) => Number.isInteger(value) && value >= 0 && value < most;
const input = (value) => value === null || count(value, 64);

/** A stored mapping as far as it is whole, else null. */
export function checked(given) {
  try {
    const axes = Object.fromEntries(NAMES.map((name) => {
      const { slot, axis: number, invert, dead } = given.axes[name];
      if (!count(slot, 2) || !input(number) || typeof invert !== "boolean" || !Number.isFinite(dead) || dead < 0 || dead > DEAD_MOST) throw new Error(name);
      return [name, { slot, axis: number, invert, dead }];
    }));
    const buttons = Object.fromEntries(BUTTONS.map((name) => {
      const { slot, button: number } = given.buttons[name];
      if (!count(slot, 2) || !input(number)) throw new Error(name);
      return [name, { slot, button: number }];
    }));
    return { axes, buttons };
  } catch {
    return null;
  }
}

const pressure = (slots, { slot, button: number }) => {
  const given = number === null ? null : slots[slot]?.buttons?.[number];
  return Math.max(0, clamp(given?.value), given?.pressed === true ? 0.5 : 0);
};
const pressed = (slots, given) => pressure(slots, given) >= 0.5;

/** What the devices in the slots say under this mapping. */
export function read(slots, mapping) {
  const deflection = Object.fromEntries(NAMES.map((name) => {
    const { slot, axis: number, invert, dead } = mapping.axes[name];
    const value = number === null ? 0 : outside(slots[slot]?.axes?.[number], dead);
    return [name, invert ? 0 - value : value];
  }));
  for (const track of ["track_left", "track_right"]) {
    const push = (way) => pressure(slots, mapping.buttons[`${track}_${way}`]);
    const buttons = outside(push("ahead") - push("back"), mapping.axes[track].dead);
    if (deflection[track] === 0) deflection[track] = buttons;
  }
  const { enable, stop, override } = mapping.buttons;
  return { deflection, enable: pressed(slots, enable), stop: pressed(slots, stop), override: pressed(slots, override) };
}

/** The slots a mapping reads from. */
export const used = (mapping) => [...new Set([...Object.values(mapping.axes).filter((a) => a.axis !== null), ...Object.values(mapping.buttons).filter((b) => b.button !== null)].map((one) => one.slot))];

const PAD_WORDS = ["A", "B", "X", "Y", "LB", "RB", "LT", "RT", "Back", "Start", "L3", "R3", "D-pad up", "D-pad down", "D-pad left", "D-pad right"];

/** A button as it is called. */
export function buttonWord(slots, { slot, button: number }) {
  if (number === null) return "none";
  return (slots[slot]?.mapping === "standard" && PAD_WORDS[number]) || `button ${number}`;
}
