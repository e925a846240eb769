// A density over directions on a latitude-longitude grid, as in `vastlight-transport`, `light::grid`.
//#include light_words
//#include real
//#include warp

/// Width, height, sums of the upper and lower half; then weights, running sums within rows, and over rows.
const LIGHT_GRID_HEAD: u32 = 4u;
const LIGHT_BELOW_LAST: f32 = 0.9999999;

/// The share of samples for the upper half, and what a weight is worth in either half.
struct LightHalves {
    upper: f32,
    scale: vec2<f32>,
}

/// Four cells around a point of a map and their weights.
struct LightFootprint {
    x: vec2<u32>,
    y: vec2<u32>,
    /// Upper left, upper right, lower left, lower right.
    weights: vec4<f32>,
}

/// Where in running sums a number lies; `found` is false where all is black.
struct LightInverse {
    index: u32,
    rest: f32,
    found: bool,
}

/// Direction of a point of the map.
fn light_direction_of(uv: vec2<f32>) -> vec3<f32> {
    let theta = real_sin_cos(uv.y * PI);
    let phi = real_sin_cos((uv.x - 0.5) * TAU);
    return vec3<f32>(theta.x * phi.x, theta.y, -theta.x * phi.y);
}

/// The point of the map that shows a unit direction.
fn light_uv_of(direction: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(0.5 + real_atan2(direction.x, -direction.z) / TAU, real_acos(direction.y) / PI);
}

/// The cells around a point of a map; columns wrap, rows end at the poles.
fn light_footprint(uv: vec2<f32>, width: u32, height: u32) -> LightFootprint {
    let x = uv.x * f32(width) - 0.5;
    let y = clamp(uv.y * f32(height) - 0.5, 0.0, f32(height - 1u));
    let s = x - floor(x);
    let t = y - floor(y);
    let left = u32((i32(floor(x)) % i32(width) + i32(width)) % i32(width));
    let right = select(left + 1u, 0u, left + 1u == width);
    let top = min(u32(floor(y)), height - 1u);
    let weights = vec4<f32>((1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t);
    return LightFootprint(vec2<u32>(left, right), vec2<u32>(top, min(top + 1u, height - 1u)), weights);
}

/// How the halves are weighted for a surface with this normal (zero: facing any way).
fn light_halves(grid: u32, normal: vec3<f32>) -> LightHalves {
    let sums = light_vec2(grid + 2u);
    let lift = clamp(normal.y, -1.0, 1.0);
    let up = sums.x * (1.0 + lift);
    let down = sums.y * (1.0 - lift);
    if (!(up + down > 0.0)) {
        return LightHalves(0.0, vec2<f32>(0.0));
    }
    // All or nothing must not depend on the division's last bits.
    let upper = select(up / (up + down), 1.0, down <= 0.0);
    var scale = vec2<f32>(0.0);
    if (sums.x > 0.0) {
        scale.x = upper / sums.x;
    }
    if (down > 0.0) {
        scale.y = (1.0 - upper) / sums.y;
    }
    return LightHalves(upper, scale);
}

/// The first of `count` running sums at `at` that exceeds `u`, and where in its step `u` lies, in [0, 1).
fn light_invert(at: u32, count: u32, u: f32) -> LightInverse {
    if (count == 0u) {
        return LightInverse(0u, 0.0, false);
    }
    let last = light_f32(at + count - 1u);
    if (!(last > 0.0)) {
        return LightInverse(0u, 0.0, false);
    }
    let wanted = min(u, last * LIGHT_BELOW_LAST);
    var first = 0u;
    var end = count;
    while (first < end) {
        let middle = (first + end) / 2u;
        if (light_f32(at + middle) <= wanted) {
            first = middle + 1u;
        } else {
            end = middle;
        }
    }
    let index = min(first, count - 1u);
    var below = 0.0;
    if (index > 0u) {
        below = light_f32(at + index - 1u);
    }
    let width = light_f32(at + index) - below;
    var rest = 0.5;
    if (width > 0.0) {
        rest = clamp((u - below) / width, 0.0, LIGHT_BELOW_LAST);
    }
    return LightInverse(index, rest, true);
}

/// A point of the map; below 0 if all is black.
fn light_grid_sample(grid: u32, halves: LightHalves, u: vec2<f32>) -> vec2<f32> {
    let width = lights[grid];
    let height = lights[grid + 1u];
    let columns = grid + LIGHT_GRID_HEAD + width * height;
    let rows = columns + width * height;
    let middle = height / 2u;
    var first = 0u;
    var count = middle;
    var uy = 0.0;
    if (u.y < halves.upper) {
        uy = u.y / halves.upper;
    } else {
        first = middle;
        count = height - middle;
        uy = (u.y - halves.upper) / (1.0 - halves.upper);
    }
    let row = light_invert(rows + first, count, uy);
    let y = first + row.index;
    let column = light_invert(columns + y * width, width, u.x);
    if (!row.found || !column.found) {
        return vec2<f32>(-1.0);
    }
    let x = (f32(column.index) + 0.5 + warp_tent(column.rest)) / f32(width);
    // Over the pole means back on the same side: the lookup clamps there, and so does the density.
    let v = abs((f32(y) + 0.5 + warp_tent(row.rest)) / f32(height));
    return vec2<f32>(x - floor(x), select(v, 2.0 - v, v > 1.0));
}

/// Density over the unit square of the map.
fn light_grid_density(grid: u32, halves: LightHalves, uv: vec2<f32>) -> f32 {
    let width = lights[grid];
    let height = lights[grid + 1u];
    let middle = height / 2u;
    let cells = light_footprint(uv, width, height);
    let upper = grid + LIGHT_GRID_HEAD + cells.y.x * width;
    let lower = grid + LIGHT_GRID_HEAD + cells.y.y * width;
    let scales = select(vec2<f32>(halves.scale.x), vec2<f32>(halves.scale.y), cells.y >= vec2<u32>(middle));
    let at_top = cells.weights.x * light_f32(upper + cells.x.x) + cells.weights.y * light_f32(upper + cells.x.y);
    let at_bottom = cells.weights.z * light_f32(lower + cells.x.x) + cells.weights.w * light_f32(lower + cells.x.y);
    let sum = at_top * scales.x + at_bottom * scales.y;
    return sum * f32(width * height);
}

/// Density over solid angle of a direction in the grid's own space.
fn light_grid_pdf(grid: u32, normal: vec3<f32>, direction: vec3<f32>) -> f32 {
    let sin_theta = max(sqrt(direction.x * direction.x + direction.z * direction.z), 1e-6);
    let density = light_grid_density(grid, light_halves(grid, normal), light_uv_of(direction));
    return density / (2.0 * PI * PI * sin_theta);
}
