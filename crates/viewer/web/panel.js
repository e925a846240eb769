// The panel: sections of controls. Each control shows the server's state, and tells what its user wants.

import { Placed } from "./object.js";
import { Plot, bytes } from "./plots.js";
import { recall, remember } from "./store.js";

let count = 0;

function make(tag, properties = {}, ...children) {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...children);
  return node;
}

function section(name, open, ...rows) {
  const body = make("div", { className: "body" }, ...rows);
  const details = make("details", { open: recall("open", {})[name] ?? open }, make("summary", { textContent: name }), body);
  details.addEventListener("toggle", () => remember("open", { ...recall("open", {}), [name]: details.open }));
  return details;
}

function row(label, control, ...others) {
  control.id ||= `control-${(count += 1)}`;
  const name = make("label", { textContent: label, htmlFor: control.id });
  return make("div", { className: others.length ? "row" : "row wide" }, name, control, ...others);
}

// A number with a slider beside it. The slider may run over another scale than the number.
function number(label, { min, max, step, digits = 2, curve = (x) => x, inverse = (x) => x, change }) {
  const slider = make("input", { type: "range", min: inverse(min), max: inverse(max), step: (inverse(max) - inverse(min)) / 400 });
  const field = make("input", { type: "number", min, max, step });
  field.setAttribute("aria-label", `${label}, number`);
  let shown = NaN;
  const show = (value) => {
    shown = value;
    if (document.activeElement !== field) field.value = Number(value.toFixed(digits));
    if (document.activeElement !== slider || Math.abs(curve(Number(slider.value)) - value) > step) slider.value = inverse(value);
    slider.setAttribute("aria-valuetext", String(Number(value.toFixed(digits))));
  };
  const want = (value) => {
    if (!Number.isFinite(value)) return;
    const near = Math.min(max, Math.max(min, Number((Math.round(value / step) * step).toFixed(6))));
    if (near === shown) return;
    show(near);
    change(near);
  };
  slider.addEventListener("input", () => want(curve(Number(slider.value))));
  field.addEventListener("change", () => want(Number(field.value)));
  return { root: row(label, slider, field), show, inputs: [slider, field] };
}

// Three numbers in a row, for the axes of the world.
function triple(label, { step, digits, change }) {
  const fields = ["x", "y", "z"].map((axis) => {
    const field = make("input", { type: "number", step });
    field.setAttribute("aria-label", `${label} ${axis}`);
    return field;
  });
  fields.forEach((field, i) => field.addEventListener("input", () => {
    if (field.value !== "" && Number.isFinite(field.valueAsNumber)) change(i, field.valueAsNumber);
  }));
  const show = (values, other = digits) => fields.forEach((field, i) => {
    if (document.activeElement !== field) field.value = Number(values[i].toFixed(other));
  });
  const name = make("span", { textContent: label, className: "name" });
  name.setAttribute("aria-hidden", "true");
  return { root: make("div", { className: "row three" }, name, ...fields), show, inputs: fields };
}

function choice(label, options, change) {
  const select = make("select");
  select.addEventListener("change", () => change(select.value));
  const fill = (list) => {
    const value = select.value;
    select.replaceChildren(...list.map(([key, text]) => make("option", { value: key, textContent: text })));
    select.value = value;
  };
  fill(options);
  return { root: row(label, select), fill, show: (value) => (select.value = value), inputs: [select], select };
}

function check(label, change) {
  const box = make("input", { type: "checkbox" });
  box.addEventListener("change", () => change(box.checked));
  return { root: row(label, box), show: (value) => (box.checked = value), inputs: [box] };
}

function button(text, act, title = "") {
  const node = make("button", { type: "button", textContent: text, title });
  node.addEventListener("click", act);
  return node;
}

export const CHANNELS = [
  ["beauty", "Light"], ["albedo", "Albedo"], ["normal", "Normals"], ["depth", "Depth"],
  ["object", "Objects"], ["material", "Materials"], ["alpha", "Coverage"],
  ["steps", "Steps"], ["samples", "Samples"], ["non_finite", "Not finite"],
];

