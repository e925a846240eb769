//! The JSON of a GLB. Nodes, which may be millions, are written one by one; the rest is small.

use super::EXTRAS_HINT;
use super::layout::{Layout, MeshLayout, Primitive};
use super::material::{self, Extensions};
use super::number::{color_and_strength, number, numbers};
use crate::ExportError;
use crate::target::Target;
use serde_json::{Map, Value, json};
use vastlight_math::{Affine3, Vec3};
use vastlight_scene::{
    Camera, Diagnostics, Environment, Filter, Instances, Light, LightKind, Projection, Scene, Texture, Wrap,
};

const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_BUFFER: u32 = 34963;

/// What the document describes.
pub(super) struct Document<'a> {
    pub(super) scene: &'a Scene,
    pub(super) layout: &'a Layout,
    pub(super) instances: &'a Instances,
}

/// Tables that refer to the binary chunk.
#[derive(Default)]
struct Tables {
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Tables {
    fn view(&mut self, offset: u64, length: u64) -> usize {
        self.views.push(json!({"buffer": 0, "byteOffset": offset, "byteLength": length}));
        self.views.len() - 1
    }

    /// A view of one attribute, which several primitives may share.
    fn vertex_view(&mut self, offset: u64, length: u64, stride: u64) -> usize {
        let view = self.view(offset, length);
        self.views[view]["byteStride"] = stride.into();
        self.views[view]["target"] = ARRAY_BUFFER.into();
        view
    }

    fn index_view(&mut self, offset: u64, length: u64) -> usize {
        let view = self.view(offset, length);
        self.views[view]["target"] = ELEMENT_BUFFER.into();
        view
    }
}

impl Document<'_> {
    /// Writes the JSON, unpadded.
    pub(super) fn write(&self, file: &mut Target, lost: &mut Diagnostics) -> Result<(), ExportError> {
        let mut root = Map::new();
        let mut extensions = Extensions::default();
        let mut tables = Tables::default();
        self.meshes(&mut root, &mut tables);
        self.images(&mut root, &mut tables);
        let materials: Vec<Value> = self
            .scene
            .materials()
            .iter()
            .map(|m| material::json(self.scene, m, &mut extensions, lost))
            .collect();
        set(&mut root, "materials", materials);
        set(&mut root, "cameras", self.scene.cameras().iter().map(|c| camera(c, lost)).collect());
        if !self.scene.lights().is_empty() {
            extensions.add("KHR_lights_punctual");
            let lights: Vec<Value> = self.scene.lights().iter().map(|l| light(l, lost)).collect();
            root.insert("extensions".into(), json!({"KHR_lights_punctual": {"lights": lights}}));
        }
        set(&mut root, "bufferViews", tables.views);
        set(&mut root, "accessors", tables.accessors);
        if self.layout.bytes > 0 {
            root.insert("buffers".into(), json!([{"byteLength": self.layout.bytes}]));
        }
        set(&mut root, "extensionsUsed", extensions.names());
        root.insert("asset".into(), json!({"version": "2.0", "generator": "vastlight"}));
        root.insert("scene".into(), 0.into());
        if let Some(extras) = self.extras(lost) {
            root.insert("extras".into(), extras);
        }
        let text = Value::Object(root).to_string();
        // Reopen the object for what is streamed.
        file.put(&text.as_bytes()[..text.len() - 1])?;
        let count = self.nodes(file)?;
        file.put(b",\"scenes\":[{\"nodes\":[")?;
        for i in 0..count {
            file.put(format!("{}{i}", if i > 0 { "," } else { "" }).as_bytes())?;
        }
        file.put(b"]}]}")
    }

    fn meshes(&self, root: &mut Map<String, Value>, tables: &mut Tables) {
        // A mesh without triangles is no glTF mesh.
        let some = self.layout.meshes.iter().filter(|mesh| !mesh.primitives.is_empty());
        let list = some.map(|mesh| mesh_json(mesh, tables)).collect();
        set(root, "meshes", list);
    }

