// The page: what the user does becomes commands, and what the server says is shown.

import { Link } from "./link.js";
import { Camera } from "./camera.js";
import * as pointer from "./pointer.js";
import * as keys from "./keys.js";
import { Panel, CHANNELS } from "./panel.js";
import { Region } from "./region.js";
import { Scenes } from "./scenes.js";
import { recall, recallSettings, remember, rememberSetting } from "./store.js";

const MOST_PIXELS = 2_560_000;
// How long after its own input a page does not take the camera from the server.
const OWN = 600;
const SHOWN_TOASTS = 5000;

const $ = (id) => document.getElementById(id);
const canvas = $("viewport");
const context = canvas.getContext("2d", { alpha: false });
const parameters = new URLSearchParams(location.search);
const link = new Link(parameters.get("token") ?? "");
const camera = new Camera();

// Numbers of inputs rise also from one load of the page to the next: pictures of an earlier page are no answers.
function firstInput() {
  return Math.floor(Date.now() / 10) % 2 ** 31;
}

const state = { id: null, steering: false, view: null, scene: null, picked: null, phase: "idle", input: firstInput(), moved: -Infinity };
// When inputs were made whose pictures are not there yet, and what came of those that are: for the plot, and for measurements.
const waiting = [];
const measured = { latencies: [], pictures: 0, bytes: 0, first: null, opened: performance.now() };
window.vastlight = { measured, state, camera, open };

// Speaking to the server

function open(source) {
  measured.opened = performance.now();
  link.send({ do: "open", source });
}

function want(command) {
  if (!state.steering) return;
  link.send(command);
  if (KEPT.includes(command.do)) rememberSetting(command.do, command[command.do]);
}

// Settings that the browser keeps are offered to a server that has its defaults still.
const KEPT = ["tone", "render", "channel"];
let defaults = null;

function offerSettings(view) {
  const isDefault = defaults && KEPT.every((name) => same(view[name], defaults[name]));
  const { tone, render, channel } = recallSettings();
  if (isDefault && tone) link.send({ do: "tone", tone: { ...view.tone, ...tone } });
  if (isDefault && render) {
    const { seed, spp } = view.render;
    link.send({ do: "render", render: { ...view.render, ...render, seed, spp: defaults.isChosen ? spp : (render.spp ?? spp) } });
  }
  if (isDefault && CHANNELS.some(([name]) => name === channel)) link.send({ do: "channel", channel });
  defaults = null;
}

// Whether two plain values are alike, whatever the order of their fields.
function same(a, b) {
  if (typeof a !== "object") return a === b;
  return Object.keys(a).every((key) => same(a[key], b[key]));
}

let cameraIsDue = false;

// The camera was moved here: it is sent once a frame of the screen.
function moved() {
  if (!state.steering) return adopt();
  state.moved = performance.now();
  state.input += 1;
  waiting.push({ input: state.input, at: state.moved });
  if (cameraIsDue) return;
  cameraIsDue = true;
  requestAnimationFrame(() => {
    cameraIsDue = false;
    link.send({ do: "camera", camera: camera.plain(), input: state.input });
    panel.showCamera(camera);
    setHash();
  });
}

// Takes the camera of the server, but not while the user moves it.
function adopt() {
  if (!state.view || performance.now() - state.moved < OWN) return;
  camera.set(state.view.camera);
  panel.showCamera(camera);
}

// The camera in the address

let hashTimer = 0;

function setHash() {
  clearTimeout(hashTimer);
  hashTimer = setTimeout(() => {
    const hash = new URLSearchParams({ scene: state.scene?.source ?? "", camera: camera.toText() });
    history.replaceState(null, "", `${location.pathname}${location.search}#${hash}`);
  }, 300);
}

let hashIsNew = true;

function takeHash() {
  const hash = new URLSearchParams(location.hash.slice(1));
  const found = Camera.fromText(hash.get("camera"));
  if (hashIsNew && found && state.steering && hash.get("scene") === state.scene?.source) {
    camera.set(found);
    moved();
  }
  hashIsNew = false;
}

addEventListener("hashchange", () => {
  hashIsNew = true;
  takeHash();
});

// Telling the user

function toast(text, bad = false) {
  const line = document.createElement("p");
  line.textContent = text;
  if (bad) line.className = "bad";
  $("toasts").append(line);
  setTimeout(() => line.remove(), SHOWN_TOASTS);
}

let announced = "";

// For screen readers: only what is worth a sentence.
function announce(text) {
  if (text === announced) return;
  announced = text;
  $("live").textContent = text;
}

