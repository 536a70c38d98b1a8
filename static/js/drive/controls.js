// The dialog “Controls”: handing over, taking over, override, pause.

import { $, make, write } from "../words.js";
import { label, state } from "../state.js";
import { consoles, controllable, decision, driving, holds, method, remote, seat, supervisor } from "./driving.js";
import { lease, overrideReason, pause, setting } from "./asks.js";
import { openMapping } from "./editor.js";
import { still } from "./operator.js";

let others = "";

function answer(text, kind = "") {
  write($("controls-answer"), text);
  $("controls-answer").dataset.kind = kind;
}

export function openControls() {
  if (!controllable(state.own)) return;
  answer("");
  const dialog = $("controls");
  if (!dialog.open) dialog.show();
  update();
  (holds(state.own) ? $("hand-to") : $("take-why")).focus();
}

export function closeControls() {
  if ($("controls").open) $("controls").close();
}

function submit(form, field, need, act) {
  $(form).addEventListener("submit", (event) => {
    event.preventDefault();
    const text = $(field).value.trim();
    if (!text) return answer(need, "error");
    act(text);
    $(field).value = "";
    return undefined;
  });
}

export function startControls() {
  submit("hand-over", "hand-to", "To whom?", (to) => {
    lease("hand_over", { to });
    answer(`Offered to ${to}.`);
  });
  submit("take-over", "take-why", "Taking over needs a reason: it is recorded.", (reason) => {
    lease("take_over", { reason });
    answer("Asked to take over.");
  });
  submit("override-form", "override-why", "An override needs a reason: it is recorded.", (reason) => {
    overrideReason(reason);
    answer("Hold OVERRIDE or O to run; the dead-man as well.");
  });
  $("method").addEventListener("change", () => still() && setting({ method: $("method").value }));
  $("override-clear").addEventListener("click", () => overrideReason(""));
  $("release-more").addEventListener("click", () => lease("release"));
  $("pause").addEventListener("click", pause);
  $("mapping-more").addEventListener("click", openMapping);
  $("controls-close").addEventListener("click", closeControls);
}

function holderText() {
  const r = remote(state.own) ?? {};
  const refused = consoles()[state.own]?.refused;
  const who = r.holder ? `${label(state.own)} is driven by ${r.holder}` : `Nobody drives ${label(state.own)} remotely`;
  return `You are ${state.you?.who} (${state.you?.role}). ${who}${r.offered_to ? `, offered to ${r.offered_to}` : ""}.${refused ? ` Refused: ${refused}.` : ""}`;
}

const meters = (value) => (Number.isFinite(value) ? `${value.toFixed(2)} m` : "?");

/** The method is the server's word; which joints cannot stop within its distances is said below. */
function showMethod(mine) {
  $("method-row").hidden = $("method-note").hidden = !mine;
  if ($("method").value !== method()) $("method").value = method();
  if ($("method").disabled === still()) $("method").disabled = !still();
  const told = decision(state.own)?.method;
  const kept = told ? `p_u ${meters(told.upper)}, p_l ${meters(told.lower)}. ` : "";
  const lines = [`${kept}The limiter comes after it in any case.`, ...(told?.warnings ?? []).map((line) => `▲ ${line}`)];
  write($("method-note"), lines.join("\n"));
}

/** Ten times a second. */
export function update() {
  if (!$("controls").open) return;
  if (!controllable(state.own)) {
    closeControls();
    return;
  }
  const mine = holds(state.own);
  write($("controls-holder"), holderText());
  $("hand-over").hidden = !mine;
  $("take-over").hidden = mine || !remote(state.own)?.holder;
  $("override-form").hidden = !supervisor() || !mine;
  $("override-clear").hidden = !seat()?.override;
  showMethod(mine);
  for (const id of ["release-more", "pause"]) $(id).hidden = !mine;
  const names = [...new Set(Object.values(driving()?.seats ?? {}).filter((one) => one.role !== "viewer").map((one) => one.who))].filter((who) => who && who !== state.you?.who);
  if (names.join("\n") === others) return;
  others = names.join("\n");
  $("hand-list").replaceChildren(...names.map((who) => make("option", { value: who })));
}