    fn images(&self, root: &mut Map<String, Value>, tables: &mut Tables) {
        let mut numbers = Vec::new();
        let mut images = Vec::new();
        for (image, &(offset, length)) in self.scene.images().iter().zip(&self.layout.images) {
            numbers.push(images.len());
            if length > 0 {
                let view = tables.view(offset, length);
                images.push(json!({"name": image.name, "mimeType": "image/png", "bufferView": view}));
            }
        }
        let textures = self.scene.textures().iter().enumerate();
        let textures = textures
            .map(|(i, t)| json!({"source": numbers[t.image as usize], "sampler": i}))
            .collect::<Vec<Value>>();
        set(root, "images", images);
        set(root, "textures", textures);
        set(root, "samplers", self.scene.textures().iter().map(sampler).collect());
    }

    /// Instances, then cameras, then lights; returns how many.
    fn nodes(&self, file: &mut Target) -> Result<usize, ExportError> {
        let numbers = self.mesh_numbers();
        let mut count = 0;
        let mut put = |node: String| {
            count += 1;
            file.put(format!("{}{node}", if count == 1 { ",\"nodes\":[" } else { "," }).as_bytes())
        };
        for instance in self.instances.iter() {
            let name = Value::from(self.scene.name(instance.name));
            let mesh = numbers[instance.mesh as usize].map_or(String::new(), |n| format!(",\"mesh\":{n}"));
            put(format!("{{\"name\":{name}{mesh}{}}}", place(&instance.world_from_object)))?;
        }
        for (i, camera) in self.scene.cameras().iter().enumerate() {
            let name = Value::from(camera.name.as_str());
            put(format!("{{\"name\":{name},\"camera\":{i}{}}}", place(&camera.world_from_camera)))?;
        }
        for (i, light) in self.scene.lights().iter().enumerate() {
            let name = Value::from(light.name.as_str());
            let light_json = format!("\"extensions\":{{\"KHR_lights_punctual\":{{\"light\":{i}}}}}");
            put(format!("{{\"name\":{name},{light_json}{}}}", place(&light.world_from_light)))?;
        }
        if count > 0 {
            file.put(b"]")?;
        }
        Ok(count)
    }

    /// The number of each mesh among those that have triangles.
    fn mesh_numbers(&self) -> Vec<Option<usize>> {
        let mut next = 0;
        let mut number = |mesh: &MeshLayout| {
            next += usize::from(!mesh.primitives.is_empty());
            (!mesh.primitives.is_empty()).then(|| next - 1)
        };
        self.layout.meshes.iter().map(&mut number).collect()
    }

    /// What glTF has no place for: light from infinity, or that there is none.
    fn extras(&self, lost: &mut Diagnostics) -> Option<Value> {
        let environment = match self.scene.environment() {
            Environment::Constant(radiance) => json!({"constant": numbers(&radiance.to_array())}),
            Environment::Sky(sky) => json!({"sky": {
                "sunAzimuth": number(sky.sun_azimuth),
                "sunElevation": number(sky.sun_elevation),
                "turbidity": number(sky.turbidity),
                "groundAlbedo": numbers(&sky.ground_albedo.to_array()),
                "strength": number(sky.strength),
                "sunDisc": sky.sun_disc,
            }}),
            Environment::Map { .. } => {
                lost.warn("glTF holds no environment map", "environment", "give it with --env");
                return None;
            }
        };
        if *self.scene.environment() != Environment::Constant(Vec3::ZERO) {
            lost.warn("glTF holds no sky; it stands in the file's extras", "environment", EXTRAS_HINT);
        }
        Some(json!({"vastlight": {"environment": environment}}))
    }
}

fn set(root: &mut Map<String, Value>, key: &str, list: Vec<Value>) {
    if !list.is_empty() {
        root.insert(key.into(), list.into());
    }
}

fn mesh_json(mesh: &MeshLayout, tables: &mut Tables) -> Value {
    let mut at = mesh.offset;
    let views: Vec<(&str, &str, u64, usize)> = mesh
        .attributes
        .iter()
        .map(|(name, kind, size)| {
            let length = size * mesh.vertices;
            let view = tables.vertex_view(at, length, *size);
            at += length;
            (name.as_str(), *kind, *size, view)
        })
        .collect();
    let list: Vec<Value> = mesh
        .primitives
        .iter()
        .map(|primitive| {
            let value = primitive_json(primitive, &views, at, tables);
            at += primitive.index_bytes();
            value
        })
        .collect();
    json!({"name": mesh.name, "primitives": list})
}

