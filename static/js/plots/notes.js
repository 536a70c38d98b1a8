// What every image says about its age, on the image itself.

import { C } from "../theme.js";
import { seconds } from "../axis.js";
import { label } from "../pen.js";
import { staleText } from "../head.js";

/** "STALE 1.4 s", or "computing 0.6 s" while a newer image is being made; nothing when fresh. */
export function ageNote(g, x, y, age, stale, options = {}) {
  const text = stale ? staleText(age) : age > 0.5 ? `computing ${seconds(age)}` : null;
  if (text) label(g, text, x, y, { base: "bottom", colour: C.text, weight: stale ? 700 : 400, halo: true, ...options });
  return text;
}
