// Small helpers for text on the page. All data become text nodes, never markup.

export const $ = (id) => document.getElementById(id);

export function make(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "text") node.textContent = value;
    else if (name === "class") node.className = value;
    else node.setAttribute(name, value);
  }
  node.append(...children);
  return node;
}

/** An empty drawing of 48 by 48 for the shapes of glyphs.js. */
export function glyph(name) {
  const node = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  for (const [attribute, value] of [["viewBox", "0 0 48 48"], ["class", name], ["aria-hidden", "true"]]) node.setAttribute(attribute, value);
  return node;
}

/** Writes only what differs, so that an idle page stays idle. */
export function write(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

export function mark(node, name, value) {
  if (node.dataset[name] !== String(value)) node.dataset[name] = value;
}

/** Text whose digits change at most twice a second; a new `key` (a threshold crossed) shows at once. */
export function slowText(node) {
  let last = -Infinity;
  let lastKey;
  return (text, key = "") => {
    const now = performance.now();
    if (key === lastKey && now - last < 500) return;
    last = now;
    lastKey = key;
    write(node, text);
  };
}

/** A value held until it has moved by more than `band`, so that the last digit does not flicker. */
export function steady(band) {
  let held = NaN;
  return (value) => {
    if (!Number.isFinite(value) || !(Math.abs(value - held) <= band)) held = value;
    return held;
  };
}

/** "left:bucket/0" or "bucket/0" -> "bucket" */
export const partName = (body) => String(body ?? "").replace(/^[^:]*:/, "").replace(/\/\d+$/, "");
