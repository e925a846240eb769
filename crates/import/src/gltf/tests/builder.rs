//! Makes glTF documents with their data for tests.

use crate::LoadOptions;
use crate::gltf::findings::Findings;
use serde_json::{Value, json};
use std::path::Path;
use vastlight_scene::{Mesh, SceneDesc, Severity};

/// A document with its binary chunk.
pub(super) struct Builder {
    pub(super) json: Value,
    pub(super) bin: Vec<u8>,
}

impl Builder {
    /// A document with nothing but its version.
    pub(super) fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "accessors": [], "bufferViews": [], "buffers": [], "meshes": [], "nodes": []
        });
        Self { json, bin: Vec::new() }
    }

    /// One triangle in the xy plane, shown by one node.
    pub(super) fn triangle() -> Self {
        let mut builder = Self::new();
        let positions = builder.positions(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        builder.mesh(json!([{"attributes": {"POSITION": positions}}]));
        builder.node(json!({"mesh": 0}));
        builder
    }

    /// Appends to a table; returns the index.
    pub(super) fn push(&mut self, table: &str, value: Value) -> usize {
        let list = self.json[table].as_array_mut().expect("a table");
        list.push(value);
        list.len() - 1
    }

    /// Starts a table that `new` does not have.
    pub(super) fn with(mut self, key: &str, value: Value) -> Self {
        self.json[key] = value;
        self
    }

    pub(super) fn mesh(&mut self, primitives: Value) -> usize {
        self.push("meshes", json!({"primitives": primitives}))
    }

    pub(super) fn node(&mut self, node: Value) -> usize {
        self.push("nodes", node)
    }

    /// Appends bytes as a buffer view; `stride` 0 means none.
    pub(super) fn view(&mut self, bytes: &[u8], stride: usize) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let mut view = json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len()});
        if stride > 0 {
            view["byteStride"] = json!(stride);
        }
        self.bin.extend(bytes);
        self.push("bufferViews", view)
    }

    /// An accessor over bytes of its own.
    pub(super) fn accessor(&mut self, bytes: &[u8], component: u32, shape: &str, count: usize) -> usize {
        let view = self.view(bytes, 0);
        let accessor = json!({"bufferView": view, "componentType": component, "type": shape, "count": count});
        self.push("accessors", accessor)
    }

    /// Floats with the bounds that positions need.
    pub(super) fn positions(&mut self, points: &[[f32; 3]]) -> usize {
        let index = self.floats(points, "VEC3");
        let bound = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
            (0..3).map(|c| points.iter().map(|p| p[c]).reduce(pick).expect("a point")).collect()
        };
        self.json["accessors"][index]["min"] = json!(bound(f32::min));
        self.json["accessors"][index]["max"] = json!(bound(f32::max));
        index
    }

    pub(super) fn floats<const N: usize>(&mut self, values: &[[f32; N]], shape: &str) -> usize {
        self.accessor(&bytes_of(values), 5126, shape, values.len())
    }

    /// Unsigned 16-bit indices.
    pub(super) fn indices(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        self.accessor(&bytes, 5123, "SCALAR", indices.len())
    }

    /// The file as GLB; its binary chunk is buffer 0, the document's own buffers follow.
    pub(super) fn glb(&self) -> Vec<u8> {
        let mut document = self.json.clone();
        if !self.bin.is_empty() {
            let mut buffers = vec![json!({"byteLength": self.bin.len()})];
            buffers.extend(self.json["buffers"].as_array().into_iter().flatten().cloned());
            document["buffers"] = json!(buffers);
        }
        let object = document.as_object_mut().expect("an object");
        object.retain(|_, value| value.as_array().is_none_or(|list| !list.is_empty()));
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut bin = self.bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        let mut chunks = chunk(b"JSON", &text);
        if !bin.is_empty() {
            chunks.extend(chunk(b"BIN\0", &bin));
        }
        let mut glb = b"glTF\x02\0\0\0".to_vec();
        glb.extend((chunks.len() as u32 + 12).to_le_bytes());
        glb.extend(chunks);
        glb
    }

    /// What is read from the file.
    pub(super) fn load(&self) -> SceneDesc {
        load_bytes(&self.glb(), &LoadOptions::default())
    }

    /// What is read from the file, which must have no errors.
    pub(super) fn load_clean(&self) -> SceneDesc {
        let desc = self.load();
        let errors: Vec<_> =
            desc.diagnostics.items().iter().filter(|d| d.severity == Severity::Error).collect();
        assert!(errors.is_empty(), "{errors:?}");
        desc
    }

    /// The only mesh of a file without errors.
    pub(super) fn only_mesh(&self) -> Mesh {
        let mut desc = self.load_clean();
        assert_eq!(desc.meshes.len(), 1, "{:?}", desc.diagnostics);
        desc.meshes.remove(0)
    }

    /// The words of the first error.
    pub(super) fn error(&self) -> String {
        self.load().diagnostics.first_error().expect("an error").to_string()
    }

    /// All warnings.
    pub(super) fn warnings(&self) -> Vec<String> {
        self.load_clean().diagnostics.items().iter().map(ToString::to_string).collect()
    }
}

fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    [&(data.len() as u32).to_le_bytes()[..], kind, data].concat()
}

pub(super) fn bytes_of<const N: usize>(values: &[[f32; N]]) -> Vec<u8> {
    values.iter().flatten().flat_map(|x| x.to_le_bytes()).collect()
}

/// What is read from the bytes of a file.
pub(super) fn load_bytes(bytes: &[u8], options: &LoadOptions) -> SceneDesc {
    let mut findings = Findings::default();
    let file = bytes.to_vec().into();
    let (mut desc, _) = crate::gltf::load_blob(&file, Path::new("test.glb"), options, &mut findings);
    findings.report("test.glb", &mut desc.diagnostics);
    desc
}
