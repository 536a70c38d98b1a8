// Operating or analysis layout, kept for each operator in this browser, and full screen.

import { $, make, mark } from "./words.js";
import { state } from "./state.js";

const LAYOUTS = ["operate", "analyse"];
const WORDS = { operate: "Analyse", analyse: "Operate" };
const key = () => `layout ${state.you?.who ?? ""}`;

let who = null, redraw = () => {};
let button = null;

const current = () => document.body.dataset.layout ?? LAYOUTS[0];

function show(layout) {
  mark(document.body, "layout", layout);
  button.textContent = WORDS[layout];
  button.title = layout === "operate" ? "Images large, scene small (V)" : "Scene large, images beside it (V)";
  redraw();
}

export function toggleLayout() {
  const next = LAYOUTS[(LAYOUTS.indexOf(current()) + 1) % LAYOUTS.length];
  show(next);
  try {
    localStorage.setItem(key(), next);
  } catch {
    // this browser keeps nothing
  }
}

export function toggleFullScreen() {
  if (document.fullscreenElement) document.exitFullscreen();
  else document.documentElement.requestFullscreen?.().catch(() => {}); // the browser may refuse
}

/** draw: called when panels changed their sizes. */
export function startLayout(draw) {
  redraw = draw;
  button = make("button", { type: "button", id: "layout" });
  button.addEventListener("click", toggleLayout);
  const full = make("button", { type: "button", id: "full-screen", text: "Full", title: "Full screen (F)" });
  full.addEventListener("click", toggleFullScreen);
  $("layout-tools").replaceChildren(button, full);
  show(LAYOUTS[0]);
}

/** Once it is known who sits here: the layout that they left. */
export function recall() {
  if (state.you?.who === who) return;
  who = state.you?.who;
  let kept = null;
  try {
    kept = localStorage.getItem(key());
  } catch {
    // this browser keeps nothing
  }
  if (LAYOUTS.includes(kept)) show(kept);
}
