//! From a scene's materials and a point's attributes to the numbers that the scattering needs.

use crate::bsdf::{BsdfParams, Metal};
use crate::texture::PreparedTexture;
use vastlight_math::{Frame, Vec2, Vec3, Vec4, real};
use vastlight_scene::{AlphaMode, Channel, ColorInput, Material, NormalMap, ScalarInput, Scene};

/// Texture coordinate sets that a shading point carries.
pub const UV_SETS: usize = 4;

/// The attributes of a point that materials depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadingPoint {
    /// Texture coordinates by set; zero for absent sets. Only [`MaterialTable::uv_sets`] of them are read.
    pub uvs: [Vec2; UV_SETS],
    /// Linear vertex colour; white where the mesh has none.
    pub color: Vec4,
}

impl Default for ShadingPoint {
    fn default() -> Self {
        Self { uvs: [Vec2::ZERO; UV_SETS], color: Vec4::ONE }
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

#[derive(Clone, Debug)]
struct Row<'s> {
    material: &'s Material,
    /// The evaluation without textures and vertex colour.
    plain: Evaluated,
    textured: bool,
    uv_sets: usize,
}

impl<'s> MaterialTable<'s> {
    /// Prepares the scene's materials and textures.
    #[must_use]
    pub fn new(scene: &'s Scene) -> Self {
        let textures = PreparedTexture::all(scene);
        let rows = scene.materials().iter().map(|m| Row::new(m, &textures)).collect();
        Self { textures, rows }
    }

    /// The material at a point. `material` must be an index into the scene's materials.
    #[must_use]
    pub fn evaluate(&self, material: u32, point: &ShadingPoint) -> Evaluated {
        let row = &self.rows[material as usize];
        let mut out = row.plain;
        if row.textured {
            self.apply_textures(row.material, point, &mut out);
        }
        if point.color != Vec4::ONE {
            let tint = point.color.truncate().max(Vec3::ZERO);
            out.params.base_color *= tint;
            if out.unlit {
                out.emission *= tint;
            }
        }
        if row.material.alpha_mode != AlphaMode::Opaque {
            out.alpha = self.alpha(material, point);
        }
        out
    }

    /// Coverage at a point: 1 for an opaque surface, 0 or 1 for a masked one.
    #[must_use]
    pub fn alpha(&self, material: u32, point: &ShadingPoint) -> f32 {
        let m = self.rows[material as usize].material;
        match m.alpha_mode {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask(cutoff) => {
                if self.scalar(&m.alpha, point) * point.color.w >= cutoff {
                    1.0
                } else {
                    0.0
                }
            }
            AlphaMode::Blend => unit(self.scalar(&m.alpha, point) * point.color.w),
        }
    }

    /// Emitted radiance at a point, W/(sr m^2), without the rest of the material. Zero for unlit materials.
    #[must_use]
    pub fn emission(&self, material: u32, point: &ShadingPoint) -> Vec3 {
        let m = self.rows[material as usize].material;
        if m.unlit { Vec3::ZERO } else { self.color(&m.emission, point) }
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
        let m = self.rows[material as usize].material;
        m.normal_map.is_some() || m.clearcoat_normal_map.is_some() || m.anisotropy != 0.0
    }

    /// A texture's value; white for an index that is not there.
    fn texture(&self, index: u32, point: &ShadingPoint) -> Vec4 {
        let Some(texture) = self.textures.get(index as usize) else { return Vec4::ONE };
        texture.lookup(point.uvs.get(texture.uv_set() as usize).copied().unwrap_or_default())
    }

    fn scalar(&self, input: &ScalarInput, point: &ShadingPoint) -> f32 {
        match input.texture {
            None => input.factor,
            Some((index, channel)) => input.factor * select(self.texture(index, point), channel),
        }
    }

    fn color(&self, input: &ColorInput, point: &ShadingPoint) -> Vec3 {
        match input.texture {
            None => input.factor,
            Some(index) => input.factor * self.texture(index, point).truncate(),
        }
    }

    fn normal(&self, map: &NormalMap, point: &ShadingPoint) -> Option<Vec3> {
        let n = self.texture(map.texture, point).truncate() * 2.0 - 1.0;
        let n = Vec3::new(n.x * map.scale, n.y * map.scale, n.z.max(1e-3));
        n.try_normalize()
    }

    fn apply_textures(&self, m: &Material, point: &ShadingPoint, out: &mut Evaluated) {
        if m.unlit {
            out.emission = self.color(&m.base_color, point);
            return;
        }
        let p = &mut out.params;
        if m.base_color.texture.is_some() {
            p.base_color = self.color(&m.base_color, point);
        }
        p.metallic = self.scalar(&m.metallic, point);
        p.roughness = self.scalar(&m.roughness, point);
        p.specular = self.scalar(&m.specular, point);
        p.specular_color = self.color(&m.specular_color, point);
        p.transmission = self.scalar(&m.transmission, point);
        p.clearcoat = self.scalar(&m.clearcoat, point);
        p.clearcoat_roughness = self.scalar(&m.clearcoat_roughness, point);
        p.sheen_color = self.color(&m.sheen_color, point);
        p.sheen_roughness = self.scalar(&m.sheen_roughness, point);
        p.iridescence = self.scalar(&m.iridescence, point);
        if let Some(index) = m.iridescence_thickness_texture {
            let [low, high] = m.iridescence_thickness;
            p.iridescence_thickness = low + (high - low) * self.texture(index, point).y;
        }
        if let Some(index) = m.anisotropy_texture {
            let texel = self.texture(index, point);
            let d = Vec2::new(texel.x, texel.y) * 2.0 - Vec2::ONE;
            p.anisotropy = m.anisotropy * texel.z;
            let rotation = p.anisotropy_direction;
            p.anisotropy_direction = rotation.rotate(d.normalize_or(Vec2::X));
        }
        out.emission = self.color(&m.emission, point);
        out.normal = m.normal_map.as_ref().and_then(|map| self.normal(map, point));
        out.clearcoat_normal = m.clearcoat_normal_map.as_ref().and_then(|map| self.normal(map, point));
    }
}

impl<'s> Row<'s> {
    fn new(m: &'s Material, textures: &[PreparedTexture<'s>]) -> Self {
        let used = textures_of(m);
        let uv_sets =
            used.iter().filter_map(|&i| textures.get(i as usize)).map(|t| t.uv_set() as usize + 1).max();
        Self {
            material: m,
            plain: plain(m),
            textured: !used.is_empty(),
            uv_sets: uv_sets.unwrap_or(0).min(UV_SETS),
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

/// Every texture that a material refers to.
fn textures_of(m: &Material) -> Vec<u32> {
    let scalars = [
        &m.alpha,
        &m.metallic,
        &m.roughness,
        &m.specular,
        &m.transmission,
        &m.clearcoat,
        &m.clearcoat_roughness,
        &m.sheen_roughness,
        &m.iridescence,
    ];
    let colors = [&m.base_color, &m.emission, &m.specular_color, &m.sheen_color];
    let maps = [&m.normal_map, &m.clearcoat_normal_map];
    let single = [m.anisotropy_texture, m.iridescence_thickness_texture];
    let scalars = scalars.iter().filter_map(|s| s.texture.map(|t| t.0));
    let colors = colors.iter().filter_map(|c| c.texture);
    let maps = maps.iter().filter_map(|n| n.as_ref().map(|n| n.texture));
    scalars.chain(colors).chain(maps).chain(single.into_iter().flatten()).collect()
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