fn primitive_json(
    primitive: &Primitive,
    views: &[(&str, &str, u64, usize)],
    index_offset: u64,
    tables: &mut Tables,
) -> Value {
    let mut named = Map::new();
    for (name, kind, size, view) in views {
        let mut accessor = json!({
            "bufferView": view,
            "byteOffset": u64::from(primitive.first_vertex) * size,
            "componentType": 5126,
            "count": primitive.vertices,
            "type": kind,
        });
        if *name == "POSITION" {
            accessor["min"] = numbers(&primitive.bounds.min.to_array());
            accessor["max"] = numbers(&primitive.bounds.max.to_array());
        }
        named.insert((*name).into(), tables.accessors.len().into());
        tables.accessors.push(accessor);
    }
    let size = if primitive.short_indices { 2 } else { 4 };
    let count = primitive.triangles.len() as u64 * 3;
    let view = tables.index_view(index_offset, count * size);
    let indices = tables.accessors.len();
    tables.accessors.push(json!({
        "bufferView": view,
        "componentType": if primitive.short_indices { 5123 } else { 5125 },
        "count": count,
        "type": "SCALAR",
    }));
    json!({"attributes": named, "indices": indices, "material": primitive.material})
}

/// The members of a node that place it; nothing for the identity.
fn place(map: &Affine3) -> String {
    if *map == Affine3::IDENTITY {
        return String::new();
    }
    let t = map.translation;
    if map.matrix3 == vastlight_math::Mat3::IDENTITY {
        return format!(",\"translation\":[{},{},{}]", t.x, t.y, t.z);
    }
    let axes = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis];
    let columns: String = axes.iter().map(|c| format!("{},{},{},0,", c.x, c.y, c.z)).collect();
    format!(",\"matrix\":[{columns}{},{},{},1]", t.x, t.y, t.z)
}

fn sampler(texture: &Texture) -> Value {
    let wrap = |w: Wrap| match w {
        Wrap::Repeat => 10497,
        Wrap::Mirror => 33648,
        Wrap::Clamp => 33071,
    };
    let filter = if texture.filter == Filter::Nearest { 9728 } else { 9729 };
    json!({"magFilter": filter, "minFilter": filter, "wrapS": wrap(texture.wrap[0]), "wrapT": wrap(texture.wrap[1])})
}

fn camera(camera: &Camera, lost: &mut Diagnostics) -> Value {
    let mut value = match camera.projection {
        Projection::Perspective { vertical_fov, lens_radius, focus_distance } => {
            let mut value = json!({"type": "perspective",
                "perspective": {"yfov": number(vertical_fov), "znear": 0.01}});
            if lens_radius > 0.0 {
                let lens =
                    json!({"lensRadius": number(lens_radius), "focusDistance": number(focus_distance)});
                value["extras"] = json!({"vastlight": lens});
                let place = format!("camera \"{}\"", camera.name);
                lost.warn("glTF holds no lens; it stands in the file's extras", place, EXTRAS_HINT);
            }
            value
        }
        Projection::Orthographic { half_height } => {
            let width = half_height * camera.aspect.unwrap_or(1.0);
            json!({"type": "orthographic",
                "orthographic": {"xmag": number(width), "ymag": number(half_height), "znear": 0, "zfar": 1e9}})
        }
    };
    if let (Some(aspect), Projection::Perspective { .. }) = (camera.aspect, camera.projection) {
        value["perspective"]["aspectRatio"] = number(aspect);
    }
    value["name"] = camera.name.as_str().into();
    value
}

fn light(light: &Light, lost: &mut Diagnostics) -> Value {
    let (color, strength) = color_and_strength(light.intensity.max(Vec3::ZERO));
    let mut value = json!({
        "name": light.name, "color": numbers(&color.to_array()), "intensity": number(strength),
    });
    value["type"] = match light.kind {
        LightKind::Point => "point",
        LightKind::Spot { .. } => "spot",
        LightKind::Directional => "directional",
    }
    .into();
    if let LightKind::Spot { inner, outer } = light.kind {
        value["spot"] = json!({"innerConeAngle": number(inner), "outerConeAngle": number(outer)});
    }
    if light.range.is_finite() {
        value["range"] = number(light.range);
    }
    if light.profile.is_some() {
        lost.warn("glTF holds no measured light distribution", format!("light \"{}\"", light.name), "");
    }
    value
}
