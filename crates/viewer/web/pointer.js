// Mouse, pen and fingers on the viewport.

const CLICK = 4;
const TURN = Math.PI;

export function listen(canvas, camera, { moved, clicked, carried }) {
  const pointers = new Map();
  let travel = 0;

  const height = () => canvas.clientHeight || 1;
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.hypot(a.x - b.x, a.y - b.y) || 1 };
  };

  canvas.addEventListener("pointerdown", (event) => {
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    if (pointers.size === 0) travel = 0;
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, button: event.button });
    event.preventDefault();
  });

  canvas.addEventListener("pointermove", (event) => {
    const pointer = pointers.get(event.pointerId);
    if (!pointer) return;
    const before = pointers.size === 2 ? spread() : null;
    const [dx, dy] = [event.clientX - pointer.x, event.clientY - pointer.y];
    travel += Math.abs(dx) + Math.abs(dy);
    pointer.x = event.clientX;
    pointer.y = event.clientY;
    if (travel <= CLICK) return;
    if (before) {
      const after = spread();
      camera.dolly(before.apart / after.apart);
      camera.pan(-(after.x - before.x) / height(), (after.y - before.y) / height());
    } else if (pointer.button === 0 && event.altKey && carried(dx / height(), -dy / height())) {
      return;
    } else {
      drag(pointer.button, event.shiftKey, dx / height(), dy / height());
    }
    moved();
  });

  function drag(button, shift, dx, dy) {
    if (button === 1 || (button === 0 && shift)) camera.pan(-dx, dy);
    else if (button === 2) camera.look(-dx * TURN * 0.5, -dy * TURN * 0.5);
    else camera.orbit(-dx * TURN, -dy * TURN);
  }

  const up = (event) => {
    const pointer = pointers.get(event.pointerId);
    pointers.delete(event.pointerId);
    if (pointer && event.type === "pointerup" && pointer.button === 0 && travel <= CLICK) {
      clicked(event.clientX, event.clientY);
    }
  };
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", up);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener(
    "wheel",
    (event) => {
      const lines = event.deltaMode === 1 ? 18 : 1;
      camera.dolly(Math.exp(event.deltaY * lines * 0.0012));
      moved();
      event.preventDefault();
    },
    { passive: false },
  );
}
