//! From a scene's materials and a point's attributes to the numbers that the scattering needs.

use crate::bsdf::{Bsdf, BsdfParams, Metal};
use crate::texture::{PreparedTexture, TileAccess};
use std::collections::BTreeSet;
use vastlight_math::{Frame, Vec2, Vec3, Vec4, real};
use vastlight_scene::{AlphaMode, Channel, ColorInput, Material, NormalMap, ScalarInput, Scene};
use vastlight_store::StoredTexture;

/// Texture coordinate sets that a shading point carries.
pub const UV_SETS: usize = 4;

/// The attributes of a point that materials depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadingPoint {
    /// Texture coordinates by set; zero for absent sets. Only [`MaterialTable::uv_sets`] of them are read.
    pub uvs: [Vec2; UV_SETS],
    /// Linear vertex colour; white where the mesh has none.
    pub color: Vec4,
    /// The area around the point, in units of the texture coordinates by set, that a lookup stands for: 0 for the point alone.
    pub areas: [f32; UV_SETS],
}

impl Default for ShadingPoint {
    fn default() -> Self {
        Self { uvs: [Vec2::ZERO; UV_SETS], color: Vec4::ONE, areas: [0.0; UV_SETS] }
    }
}

/// A material at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evaluated {
    /// The scattering's numbers.
    pub params: BsdfParams,
    /// Emitted radiance, W/(sr m^2). Holds for the front; the back emits where [`MaterialTable::is_two_sided`].
    pub emission: Vec3,
    /// Coverage: 1 for an opaque surface, 0 or 1 for a masked one.
    pub alpha: f32,
    /// The emission alone is what is seen, to every ray; it is not light that lamps are sampled for.
    pub unlit: bool,
    /// Unit normal of the normal map, in tangent space.
    pub normal: Option<Vec3>,
    /// Unit normal of the clear coat's own map, in tangent space.
    pub clearcoat_normal: Option<Vec3>,
    /// Absorption coefficient of the inside, 1/metre; zero for none.
    pub attenuation: Vec3,
}

impl Evaluated {
    /// The shading frame after the normal map. `frame` is the frame of the interpolated normal (z) and the tangent
    /// (x) and bitangent (y, with its sign); it may be left-handed. Also expresses the clear coat's normal, which the
    /// base's normal map does not bend, in the new frame.
    #[must_use]
    pub fn shading_frame(&mut self, frame: &Frame) -> Frame {
        if self.normal.is_none() && self.clearcoat_normal.is_none() {
            return *frame;
        }
        let bent = self.normal.map_or(*frame, |n| bend(frame, n));
        if self.params.clearcoat > 0.0 {
            let coat = frame.to_outer(self.clearcoat_normal.unwrap_or(Vec3::Z));
            self.params.clearcoat_normal = bent.to_local(coat).normalize_or(Vec3::Z);
        }
        bent
    }
}

/// The frame around a tangent-space normal, with the same handedness.
fn bend(frame: &Frame, normal: Vec3) -> Frame {
    let z = frame.to_outer(normal).normalize_or(frame.z);
    let bent = Frame::from_z_and_tangent(z, frame.x);
    let left_handed = frame.x.cross(frame.y).dot(frame.z) < 0.0;
    if left_handed { Frame { y: -bent.y, ..bent } } else { bent }
}

/// All materials of a scene, ready to be evaluated. Borrows the scene's texels.
#[derive(Clone, Debug)]
pub struct MaterialTable<'s> {
    textures: Vec<PreparedTexture<'s>>,
    rows: Vec<Row<'s>>,
}

/// A material, ready.
#[derive(Clone, Debug)]
pub(crate) struct Row<'s> {
    pub(crate) material: &'s Material,
    /// The evaluation without textures and vertex colour, and its scattering.
    pub(crate) plain: Evaluated,
    bsdf: Bsdf,
    textured: bool,
    /// All lookups are exact.
    pub(crate) exact: bool,
    pub(crate) uv_sets: usize,
    /// The most tiles that an evaluation needs.
    most_tiles: usize,
}

