// What shading kernels share: what a sample says about its first surface, shadow rays, and what triangles emit for the part
// `lights`. Who includes this has what `path_state` and `vertex` ask for.
//#include path_state
//#include vertex

/// Shortens shadow rays so that they do not meet the light itself.
const SHADOW_SHORTENING: f32 = 1e-4;
const CAMERA_DIMENSIONS: u32 = 4u;

/// Fills in what a sample says about its first surface.
fn describe(slot: u32, vertex: ptr<function, Vertex>, bsdf: Bsdf, direction: vec3<f32>, met: Meeting) {
    var albedo = bsdf_albedo(bsdf);
    if (((*vertex).evaluated.flags & FLAG_UNLIT) != 0u) {
        albedo = clamp((*vertex).evaluated.emission, vec3<f32>(0.0), vec3<f32>(1.0));
    }
    put_vec3(SAMPLE_ALBEDO, slot, albedo);
    put_vec3(SAMPLE_NORMAL, slot, vertex_facing_normal(vertex));
    put_vec3(SAMPLE_POSITION, slot, (*vertex).surface.position);
    let axis = table_vec3(tables[TABLES_CAMERA] + CAMERA_AXIS);
    put_f32(SAMPLE_DEPTH, slot, met.t * dot(direction, axis));
    put_f32(SAMPLE_COVERAGE, slot, 1.0);
    put_word(SAMPLE_OBJECT, slot, met.instance);
    put_word(SAMPLE_MATERIAL, slot, (*vertex).material);
}

/// How far a shadow ray goes to a light at a distance; nothing where there is no way between.
fn shadow_length(vertex: ptr<function, Vertex>, distance: f32) -> f32 {
    if (distance >= PATH_FAR) {
        return PATH_FAR;
    }
    return distance * (1.0 - SHADOW_SHORTENING) - 2.0 * (*vertex).surface.offset;
}

/// What a triangle emits at a point of it, times its coverage.
fn textured_emission(instance: u32, prim: u32, weights: vec2<f32>) -> vec3<f32> {
    let mesh = mesh_record(instance);
    let material = material_of(material_of_triangle(mesh, prim));
    if ((tables[material] & FLAG_UNLIT) != 0u) {
        return vec3<f32>(0.0);
    }
    let whole = vec3<f32>(1.0 - weights.x - weights.y, weights);
    let records = records_of(tables[mesh + GEOMETRY_ATTRIBUTES], place_by_number(mesh, prim));
    var point = surface_point(records, whole, tables[material + MATERIAL_UV_SETS]);
    var value = vec4<f32>(0.0);
    var emission = vec3<f32>(0.0);
    for (var i = 0u; i < 2u; i++) {
        value = material_input(material, select(INPUT_ALPHA, INPUT_EMISSION, i == 0u), &point);
        emission = select(emission, value.xyz, i == 0u);
    }
    return emission * material_alpha(material, value, point.color);
}
