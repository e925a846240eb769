// A picked object that is put elsewhere: moved, turned and scaled about the middle of the box that it had when the scene was opened.
// Maps are three rows of four numbers.

const RADIAN = Math.PI / 180;
const clamp = (x) => Math.min(Math.max(x, -1), 1);

const point = (map, p) => map.map((row) => row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3]);

function times(a, b) {
  const column = (i) => b.map((row) => row[i]);
  return a.map((row) => [0, 1, 2, 3].map((i) => row.slice(0, 3).reduce((sum, x, k) => sum + x * column(i)[k], i === 3 ? row[3] : 0)));
}

function inverse(map) {
  const [a, b, c] = map.map((row) => row.slice(0, 3));
  const cross = (u, v) => [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const [x, y, z] = [cross(b, c), cross(c, a), cross(a, b)];
  const determinant = a[0] * x[0] + a[1] * x[1] + a[2] * x[2];
  const rows = [0, 1, 2].map((i) => [x[i], y[i], z[i]].map((value) => value / determinant));
  const from = map.map((row) => row[3]);
  return rows.map((row) => [...row, -(row[0] * from[0] + row[1] * from[1] + row[2] * from[2])]);
}

// Scale along the axes of the world, then turns about x, y and z, degrees.
function linear(turn, scale) {
  const [[a, b, c], [x, y, z]] = [turn.map((angle) => Math.cos(angle * RADIAN)), turn.map((angle) => Math.sin(angle * RADIAN))];
  const rows = [
    [b * c, x * y * c - a * z, a * y * c + x * z],
    [b * z, x * y * z + a * c, a * y * z - x * c],
    [-y, x * b, a * b],
  ];
  return rows.map((row) => row.map((value, i) => value * scale[i]));
}

// What a linear map is of scale and turns; a mirror image is one along x.
function parts(rows) {
  const column = (i) => rows.map((row) => row[i]);
  const scale = [0, 1, 2].map((i) => Math.hypot(...column(i)));
  const [a, b, c] = rows;
  const determinant = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  if (determinant < 0) scale[0] = -scale[0];
  const unit = rows.map((row) => row.map((value, i) => value / scale[i]));
  // Where the turn about y is a right angle, those about x and z are one.
  const pole = Math.abs(unit[2][0]) > 1 - 1e-6;
  const [x, z] = pole
    ? [0, Math.atan2(-unit[0][1], unit[1][1])]
    : [Math.atan2(unit[2][1], unit[2][2]), Math.atan2(unit[1][0], unit[0][0])];
  const turn = [x, Math.asin(clamp(-unit[2][0])), z];
  return { turn: turn.map((angle) => angle / RADIAN), scale };
}

export class Placed {
  constructor({ instance, opened, held }) {
    this.instance = instance;
    this.held = held;
    this.opened = opened.place;
    this.box = opened.bounds;
    this.middle = opened.bounds.min.map((x, i) => (x + opened.bounds.max[i]) / 2);
    this.take(null);
  }

  // The size of the object, for steps.
  get size() {
    return Math.hypot(...this.box.max.map((x, i) => x - this.box.min[i]));
  }

  // The change that brings the opened place to another one, in world space.
  #change() {
    const rows = linear(this.turn, this.scale);
    return rows.map((row, i) => [...row, this.move[i] + this.middle[i] - row.reduce((sum, x, k) => sum + x * this.middle[k], 0)]);
  }

  // Reads the place that the server has; none where the object was not put elsewhere.
  take(place) {
    Object.assign(this, { move: [0, 0, 0], turn: [0, 0, 0], scale: [1, 1, 1] });
    if (!place) return;
    const change = times(place, inverse(this.opened));
    Object.assign(this, parts(change.map((row) => row.slice(0, 3))));
    this.move = point(change, this.middle).map((x, i) => x - this.middle[i]);
  }

  // World from object, in single precision; nothing where it is as it was.
  place() {
    const same = [...this.move, ...this.turn].every((x) => x === 0) && this.scale.every((x) => x === 1);
    return same ? null : times(this.#change(), this.opened).map((row) => row.map(Math.fround));
  }

  // Where its middle is now.
  now() {
    return this.middle.map((x, i) => x + this.move[i]);
  }

  // Its box where it is now.
  bounds() {
    const change = this.#change();
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((n) => point(change, [0, 1, 2].map((i) => (n >> i & 1 ? this.box.max : this.box.min)[i])));
    const along = (pick) => [0, 1, 2].map((i) => pick(...corners.map((corner) => corner[i])));
    return { min: along(Math.min), max: along(Math.max) };
  }
}
