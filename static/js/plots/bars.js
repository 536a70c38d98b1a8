// The joint bars: with exact intervals where there is an exact image.

import { $ } from "../words.js";
import { surface } from "../surface.js";
import { described, exactImage, machine, state } from "../state.js";
import * as sun from "./bars_sun.js";
import * as exact from "./bars_exact.js";

const now = () => (exactImage() && machine(state.own)?.joints && described(state.own)?.joints ? exact : sun);

export const bars = () => surface($("bars"), (...given) => now().paint(...given), (x, y) => now().probe(x, y), (x, y) => now().aim?.(x, y) ?? null);
