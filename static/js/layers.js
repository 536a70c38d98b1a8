// The layers of exact images: what a cell's byte means, and how cells become pixels.

import { C, hatch, tile } from "./theme.js";
import { swatches } from "./pen.js";

export const FREE = 64; // the whole cell is certified free
export const COLLIDING = 128; // the whole cell is certified colliding
export const OUTSIDE = 255; // no cell here; never on the wire
const PARTNER = 1, SITE = 2, SELF = 4, NEAR_LIMIT = 8, BEYOND_LIMIT = 16, OUT_OF_REACH = 32, PEOPLE_IN_REACH = 64, TIPPING_REACH = 128;

/** On top first. `bit` of joint images and bars. */
export const LAYERS = [
  { bit: 8, name: "people", colour: C.people, hatch: "dots" },
  { bit: PARTNER, name: "partner", colour: C.partner, hatch: "/" },
  { bit: 16, name: "tip-over", colour: C.tipOver, hatch: "-" },
  { bit: SITE, name: "site", colour: C.site, hatch: "\\" },
  { bit: SELF, name: "self", colour: C.self, hatch: "x" },
  { bit: 32, name: "other", colour: C.text, hatch: "|" },
];
/** The reach image is not certified and has no undecided cells, but limits. */
const REACH_BITS = { people: PEOPLE_IN_REACH, "tip-over": TIPPING_REACH, partner: PARTNER, site: SITE, self: SELF };
const REACH_LAYERS = LAYERS.filter(({ name }) => name in REACH_BITS).map((layer) => ({ ...layer, bit: REACH_BITS[layer.name] }));

/** Of the reach image: what else a byte tells. */
export const layerBits = { near: NEAR_LIMIT, beyond: BEYOND_LIMIT, out: OUT_OF_REACH, unreachable: BEYOND_LIMIT | OUT_OF_REACH };

export const jointKind = {
  name: "joint",
  layers: LAYERS,
  hits: (b) => b & 63,
  undecided: (b) => !(b & (FREE | COLLIDING)),
  plain: () => null,
};
export const reachKind = {
  name: "reach",
  partner: PARTNER,
  layers: REACH_LAYERS,
  hits: (b) => b & (7 | PEOPLE_IN_REACH | TIPPING_REACH),
  touches: (b) => b & (7 | PEOPLE_IN_REACH), // something: Sun's method knows contact only
  undecided: () => false,
  plain: (b) => (b & OUT_OF_REACH ? "out" : b & BEYOND_LIMIT ? "beyond" : b & NEAR_LIMIT ? "near" : null),
};

const rgb = (hex) => [16, 8, 0].map((shift) => (parseInt(hex.slice(1), 16) >> shift) & 255);
const mix = (under, over, alpha) => under.map((v, i) => v + alpha * (over[i] - v));
const pack = ([r, g, b]) => (0xff000000 | (Math.round(b) << 16) | (Math.round(g) << 8) | Math.round(r)) >>> 0;

const palettes = new Map();

/** For each byte a tile of colours, made when first met. */
function palette(kind, dpr) {
  const key = `${kind.name} ${dpr}`;
  if (!palettes.has(key)) {
    const hatches = new Map(["checker", "|", "-", ...LAYERS.map((l) => l.hatch)].map((h) => [h, tile(h, dpr)]));
    palettes.set(key, { hatches, side: hatches.get("/").side, tiles: new Array(256).fill(null), solid: kind.layers.map((l) => pack(rgb(l.colour))) });
  }
  return palettes.get(key);
}

function colours(kind, { hatches, side }, byte) {
  const cells = new Uint32Array(side * side);
  const outside = byte === OUTSIDE;
  const plain = outside ? null : kind.plain(byte);
  const hit = outside ? [] : kind.layers.filter(({ bit }) => kind.hits(byte) & bit);
  const undecided = !outside && kind.undecided(byte);
  const on = (name, p) => hatches.get(name).cells[p];
  for (let p = 0; p < cells.length; p++) {
    let c = rgb(outside || plain === "out" || plain === "beyond" ? C.outside : C.free);
    if (plain === "beyond" && on("|", p)) c = mix(c, rgb(C.edge), 0.35);
    if (plain === "near") c = mix(c, rgb(C.edge), on("-", p) ? 0.5 : 0.06);
    if (undecided && on("checker", p)) c = mix(c, rgb(C.undecided), hit.length ? 0.25 : 1);
    if (hit.length) c = mix(c, rgb(hit[0].colour), undecided ? 0.18 : 0.35);
    for (const layer of [...hit].reverse()) if (on(layer.hatch, p)) c = mix(c, rgb(layer.colour), 0.85);
    cells[p] = pack(c);
  }
  return cells;
}

