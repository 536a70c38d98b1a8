// The embedded 3D scene and its camera buttons. The page's keys work inside the frame, too.

import { $, make } from "./words.js";
import { label, names, state } from "./state.js";

let built = "";

/** This window's own scene: its camera must not follow another operator's buttons. */
export const page = Array.from(crypto.getRandomValues(new Uint8Array(12)), (byte) => byte.toString(16).padStart(2, "0")).join("");

/**
 * `listeners`: by type of event, for the window of the scene. Its program is large and shares the
 * page's thread: it comes with beginScene(), or by itself where no picture ever does.
 */
export function startScene(listeners) {
  const frame = $("scene");
  frame.addEventListener("load", () => {
    try {
      for (const [type, listener] of Object.entries(listeners)) frame.contentWindow.addEventListener(type, listener, true);
    } catch {
      // another origin: the keys then work outside the scene only
    }
  });
  setTimeout(beginScene, 2000);
}

/** Once the first snapshot is on the page: distances and alarms do not wait for the 3D scene. */
export function beginScene() {
  const frame = $("scene");
  if (!frame.getAttribute("src")) frame.src = `/view/${page}/?hideViserLogo&darkMode`;
}

export function updateCameras(send) {
  const key = `${names().join(" ")} ${state.own}`;
  if (key === built || !state.site) return;
  built = key;
  const cameras = [["site", "Site"], ["plan", "Plan"], [`behind ${label(state.own)}`, "Behind"], ["follow", "Follow"], ["joints", "Joints"]];
  $("cameras").replaceChildren(...cameras.map(([name, text]) => {
    const button = make("button", { type: "button", title: name === "joints" ? "The joint space of the own machine: boom, stick and bucket" : `Camera: ${name}`, text });
    button.addEventListener("click", () => send({ type: "camera", name, page }));
    return button;
  }));
}