function showActivity(activity, text) {
  $("activity").dataset.activity = activity;
  $("activity").textContent = text;
}

async function copy(text, what) {
  try {
    await navigator.clipboard.writeText(text);
    toast(`${what} copied`);
  } catch {
    showText(what, text);
  }
}

function showText(title, text) {
  $("text-title").textContent = title;
  $("text-area").value = text;
  $("text-dialog").showModal();
  $("text-area").select();
}

let shareWanted = null;

function share(part, what) {
  shareWanted = { part, what };
  link.send({ do: "share" });
}

// Sizes

const frame = $("frame");

function sizeFor(choice) {
  const fixed = /^(\d+)x(\d+)$/.exec(choice);
  if (fixed) return { width: Number(fixed[1]), height: Number(fixed[2]) };
  const part = Number(choice.replace("fit-", "")) || 1;
  const ratio = Math.min(devicePixelRatio || 1, 2) * part;
  let [width, height] = [frame.clientWidth * ratio, frame.clientHeight * ratio];
  const shrink = Math.min(1, Math.sqrt(MOST_PIXELS / (width * height || 1)), 4096 / Math.max(width, height, 1));
  [width, height] = [width * shrink, height * shrink].map((x) => Math.max(16, Math.floor(x)));
  return { width, height };
}

let sizeTimer = 0;

function sendSize() {
  want({ do: "size", size: sizeFor(recall("size", "fit-1")) });
}

new ResizeObserver(() => {
  clearTimeout(sizeTimer);
  sizeTimer = setTimeout(sendSize, 120);
  if (state.view && !region.isOn) region.show(state.view.region);
}).observe(frame);

// The part of the canvas that the picture fills.
function pictureBox() {
  const box = canvas.getBoundingClientRect();
  const fit = Math.min(box.width / canvas.width, box.height / canvas.height);
  const [width, height] = [canvas.width * fit, canvas.height * fit];
  return { left: box.left + (box.width - width) / 2, top: box.top + (box.height - height) / 2, width, height };
}

const region = new Region(canvas, $("region"), {
  box: pictureBox,
  want: (rectangle) => want({ do: "region", region: rectangle }),
  drawing: (on) => panel.showRegion(state.view?.region ?? null, on),
});

function pick(clientX, clientY) {
  const box = pictureBox();
  const [x, y] = [(clientX - box.left) / box.width, (clientY - box.top) / box.height];
  if (x < 0 || x > 1 || y < 0 || y > 1) return;
  const outer = frame.getBoundingClientRect();
  const mark = $("crosshair");
  mark.style.left = `${clientX - outer.left}px`;
  mark.style.top = `${clientY - outer.top}px`;
  mark.hidden = false;
  setTimeout(() => (mark.hidden = true), 700);
  link.send({ do: "pick", x, y });
}

function pickMiddle() {
  const box = pictureBox();
  pick(box.left + box.width / 2, box.top + box.height / 2);
}

// Actions

function frameBox(bounds) {
  if (!bounds) return;
  camera.frame(bounds, canvas.width / canvas.height);
  moved();
}

const bookmarksKey = () => `bookmarks ${state.scene?.source ?? ""}`;

function showBookmarks() {
  panel.showBookmarks(recall(bookmarksKey(), []), goToBookmark, (i) => {
    remember(bookmarksKey(), recall(bookmarksKey(), []).toSpliced(i, 1));
    showBookmarks();
  });
}

function setBookmark(i) {
  const list = [...recall(bookmarksKey(), [])];
  const place = Math.min(i, list.length, 8);
  list[place] = { name: `View ${place + 1}`, camera: camera.plain() };
  remember(bookmarksKey(), list);
  showBookmarks();
  toast(`Bookmark ${place + 1} set`);
}

function goToBookmark(i) {
  const bookmark = recall(bookmarksKey(), [])[i];
  if (!bookmark) return toast(`There is no bookmark ${i + 1}`);
  camera.set(bookmark.camera);
  moved();
}

const dark = matchMedia("(prefers-color-scheme: dark)");

function showTheme() {
  document.documentElement.dataset.theme = recall("theme", dark.matches ? "dark" : "light");
}

function toggleTheme() {
  remember("theme", document.documentElement.dataset.theme === "light" ? "dark" : "light");
  showTheme();
}

function showPanel(shown) {
  document.body.classList.toggle("no-panel", !shown);
  $("panel-toggle").setAttribute("aria-expanded", String(shown));
}

function togglePanel() {
  const shown = document.body.classList.contains("no-panel");
  remember("panel", shown);
  showPanel(shown);
}