function channels(change) {
  const inputs = CHANNELS.map(([value]) => make("input", { type: "radio", name: "channel", value }));
  const labels = inputs.map((input, i) => make("label", {}, input, make("span", { textContent: CHANNELS[i][1] })));
  inputs.forEach((input) => input.addEventListener("change", () => change(input.value)));
  const legend = make("legend", { textContent: "Output", className: "visually-hidden" });
  const root = make("fieldset", {}, legend, make("div", { className: "choices" }, ...labels));
  return { root, show: (value) => inputs.forEach((input) => (input.checked = input.value === value)), inputs };
}

function facts() {
  const root = make("dl", { className: "facts" });
  const show = (pairs) => {
    const rows = pairs.filter(([, value]) => value !== null && value !== undefined && value !== "");
    root.replaceChildren(...rows.flatMap(([key, value]) => [make("dt", { textContent: key }), make("dd", { textContent: value })]));
  };
  return { root, show };
}

const hex = (color) => `#${color.map((x) => Math.round(encode(Math.min(Math.max(x, 0), 1)) * 255).toString(16).padStart(2, "0")).join("")}`;
const unhex = (text) => [1, 3, 5].map((i) => Number(decode(parseInt(text.slice(i, i + 2), 16) / 255).toFixed(6)));
const encode = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
const decode = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);

const vector = (v) => v.map((x) => Number(x.toPrecision(4))).join(", ");
const log = { curve: (x) => 10 ** x, inverse: (x) => Math.log10(x) };

export const SIZES = [
  ["fit-1", "Fit the window"], ["fit-0.5", "Half of the window"], ["640x360", "640 × 360"], ["1280x720", "1280 × 720"], ["1920x1080", "1920 × 1080"],
];