/// Tiles that a lookup touches at most: of two levels, four each.
const TILES_OF_LOOKUP: usize = 8;

impl<'s> MaterialTable<'s> {
    /// Prepares the scene's materials and textures.
    #[must_use]
    pub fn new(scene: &'s Scene) -> Self {
        Self::with_tiles(scene, &[])
    }

    /// The same for a scene of which some images are in tiles.
    #[must_use]
    pub fn with_tiles(scene: &'s Scene, stored: &[StoredTexture]) -> Self {
        let textures = PreparedTexture::all(scene, stored);
        let rows = scene.materials().iter().map(|m| Row::new(m, &textures)).collect();
        Self { textures, rows }
    }

    /// The material at a point. `material` must be an index into the scene's materials. For materials that are
    /// [in tiles](Self::is_in_tiles) it takes [`evaluate_through`](Self::evaluate_through).
    #[must_use]
    pub fn evaluate(&self, material: u32, point: &ShadingPoint) -> Evaluated {
        self.evaluate_with(material, point, None)
    }

    /// The material at a point, with textures in tiles.
    #[must_use]
    pub fn evaluate_through(
        &self,
        tiles: &mut TileAccess<'_>,
        material: u32,
        point: &ShadingPoint,
    ) -> Evaluated {
        self.evaluate_with(material, point, Some(tiles))
    }

    #[inline(always)]
    fn evaluate_with(
        &self,
        material: u32,
        point: &ShadingPoint,
        tiles: Option<&mut TileAccess<'_>>,
    ) -> Evaluated {
        let row = &self.rows[material as usize];
        let mut out = row.plain;
        let mut lookups = Lookups { tiles, ..self.lookups(point, row.exact) };
        out.alpha = lookups.alpha(row.material);
        if row.textured {
            lookups.apply(row.material, &mut out);
        }
        if point.color != Vec4::ONE {
            let tint = point.color.truncate().max(Vec3::ZERO);
            out.params.base_color *= tint;
            if out.unlit {
                out.emission *= tint;
            }
        }
        out
    }

    /// The material and its scattering in empty space, if nothing changes them at `point`: no texture, no vertex colour.
    #[inline]
    pub(crate) fn uniform(&self, material: u32, point: &ShadingPoint) -> Option<(&Evaluated, &Bsdf)> {
        let row = &self.rows[material as usize];
        (!row.textured && point.color == Vec4::ONE).then_some((&row.plain, &row.bsdf))
    }

    /// Coverage at a point: 1 for an opaque surface, 0 or 1 for a masked one.
    #[must_use]
    pub fn alpha(&self, material: u32, point: &ShadingPoint) -> f32 {
        self.lookups(point, true).alpha(self.rows[material as usize].material)
    }

    /// Emitted radiance at a point, W/(sr m^2), without the rest of the material. Zero for unlit materials.
    #[must_use]
    pub fn emission(&self, material: u32, point: &ShadingPoint) -> Vec3 {
        let m = self.rows[material as usize].material;
        if m.unlit { Vec3::ZERO } else { self.lookups(point, true).color(&m.emission) }
    }

    /// Absorption coefficient of the material's inside, 1/metre; zero for none.
    #[must_use]
    pub fn attenuation(&self, material: u32) -> Vec3 {
        self.rows[material as usize].plain.attenuation
    }

    /// Whether coverage may be below 1 somewhere.
    #[must_use]
    pub fn has_alpha(&self, material: u32) -> bool {
        self.rows[material as usize].material.has_alpha()
    }

    /// Whether the material may be a smooth thin wall somewhere, which shadow rays pass.
    #[must_use]
    pub fn may_be_pane(&self, material: u32) -> bool {
        self.rows[material as usize].material.may_be_pane()
    }