function save(kind) {
  const address = new URL(`snapshot.${kind}`, location.href);
  address.search = new URLSearchParams({ token: link.token });
  address.hash = "";
  const anchor = Object.assign(document.createElement("a"), { href: address, download: `picture.${kind}` });
  anchor.click();
}

const actions = {
  moved,
  help: () => $("help").open || $("help").showModal(),
  bookmark: (n, set) => (set ? setBookmark(n - 1) : goToBookmark(n - 1)),
  sceneCamera: (name = state.scene?.inventory.cameras[0]?.name) => {
    state.moved = -Infinity;
    if (name !== undefined) want({ do: "scene_camera", name });
  },
  frameSelection: () => (panel.object ? frameBox(panel.object.bounds()) : frameBox(state.scene?.inventory.bounds)),
  frameAll: () => frameBox(state.scene?.inventory.bounds),
  pickMiddle: () => (region.isOn ? region.takeMiddle() : pickMiddle()),
  carry: (x, y) => state.steering && panel.object !== null && panel.carry(camera.across(panel.object.now(), x, y)),
  region: () => state.steering && region.toggle(),
  clear: () => {
    if (region.isOn) return region.set(false);
    state.picked = null;
    panel.showPicked(null);
  },
  expose: (by) => state.view && want({ do: "tone", tone: { ...state.view.tone, exposure: state.view.tone.exposure + by } }),
  nextChannel: () => {
    const at = CHANNELS.findIndex(([name]) => name === state.view?.channel);
    want({ do: "channel", channel: CHANNELS[(at + 1) % CHANNELS.length][0] });
  },
  pause: () => state.view && want({ do: "pause", paused: !state.view.paused }),
  reset: () => want({ do: "reset" }),
  copyCommand: () => share("command", "Command line"),
  copyPython: () => share("python", "Python"),
  copyOverrides: () => share("overrides", "Changes"),
  play: () => $("timeline").hidden || setPlaying(playing === null),
  theme: toggleTheme,
  panel: togglePanel,
  speed: () => recall("speed", 0.6),
  fov: (fov) => {
    camera.fov = fov;
    moved();
  },
  addBookmark: () => setBookmark(recall(bookmarksKey(), []).length),
  copyLink: () => copy(location.href, "Link"),
  size: (choice) => {
    remember("size", choice);
    sendSize();
  },
  save,
};

const panel = new Panel($("panel"), want, actions);
const scenes = new Scenes(link, open);
pointer.listen(canvas, camera, { moved, clicked: pick, carried: actions.carry });
keys.listen(canvas, camera, actions);
keys.fillList($("key-list"));

for (const id of ["open-scenes", "welcome-open", "failed-open"]) $(id).addEventListener("click", () => scenes.show());
$("help-open").addEventListener("click", actions.help);
$("theme").addEventListener("click", toggleTheme);
$("panel-toggle").addEventListener("click", togglePanel);
$("pause").addEventListener("click", actions.pause);
$("take-over").addEventListener("click", () => link.send({ do: "steer" }));

dark.addEventListener("change", showTheme);
showTheme();
showPanel(recall("panel", innerWidth > 760));

// The timeline

let playing = null;

function setMoment(seconds) {
  $("moment").value = seconds;
  $("moment-text").textContent = `${seconds.toFixed(2)} s`;
  want({ do: "time", seconds });
}

function setPlaying(on) {
  $("play").setAttribute("aria-pressed", String(on));
  $("play").textContent = on ? "Stop" : "Play";
  playing = on ? { from: Number($("moment").value), at: performance.now() } : null;
}

// Played as fast as pictures come: the next moment is wanted when the last was shown.
function playOn() {
  if (!playing) return;
  const end = Number($("moment").max);
  setMoment((playing.from + (performance.now() - playing.at) / 1000) % end);
}

$("moment").addEventListener("input", () => setMoment(Number($("moment").value)));
$("play").addEventListener("click", actions.play);

// What the server says

function on(kind, act) {
  link.addEventListener(kind, ({ detail }) => act(detail));
}

on("hello", ({ id, defaults: known, spp_chosen: isChosen }) => {
  state.id = id;
  defaults = { ...known, isChosen };
  $("offline").hidden = true;
});

on("offline", ({ ended }) => {
  state.steering = false;
  panel.showSteering(false);
  $("offline").textContent = ended ? "The server has stopped. Waiting for it to come back." : "The connection is lost. Trying again.";
  $("offline").hidden = false;
  showActivity("offline", "offline");
});

on("closed", () => announce("The server has stopped."));

