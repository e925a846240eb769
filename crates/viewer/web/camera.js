// A camera that stands at `eye`, looks at `target` with +y up, and has a full vertical angle of view in degrees.

const add = (a, b) => a.map((x, i) => x + b[i]);
const sub = (a, b) => a.map((x, i) => x - b[i]);
const scale = (a, s) => a.map((x) => x * s);
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const length = (a) => Math.sqrt(dot(a, a));
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => scale(a, 1 / (length(a) || 1));
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

// Closest that a view comes to straight up or down, radians.
const POLE = 0.02;

export class Camera {
  eye = [0, 0, 5];
  target = [0, 0, 0];
  fov = 40;

  set({ eye, target, fov }) {
    this.eye = [...eye];
    this.target = [...target];
    this.fov = fov;
  }

  // As the server takes it: in single precision, so that the address and the command line say the same.
  plain() {
    const single = (a) => a.map(Math.fround);
    return { eye: single(this.eye), target: single(this.target), fov: Math.fround(this.fov) };
  }

  get distance() {
    return length(sub(this.target, this.eye));
  }

  axes() {
    const forward = unit(sub(this.target, this.eye));
    const right = unit(cross(forward, Math.abs(forward[1]) > 0.9999 ? [0, 0, -1] : [0, 1, 0]));
    return { forward, right, up: cross(right, forward) };
  }

  // The view's direction turned by angles about +y and sideways.
  #turned(yaw, pitch) {
    const { forward } = this.axes();
    const azimuth = Math.atan2(forward[0], forward[2]) + yaw;
    const elevation = clamp(Math.asin(clamp(forward[1], -1, 1)) + pitch, -Math.PI / 2 + POLE, Math.PI / 2 - POLE);
    const flat = Math.cos(elevation);
    return [flat * Math.sin(azimuth), Math.sin(elevation), flat * Math.cos(azimuth)];
  }

  orbit(yaw, pitch) {
    const distance = this.distance;
    this.eye = sub(this.target, scale(this.#turned(yaw, pitch), distance));
  }

  look(yaw, pitch) {
    const distance = this.distance;
    this.target = add(this.eye, scale(this.#turned(yaw, pitch), distance));
  }

  // The way sideways at the depth of a point, in parts of the picture's height.
  across(place, x, y) {
    const { forward, right, up } = this.axes();
    const height = 2 * dot(sub(place, this.eye), forward) * Math.tan((this.fov * Math.PI) / 360);
    return add(scale(right, x * height), scale(up, y * height));
  }

  // Moves sideways, in parts of the picture's height.
  pan(x, y) {
    const { right, up } = this.axes();
    const height = 2 * this.distance * Math.tan((this.fov * Math.PI) / 360);
    this.#move(add(scale(right, x * height), scale(up, y * height)));
  }

  // Comes closer by a factor.
  dolly(factor) {
    const away = scale(sub(this.eye, this.target), factor);
    if (length(away) > 1e-6 * (1 + length(this.target))) this.eye = add(this.target, away);
  }

  // Flies by distances along its own axes.
  fly([x, y, z]) {
    const { forward, right, up } = this.axes();
    this.#move(add(add(scale(right, x), scale(up, y)), scale(forward, z)));
  }

  // Shows a box, from the same side.
  frame({ min, max }, aspect) {
    const { forward, right, up } = this.axes();
    const half = scale(sub(max, min), 0.5);
    const middle = add(min, half);
    const slope = Math.tan((this.fov * Math.PI) / 360);
    const extent = (axis) => Math.abs(axis[0]) * half[0] + Math.abs(axis[1]) * half[1] + Math.abs(axis[2]) * half[2];
    const needed = Math.max(extent(up), extent(right) / aspect) / (0.9 * slope) + extent(forward);
    this.target = middle;
    this.eye = sub(middle, scale(forward, Math.max(needed, 1e-6)));
  }

  toText() {
    const { eye, target, fov } = this.plain();
    return [...eye, ...target, fov].map((x) => String(Number(x.toPrecision(9)))).join(",");
  }

  static fromText(text) {
    const numbers = (text ?? "").split(",").map(Number);
    if (numbers.length !== 7 || !numbers.every(Number.isFinite) || !(numbers[6] > 0 && numbers[6] < 179)) return null;
    return { eye: numbers.slice(0, 3), target: numbers.slice(3, 6), fov: numbers[6] };
  }

  #move(by) {
    this.eye = add(this.eye, by);
    this.target = add(this.target, by);
  }
}
