// The keyboard: what keys do, in the viewport and everywhere, and the list of them.

const STEP = (5 * Math.PI) / 180;

// Keys that hold: while one is down the camera goes on.
const FLY = {
  KeyW: [0, 0, 1], KeyS: [0, 0, -1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyE: [0, 1, 0], KeyQ: [0, -1, 0],
};

const LIST = [
  ["Drag, arrow keys", "Orbit"],
  ["Shift + drag, middle drag, Shift + arrows", "Pan"],
  ["Right drag", "Look around"],
  ["Alt + drag, Alt + arrows", "Move the picked object"],
  ["Wheel, + and −", "Zoom"],
  ["W A S D, Q E", "Fly; with Shift faster"],
  ["One finger, two fingers", "Orbit; pan and zoom"],
  ["Click, Enter", "Pick an object; Enter picks in the middle"],
  ["F, Home", "Frame the selection; frame all"],
  ["0", "The scene's own camera"],
  ["1 to 9, Shift + 1 to 9", "Go to a bookmark; set it"],
  ["[ and ]", "Exposure down and up by a quarter stop"],
  ["V", "Next output: light, albedo, normals, ..."],
  ["Space", "Pause or go on"],
  ["B", "Refine a region: draw it, or Enter for the middle; B again for all"],
  ["R", "Begin the picture anew"],
  ["C, P", "Copy the command line; copy as Python"],
  ["L", "Play or stop the timeline"],
  ["T, H", "Dark or light; show or hide the panel"],
  ["Escape", "Clear the selection; close a window"],
  ["?", "This list"],
];

export function fillList(list) {
  for (const [keys, what] of LIST) {
    const dt = document.createElement("dt");
    const dd = document.createElement("dd");
    dt.textContent = keys;
    dd.textContent = what;
    list.append(dt, dd);
  }
}

export function listen(canvas, camera, actions) {
  const held = new Set();
  let last = 0;

  // Keys of fields and windows are theirs; buttons have two.
  const isTaken = ({ target, key, ctrlKey, metaKey, altKey }) =>
    ctrlKey || metaKey || altKey || target.closest("input, select, textarea, dialog") !== null ||
    ((key === "Enter" || key === " ") && target.closest("button, summary, a") !== null);

  const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

  // Moves the picked object; says whether there is one.
  function carries({ altKey, key, target }) {
    const arrow = altKey && !target.closest("input, select, textarea, dialog") && ARROWS[key];
    return arrow && actions.carry(arrow[0] * 0.02, arrow[1] * 0.02);
  }

  document.addEventListener("keydown", (event) => {
    if (carries(event)) return event.preventDefault();
    if (isTaken(event)) return;
    const digit = /^Digit([0-9])$/.exec(event.code);
    if (event.key === "?") actions.help();
    else if (digit && digit[1] !== "0") actions.bookmark(Number(digit[1]), event.shiftKey);
    else if (digit) actions.sceneCamera();
    else if (FLY[event.code]) hold(event);
    else if (!named(event)) return;
    event.preventDefault();
  });

  function named(event) {
    const arrow = ARROWS[event.key];
    if (arrow && event.shiftKey) camera.pan(arrow[0] * 0.05, arrow[1] * 0.05);
    else if (arrow) camera.orbit(arrow[0] * STEP, -arrow[1] * STEP);
    else if (event.key === "+" || event.key === "=") camera.dolly(1 / 1.1);
    else if (event.key === "-") camera.dolly(1.1);
    else return act(event);
    actions.moved();
    return true;
  }

  function act(event) {
    const others = {
      f: actions.frameSelection, Home: actions.frameAll, Enter: actions.pickMiddle, Escape: actions.clear,
      "[": () => actions.expose(-0.25), "]": () => actions.expose(0.25), v: actions.nextChannel, " ": actions.pause,
      b: actions.region, r: actions.reset, c: actions.copyCommand, p: actions.copyPython, l: actions.play, t: actions.theme, h: actions.panel,
    };
    const action = others[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return false;
    action();
    return true;
  }

  function hold(event) {
    if (held.size === 0) {
      last = performance.now();
      requestAnimationFrame(fly);
    }
    held.add(event.code);
  }

  function fly(now) {
    if (held.size === 0) return;
    const secs = Math.min((now - last) / 1000, 0.1);
    last = now;
    const speed = camera.distance * actions.speed() * secs * (held.has("fast") ? 4 : 1);
    const way = [0, 0, 0];
    for (const code of held) FLY[code]?.forEach((x, i) => (way[i] += x * speed));
    camera.fly(way);
    actions.moved();
    requestAnimationFrame(fly);
  }

  document.addEventListener("keydown", (event) => {
    if (event.key === "Shift" && held.size > 0) held.add("fast");
  });
  document.addEventListener("keyup", (event) => {
    held.delete(event.key === "Shift" ? "fast" : event.code);
    if (held.size === 1) held.delete("fast");
  });
  addEventListener("blur", () => held.clear());
}