    /// Whether the material may send on light in a narrow lobe somewhere.
    #[must_use]
    pub fn may_focus(&self, material: u32) -> bool {
        let row = &self.rows[material as usize];
        let m = row.material;
        let inputs =
            [&m.roughness, &m.metallic, &m.transmission, &m.specular, &m.clearcoat, &m.clearcoat_roughness];
        !m.unlit && (row.bsdf.may_focus() || inputs.iter().any(|input| input.texture.is_some()))
    }

    /// Whether textures of the material are in tiles.
    #[inline]
    #[must_use]
    pub fn is_in_tiles(&self, material: u32) -> bool {
        self.rows[material as usize].most_tiles > 0
    }

    /// The most tiles that the evaluation of a material at a point needs; 0 where no material is in tiles.
    #[must_use]
    pub fn most_tiles(&self) -> usize {
        self.rows.iter().map(|row| row.most_tiles).max().unwrap_or(0)
    }

    /// The most tiles that the evaluation of a material needs if all its textures are in tiles.
    pub(crate) fn most_tiles_of_all(&self) -> usize {
        let textures =
            |row: &Row<'_>| row.material.textures().iter().map(|used| used.0).collect::<BTreeSet<_>>();
        TILES_OF_LOOKUP * self.rows.iter().map(|row| textures(row).len()).max().unwrap_or(0)
    }

    /// Whether the back emits like the front.
    #[must_use]
    pub fn is_two_sided(&self, material: u32) -> bool {
        self.rows[material as usize].material.double_sided
    }

    /// How many texture coordinate sets, from the first, the material reads: 0 without textures.
    #[must_use]
    pub fn uv_sets(&self, material: u32) -> usize {
        self.rows[material as usize].uv_sets
    }

    /// Whether the frame's tangent matters: there is a normal map or a stretched highlight.
    #[must_use]
    pub fn needs_tangent(&self, material: u32) -> bool {
        self.rows[material as usize].needs_tangent()
    }

    /// All materials and textures, ready.
    pub(crate) fn parts(&self) -> (&[Row<'s>], &[PreparedTexture<'s>]) {
        (&self.rows, &self.textures)
    }

    fn lookups<'a>(&'a self, point: &'a ShadingPoint, exact: bool) -> Lookups<'a, 'a> {
        Lookups { textures: &self.textures, point, last: None, exact, tiles: None }
    }
}

/// Looks inputs up at one point. Neighbouring inputs often share a texture (roughness and metallic, colour and alpha):
/// the last value is kept.
struct Lookups<'a, 't> {
    textures: &'a [PreparedTexture<'a>],
    point: &'a ShadingPoint,
    /// Texture, bits of the area, value.
    last: Option<(u32, u32, Vec4)>,
    /// Whether lookups are for the point alone: where hits or light depend on them (`Material::looks_up_exactly`).
    exact: bool,
    /// Where textures that are not in memory are looked up.
    tiles: Option<&'a mut TileAccess<'t>>,
}

impl Lookups<'_, '_> {
    /// A texture's value; white for an index that is not there.
    fn texture(&mut self, index: u32) -> Vec4 {
        let Some(texture) = self.textures.get(index as usize) else { return Vec4::ONE };
        let set = texture.uv_set() as usize;
        let area = if self.exact { 0.0 } else { self.point.areas.get(set).copied().unwrap_or_default() };
        if let Some((last, last_area, value)) = self.last
            && (last, last_area) == (index, area.to_bits())
        {
            return value;
        }
        let uv = self.point.uvs.get(set).copied().unwrap_or_default();
        let value = match &mut self.tiles {
            Some(tiles) => texture.lookup_through(tiles, uv, area),
            None => texture.lookup_area(uv, area),
        };
        self.last = Some((index, area.to_bits(), value));
        value
    }

    fn scalar(&mut self, input: &ScalarInput) -> f32 {
        match input.texture {
            None => input.factor,
            Some((index, channel)) => input.factor * select(self.texture(index), channel),
        }
    }