/** Bytes (one per pixel, w by h) as colours: fills, hatches, and an outline of 2 px around every layer. */
export function paintBytes(bytes, w, h, out, dpr, kind) {
  const look = palette(kind, dpr);
  const { side, tiles, solid } = look;
  const rim = Math.max(1, Math.round(2 * dpr));
  const hits = new Uint8Array(256).map((_, b) => (b === OUTSIDE ? 0 : kind.hits(b)));
  for (let y = 0, p = 0; y < h; y++) {
    const row = (y % side) * side;
    for (let x = 0; x < w; x++, p++) {
      const b = bytes[p];
      const mine = hits[b];
      if (mine) {
        // What is missing from some neighbour ends here.
        let all = 255;
        if (x >= rim) all &= hits[bytes[p - rim]];
        if (x < w - rim) all &= hits[bytes[p + rim]];
        if (y >= rim) all &= hits[bytes[p - rim * w]];
        if (y < h - rim) all &= hits[bytes[p + rim * w]];
        const ends = mine & ~all;
        if (ends) {
          out[p] = solid[kind.layers.findIndex(({ bit }) => ends & bit)];
          continue;
        }
      }
      out[p] = (tiles[b] ??= colours(kind, look, b))[row + (x % side)];
    }
  }
}

/** What is stale loses its colour. */
export function fade(out) {
  for (let p = 0; p < out.length; p++) {
    const c = out[p], v = 0.3 * (c & 255) + 0.59 * ((c >> 8) & 255) + 0.11 * ((c >> 16) & 255);
    out[p] = pack([v, v, v]);
  }
}

/** Sun's set over the exact one: a light veil with a white outline of 2 px, hatches shining through. */
export function paintVeil(mask, w, h, out, dpr) {
  const rim = Math.max(1, Math.round(2 * dpr));
  for (let y = 0, p = 0; y < h; y++) {
    for (let x = 0; x < w; x++, p++) {
      if (!mask[p]) continue;
      const border = (x >= rim && !mask[p - rim]) || (x < w - rim && !mask[p + rim]) || (y >= rim && !mask[p - rim * w]) || (y < h - rim && !mask[p + rim * w]);
      const c = out[p];
      out[p] = border ? 0xffffffff : pack(mix([c & 255, (c >> 8) & 255, (c >> 16) & 255], [255, 255, 255], 0.22));
    }
  }
}

/** How many cells there are of each class. */
export function count(data, kind) {
  const by = new Uint32Array(256);
  for (const b of data) by[b] += 1;
  const sum = (test) => by.reduce((total, n, b) => (n && test(b) ? total + n : total), 0);
  const counts = Object.fromEntries(kind.layers.map(({ bit, name }) => [name, sum((b) => kind.hits(b) & bit)]).filter(([name, n]) => n || ["partner", "site", "self"].includes(name)));
  if (kind === jointKind) return { free: by[FREE], colliding: sum((b) => b & COLLIDING), undecided: sum((b) => kind.undecided(b)), ...counts };
  return { free: sum((b) => !kind.hits(b) && !(b & (BEYOND_LIMIT | OUT_OF_REACH))), ...counts, near: sum((b) => kind.plain(b) === "near"), beyond: sum((b) => kind.plain(b) === "beyond"), out: sum((b) => kind.plain(b) === "out") };
}

export const swatch = {
  layer: (g, { colour, hatch: kind }, dpr) => swatches.area(hatch(g, colour, dpr, 0.85, kind), colour),
  undecided: (g, dpr) => swatches.area(hatch(g, C.undecided, dpr, 1, "checker"), C.undecided),
  /** Any byte, as its cells look. */
  byte: (g, byte, kind, dpr) => (c, x, y, w) => {
    const look = palette(kind, dpr);
    const cells = (look.tiles[byte] ??= colours(kind, look, byte));
    for (let v = 0; v < w - 4; v++) for (let u = 0; u < w; u++) {
      const p = cells[(v % look.side) * look.side + (u % look.side)];
      c.fillStyle = `rgb(${p & 255}, ${(p >> 8) & 255}, ${(p >> 16) & 255})`;
      c.fillRect(x + u, Math.round(y - w / 2 + 2) + v, 1, 1);
    }
    c.lineWidth = 1;
    c.strokeStyle = C.edge;
    c.strokeRect(x + 0.5, Math.round(y - w / 2 + 2) + 0.5, w - 1, w - 5);
  },
  free: () => swatches.area(C.free, C.free),
  sun: () => swatches.area("rgba(255, 255, 255, 0.3)", "#FFFFFF"),
};
