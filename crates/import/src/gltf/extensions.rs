//! Which extensions are supported.

/// How far an extension is supported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Support {
    /// As its text says.
    Full,
    /// But for what the words say.
    Partial(&'static str),
    /// Not at all.
    None,
}

const TABLE: &[(&str, Support)] = &[
    ("EXT_mesh_gpu_instancing", Support::Full),
    ("EXT_meshopt_compression", Support::Full),
    ("EXT_texture_webp", Support::Full),
    ("KHR_draco_mesh_compression", Support::Full),
    ("KHR_lights_punctual", Support::Full),
    ("KHR_materials_anisotropy", Support::Full),
    ("KHR_materials_clearcoat", Support::Full),
    ("KHR_materials_dispersion", Support::Full),
    ("KHR_materials_emissive_strength", Support::Full),
    ("KHR_materials_ior", Support::Full),
    ("KHR_materials_iridescence", Support::Full),
    ("KHR_materials_sheen", Support::Full),
    ("KHR_materials_specular", Support::Full),
    ("KHR_materials_transmission", Support::Full),
    ("KHR_materials_unlit", Support::Full),
    ("KHR_materials_variants", Support::Partial("only the default materials are shown")),
    ("KHR_materials_volume", Support::Full),
    ("KHR_mesh_quantization", Support::Full),
    ("KHR_meshopt_compression", Support::Full),
    ("KHR_node_visibility", Support::Full),
    ("KHR_texture_basisu", Support::Full),
    ("KHR_texture_transform", Support::Full),
    ("KHR_xmp", Support::Full),
    ("KHR_xmp_json_ld", Support::Full),
];

/// How far an extension is supported.
pub(super) fn support(name: &str) -> Support {
    TABLE.binary_search_by_key(&name, |(known, _)| known).map_or(Support::None, |i| TABLE[i].1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_sorted() {
        assert!(TABLE.windows(2).all(|pair| pair[0].0 < pair[1].0));
        assert_eq!(support("KHR_materials_ior"), Support::Full);
        assert_eq!(support("KHR_unheard_of"), Support::None);
    }
}