    fn color(&mut self, input: &ColorInput) -> Vec3 {
        match input.texture {
            None => input.factor,
            Some(index) => input.factor * self.texture(index).truncate(),
        }
    }

    fn normal(&mut self, map: &NormalMap) -> Option<Vec3> {
        let n = self.texture(map.texture).truncate() * 2.0 - 1.0;
        Vec3::new(n.x * map.scale, n.y * map.scale, n.z.max(1e-3)).try_normalize()
    }

    fn alpha(&mut self, m: &Material) -> f32 {
        if m.alpha_mode == AlphaMode::Opaque {
            return 1.0;
        }
        let exact = std::mem::replace(&mut self.exact, true);
        let alpha = self.scalar(&m.alpha) * self.point.color.w;
        self.exact = exact;
        match m.alpha_mode {
            AlphaMode::Mask(cutoff) if alpha >= cutoff => 1.0,
            AlphaMode::Mask(_) => 0.0,
            _ => unit(alpha),
        }
    }

    /// Replaces what textures decide.
    fn apply(&mut self, m: &Material, out: &mut Evaluated) {
        if m.unlit {
            out.emission = self.color(&m.base_color);
            return;
        }
        let p = &mut out.params;
        p.base_color = self.color(&m.base_color);
        p.metallic = self.scalar(&m.metallic);
        p.roughness = self.scalar(&m.roughness);
        p.transmission = self.scalar(&m.transmission);
        p.specular = self.scalar(&m.specular);
        p.specular_color = self.color(&m.specular_color);
        p.clearcoat = self.scalar(&m.clearcoat);
        p.clearcoat_roughness = self.scalar(&m.clearcoat_roughness);
        p.sheen_color = self.color(&m.sheen_color);
        p.sheen_roughness = self.scalar(&m.sheen_roughness);
        p.iridescence = self.scalar(&m.iridescence);
        if let Some(index) = m.iridescence_thickness_texture {
            let [low, high] = m.iridescence_thickness;
            p.iridescence_thickness = low + (high - low) * self.texture(index).y;
        }
        if let Some(index) = m.anisotropy_texture {
            let texel = self.texture(index);
            let d = Vec2::new(texel.x, texel.y) * 2.0 - Vec2::ONE;
            p.anisotropy = m.anisotropy * texel.z;
            p.anisotropy_direction = p.anisotropy_direction.rotate(d.normalize_or(Vec2::X));
        }
        out.normal = m.normal_map.as_ref().and_then(|map| self.normal(map));
        out.clearcoat_normal = m.clearcoat_normal_map.as_ref().and_then(|map| self.normal(map));
        self.exact = true;
        out.emission = self.color(&m.emission);
    }
}

impl<'s> Row<'s> {
    /// Whether the frame's tangent matters.
    pub(crate) fn needs_tangent(&self) -> bool {
        let m = self.material;
        m.normal_map.is_some() || m.clearcoat_normal_map.is_some() || m.anisotropy != 0.0
    }

    fn new(m: &'s Material, textures: &[PreparedTexture<'s>]) -> Self {
        let used = m.textures();
        let uv_sets =
            used.iter().filter_map(|&(i, _)| textures.get(i as usize)).map(|t| t.uv_set() as usize + 1).max();
        let in_tiles = |i: &u32| textures.get(*i as usize).is_some_and(PreparedTexture::is_in_tiles);
        // A texture with several roles is looked up in the same tiles.
        let tiled: BTreeSet<u32> = used.iter().map(|&(i, _)| i).filter(in_tiles).collect();
        let mut plain = plain(m);
        plain.alpha =
            Lookups { textures: &[], point: &ShadingPoint::default(), last: None, exact: true, tiles: None }
                .alpha(m);
        Self {
            material: m,
            bsdf: Bsdf::new(&plain.params),
            plain,
            textured: !used.is_empty(),
            exact: m.may_be_pane(),
            uv_sets: uv_sets.unwrap_or(0).min(UV_SETS),
            most_tiles: TILES_OF_LOOKUP * tiled.len(),
        }
    }
}

