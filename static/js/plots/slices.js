// The three joint images: exact slices where there are any, Sun's projections otherwise.

import { $ } from "../words.js";
import { surface } from "../surface.js";
import { shown } from "../view.js";
import { PAIRS, sliceSun } from "./slice_sun.js";
import { sliceExact } from "./slice_exact.js";

function slice(index) {
  const sun = sliceSun(index), exact = sliceExact(index);
  const now = () => (shown() === "sun" ? sun : exact);
  return surface($(`slice-${index}`), (...given) => now().paint(...given), (...at) => now().probe(...at), (...at) => now().aim(...at));
}

export const slices = () => PAIRS.map((_, index) => slice(index));
