// Wires the page: frames into the state, the state onto the panels, each at its own pace.

import { connect } from "./socket.js";
import { readSizes } from "./theme.js";
import { $ } from "./words.js";
import { accept, choose, exactImage, far, image, imageAge, imageStale, label, link, names, replaying, silence, snapshotAge, state } from "./state.js";
import { head } from "./head.js";
import * as hover from "./hover.js";
import * as alarm from "./alarm.js";
import * as topbar from "./topbar.js";
import * as demo from "./demo.js";
import { leaveIfSignedOut } from "./signed_out.js";
import { startSound, toggleSound } from "./sound.js";
import * as ghost from "./ghost.js";
import * as tip from "./tip.js";
import * as headers from "./headers.js";
import { next, shown } from "./view.js";
import { beginScene, page, startScene, updateCameras } from "./scene.js";
import { plan } from "./plots/plan.js";
import { reach } from "./plots/reach.js";
import { slices } from "./plots/slices.js";
import { bars } from "./plots/bars.js";
import { limits } from "./plots/limits.js";
import { trends } from "./plots/trends.js";
import * as along from "./plots/along.js";
import * as people from "./plots/people.js";
import * as status from "./people/status.js";
import * as stages from "./people/stages.js";
import { timeline } from "./plots/timeline.js";
import * as player from "./player.js";
import * as session from "./session.js";
import * as sheets from "./sheets.js";
import * as transport from "./transport.js";
import * as recording from "./recording.js";
import { recall, startLayout, toggleFullScreen, toggleLayout } from "./layout.js";
import { startCameras, toggleCameras, toggleMachines, update as updatePictures } from "./cameras/cameras.js";
import * as watermark from "./watermark.js";
import { startSeries } from "./series_pointer.js";
import { sessionKey } from "./keys.js";
import * as drive from "./drive/start.js";
import * as gauge from "./gauge/panel.js";
import * as useCases from "./use_cases/panel.js";
import * as trajectory from "./trajectory/panel.js";
import * as surmount from "./surmount/panel.js";

readSizes();

const plots = { plan: plan(), reach: reach(), bars: bars(), limits: limits(), trends: trends(), timeline: timeline() };
const three = slices();
const images = [plots.reach, ...three];
const live = [plots.plan, plots.bars, plots.limits, plots.trends, plots.timeline];
// The least time between two drawings [ms].
const PERIOD = new Map([[plots.plan, 38], [plots.bars, 95], [plots.limits, 95], [plots.trends, 240], [plots.timeline, 240], ...images.map((s) => [s, 90])]);
for (const s of [...live, ...images]) hover.watch(s);

const heads = Object.fromEntries(["scene", "plan", "reach", "bars", "limits", "trends", "timeline", "slice-0", "slice-1", "slice-2"].map((name) => [name, head($(`${name}-panel`))]));

let waitingToDraw = null; // wall clock of the newest snapshot not drawn yet
const latency = { arrival: [], drawn: [], first: null }; // from the snapshot's wall clock [ms]
const push = (list, value) => {
  list.push(value);
  if (list.length > 500) list.shift();
};
const quantiles = (list) => {
  const sorted = [...list].sort((a, b) => a - b);
  const at = (q) => (sorted.length ? Math.round(sorted[Math.min(sorted.length - 1, Math.floor(q * sorted.length))] * 10) / 10 : null);
  return { last: list[list.length - 1] ?? null, p50: at(0.5), p95: at(0.95), p99: at(0.99), count: list.length };
};

function own(name) {
  drive.chosen(name);
  if (!choose(name)) return;
  sessionStorage.setItem("own", name);
  socket.send({ type: "own", machine: name, page });
  ghost.unpin();
  redraw();
}

function redraw() {
  for (const s of [...live, ...images]) Object.assign(s, { dirty: true, last: -Infinity });
  tip.update();
  headers.update();
}

/** Exact images, Sun's, or both over each other. */
function switchImages() {
  next();
  redraw();
}

function onKey(event) {
  if (event.ctrlKey || event.altKey || event.metaKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target?.tagName ?? "")) return;
  if (drive.driveKey(event)) event.stopPropagation();
  else if (gauge.drawKey(event)) event.stopPropagation();
  else if (event.key >= "1" && event.key <= "9") own(names()[Number(event.key) - 1]);
  else if (event.key === "?") help();
  else if (event.key === "a" || event.key === "A") alarm.silenceAlarms();
  else if (event.key === "m" || event.key === "M") toggleSound();
  else if (event.key === "x" || event.key === "X") switchImages();
  else if (event.key === "t" || event.key === "T") plots.plan.turning();
  else if (event.key === "z" || event.key === "Z") plots.plan.around();
  else if (event.key === "v" || event.key === "V") toggleLayout();
  else if (event.key === "f" || event.key === "F") toggleFullScreen();
  else if (event.key === "c" || event.key === "C") toggleCameras();
  else if (event.key === "u" || event.key === "U") surmount.toggleSurmount(trajectory.closeTrajectory);
  else if (event.key === "b" || event.key === "B") toggleMachines();
  else if (sessionKey(event)) event.stopPropagation(); // the scene's own keys would turn its camera
  else if (event.key === "Escape") {
    sheets.close();
    recording.closeRecording();
    drive.closeDialogs();
    gauge.closeGauge();
    useCases.closeUseCases();
    trajectory.closeTrajectory();
    surmount.closeSurmount();
    hover.hide();
    ghost.unpin();
    alarm.showList(false);
    $("help").close();
  } else return;
  event.preventDefault();
}

function help() {
  const dialog = $("help");
  if (dialog.open) dialog.close();
  else dialog.show(); // not modal: the alarm line below stays in sight and in reach
}

