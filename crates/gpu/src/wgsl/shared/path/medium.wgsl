// The media that a path is inside of, as in `vastlight-transport`, `medium`.
//#include table_access
//#include real

/// Volumes around a path, outermost first, by material; all bits for none.
alias MediumStack = vec4<u32>;

const NO_MEDIUM: u32 = 0xffffffffu;

/// The material whose volume surrounds the path.
fn medium_current(media: MediumStack) -> u32 {
    for (var i = 4u; i > 0u; i--) {
        if (media[i - 1u] != NO_MEDIUM) {
            return media[i - 1u];
        }
    }
    return NO_MEDIUM;
}

fn medium_entered(given: MediumStack, material: u32) -> MediumStack {
    var media = given;
    for (var i = 0u; i < 4u; i++) {
        if (media[i] == NO_MEDIUM) {
            media[i] = material;
            return media;
        }
    }
    return media;
}

fn medium_left(given: MediumStack, material: u32) -> MediumStack {
    var media = given;
    for (var i = 4u; i > 0u; i--) {
        if (media[i - 1u] == material) {
            for (var place = i - 1u; place < 3u; place++) {
                media[place] = media[place + 1u];
            }
            media[3] = NO_MEDIUM;
            return media;
        }
    }
    return media;
}

/// What remains of light after a distance in a medium that absorbs so much a metre.
fn transmittance(absorption: vec3<f32>, distance: f32) -> vec3<f32> {
    if (all(absorption == vec3<f32>(0.0))) {
        return vec3<f32>(1.0);
    }
    let depth = absorption * distance;
    return vec3<f32>(real_exp(-depth.x), real_exp(-depth.y), real_exp(-depth.z));
}

fn medium_attenuation(material: u32) -> vec3<f32> {
    return table_vec3(record_of(TABLES_MATERIALS, material, MATERIAL_WORDS) + MATERIAL_ATTENUATION);
}
