// Reading the binding `tables`. Who includes this has it.
//#include tables
//#include layouts

fn table_f32(at: u32) -> f32 {
    return bitcast<f32>(tables[at]);
}

fn table_vec2(at: u32) -> vec2<f32> {
    return vec2<f32>(table_f32(at), table_f32(at + 1u));
}

fn table_vec3(at: u32) -> vec3<f32> {
    return vec3<f32>(table_f32(at), table_f32(at + 1u), table_f32(at + 2u));
}

/// v / |v|, or `otherwise` where that is nothing of use.
fn normalize_or(v: vec3<f32>, otherwise: vec3<f32>) -> vec3<f32> {
    let size = dot(v, v);
    if (size > 0.0 && size < 3.4e38) {
        return v / sqrt(size);
    }
    return otherwise;
}

/// Where the record of this number begins.
fn record_of(section: u32, number: u32, words: u32) -> u32 {
    return tables[section] + number * words;
}
