// Lookups in textures as in `vastlight-transport`, `texture`: wrap modes, nearest and bilinear filtering, trilinear
// between the levels of a pyramid, in tiles. Who includes this has the binding `tables`, the part `page_table` and a function `pool_word`.
//#include real
//#include table_access

const LOG2_E: f32 = 1.44269504;

/// The number `i` of the page that begins at a word of the pool, as a linear one. `level` is the record of its image.
fn texel_number(level: u32, page: u32, i: u32, color: bool) -> f32 {
    switch (tables[level + LEVEL_NUMBER_BYTES]) {
        case 1u: {
            let byte = (pool_word(page + (i >> 2u)) >> ((i & 3u) * 8u)) & 255u;
            if (color) {
                return table_f32(tables[TABLES_SRGB] + byte);
            }
            return f32(byte) * (1.0 / 255.0);
        }
        case 2u: {
            let word = (pool_word(page + (i >> 1u)) >> ((i & 1u) * 16u)) & 0xffffu;
            let x = f32(word) * (1.0 / 65535.0);
            if (!color) {
                return x;
            }
            if (x <= 0.04045) {
                return x / 12.92;
            }
            return real_pow((x + 0.055) / 1.055, 2.4);
        }
        default: {
            let word = pool_word(page + i);
            // Neither infinite nor no number.
            return select(0.0, bitcast<f32>(word), (word & 0x7f800000u) != 0x7f800000u);
        }
    }
}

fn texel_at(texture: u32, level: u32, column: u32, row: u32) -> vec4<f32> {
    let edge = tables[level + LEVEL_EDGE];
    var tile = 0u;
    var texel = tables[level + LEVEL_TEXEL] + row * tables[level + LEVEL_WIDTH] + column;
    if (edge != LEVEL_IN_A_ROW) {
        tile = (row >> edge) * tables[level + LEVEL_ACROSS] + (column >> edge);
        let within = (1u << edge) - 1u;
        texel = ((row & within) << edge) + (column & within);
    }
    let page = page_at(tables[level + LEVEL_PAGE] + tile);
    let channels = tables[level + LEVEL_CHANNELS];
    let first = texel * channels;
    let srgb = tables[texture + TEXTURE_SRGB] == 1u;
    var value = vec4<f32>(1.0);
    value.x = texel_number(level, page, first, srgb);
    if (channels >= 3u) {
        value.y = texel_number(level, page, first + 1u, srgb);
        value.z = texel_number(level, page, first + 2u, srgb);
    } else {
        value = vec4<f32>(value.xxx, 1.0);
    }
    if (channels == 2u || channels == 4u) {
        value.w = texel_number(level, page, first + channels - 1u, false);
    }
    return value;
}

/// A column or row within the image. Beyond 2^30 places nothing is told apart any more.
fn texture_wrap(i: i32, size: u32, mode: u32) -> u32 {
    let n = i32(max(size, 1u));
    switch (mode) {
        case 0u: {
            return u32(((i % n) + n) % n);
        }
        case 1u: {
            let twice = ((i % (2 * n)) + 2 * n) % (2 * n);
            return u32(min(twice, 2 * n - 1 - twice));
        }
        default: {
            return u32(clamp(i, 0, n - 1));
        }
    }
}

fn texture_whole(x: f32) -> i32 {
    return i32(clamp(floor(x), -1e9, 1e9));
}

fn texture_sample(texture: u32, level: u32, place: vec2<f32>) -> vec4<f32> {
    let width = tables[level + LEVEL_WIDTH];
    let height = tables[level + LEVEL_HEIGHT];
    var at = place * vec2<f32>(f32(width), f32(height));
    var taps = 1u;
    if (tables[texture + TEXTURE_NEAREST] == 0u) {
        at -= vec2<f32>(0.5);
        taps = 4u;
    }
    let column = texture_whole(at.x);
    let row = texture_whole(at.y);
    let share = at - floor(at);
    var value = vec4<f32>(0.0);
    for (var tap = 0u; tap < taps; tap++) {
        let x = texture_wrap(column + i32(tap & 1u), width, tables[texture + TEXTURE_WRAP]);
        let y = texture_wrap(row + i32(tap >> 1u), height, tables[texture + TEXTURE_WRAP + 1u]);
        var weight = 1.0;
        if (taps == 4u) {
            weight = select(1.0 - share.x, share.x, (tap & 1u) == 1u) * select(1.0 - share.y, share.y, tap >= 2u);
        }
        value += texel_at(texture, level, x, y) * weight;
    }
    return value;
}

/// The linear value of a texture at coordinates, for an area of them; white for a texture that is not there.
fn texture_lookup(number: u32, uv: vec2<f32>, area: f32) -> vec4<f32> {
    if (number == 0xffffffffu) {
        return vec4<f32>(1.0);
    }
    let texture = record_of(TABLES_TEXTURES, number, TEXTURE_WORDS);
    if (tables[texture + TEXTURE_LEVEL_COUNT] == 0u) {
        return vec4<f32>(1.0);
    }
    let u_row = table_vec3(texture + TEXTURE_MATRIX);
    let v_row = table_vec3(texture + TEXTURE_MATRIX + 3u);
    let place = vec2<f32>(u_row.x * uv.x + u_row.y * uv.y + u_row.z, v_row.x * uv.x + v_row.y * uv.y + v_row.z);
    let covered = area * table_f32(texture + TEXTURE_TEXELS);
    let last = tables[texture + TEXTURE_LEVEL_COUNT] - 1u;
    var level = 0u;
    var share = 0.0;
    if (last > 0u && covered > 1.0) {
        let wanted = clamp(0.5 * LOG2_E * real_ln(covered), 0.0, f32(last));
        level = u32(wanted);
        share = wanted - floor(wanted);
    }
    var value = vec4<f32>(0.0);
    let levels = select(1u, 2u, share > 0.0);
    for (var i = 0u; i < levels; i++) {
        let weight = select(share, 1.0 - share, i == 0u);
        let record = tables[texture + TEXTURE_LEVELS] + (level + i) * TEXTURE_LEVEL_WORDS;
        value += texture_sample(texture, record, place) * weight;
    }
    return value;
}
