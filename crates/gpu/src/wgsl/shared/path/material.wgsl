// From a material and a point's attributes to the numbers that the scattering needs, as in `vastlight-transport`, `material`.
//#include bsdf_params
//#include frame
//#include texture

const UV_SETS: u32 = 4u;
const RGB: u32 = 4u;

/// The attributes of a point that materials depend on.
struct ShadingPoint {
    uvs: array<vec2<f32>, UV_SETS>,
    color: vec4<f32>,
    areas: array<f32, UV_SETS>,
}

/// A material at one point.
struct Evaluated {
    params: BsdfParams,
    emission: vec3<f32>,
    alpha: f32,
    /// Of the first word.
    flags: u32,
    /// Of the normal maps, in tangent space; zero for none.
    normal: vec3<f32>,
    coat_normal: vec3<f32>,
    attenuation: vec3<f32>,
}

fn material_of(number: u32) -> u32 {
    return record_of(TABLES_MATERIALS, number, MATERIAL_WORDS);
}

/// An input of a material at a point, its factor multiplied.
fn material_input(material: u32, input: u32, point: ptr<function, ShadingPoint>) -> vec4<f32> {
    let at = material + MATERIAL_INPUTS + input * MATERIAL_INPUT_WORDS;
    let factor = vec4<f32>(table_vec3(at), 1.0);
    let texture = tables[at + 3u];
    if (texture == 0xffffffffu) {
        return factor;
    }
    let channel = tables[at + 4u];
    let uv_set = tables[record_of(TABLES_TEXTURES, texture, TEXTURE_WORDS) + TEXTURE_UV_SET];
    var uv = vec2<f32>(0.0);
    var area = 0.0;
    if (uv_set < UV_SETS) {
        uv = (*point).uvs[uv_set];
        area = select((*point).areas[uv_set], 0.0, (channel & MATERIAL_EXACT) != 0u);
    }
    let value = texture_lookup(texture, uv, area);
    let part = channel & 255u;
    if (part < RGB) {
        return factor * value[part];
    }
    return factor * value;
}

/// Coverage at a point: 1 for an opaque surface, 0 or 1 for a masked one.
fn material_alpha(material: u32, input: vec4<f32>, color: vec4<f32>) -> f32 {
    let flags = tables[material];
    if ((flags & FLAG_ALPHA) == 0u) {
        return 1.0;
    }
    let alpha = input.x * color.w;
    if ((flags & FLAG_MASK) != 0u) {
        return select(0.0, 1.0, alpha >= table_f32(material + MATERIAL_CUTOFF));
    }
    return select(0.0, min(alpha, 1.0), alpha > 0.0);
}

/// The unit normal that a normal map means.
fn material_normal(texel: vec4<f32>, scale: f32) -> vec3<f32> {
    let n = texel.xyz * 2.0 - 1.0;
    return normalize_or(vec3<f32>(n.x * scale, n.y * scale, max(n.z, 1e-3)), vec3<f32>(0.0));
}

/// The numbers that no input decides.
fn material_plain(material: u32) -> Evaluated {
    var out: Evaluated;
    out.flags = tables[material];
    out.attenuation = table_vec3(material + MATERIAL_ATTENUATION);
    out.params = bsdf_params_diffuse(vec3<f32>(0.0));
    out.params.ior = table_f32(material + MATERIAL_IOR);
    out.params.thin = (out.flags & FLAG_THIN) != 0u;
    out.params.dispersion = table_f32(material + MATERIAL_DISPERSION);
    out.params.anisotropy = table_f32(material + MATERIAL_ANISOTROPY);
    out.params.anisotropy_direction = table_vec2(material + MATERIAL_ANISOTROPY_DIRECTION);
    out.params.iridescence_ior = table_f32(material + MATERIAL_IRIDESCENCE_IOR);
    out.params.iridescence_thickness = table_f32(material + MATERIAL_THICKNESS + 1u);
    out.params.conductor = (out.flags & FLAG_CONDUCTOR) != 0u;
    out.params.conductor_eta = table_vec3(material + MATERIAL_CONDUCTOR);
    out.params.conductor_k = table_vec3(material + MATERIAL_CONDUCTOR + 3u);
    out.params.conductor_average = table_vec3(material + MATERIAL_CONDUCTOR + 6u);
    return out;
}