export class Panel {
  constructor(root, want, act) {
    this.want = want;
    this.act = act;
    this.materials = new Map();
    this.lights = new Map();
    this.edits = {};
    this.object = null;
    [this.sent, this.seen] = [[], null];
    root.append(...this.#sections());
  }

  #sections() {
    const { want, act } = this;
    this.camera = choice("Camera", [["", "Free"]], (name) => name && act.sceneCamera(name));
    this.fov = number("Angle of view", { min: 5, max: 120, step: 0.5, digits: 1, change: act.fov });
    this.speed = number("Flying speed", { min: 0.05, max: 5, step: 0.05, ...log, change: (speed) => remember("speed", speed) });
    this.speed.show(recall("speed", act.speed()));
    this.place = facts();
    this.bookmarks = make("ul", { className: "bookmarks" });
    const cameraButtons = make("div", { className: "buttons" },
      button("Frame selection", act.frameSelection, "F"), button("Frame all", act.frameAll, "Home"),
      button("Add bookmark", act.addBookmark), button("Copy link", act.copyLink));

    this.exposure = number("Exposure", { min: -10, max: 10, step: 0.05, change: (exposure) => this.#tone({ exposure }) });
    this.curve = choice("Tone curve", [["filmic", "Filmic"], ["reinhard", "Reinhard"], ["linear", "Linear"]], (curve) => this.#tone({ curve }));
    this.rotation = number("Turn the sky", { min: -180, max: 180, step: 1, digits: 0, change: (rotation) => this.#environment({ rotation }) });
    this.strength = number("Sky strength", { min: 0.01, max: 100, step: 0.01, ...log, change: (strength) => this.#environment({ strength }) });
    this.light = choice("Light", [], () => this.#showLight());
    this.lightScale = number("Brightness", { min: 0.01, max: 100, step: 0.01, ...log,
      change: (scale) => want({ do: "light", name: this.light.select.value, edit: { scale } }) });
    this.lightRows = make("div", { className: "group" }, this.light.root, this.lightScale.root);

    this.integrator = choice("Integrator", [["path", "Path tracing"], ["direct", "Direct light"], ["ao", "Ambient occlusion"], ["primary", "First surface"]],
      (integrator) => this.#render({ integrator }));
    this.depth = number("Depth", { min: 1, max: 64, step: 1, digits: 0, change: (max_depth) => this.#render({ max_depth }) });
    this.spp = number("Samples", { min: 1, max: 16384, step: 1, digits: 0, ...log, change: (spp) => this.#render({ spp }) });
    this.seed = number("Seed", { min: 0, max: 999, step: 1, digits: 0, change: (seed) => this.#render({ seed }) });
    this.caustics = check("Caustics", (caustics) => this.#render({ caustics }));
    this.size = choice("Resolution", SIZES, act.size);
    this.size.show(recall("size", "fit-1"));
    this.region = button("Refine a region", act.region, "B");
    this.region.setAttribute("aria-pressed", "false");
    const renderButtons = make("div", { className: "buttons" }, this.region, button("Begin anew", () => want({ do: "reset" }), "R"));

    this.channel = channels((channel) => want({ do: "channel", channel }));

    this.picked = facts();
    this.material = choice("Material", [], () => this.#showMaterial());
    this.color = make("input", { type: "color" });
    this.color.addEventListener("input", () => this.#material({ base_color: unhex(this.color.value) }));
    this.roughness = number("Roughness", { min: 0, max: 1, step: 0.01, change: (roughness) => this.#material({ roughness }) });
    this.metallic = number("Metalness", { min: 0, max: 1, step: 0.01, change: (metallic) => this.#material({ metallic }) });
    this.move = triple("Move", { step: 0.1, digits: 3, change: (i, x) => this.#arrange("move", i, x) });
    this.turn = triple("Turn °", { step: 5, digits: 2, change: (i, x) => this.#arrange("turn", i, x) });
    this.scale = triple("Scale", { step: 0.05, digits: 3, change: (i, x) => x !== 0 && this.#arrange("scale", i, x) });
    this.even = check("Scale evenly", () => {});
    this.even.show(true);
    this.putBack = button("Put it back", () => {
      this.object?.take(null);
      this.#sendPlace();
    });
    const axes = make("div", { className: "row three axes" }, ...["", "x", "y", "z"].map((textContent) => make("span", { textContent })));
    axes.setAttribute("aria-hidden", "true");
    this.objectRows = make("div", { className: "group" }, axes, this.move.root, this.turn.root, this.scale.root, this.even.root,
      make("div", { className: "buttons" }, this.putBack));
    this.objectRows.hidden = true;
    this.revert = button("Undo all changes", () => want({ do: "revert" }));
    this.picked.show([["Object", "Click into the picture."]]);

    this.plots = {
      rays: new Plot("Rays", (x) => `${x.toFixed(2)} M/s`),
      latency: new Plot("Input to picture", (x) => `${x.toFixed(0)} ms`),
      memory: new Plot("Memory", bytes),
    };
    this.figures = facts();

    const share = make("div", { className: "buttons" },
      button("Save PNG", () => act.save("png")), button("Save EXR", () => act.save("exr")),
      button("Copy command line", act.copyCommand, "C"), button("Copy as Python", act.copyPython, "P"),
      button("Copy changes", act.copyOverrides));
    this.about = facts();

    this.steered = [this.camera, this.fov, this.exposure, this.curve, this.rotation, this.strength, this.light, this.lightScale, this.integrator,
      this.depth, this.spp, this.seed, this.caustics, this.channel, this.material, this.roughness, this.metallic, this.move, this.turn, this.scale,
      this.even, { inputs: [this.color, this.revert, this.putBack, this.region] }]
      .flatMap(({ inputs }) => inputs);
    return [
      section("View", true, this.channel.root),
      section("Camera", true, this.camera.root, this.fov.root, this.speed.root, this.place.root, cameraButtons, this.bookmarks),
      section("Light & tone", true, this.exposure.root, this.curve.root, this.rotation.root, this.strength.root, this.lightRows),
      section("Render", true, this.integrator.root, this.depth.root, this.spp.root, this.seed.root, this.caustics.root, this.size.root, renderButtons),
      section("Selection", true, this.picked.root, this.objectRows, this.material.root, row("Base colour", this.color), this.roughness.root, this.metallic.root, this.revert),
      section("Memory & speed", true, ...Object.values(this.plots).map((plot) => plot.root), this.figures.root),
      section("Share", true, share),
      section("Scene", false, this.about.root),
    ];
  }

  #tone(change) {
    this.want({ do: "tone", tone: { ...this.view.tone, ...change } });
  }

  #render(change) {
    this.want({ do: "render", render: { ...this.view.render, ...change } });
  }

  #environment(change) {
    const edit = { rotation: 0, strength: 1, ...this.view.edits.environment, ...change };
    this.want({ do: "environment", edit });
  }

  #material(edit) {
    const name = this.material.select.value;
    if (this.materials.has(name)) this.want({ do: "material", name, edit });
  }

  showRegion(region, drawing) {
    this.region.setAttribute("aria-pressed", String(drawing || region !== null));
    this.region.textContent = drawing ? "Draw in the picture" : region ? "Refine all again" : "Refine a region";
  }

  // One number of the picked object's place.
  #arrange(part, i, x) {
    const { object } = this;
    if (!object) return;
    const ratio = x / object[part][i];
    if (part === "scale" && this.even.inputs[0].checked) object.scale = object.scale.map((old) => old * ratio);
    object[part][i] = x;
    this.#sendPlace();
  }

  // Moves the picked object; says whether there is one that may be moved.
  carry(by) {
    const { object } = this;
    if (!object || object.held) return false;
    object.move = object.move.map((x, i) => x + by[i]);
    this.#sendPlace();
    return true;
  }

  #sendPlace() {
    const { instance } = this.object;
    const place = this.object.place();
    this.sent.push(JSON.stringify(place));
    this.want({ do: "object", instance, place });
    this.#showPlace();
  }

  #showPlace() {
    const { object } = this;
    this.objectRows.hidden = !object || Boolean(object.held);
    if (this.objectRows.hidden) return;
    const digits = Math.max(0, 3 - Math.floor(Math.log10(object.size || 1)));
    for (const field of this.move.inputs) field.step = 10 ** (1 - digits);
    this.move.show(object.move, digits);
    this.turn.show(object.turn);
    this.scale.show(object.scale);
  }

  // Takes the place from the server, unless it is one that was sent from here and is on its way back.
  #takePlace() {
    if (this.object && this.view) {
      const place = this.view.objects[this.object.instance]?.map((row) => row.map(Math.fround)) ?? null;
      const text = JSON.stringify(place);
      const own = this.sent.indexOf(text);
      if (own >= 0) this.sent.splice(0, own + 1);
      else if (text !== this.seen) this.object.take(place);
      this.seen = text;
    }
    this.#showPlace();
  }

  #choose(picked) {
    // What was sent of the same object may be on its way back still.
    if (!picked || picked.instance !== this.object?.instance) {
      this.object = picked && new Placed(picked);
      [this.sent, this.seen] = [[], null];
    }
    this.#takePlace();
  }

  showSteering(steering) {
    for (const input of this.steered) input.disabled = !steering;
  }

  // The server's state.
  showView(view) {
    this.view = view;
    this.edits = view.edits;
    this.channel.show(view.channel);
    this.camera.show(view.camera.name ?? "");
    this.exposure.show(view.tone.exposure);
    this.curve.show(view.tone.curve);
    this.rotation.show(view.edits.environment?.rotation ?? 0);
    this.strength.show(view.edits.environment?.strength ?? 1);
    this.integrator.show(view.render.integrator);
    this.depth.show(view.render.max_depth);
    this.spp.show(view.render.spp);
    this.seed.show(view.render.seed);
    this.caustics.show(view.render.caustics);
    this.#takePlace();
    this.#showMaterial();
    this.#showLight();
  }

  showCamera(camera) {
    this.fov.show(camera.fov);
    this.place.show([["Eye", vector(camera.eye)], ["Target", vector(camera.target)]]);
  }

  showScene({ inventory }) {
    const { cameras, materials, lights, environment, counts, warnings } = inventory;
    this.camera.fill([["", "Free"], ...cameras.map(({ name }) => [name, name || "unnamed"])]);
    this.materials = new Map(materials.map((material) => [material.name, material]));
    this.material.fill([...this.materials.keys()].map((name) => [name, name || "unnamed"]));
    this.lights = new Map(lights.map((light) => [light.name, light]));
    this.light.fill([...this.lights.keys()].map((name) => [name, name || "unnamed"]));
    this.lightRows.hidden = lights.length === 0;
    if (this.material.select.selectedIndex < 0) this.material.select.selectedIndex = 0;
    if (this.light.select.selectedIndex < 0) this.light.select.selectedIndex = 0;
    this.rotation.root.hidden = environment !== "map" && environment !== "sky";
    this.strength.root.hidden = environment === null;
    const n = (x) => x.toLocaleString("en");
    this.about.show([
      ["Triangles", `${n(counts.unique_triangles)} (${n(counts.instanced_triangles)} in instances)`],
      ["Meshes", n(counts.meshes)], ["Instances", n(counts.instances)], ["Materials", n(counts.materials)],
      ["Textures", n(counts.textures)], ["Lights", n(counts.lights)], ["Surroundings", environment ?? "the default"],
      ["Warnings", warnings.join("; ")],
    ]);
    this.showPicked(null);
  }

  showPicked(picked) {
    this.#choose(picked?.object == null ? null : picked);
    if (!this.object) {
      this.picked.show([["Object", picked ? "Nothing is there." : "Click into the picture."]]);
      return;
    }
    this.picked.show([
      ["Object", picked.object || `instance ${picked.instance}`], ["Mesh", picked.mesh],
      ["Triangle", picked.primitive === null ? null : `${picked.primitive.toLocaleString("en")} of ${picked.triangles.toLocaleString("en")}`],
      ["Place", vector(picked.position)], ["Normal", vector(picked.normal)], ["Depth", Number(picked.depth.toPrecision(5))],
      ["Stays", picked.held],
    ]);
    if (picked.material && this.materials.has(picked.material.name)) {
      this.material.show(picked.material.name);
      this.#showMaterial();
    }
  }

  #showMaterial() {
    const name = this.material.select.value;
    const material = this.materials.get(name);
    if (!material) return;
    const now = { ...material, ...(this.edits.materials?.[name] ?? {}) };
    if (document.activeElement !== this.color) this.color.value = hex(now.base_color);
    this.roughness.show(now.roughness);
    this.metallic.show(now.metallic);
  }

  #showLight() {
    const edit = this.edits.lights?.[this.light.select.value];
    this.lightScale.show(edit?.scale ?? 1);
  }

  showStatus(status) {
    this.plots.rays.add(status.mrays_per_s);
    if (status.rss_bytes) this.plots.memory.add(status.rss_bytes);
    const percent = (x) => `${(100 * x).toFixed(1)} %`;
    const { residency: pages, hit_rate: hits } = status;
    this.figures.show([
      ["Samples", `${status.msamples_per_s.toFixed(2)} M/s`],
      ["Not finite", status.non_finite ? `${status.non_finite.toLocaleString("en")} samples` : null],
      ["Last pass", `${status.pass_ms.toFixed(0)} ms, shown in ${status.encode_ms.toFixed(0)} ms`],
      ["Prepared in", `${(status.build_ms + status.prepare_ms).toFixed(0)} ms`],
      ["Structure", bytes(status.structure_bytes)],
      ["Peak", status.peak_bytes ? bytes(status.peak_bytes) : null],
      ["Budget", status.budget_bytes ? bytes(status.budget_bytes) : null],
      ["Resident", pages ? `${bytes(pages.resident_bytes)} of ${bytes(pages.store_bytes)}` : null],
      ["Read", pages ? bytes(pages.bytes_read) : null],
      ["Page hits", hits ? `${percent(hits.geometry)}, attributes ${percent(hits.attributes)}` : null],
    ]);
  }

  showBookmarks(list, go, remove) {
    this.bookmarks.replaceChildren(...list.map((bookmark, i) => {
      const away = button("✕", () => remove(i));
      away.setAttribute("aria-label", `Remove bookmark ${i + 1}`);
      return make("li", {}, button(`${i + 1}  ${bookmark.name}`, () => go(i)), away);
    }));
  }
}
