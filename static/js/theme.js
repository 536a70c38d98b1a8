// The colours of css/base.css for canvases, the fonts, and the hatches.

export const C = {
  page: "#0F1418", panel: "#171D23", text: "#E6EAED", second: "#A9B3BB", line: "#2C3740", edge: "#6E8496",
  free: "#22303A", outside: "#0B0F13", undecided: "#8A949E", grid: "#34434E",
  partner: "#A970F0", partnerLine: "#C9A9F7", slow: "#FFA51F", stop: "#C4262E", stopLine: "#FF6B5E", unknown: "#FF6B5E",
  stale: "#8A949E", halo: "#0B0F13",
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

/** A "/" hatch, 3 px strokes at 12 px pitch, for a canvas drawn at `dpr` device pixels per pixel. */
export function hatch(g, colour, dpr, alpha = 0.8) {
  const key = `${colour} ${dpr} ${alpha}`;
  let pattern = tiles.get(key);
  if (!pattern) {
    const side = Math.round(12 * Math.SQRT2 * dpr); // so that the strokes lie 12 px apart, measured across
    const tile = document.createElement("canvas");
    tile.width = tile.height = side;
    const t = tile.getContext("2d");
    t.strokeStyle = rgba(colour, alpha);
    t.lineWidth = 3 * dpr;
    t.beginPath();
    for (const shift of [-side, 0, side]) {
      t.moveTo(shift - side, 2 * side);
      t.lineTo(shift + 2 * side, -side);
    }
    t.stroke();
    pattern = g.createPattern(tile, "repeat");
    pattern.setTransform(new DOMMatrix().scale(1 / dpr));
    tiles.set(key, pattern);
  }
  return pattern;
}
