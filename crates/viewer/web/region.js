// A rectangle of the picture to which refining is limited: drawn with the pointer, shown above the picture, in parts of its edges.

const SMALLEST = 0.005;
const MIDDLE = [0.25, 0.25, 0.75, 0.75];

export class Region {
  #start = null;
  #known = null;

  // `box` says where the picture is on the screen; `want` is told of a rectangle, `drawing` whether one is to be drawn.
  constructor(canvas, mark, { box, want, drawing }) {
    Object.assign(this, { canvas, mark, box, want, drawing, isOn: false });
    const take = (name, act) => canvas.addEventListener(name, (event) => {
      if (!this.isOn) return;
      act(event);
      event.preventDefault();
      event.stopImmediatePropagation();
    });
    take("pointerdown", (event) => this.#begin(event));
    take("pointermove", (event) => this.#start && this.#draw(this.#to(event)));
    take("pointerup", (event) => this.#end(this.#to(event)));
    take("pointercancel", () => this.set(false));
  }

  // Begins or ends drawing.
  set(on) {
    this.isOn = on;
    this.#start = null;
    this.canvas.classList.toggle("drawing", on);
    this.drawing(on);
    this.show(this.#known);
  }

  // One control for all: draws, stops drawing, or takes the rectangle away.
  toggle() {
    if (this.#known) this.want(null);
    else this.set(!this.isOn);
  }

  // Without a pointer: the middle of the picture.
  takeMiddle() {
    this.set(false);
    this.want(MIDDLE);
  }

  // Shows what the server has.
  show(region) {
    this.#known = region;
    this.#draw(region);
  }

  #part({ clientX, clientY }) {
    const { left, top, width, height } = this.box();
    return [(clientX - left) / width, (clientY - top) / height].map((x) => Math.min(Math.max(x, 0), 1));
  }

  #begin(event) {
    this.canvas.focus({ preventScroll: true });
    this.canvas.setPointerCapture(event.pointerId);
    this.#start = this.#part(event);
  }

  #to(event) {
    const [a, b] = [this.#start ?? this.#part(event), this.#part(event)];
    return [Math.min(a[0], b[0]), Math.min(a[1], b[1]), Math.max(a[0], b[0]), Math.max(a[1], b[1])];
  }

  #end(region) {
    const isLarge = this.#start && region[2] - region[0] > SMALLEST && region[3] - region[1] > SMALLEST;
    this.set(false);
    if (isLarge) this.want(region);
  }

  #draw(region) {
    this.mark.hidden = !region;
    if (!region) return;
    const [{ left, top, width, height }, outer] = [this.box(), this.mark.parentElement.getBoundingClientRect()];
    const style = {
      left: left - outer.left + region[0] * width, top: top - outer.top + region[1] * height,
      width: (region[2] - region[0]) * width, height: (region[3] - region[1]) * height,
    };
    for (const [name, value] of Object.entries(style)) this.mark.style[name] = `${value}px`;
  }
}
