// One picture over the scene: whose it is, how old it is, and when it is none to go by.

import { make, mark, slowText, write } from "../words.js";
import { seconds } from "../axis.js";
import { ageLevel } from "../head.js";
import { described, label } from "../state.js";
import { openPictures } from "./pictures.js";
import { openWhep } from "./whep.js";

const upper = (text) => text.charAt(0).toUpperCase() + text.slice(1);

/** side: "own" or "partner"; act: {next, enlarge, hide}, called with the side. */
export function slot(side, act) {
  const name = make("b", { class: "camera-name" });
  const age = make("span", { class: "age" });
  const next = make("button", { type: "button", class: "camera-next" });
  const size = make("button", { type: "button", class: "camera-size" });
  const hide = make("button", { type: "button", "aria-label": "Hide the pictures (C)", title: "Hide the pictures (C)", text: "×" });
  const canvas = make("canvas", { role: "img" });
  const video = make("video", { muted: "", playsinline: "", autoplay: "", disablepictureinpicture: "" });
  video.muted = true;
  const word = make("b"), why = make("span", { role: "status" });
  const veil = make("p", { class: "veil" }, word, why);
  const node = make("div", { class: "camera", id: `camera-${side}`, role: "group", hidden: "" },
    make("header", {}, name, age, next, size, hide), canvas, video, veil);
  next.addEventListener("click", () => act.next(side));
  size.addEventListener("click", () => act.enlarge(side));
  hide.addEventListener("click", () => act.hide());
  const writeAge = slowText(age), writeWord = slowText(word);
  let feed = null, open = "";

  function close() {
    feed?.close();
    feed = null;
    open = "";
    node.hidden = true;
    canvas.width = canvas.width; // the next camera must not begin with this one's picture
  }

  /** The camera that is to be seen: a machine's, by its number there; null for none. */
  function show(machine, index, large) {
    const cameras = machine === null ? [] : described(machine)?.cameras ?? [];
    const camera = cameras[index];
    if (!camera) {
      if (open) close();
      return;
    }
    const key = `${machine} ${index} ${camera.kind} ${camera.url ?? ""}`;
    if (key !== open) {
      close();
      open = key;
      node.hidden = false;
      const whep = camera.kind === "whep";
      canvas.hidden = whep;
      video.hidden = !whep;
      feed = whep ? openWhep(camera.url, video) : openPictures(machine, index, canvas);
    }
    const title = `${label(machine)} ${camera.label || "camera"}`.trim();
    write(name, title);
    next.hidden = cameras.length < 2;
    write(next, `${index + 1}/${cameras.length}`);
    next.title = "Next camera of this machine";
    next.setAttribute("aria-label", `Camera ${index + 1} of ${cameras.length}: the next`);
    write(size, large ? "▁" : "⤢");
    size.setAttribute("aria-label", large ? "Picture small" : "Picture large");
    size.title = large ? "Small, in the corner" : "Large, in the place of the scene";
    size.setAttribute("aria-pressed", String(large));
    mark(node, "large", large ? 1 : 0);
    ages(title);
  }

  function ages(title) {
    const old = feed.taken === null ? Infinity : Math.max(0, (performance.now() - feed.taken) / 1000);
    const level = ageLevel(old);
    const lost = level === "stale";
    const text = !Number.isFinite(old) ? "no picture" : feed.by === "capture" ? `${seconds(old)} old` : `came ${seconds(old)} ago`;
    writeAge(text, `${level}${feed.by}`);
    age.title = feed.by === "capture" ? "Since the picture was taken" : "Since the picture arrived: this camera does not say when it was taken";
    const name = `age ${level}`;
    if (age.className !== name) age.className = name;
    veil.hidden = !lost;
    if (lost) {
      writeWord(Number.isFinite(old) ? `UNKNOWN · no picture for ${seconds(old)}` : "No picture yet", title);
      write(why, feed.trouble ? `${upper(feed.trouble)}. Trying again.` : "");
    }
    mark(node, "state", lost ? (feed.taken === null ? "none" : "lost") : level);
    mark(node, "count", feed.count);
    mark(node, "by", feed.by);
    canvas.setAttribute("aria-label", `Camera: ${title}, ${text}`);
    video.setAttribute("aria-label", `Camera: ${title}, ${text}`);
  }

  return { node, show, close };
}