on("error", ({ what, place, hint }) => {
  const text = [place, what].filter(Boolean).join(": ") + (hint ? ` (${hint})` : "");
  toast(text, true);
});

on("share", (shared) => {
  if (!shareWanted) return;
  const { part, what } = shareWanted;
  shareWanted = null;
  if (!shared[part]) return toast(shared.notice || "Nothing was changed");
  copy(shared[part], what);
  if (part !== "python" && shared.notice) toast(shared.notice, true);
});

on("picked", (picked) => {
  state.picked = picked.object === null ? null : picked;
  panel.showPicked(picked);
  announce(state.picked ? `Picked ${picked.object || "an object"}, material ${picked.material?.name ?? "unknown"}` : "Nothing is there");
});

on("state", ({ view, steering, viewers }) => {
  const began = !state.steering && steering === state.id;
  state.view = view;
  state.steering = steering === state.id;
  panel.showView(view);
  panel.showRegion(view.region, region.isOn);
  if (!region.isOn) region.show(view.region);
  panel.showSteering(state.steering);
  $("pause").setAttribute("aria-pressed", String(view.paused));
  $("pause").textContent = view.paused ? "Go on" : "Pause";
  $("pause").disabled = !state.steering;
  $("take-over").hidden = state.steering;
  $("steer-state").hidden = viewers < 2 && state.steering;
  $("steer-state").textContent = state.steering ? `${viewers} watching` : "watching";
  adopt();
  if (began) {
    sendSize();
    offerSettings(view);
  }
});

on("scene", (scene) => {
  state.phase = scene.phase;
  $("welcome").hidden = scene.phase !== "idle";
  $("loading").hidden = scene.phase !== "loading";
  $("failed").hidden = scene.phase !== "failed";
  const acts = { idle: showIdle, loading: showLoading, failed: showFailed, ready: showReady };
  acts[scene.phase]?.(scene);
});

function showIdle() {
  showActivity("idle", "idle");
}

function showLoading({ source, step }) {
  state.scene = null;
  state.picked = null;
  panel.showPicked(null);
  measured.first = null;
  const text = step === "reading" ? `Reading ${source}` : "Building acceleration structures, preparing lights and textures";
  $("scene-name").textContent = source;
  $("loading-text").textContent = text;
  $("loading-bar").value = step === "reading" ? 1 : 2;
  showActivity("loading", "loading");
  announce(text);
}

function showFailed({ source, what, place, hint }) {
  $("scene-name").textContent = source;
  $("failed-what").textContent = [place, what].filter(Boolean).join(": ");
  $("failed-hint").textContent = hint;
  showActivity("failed", "failed");
}

function showReady(scene) {
  state.scene = scene;
  state.picked = null;
  state.moved = -Infinity;
  document.title = `${scene.source} – vastlight`;
  $("scene-name").textContent = scene.source;
  $("timeline").hidden = !scene.moves;
  $("moment").max = scene.duration ?? 10;
  panel.showScene(scene);
  showBookmarks();
  adopt();
  takeHash();
  announce(`${scene.source} is ready`);
}

on("status", (status) => {
  if (state.phase !== "ready") return;
  const part = Math.min(1, status.spp / status.target);
  $("progress").firstElementChild.style.width = `${part * 100}%`;
  $("progress").setAttribute("aria-valuenow", String(Math.round(part * 100)));
  const count = `${status.spp} / ${status.target} spp${state.view?.region ? ", region" : ""}`;
  const texts = { done: `${count}, done`, paused: `${count}, paused`, moving: "moving", refining: count };
  showActivity(status.activity, texts[status.activity]);
  panel.showStatus(status);
  if (status.activity === "done") announce(`The picture is complete, ${status.spp} samples`);
});

on("picture", ({ bitmap, full, input, bytes, number, isFinal, spp, size }) => {
  const changed = canvas.width !== full[0] || canvas.height !== full[1];
  if (changed) [canvas.width, canvas.height] = full;
  if (changed && !region.isOn) region.show(state.view?.region ?? null);
  context.imageSmoothingEnabled = size[0] < full[0];
  context.imageSmoothingQuality = "medium";
  context.drawImage(bitmap, 0, 0, full[0], full[1]);
  const now = performance.now();
  measured.pictures += 1;
  measured.bytes += bytes;
  measured.first ??= now;
  measured.last = { number, input, isFinal, spp, size, full, at: now };
  let latency = null;
  while (waiting.length > 0 && waiting[0].input <= input) {
    latency = now - waiting.shift().at;
    measured.latencies.push(latency);
  }
  if (latency !== null) panel.plots.latency.add(latency);
  playOn();
});