/// The evaluation of a material without its textures.
fn plain(m: &Material) -> Evaluated {
    let (sin, cos) = real::sin_cos(m.anisotropy_rotation);
    let params = BsdfParams {
        base_color: m.base_color.factor,
        metallic: m.metallic.factor,
        roughness: m.roughness.factor,
        conductor: m.conductor.map(Metal::new),
        ior: m.ior,
        specular: m.specular.factor,
        specular_color: m.specular_color.factor,
        transmission: m.transmission.factor,
        transmission_tint: Vec3::ONE,
        thin: m.thickness <= 0.0,
        dispersion: m.dispersion,
        clearcoat: m.clearcoat.factor,
        clearcoat_roughness: m.clearcoat_roughness.factor,
        clearcoat_normal: Vec3::Z,
        sheen_color: m.sheen_color.factor,
        sheen_roughness: m.sheen_roughness.factor,
        anisotropy: m.anisotropy,
        anisotropy_direction: Vec2::new(cos, sin),
        iridescence: m.iridescence.factor,
        iridescence_ior: m.iridescence_ior,
        iridescence_thickness: m.iridescence_thickness[1],
    };
    let params = if m.unlit { BsdfParams::diffuse(Vec3::ZERO) } else { params };
    Evaluated {
        params,
        emission: if m.unlit { m.base_color.factor } else { m.emission.factor },
        alpha: 1.0,
        unlit: m.unlit,
        normal: None,
        clearcoat_normal: None,
        attenuation: attenuation(m),
    }
}

/// Absorption so that white light has the attenuation colour after the attenuation distance (Beer and Lambert).
fn attenuation(m: &Material) -> Vec3 {
    let inside = m.thickness > 0.0 && m.attenuation_distance > 0.0 && m.attenuation_distance.is_finite();
    if !inside {
        return Vec3::ZERO;
    }
    let sigma = |c: f32| -real::ln(c.clamp(1e-6, 1.0)) / m.attenuation_distance;
    let c = m.attenuation_color;
    Vec3::new(sigma(c.x), sigma(c.y), sigma(c.z))
}

fn select(v: Vec4, channel: Channel) -> f32 {
    match channel {
        Channel::R => v.x,
        Channel::G => v.y,
        Channel::B => v.z,
        Channel::A => v.w,
    }
}

