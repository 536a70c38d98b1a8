// The colours of css/base.css for canvases, the fonts, and the hatches.

export const C = {
  page: "#0F1418", panel: "#171D23", text: "#E6EAED", second: "#A9B3BB", line: "#2C3740", edge: "#6E8496",
  free: "#22303A", outside: "#0B0F13", undecided: "#8A949E", grid: "#34434E",
  partner: "#A970F0", partnerLine: "#C9A9F7", site: "#3E8E78", self: "#C0B8D9", people: "#FFFFFF", tipOver: "#79E0B6", slow: "#FFA51F", stop: "#C4262E", stopLine: "#FF6B5E", unknown: "#FF6B5E",
  remote: "#4C9BFF", stale: "#8A949E", playback: "#C84DAE", playbackLine: "#EC96D7", halo: "#0B0F13",
};

const FAMILY = '"Segoe UI", Roboto, "Helvetica Neue", "Liberation Sans", Arial, sans-serif';
let sizes = { t2: 22, t3: 16, tick: 13 };

/** Reads the type sizes of the present layout; call after a resize. */
export function readSizes() {
  const style = getComputedStyle(document.documentElement);
  const px = (name) => parseFloat(style.getPropertyValue(name));
  sizes = { t2: px("--t2"), t3: px("--t3"), tick: px("--tick") };
}

export const size = (name) => sizes[name];
export const font = (name, weight = 400) => `${weight} ${sizes[name]}px ${FAMILY}`;

export function rgba(hex, alpha) {
  const v = parseInt(hex.slice(1), 16);
  return `rgba(${v >> 16}, ${(v >> 8) & 255}, ${v & 255}, ${alpha})`;
}

export const LEVEL_COLOUR = { SLOW: C.slow, STOP: C.stopLine, UNKNOWN: C.unknown };

const tiles = new Map();

/** Which pixels of a tile a stroke covers; `side` and `stroke` in pixels along the axes. */
const STROKES = {
  "/": (x, y, side, stroke) => (x + y) % side < stroke,
  "\\": (x, y, side, stroke) => (x - y + side) % side < stroke,
  "x": (x, y, side, stroke) => (x + y) % side < 0.6 * stroke || (x - y + side) % side < 0.6 * stroke,
  "-": (x, y, side, stroke) => y % (side / 2) < 0.5 * stroke,
  "|": (x, y, side, stroke) => x % (side / 2) < 0.5 * stroke,
  "dots": (x, y, side, stroke) => Math.hypot((x % (side / 2)) - side / 4, (y % (side / 2)) - side / 4) < 0.5 * stroke,
  "checker": (x, y, side, stroke, half) => (Math.floor(x / half) + Math.floor(y / half)) % 2 === 0,
};

/** The tile of a hatch at `dpr`: 3 px strokes at 12 px pitch, measured across; a checker of 2 px. */
export function tile(kind, dpr) {
  const half = Math.max(1, Math.round(2 * dpr)); // of the checker
  const side = 4 * half * Math.round((12 * Math.SQRT2 * dpr) / (4 * half));
  const stroke = 3 * Math.SQRT2 * dpr;
  const covered = STROKES[kind];
  const cells = new Uint8Array(side * side);
  for (let y = 0, p = 0; y < side; y++) for (let x = 0; x < side; x++, p++) cells[p] = covered(x, y, side, stroke, half) ? 1 : 0;
  return { side, cells };
}

/** A hatch as a pattern, for a canvas drawn at `dpr` device pixels per pixel. */
export function hatch(g, colour, dpr, alpha = 0.8, kind = "/") {
  const key = `${colour} ${dpr} ${alpha} ${kind}`;
  let pattern = tiles.get(key);
  if (!pattern) {
    const { side, cells } = tile(kind, dpr);
    const image = document.createElement("canvas");
    image.width = image.height = side;
    const t = image.getContext("2d");
    t.fillStyle = rgba(colour, alpha);
    cells.forEach((on, p) => on && t.fillRect(p % side, Math.floor(p / side), 1, 1));
    pattern = g.createPattern(image, "repeat");
    pattern.setTransform(new DOMMatrix().scale(1 / dpr));
    tiles.set(key, pattern);
  }
  return pattern;
}