state.own = sessionStorage.getItem("own") ?? undefined;
topbar.startTopbar(own);
startSound();
demo.startDemo(drive.request);
startScene({ keydown: onKey, ...drive.sceneListeners });
document.addEventListener("keydown", onKey);
document.addEventListener("keyup", drive.onKeyUp);
$("help-open").addEventListener("click", help);
startLayout(resized);
startCameras();
function resized() {
  readSizes();
  for (const s of PERIOD.keys()) s.dirty = true;
}
addEventListener("resize", resized);

const scheme = location.protocol === "https:" ? "wss:" : "ws:";
const socket = connect(`${scheme}//${location.host}/ws`, onFrame, (word) => {
  state.socket = word;
  if (word === "open") session.reconnected();
  if (word === "closed") leaveIfSignedOut();
});
alarm.startAlarm(socket.send);
tip.startTip(socket.send);
ghost.startGhost(socket.send, redraw);
headers.startHeaders(switchImages);
player.startPlayer(socket.send);
transport.startTransport();
recording.startRecording();
startSeries(plots.trends);
const redrawTrends = () => Object.assign(plots.trends, { dirty: true, last: -Infinity });
along.startAlong(socket.send, redrawTrends);
people.startPeople(redrawTrends);
status.startStatus();
stages.startStages(socket.send);
gauge.startGauge();
const figures = useCases.startUseCases(socket.send, gauge.closeGauge);
for (const s of figures) {
  hover.watch(s);
  PERIOD.set(s, 90);
}
const planAnew = () => { plots.plan.dirty = true; };
for (const s of [...trajectory.startTrajectory(socket.send, planAnew, surmount.closeSurmount), ...surmount.startSurmount(socket.send, planAnew, trajectory.closeTrajectory)]) {
  hover.watch(s);
  PERIOD.set(s, 90);
}
drive.startDriving(socket.send);

function onFrame(header, arrays) {
  const { partner, snapshot: before } = state;
  accept(header, arrays);
  if (header.type === "site") {
    gauge.forget();
    updateCameras(socket.send);
    socket.send({ type: "own", machine: state.own, page });
    tip.resend();
    for (const s of [...live, ...images]) s.dirty = true;
  } else if (header.type === "snapshot") {
    drive.seen();
    recall();
    push(latency.arrival, Date.now() - 1000 * header.wall);
    waitingToDraw = header.wall;
    for (const s of live) s.dirty = true;
    // After a jump an image can be right again that was of another time.
    if (partner !== state.partner || (replaying() && before?.time !== header.time)) for (const s of images) s.dirty = true;
  } else if (header.type === "along") {
    plots.trends.dirty = true;
  } else if (header.type === "exact" || header.partner === null ? header.own === state.own : header.key === `${state.own}<-${state.partner}`) {
    for (const s of replaying() ? [...images, plots.bars, plots.plan] : images) s.dirty = true;
  }
}

/** Words, ages and levels: ten times a second whether or not anything arrives. */
function tick() {
  watermark.update();
  session.refresh();
  transport.update();
  along.update();
  people.update();
  status.update();
  stages.update();
  sheets.update();
  recording.update();
  drive.update();
  alarm.update();
  topbar.update();
  demo.update();
  updateCameras(socket.send);
  updatePictures();
  const subject = `${label(state.own)}`;
  const age = snapshotAge();
  const present = shown() === "sun" ? image() : exactImage();
  const old = imageAge(present);
  heads.scene.who(state.site ? `${names().length} machines` : "");
  heads.plan.who(`${subject}`);
  heads.reach.who(subject);
  for (const name of ["bars", "limits"]) heads[name].who(subject);
  heads.trends.who(state.partner && !along.shown() && !people.shown() ? `${subject} ↔ ${label(state.partner)}` : subject);
  for (const name of ["scene", "plan", "bars", "limits", "trends", "timeline"]) heads[name].age(age);
  const forced = Boolean(present) && imageStale(present);
  for (const name of ["reach", "slice-0", "slice-1", "slice-2"]) heads[name].age(present || far() === null ? old : age, forced);
  // Ages and hollow stars must go on while nothing arrives.
  if (old > 0.5 || forced || far() !== null) for (const s of images) s.dirty = true;
  if (link() !== "ok" && state.snapshot) for (const s of live) s.dirty = true;
  headers.update();
  gauge.update();
  useCases.update();
  trajectory.update();
  surmount.update();
  ghost.age();
  hover.refresh();
}

function frame(now) {
  requestAnimationFrame(frame);
  let drawn = false;
  for (const [s, period] of PERIOD) {
    // A picture that only grows old needs no more than two drawings a second.
    const slow = s !== plots.plan && silence() > 1 ? 500 : s === plots.timeline && replaying() ? 45 : period;
    if (s.draw(now, slow) && s === plots.plan) drawn = true;
  }
  if (drawn && waitingToDraw !== null) {
    const age = Date.now() - 1000 * waitingToDraw;
    push(latency.drawn, age);
    latency.first ??= { after: performance.now(), age };
    beginScene();
    waitingToDraw = null;
    if ((image() || exactImage() || far() !== null || names().length < 2) && document.body.dataset.ready !== "1") document.body.dataset.ready = "1";
  }
}

setInterval(tick, 100);
tick();
requestAnimationFrame(frame);

// For tests and for the curious: what the page knows, to read.
window.cockpit = Object.freeze({
  get state() { return state; },
  get latency() { return { arrival: quantiles(latency.arrival), drawn: quantiles(latency.drawn), first: latency.first }; },
  get link() { return link(); },
  get ages() { return { snapshot: snapshotAge() }; },
  get rejected() { return socket.rejected(); },
  get paint() { return Object.fromEntries([...PERIOD.keys()].map((s) => [s.canvas.id, Math.round(s.cost * 100) / 100])); },
});