fn unit(x: f32) -> f32 {
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_scene::{Encoding, Image, SceneDesc, Texels, Texture};

    /// A scene of one material and one texture: a single texel of bytes.
    fn scene(material: Material, texel: [u8; 4], encoding: Encoding) -> Scene {
        let texels = Texels::U8(texel.to_vec());
        let image = Image { name: String::new(), width: 1, height: 1, channels: 4, texels };
        let desc = SceneDesc {
            materials: vec![material],
            images: vec![image],
            textures: vec![Texture { uv_set: 1, ..Texture::new(0, encoding) }],
            ..SceneDesc::default()
        };
        Scene::new(desc).expect("valid")
    }

    #[test]
    fn factors_textures_and_vertex_colours_multiply() {
        let material = Material {
            base_color: ColorInput { factor: Vec3::new(0.5, 1.0, 1.0), texture: Some(0) },
            metallic: ScalarInput { factor: 0.5, texture: Some((0, Channel::B)) },
            roughness: ScalarInput { factor: 1.0, texture: Some((0, Channel::G)) },
            ..Material::new("m")
        };
        let scene = scene(material, [255, 51, 102, 255], Encoding::Linear);
        let table = MaterialTable::new(&scene);
        assert_eq!(table.uv_sets(0), 2);
        let point = ShadingPoint { color: Vec4::new(0.5, 0.5, 1.0, 1.0), ..ShadingPoint::default() };
        let p = table.evaluate(0, &point).params;
        assert!((p.base_color - Vec3::new(0.25, 0.1, 0.4)).abs().max_element() < 1e-6, "{}", p.base_color);
        assert!((p.metallic - 0.2).abs() < 1e-6 && (p.roughness - 0.2).abs() < 1e-6);
    }

    #[test]
    fn alpha_is_ignored_tested_or_blended() {
        let alpha = ScalarInput { factor: 0.5, texture: Some((0, Channel::A)) };
        for (mode, expected) in [
            (AlphaMode::Opaque, 1.0),
            (AlphaMode::Mask(0.19), 1.0),
            (AlphaMode::Mask(0.21), 0.0),
            (AlphaMode::Blend, 0.2),
        ] {
            let material = Material { alpha, alpha_mode: mode, ..Material::new("m") };
            let scene = scene(material, [0, 0, 0, 102], Encoding::Srgb);
            let table = MaterialTable::new(&scene);
            let point = ShadingPoint::default();
            assert!((table.alpha(0, &point) - expected).abs() < 1e-6, "{mode:?}");
            assert_eq!(table.evaluate(0, &point).alpha, table.alpha(0, &point));
        }
    }

    #[test]
    fn attenuation_gives_the_colour_at_its_distance() {
        let material = Material {
            attenuation_color: Vec3::new(0.5, 1.0, 0.1),
            attenuation_distance: 2.0,
            ..Material::glass("g", 1.5, 0.0)
        };
        let scene = scene(material.clone(), [0; 4], Encoding::Srgb);
        let sigma = MaterialTable::new(&scene).evaluate(0, &ShadingPoint::default()).attenuation;
        let left = Vec3::new(real::exp(-2.0 * sigma.x), real::exp(-2.0 * sigma.y), real::exp(-2.0 * sigma.z));
        assert!((left - material.attenuation_color).abs().max_element() < 1e-5);
        assert_eq!(attenuation(&Material { thickness: 0.0, ..material }), Vec3::ZERO);
    }

    #[test]
    fn unlit_materials_show_their_colour_and_scatter_nothing() {
        let base_color = ColorInput { factor: Vec3::new(1.0, 0.5, 0.25), texture: Some(0) };
        let scene =
            scene(Material { unlit: true, base_color, ..Material::new("u") }, [255; 4], Encoding::Srgb);
        let table = MaterialTable::new(&scene);
        let e = table.evaluate(0, &ShadingPoint::default());
        assert!(e.unlit && (e.emission - base_color.factor).length() < 1e-6);
        assert!(!crate::Bsdf::new(&e.params).has_nondelta());
        assert_eq!(table.emission(0, &ShadingPoint::default()), Vec3::ZERO);
    }

    #[test]
    fn normal_maps_bend_the_frame_and_not_the_coat() {
        let map = Some(NormalMap { texture: 0, scale: 1.0 });
        let material = Material { normal_map: map, clearcoat: ScalarInput::new(1.0), ..Material::new("n") };
        let scene = scene(material, [217, 128, 217, 255], Encoding::Linear);
        let mut e = MaterialTable::new(&scene).evaluate(0, &ShadingPoint::default());
        for y in [Vec3::Y, -Vec3::Y] {
            let flat = Frame { x: Vec3::X, y, z: Vec3::Z };
            let bent = e.shading_frame(&flat);
            assert!(bent.z.x > 0.7 && bent.x.dot(bent.z).abs() < 1e-6);
            assert!((bent.y - y).length() < 0.1, "handedness stays: {}", bent.y);
            assert!((bent.to_outer(e.params.clearcoat_normal) - Vec3::Z).length() < 1e-5);
        }
    }

    #[test]
    fn textures_that_do_not_exist_are_white() {
        let base_color = ColorInput { factor: Vec3::splat(0.5), texture: Some(77) };
        let scene = scene(Material { base_color, ..Material::new("m") }, [0; 4], Encoding::Srgb);
        let p = MaterialTable::new(&scene).evaluate(0, &ShadingPoint::default()).params;
        assert_eq!(p.base_color, Vec3::splat(0.5));
    }
}
