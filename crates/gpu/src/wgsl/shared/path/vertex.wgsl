// A path's vertex as in `vastlight-transport`, `vertex`: the surface that a ray met, its material and its scattering.
//#include bsdf
//#include medium
//#include surface

struct Vertex {
    surface: Surface,
    material: u32,
    evaluated: Evaluated,
    /// Shading frame, z outside.
    frame: Frame,
    /// Back along the ray.
    wo: vec3<f32>,
    /// Whether the ray came from the outside.
    outside: bool,
}

fn vertex_at(met: Meeting, direction: vec3<f32>, cone: Cone) -> Vertex {
    var vertex: Vertex;
    vertex.material = material_of_triangle(mesh_record(met.instance), met.prim);
    let material = material_of(vertex.material);
    let needs_tangent = (tables[material] & FLAG_NEEDS_TANGENT) != 0u;
    vertex.surface = surface_at(met, direction, cone, tables[material + MATERIAL_UV_SETS], needs_tangent);
    var point = vertex.surface.point;
    var evaluated = material_evaluate(vertex.material, &point);
    let frame = material_shading_frame(&evaluated, surface_frame(vertex.surface));
    vertex.evaluated = evaluated;
    vertex.wo = -direction;
    vertex.frame = surface_facing(vertex.surface, frame, vertex.wo);
    vertex.outside = dot(vertex.wo, vertex.surface.normal) >= 0.0;
    return vertex;
}

/// Emitted radiance towards the ray.
fn vertex_emission(vertex: ptr<function, Vertex>) -> vec3<f32> {
    if ((*vertex).outside || ((*vertex).evaluated.flags & (FLAG_UNLIT | FLAG_TWO_SIDED)) != 0u) {
        return (*vertex).evaluated.emission;
    }
    return vec3<f32>(0.0);
}

/// Whether the surface bounds a volume that light can enter.
fn vertex_bounds_volume(vertex: ptr<function, Vertex>) -> bool {
    return !(*vertex).evaluated.params.thin && (*vertex).evaluated.params.transmission > 0.0;
}

/// The media on the far side of the surface.
fn vertex_media_behind(vertex: ptr<function, Vertex>, media: MediumStack) -> MediumStack {
    if (!vertex_bounds_volume(vertex)) {
        return media;
    }
    if ((*vertex).outside) {
        return medium_entered(media, (*vertex).material);
    }
    return medium_left(media, (*vertex).material);
}

/// The numbers of the scattering for a path with a random number for its wavelength: the index relative to the medium around the volume.
fn vertex_params(vertex: ptr<function, Vertex>, wavelength: f32, media: MediumStack, dispersed: bool) -> BsdfParams {
    var params = (*vertex).evaluated.params;
    if (!vertex_bounds_volume(vertex)) {
        return params;
    }
    if (params.dispersion > 0.0) {
        wavelength_apply(wavelength, dispersed, &params);
    }
    var around = media;
    if (!(*vertex).outside) {
        around = medium_left(media, (*vertex).material);
    }
    let medium = medium_current(around);
    if (medium != NO_MEDIUM) {
        let ior = table_f32(material_of(medium) + MATERIAL_IOR);
        if (ior > 0.0) {
            params.ior /= ior;
        }
    }
    return params;
}

/// Geometric normal on the side of the ray.
fn vertex_facing_side(vertex: ptr<function, Vertex>) -> vec3<f32> {
    return select(-(*vertex).surface.normal, (*vertex).surface.normal, (*vertex).outside);
}

/// Shading normal on the side of the ray.
fn vertex_facing_normal(vertex: ptr<function, Vertex>) -> vec3<f32> {
    return select(-(*vertex).frame.z, (*vertex).frame.z, (*vertex).outside);
}
