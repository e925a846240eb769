// Small plots of what happened lately.

const KEPT = 120;

export class Plot {
  #values = [];

  constructor(title, format) {
    this.format = format;
    this.root = document.createElement("div");
    this.root.className = "plot";
    const line = document.createElement("p");
    const name = document.createElement("span");
    this.now = document.createElement("b");
    name.textContent = title;
    this.now.textContent = "–";
    line.append(name, this.now);
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${title}: nothing yet`);
    this.title = title;
    this.root.append(line, this.canvas);
  }

  add(value) {
    if (!Number.isFinite(value)) return;
    this.#values.push(value);
    if (this.#values.length > KEPT) this.#values.shift();
    this.now.textContent = this.format(value);
    this.canvas.setAttribute("aria-label", `${this.title}: now ${this.format(value)}, at most ${this.format(Math.max(...this.#values))}`);
    this.draw();
  }

  draw() {
    const { canvas } = this;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const [width, height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio];
    if (width === 0 || this.#values.length === 0) return;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const context = canvas.getContext("2d");
    const top = Math.max(...this.#values, 1e-9) * 1.1;
    const x = (i) => (i / (KEPT - 1)) * width;
    const y = (value) => height - 2 - (value / top) * (height - 4);
    context.clearRect(0, 0, width, height);
    context.strokeStyle = getComputedStyle(canvas).getPropertyValue("--plot") || "#77b6ff";
    context.fillStyle = context.strokeStyle;
    context.lineWidth = 1.5 * ratio;
    context.beginPath();
    const first = KEPT - this.#values.length;
    this.#values.forEach((value, i) => context.lineTo(x(first + i), y(value)));
    context.stroke();
    context.lineTo(x(KEPT - 1), height);
    context.lineTo(x(first), height);
    context.globalAlpha = 0.18;
    context.fill();
    context.globalAlpha = 1;
  }
}

const UNITS = ["B", "KiB", "MiB", "GiB", "TiB"];

export function bytes(value) {
  let unit = 0;
  while (value >= 1024 && unit < UNITS.length - 1) {
    value /= 1024;
    unit += 1;
  }
  return `${value >= 100 || unit === 0 ? Math.round(value) : value.toFixed(1)} ${UNITS[unit]}`;
}
