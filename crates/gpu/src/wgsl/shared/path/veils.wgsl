// Surfaces that rays may pass, as in `vastlight-transport`, `alpha` and `veil`.
//#include random
//#include surface

/// Whether the surface at a meeting is there for a ray with this key, as far as alpha says.
fn alpha_is_there(met: Meeting, key: u32) -> bool {
    let mesh = mesh_record(met.instance);
    let material = material_of(material_of_triangle(mesh, met.prim));
    if ((tables[material] & FLAG_ALPHA) == 0u) {
        return true;
    }
    let weights = vec3<f32>(1.0 - met.weights.x - met.weights.y, met.weights.x, met.weights.y);
    var point = surface_point(records_at(met), weights, tables[material + MATERIAL_UV_SETS]);
    let alpha = material_alpha(material, material_input(material, INPUT_ALPHA, &point), point.color);
    return alpha >= 1.0 || (alpha > 0.0 && hash_to_unit(key, met.instance, met.prim) < alpha);
}
