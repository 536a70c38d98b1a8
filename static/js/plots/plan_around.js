// Driving zones of people and of the site on the plan, beside the partner's: drawn, told, the nearest named.

import { C, hatch, rgba, size } from "../theme.js";
import { metres } from "../axis.js";
import { fit, swatches } from "../pen.js";
import { LAYERS } from "../layers.js";
import { far, imageStale, label as nameOf, layerZone, state } from "../state.js";
import { unknown } from "../people/model.js";
import { chart, drawArrow } from "./plan_layers.js";
import { insideZone, path, rings } from "./plan_zone.js";

export const view = { shown: true };

/** Drawn first to last: people lie on top. Lighter than a partner's, as there are many of them. */
const AROUND = [{ name: "site", fill: 0.16, hatch: 0.4 }, { name: "people", fill: 0.1, hatch: 0.5 }].map((one) => ({ ...LAYERS.find(({ name }) => name === one.name), ...one, kind: LAYERS.find(({ name }) => name === one.name).hatch }));
const LINES = [{ name: "any_swing", dash: [7, 4], width: 1.2 }, { name: "as_is", dash: [], width: 1.8 }];

const OLD_ZONE = "its zone is old";

/** "people unknown"; "site zone old". */
const missed = ({ name, reason }) => `${name} ${reason === OLD_ZONE ? "zone old" : "unknown"}`;

/** Why a layer is not known now, else empty. */
function why(name, entry) {
  if (name === "people" && unknown()) return unknown();
  return entry.header.reason || (imageStale(entry) ? OLD_ZONE : "");
}

/** The layers that are computed for the own machine, the last drawn last: [{name, entry, reason, ..}]. */
export const around = () => (view.shown ? AROUND.map((layer) => ({ ...layer, entry: layerZone(layer.name) })).filter(({ entry }) => entry).map((layer) => ({ ...layer, reason: why(layer.name, layer.entry) })) : []);

/** Returns by layer {reason, variants: {name: {rings, signed_distance, empty}}}; no area is drawn of what is not known. */
export function drawAround(g, layers, dpr) {
  const drawn = {};
  for (const { name, entry, colour, kind, fill, hatch: dense, reason } of layers) {
    const variants = {};
    for (const { name: variant, dash, width } of LINES) {
      const given = entry.header.variants?.[variant];
      if (!given) continue;
      const shape = rings(entry, variant);
      variants[variant] = { rings: shape.length, signed_distance: given.signed_distance, empty: shape.length === 0 };
      if (!shape.length) continue;
      const p = path(shape);
      if (variant === "as_is" && !reason) {
        g.fillStyle = rgba(colour, fill);
        g.fill(p, "evenodd");
        g.fillStyle = hatch(g, colour, dpr, dense, kind);
        g.fill(p, "evenodd");
      }
      // What was known is left as an outline, grey: where they were, not where they are.
      g.setLineDash(reason ? [2, 3] : dash);
      g.lineWidth = width;
      g.strokeStyle = reason ? C.stale : colour;
      g.stroke(p);
      g.setLineDash([]);
    }
    drawn[name] = { reason, variants };
  }
  return drawn;
}

const distance = (entry, variant = "as_is") => entry.header.variants?.[variant]?.signed_distance ?? Infinity;

/** All zones of the own machine that are known, the partner's too, the nearest edge first: [{word, entry, distance}]. */
function known(exact, stale, layers) {
  const found = layers.filter(({ reason }) => !reason).map(({ name, entry }) => ({ word: name, entry, distance: distance(entry) }));
  if (exact && !stale && exact.header.variants?.as_is) found.unshift({ word: nameOf(state.partner), entry: exact, distance: distance(exact) });
  return found.sort((a, b) => a.distance - b.distance);
}

/** What is not known, in words: "people unknown". Of a partner far away no zone is made, and none is missing. */
function missing(exact, stale, layers) {
  const partner = state.partner && (exact ? stale || !exact.header.variants?.as_is : far() === null);
  return [...(partner ? [`${nameOf(state.partner)} unknown`] : []), ...layers.filter(({ reason }) => reason).map(missed)];
}

/** How far the base is from the nearest edge of all zones as is, and whose that is. */
export function nearestText(exact, stale, layers) {
  const [first] = known(exact, stale, layers);
  const not = missing(exact, stale, layers);
  const rest = not.length ? `; ${not.join(", ")}` : "";
  if (!first) return `distance to the zones unknown${rest}`;
  const seen = first.entry.header.view ?? Infinity;
  if (first.distance >= seen || first.distance === Infinity) return `no zone within ${seen < Infinity ? metres(seen) : "reach"} of the base${rest}`;
  return `base ${metres(Math.abs(first.distance))} ${first.distance < 0 ? "inside" : "outside"} as-is zone: ${first.word}${rest}`;
}

/** In the corner of the plan, in words. */
export function nearestNote(g, exact, stale, layers) {
  const text = nearestText(exact, stale, layers);
  const t = size("tick"), at = chart.box.bottom - 0.45 * t;
  const not = missing(exact, stale, layers).length > 0;
  return fit(g, [text, text.replace("as-is zone: ", ""), text.replace(/^.*; /, "? ")], chart.box.left + 5, at, chart.box.right - chart.box.left - 10, { colour: not ? C.unknown : C.text, halo: true });
}

/** The shortest way out of a zone as is that leads into none of the others; null while the base is outside, or when every way leads into one. */
export function freeExit(g, exact, stale, layers, own, inside) {
  const all = known(exact, stale, layers);
  for (const { entry } of all.filter((one) => one.distance < 0)) {
    const exit = entry.header.variants.as_is.exit;
    if (!exit || !own.position || exit.length > (entry.header.view ?? Infinity)) continue;
    const end = [0, 1].map((k) => own.position[k] + exit.length * exit.direction[k]);
    if (all.some((other) => other.entry !== entry && insideZone(end, other.entry, "as_is", inside))) continue;
    return drawArrow(g, own.position, end, exit.length);
  }
  return null;
}

export const aroundLegend = (g, dpr, layers, drawn) => [...layers].reverse().filter(({ name, reason }) => reason || !drawn[name].variants.as_is?.empty || !drawn[name].variants.any_swing?.empty).map(({ name, colour, kind, reason }) =>
  reason ? [swatches.line(C.stale, [2, 3], 1.8), missed({ name, reason })] : [swatches.area(hatch(g, colour, dpr, 0.85, kind), colour), name]);

const WORDS = [["as_is", "as is"], ["any_swing", "any swing"], ["any_posture", "any posture"]];

/** What holds at a place, and how far the base is from each layer's zone. */
export function aroundLines(layers, point, inside) {
  return [...layers].reverse().flatMap(({ name, entry, reason }) => {
    if (reason) return [`${name} unknown: ${reason}`];
    const hit = WORDS.find(([variant]) => insideZone(point, entry, variant, inside));
    const d = distance(entry), seen = entry.header.view ?? Infinity;
    const far = d >= seen || d === Infinity ? `over ${metres(seen)} outside` : `${metres(Math.abs(d))} ${d < 0 ? "inside" : "outside"}`;
    return [`${hit ? `inside the zone ${hit[1]}` : "outside all zones"} (${name})`, `base ${far} as is zone (${name})`];
  });
}
