// What triangles' corners have, in pages of attributes: see `vastlight-store`, `attributes`. The pages of a block of triangles follow
// each other; blocks are pages of geometry, or stretches of a mesh's triangles in their own order. Who includes this has the
// binding `tables`, the part `page_table` and a function `pool_word`.
//#include table_access

const ATTRIBUTE_NORMALS: u32 = 1u;
const ATTRIBUTE_TANGENTS: u32 = 2u;
const ATTRIBUTE_COLORS: u32 = 4u;
const ATTRIBUTE_POSITIONS: u32 = 8u;
const ATTRIBUTE_UVS: u32 = 16u;

/// A triangle's block and its place there.
struct TrianglePlace {
    block: u32,
    place: u32,
}

/// The records of a triangle's corners: which attributes they have, and the words of the pool where they begin.
struct Records {
    attributes: u32,
    corners: array<u32, 3>,
}

/// The place of a triangle by its number in a mesh whose triangles are in blocks in their own order.
fn place_by_number(mesh: u32, prim: u32) -> TrianglePlace {
    return TrianglePlace(tables[mesh + GEOMETRY_FIRST_BLOCK] + prim / GEOMETRY_BLOCK, prim % GEOMETRY_BLOCK);
}

/// Finds the records of a triangle, all zeros where their page is not there.
fn records_of(attributes: u32, at: TrianglePlace) -> Records {
    var records = Records(attributes, array<u32, 3>(0u, 0u, 0u));
    if (attributes == 0u) {
        return records;
    }
    // The last page of the block whose first triangle is not behind this one.
    let starts = tables[TABLES_STARTS] - tables[TABLES_FIRST_ATTRIBUTES];
    var low = tables[tables[TABLES_BLOCKS] + at.block];
    var high = tables[tables[TABLES_BLOCKS] + at.block + 1u];
    while (low + 1u < high) {
        let middle = (low + high) / 2u;
        if (tables[starts + middle] <= at.place) {
            low = middle;
        } else {
            high = middle;
        }
    }
    let page = page_at(low);
    let number = at.place - tables[starts + low];
    let count = pool_word(page) & 0xffffu;
    let first = page + (4u + 3u * count + 3u) / 4u;
    for (var corner = 0u; corner < 3u; corner++) {
        let byte = 4u + 3u * number + corner;
        let vertex = (pool_word(page + (byte >> 2u)) >> ((byte & 3u) * 8u)) & 255u;
        records.corners[corner] = first + vertex * record_floats(attributes);
    }
    return records;
}

fn has_attribute(records: Records, kind: u32) -> bool {
    return (records.attributes & kind) != 0u;
}

/// Where tangents stand in a record.
fn tangents_of(records: Records) -> u32 {
    return 3u * (records.attributes & ATTRIBUTE_NORMALS);
}

/// Where colours stand.
fn colors_of(records: Records) -> u32 {
    return tangents_of(records) + 2u * (records.attributes & ATTRIBUTE_TANGENTS);
}

/// Where the texture coordinates of a set stand.
fn uvs_of(records: Records, uv_set: u32) -> u32 {
    let before = (records.attributes >> 4u) & ((1u << uv_set) - 1u);
    return colors_of(records) + (records.attributes & ATTRIBUTE_COLORS) + 2u * countOneBits(before);
}

/// Where positions stand.
fn positions_of(records: Records) -> u32 {
    return uvs_of(records, 4u);
}

/// Words of a record.
fn record_floats(attributes: u32) -> u32 {
    let records = Records(attributes, array<u32, 3>(0u, 0u, 0u));
    return positions_of(records) + 3u * ((attributes >> 3u) & 1u);
}

fn record_f32(records: Records, at: u32, corner: u32) -> f32 {
    return bitcast<f32>(pool_word(records.corners[corner] + at));
}

fn record_vec2(records: Records, at: u32, corner: u32) -> vec2<f32> {
    return vec2<f32>(record_f32(records, at, corner), record_f32(records, at + 1u, corner));
}

fn record_vec3(records: Records, at: u32, corner: u32) -> vec3<f32> {
    return vec3<f32>(record_vec2(records, at, corner), record_f32(records, at + 2u, corner));
}

fn record_vec4(records: Records, at: u32, corner: u32) -> vec4<f32> {
    return vec4<f32>(record_vec3(records, at, corner), record_f32(records, at + 3u, corner));
}

fn blend_vec3(records: Records, at: u32, weights: vec3<f32>) -> vec3<f32> {
    return record_vec3(records, at, 0u) * weights.x + record_vec3(records, at, 1u) * weights.y
        + record_vec3(records, at, 2u) * weights.z;
}

fn blend_vec4(records: Records, at: u32, weights: vec3<f32>) -> vec4<f32> {
    return record_vec4(records, at, 0u) * weights.x + record_vec4(records, at, 1u) * weights.y
        + record_vec4(records, at, 2u) * weights.z;
}