/// Puts the value of an input where it belongs.
fn material_put(material: u32, input: u32, value: vec4<f32>, out: ptr<function, Evaluated>) {
    switch (input) {
        case INPUT_BASE_COLOR: { (*out).params.base_color = value.xyz; }
        case INPUT_METALLIC: { (*out).params.metallic = value.x; }
        case INPUT_ROUGHNESS: { (*out).params.roughness = value.x; }
        case INPUT_TRANSMISSION: { (*out).params.transmission = value.x; }
        case INPUT_SPECULAR: { (*out).params.specular = value.x; }
        case INPUT_SPECULAR_COLOR: { (*out).params.specular_color = value.xyz; }
        case INPUT_CLEARCOAT: { (*out).params.clearcoat = value.x; }
        case INPUT_CLEARCOAT_ROUGHNESS: { (*out).params.clearcoat_roughness = value.x; }
        case INPUT_SHEEN_COLOR: { (*out).params.sheen_color = value.xyz; }
        case INPUT_SHEEN_ROUGHNESS: { (*out).params.sheen_roughness = value.x; }
        case INPUT_IRIDESCENCE: { (*out).params.iridescence = value.x; }
        case INPUT_EMISSION: { (*out).emission = value.xyz; }
        case INPUT_THICKNESS: {
            if (((*out).flags & FLAG_THICKNESS_TEXTURE) != 0u) {
                let range = table_vec2(material + MATERIAL_THICKNESS);
                (*out).params.iridescence_thickness = range.x + (range.y - range.x) * value.y;
            }
        }
        case INPUT_ANISOTROPY: {
            if (((*out).flags & FLAG_ANISOTROPY_TEXTURE) != 0u) {
                let d = normalize_or(vec3<f32>(value.xy * 2.0 - 1.0, 0.0), vec3<f32>(1.0, 0.0, 0.0)).xy;
                let given = (*out).params.anisotropy_direction;
                (*out).params.anisotropy_direction =
                    vec2<f32>(given.x * d.x - given.y * d.y, given.y * d.x + given.x * d.y);
                (*out).params.anisotropy *= value.z;
            }
        }
        case INPUT_NORMAL: {
            if (((*out).flags & FLAG_NORMAL_MAP) != 0u) {
                (*out).normal = material_normal(value, table_f32(material + MATERIAL_NORMAL_SCALES));
            }
        }
        default: {
            if (((*out).flags & FLAG_COAT_NORMAL_MAP) != 0u) {
                (*out).coat_normal = material_normal(value, table_f32(material + MATERIAL_NORMAL_SCALES + 1u));
            }
        }
    }
}

/// The material at a point.
fn material_evaluate(number: u32, point: ptr<function, ShadingPoint>) -> Evaluated {
    let material = material_of(number);
    var out = material_plain(material);
    for (var input = 0u; input < MATERIAL_ALL_INPUTS; input++) {
        let value = material_input(material, input, point);
        if (input == INPUT_ALPHA) {
            out.alpha = material_alpha(material, value, (*point).color);
        } else {
            material_put(material, input, value, &out);
        }
    }
    if (any((*point).color != vec4<f32>(1.0))) {
        let tint = max((*point).color.xyz, vec3<f32>(0.0));
        out.params.base_color *= tint;
        if ((out.flags & FLAG_UNLIT) != 0u) {
            out.emission *= tint;
        }
    }
    return out;
}

/// The frame around a tangent-space normal, with the same handedness.
fn material_bend(frame: Frame, normal: vec3<f32>) -> Frame {
    let z = normalize_or(frame_to_outer(frame, normal), frame.z);
    var bent = frame_from_z_and_tangent(z, frame.x);
    if (dot(cross(frame.x, frame.y), frame.z) < 0.0) {
        bent.y = -bent.y;
    }
    return bent;
}

/// The shading frame after the normal map. Also expresses the clear coat's normal in it.
fn material_shading_frame(evaluated: ptr<function, Evaluated>, frame: Frame) -> Frame {
    let has_normal = any((*evaluated).normal != vec3<f32>(0.0));
    let has_coat_normal = any((*evaluated).coat_normal != vec3<f32>(0.0));
    if (!has_normal && !has_coat_normal) {
        return frame;
    }
    var bent = frame;
    if (has_normal) {
        bent = material_bend(frame, (*evaluated).normal);
    }
    if ((*evaluated).params.clearcoat > 0.0) {
        var coat = frame.z;
        if (has_coat_normal) {
            coat = frame_to_outer(frame, (*evaluated).coat_normal);
        }
        (*evaluated).params.clearcoat_normal = normalize_or(frame_to_local(bent, coat), vec3<f32>(0.0, 0.0, 1.0));
    }
    return bent;
}
