// Which images the page shows: the exact ones, Sun's, or both over each other to compare.

import { exactImage, layerZone, zoneImage } from "./state.js";

const MODES = ["exact", "sun", "difference"];
export const WORDS = { exact: "Exact", sun: "Sun", difference: "Diff." };

/** `/?images=sun` opens the page so; a reload keeps what was chosen last. */
const asked = new URLSearchParams(location.search).get("images") ?? sessionStorage.getItem("images");
let chosen = MODES.includes(asked) ? asked : "exact";

/** Without an exact image there is only Sun's. */
export const shown = () => (exactImage() ? chosen : "sun");
const anyZone = () => Boolean(zoneImage() || layerZone("people") || layerZone("site"));
export const shownZone = () => (anyZone() ? chosen : "sun");
export const switchable = () => Boolean(exactImage() || anyZone());

export function next() {
  if (!switchable()) return;
  chosen = MODES[(MODES.indexOf(chosen) + 1) % MODES.length];
  sessionStorage.setItem("images", chosen);
}
