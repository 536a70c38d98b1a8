// The gamepads and joysticks in two slots. A slot stays a device's own after it vanished, so that no other moves up.

const slots = [null, null]; // {index, id}

/** Why there can be no gamepad, or "". */
export const unavailable = () => (typeof navigator.getGamepads === "function" && isSecureContext ? "" : "gamepads need HTTPS or localhost");

function connected() {
  try {
    return [...navigator.getGamepads()].filter((pad) => pad && pad.connected !== false);
  } catch {
    return [];
  }
}

/** Per slot: a device was there and is not any more. */
export const gone = (now) => slots.map((slot, i) => slot !== null && now[i] === null);

/** [Gamepad or null, Gamepad or null], read now. */
export function read() {
  const pads = connected();
  const is = (slot, pad) => slot && slot.index === pad.index && slot.id === pad.id;
  const at = (slot) => pads.find((pad) => is(slot, pad)) ?? null;
  for (const pad of pads) {
    if (slots.some((slot) => is(slot, pad))) continue;
    const absent = (slot) => slot && !at(slot);
    let free = slots.findIndex((slot) => absent(slot) && slot.id === pad.id);
    if (free < 0) free = slots.findIndex((slot) => !slot);
    if (free < 0) free = slots.findIndex(absent);
    if (free >= 0) slots[free] = { index: pad.index, id: pad.id };
  }
  return slots.map(at);
}
