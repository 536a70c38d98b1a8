// Which images the page shows: the exact ones, Sun's, or both over each other to compare.

import { exactImage, zoneImage } from "./state.js";

const MODES = ["exact", "sun", "difference"];
export const WORDS = { exact: "Exact", sun: "Sun", difference: "Diff." };

let chosen = "exact";

/** Without an exact image there is only Sun's. */
export const shown = () => (exactImage() ? chosen : "sun");
export const shownZone = () => (zoneImage() ? chosen : "sun");
export const switchable = () => Boolean(exactImage() || zoneImage());

export function next() {
  if (switchable()) chosen = MODES[(MODES.indexOf(chosen) + 1) % MODES.length];
  return chosen;
}
