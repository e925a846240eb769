//! What the textures of a scene are used for.

use crate::{Content, Encoding, Material, Texture};

/// What a texture tells a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureRole {
    /// How much of the surface is there.
    Alpha,
    /// Light.
    Emission,
    /// Normals.
    Normals,
    /// Anything else.
    Look,
}

impl Material {
    /// Calls `each` with the number of every texture that the material refers to, and what for; some come more than once.
    fn each_texture(&mut self, mut each: impl FnMut(&mut u32, TextureRole)) {
        let scalars = [
            &mut self.metallic,
            &mut self.roughness,
            &mut self.specular,
            &mut self.transmission,
            &mut self.clearcoat,
            &mut self.clearcoat_roughness,
            &mut self.sheen_roughness,
            &mut self.iridescence,
        ];
        let colors = [&mut self.base_color, &mut self.specular_color, &mut self.sheen_color];
        let single = [&mut self.anisotropy_texture, &mut self.iridescence_thickness_texture];
        let maps = [&mut self.normal_map, &mut self.clearcoat_normal_map];
        let scalars = scalars.into_iter().filter_map(|s| s.texture.as_mut().map(|(texture, _)| texture));
        let colors = colors.into_iter().filter_map(|c| c.texture.as_mut());
        let single = single.into_iter().filter_map(Option::as_mut);
        scalars.chain(colors).chain(single).for_each(|texture| each(texture, TextureRole::Look));
        let alpha = self.alpha.texture.as_mut().map(|(texture, _)| texture);
        alpha.into_iter().for_each(|texture| each(texture, TextureRole::Alpha));
        self.emission.texture.iter_mut().for_each(|texture| each(texture, TextureRole::Emission));
        let maps = maps.into_iter().filter_map(|map| map.as_mut().map(|map| &mut map.texture));
        maps.for_each(|texture| each(texture, TextureRole::Normals));
    }

    /// Every texture that the material refers to, and for what; some more than once.
    #[must_use]
    pub fn textures(&self) -> Vec<(u32, TextureRole)> {
        let mut found = Vec::new();
        self.clone().each_texture(|texture, role| found.push((*texture, role)));
        found
    }

    /// Adds `by` to the number of every texture that the material refers to.
    pub fn move_textures(&mut self, by: u32) {
        self.each_texture(|texture, _| *texture += by);
    }

    /// Whether the material may be a smooth thin wall somewhere, which shadow rays pass.
    #[must_use]
    pub fn may_be_pane(&self) -> bool {
        let smooth = self.roughness.factor < 0.1 || self.roughness.texture.is_some();
        self.thickness <= 0.0 && self.transmission.factor > 0.0 && self.metallic.factor < 1.0 && smooth
    }

    /// Whether what a texture says in a role is always looked up in the image itself, never in smaller ones: what hits
    /// or light depend on.
    #[must_use]
    pub fn looks_up_exactly(&self, role: TextureRole) -> bool {
        self.may_be_pane()
            || match role {
                TextureRole::Alpha => self.has_alpha(),
                TextureRole::Emission => true,
                TextureRole::Normals | TextureRole::Look => false,
            }
    }
}

/// How a texture is looked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureUse {
    /// What its numbers are.
    pub content: Content,
    /// Whether some lookups are in the image itself at any distance.
    pub exact: bool,
    /// Whether some lookups are in smaller images from afar.
    pub filtered: bool,
}

/// The uses of all textures.
#[must_use]
pub fn texture_uses(materials: &[Material], textures: &[Texture]) -> Vec<TextureUse> {
    let content = |texture: &Texture| match texture.encoding {
        Encoding::Srgb => Content::Color,
        Encoding::Linear => Content::Data,
    };
    let unused = |texture| TextureUse { content: content(texture), exact: false, filtered: false };
    let mut uses: Vec<TextureUse> = textures.iter().map(unused).collect();
    for material in materials {
        for (texture, role) in material.textures() {
            let Some(found) = uses.get_mut(texture as usize) else { continue };
            let exact = material.looks_up_exactly(role);
            found.exact |= exact;
            // The alpha of opaque materials is not looked up at all.
            found.filtered |= !exact && role != TextureRole::Alpha;
            if role == TextureRole::Normals && found.content == Content::Data {
                found.content = Content::Normals;
            }
        }
    }
    uses
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{AlphaMode, Channel, ColorInput, NormalMap, ScalarInput};
    use vastlight_math::Vec3;

    #[test]
    fn what_hits_and_light_depend_on_is_exact() {
        let textures = [Encoding::Srgb, Encoding::Linear, Encoding::Srgb].map(|e| Texture::new(0, e));
        let color = |texture| ColorInput { factor: Vec3::ONE, texture: Some(texture) };
        let mut material = Material {
            base_color: color(0),
            alpha: ScalarInput { factor: 1.0, texture: Some((0, Channel::A)) },
            normal_map: Some(NormalMap { texture: 1, scale: 1.0 }),
            emission: color(2),
            ..Material::new("m")
        };
        let of = |m: &Material| texture_uses(std::slice::from_ref(m), &textures);
        let found = |content, exact, filtered| TextureUse { content, exact, filtered };
        let normals = found(Content::Normals, false, true);
        let emission = found(Content::Color, true, false);
        assert_eq!(of(&material), [found(Content::Color, false, true), normals, emission]);
        material.alpha_mode = AlphaMode::Blend;
        assert_eq!(of(&material)[0], found(Content::Color, true, true));
        material.transmission.factor = 1.0;
        material.roughness.factor = 0.0;
        assert_eq!(of(&material)[1], found(Content::Normals, true, false), "a pane");
        assert_eq!(of(&Material::new("bare"))[0], found(Content::Color, false, false));
    }
}
