//! A small binary glTF in which all that can moves: nodes with meshes, a camera and a lamp, morph weights, joints.

use std::path::{Path, PathBuf};

/// The document's binary chunk, and accessors into it.
#[derive(Default)]
struct Chunk {
    bytes: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
}

impl Chunk {
    fn add(&mut self, bytes: &[u8], (component, count, kind): (u32, usize, &str), more: &str) -> usize {
        let (offset, length) = (self.bytes.len(), bytes.len());
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(format!(r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{length}}}"#));
        let view = self.views.len() - 1;
        self.accessors.push(format!(
            r#"{{"bufferView":{view},"componentType":{component},"count":{count},"type":"{kind}"{more}}}"#
        ));
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(&mut self, rows: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = rows.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        let list = |pick: fn(f32, f32) -> f32| {
            let of = |c: usize| rows.iter().map(|row| row[c]).reduce(pick).unwrap_or(0.0).to_string();
            (0..N).map(of).collect::<Vec<_>>().join(",")
        };
        let bounds = format!(r#","min":[{}],"max":[{}]"#, list(f32::min), list(f32::max));
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"].get(N - 1).copied().unwrap_or("MAT4");
        self.add(&bytes, (5126, rows.len(), kind), &bounds)
    }

    fn indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        let bytes: Vec<u8> = triangles.as_flattened().iter().flat_map(|i| i.to_le_bytes()).collect();
        self.add(&bytes, (5125, 3 * triangles.len(), "SCALAR"), "")
    }
}

/// A sheet of `cells` by `cells` squares over a square of edge 2, a little uneven.
fn sheet(cells: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let at = |i: u32| i as f32 / cells as f32 * 2.0 - 1.0;
    let height = |x: u32, z: u32| (x * 7 % 5) as f32 * 0.01 + (z * 3 % 4) as f32 * 0.013;
    let row = |z: u32| (0..=cells).map(move |x| [at(x), height(x, z), at(z)]);
    let corner = |x: u32, z: u32| z * (cells + 1) + x;
    let cell = |i: u32| {
        let (x, z) = (i % cells, i / cells);
        let [a, b, c, d] = [corner(x, z), corner(x + 1, z), corner(x + 1, z + 1), corner(x, z + 1)];
        [[a, c, b], [a, d, c]]
    };
    ((0..=cells).flat_map(row).collect(), (0..cells * cells).flat_map(cell).collect())
}

/// Writes the file to a folder. Its movement takes two seconds; at one second a sheet is not to be seen.
pub(crate) fn write(folder: &Path) -> PathBuf {
    write_over(folder, 48)
}

/// The same over a floor of so many squares along each side.
pub(crate) fn write_over(folder: &Path, cells: u32) -> PathBuf {
    let mut chunk = Chunk::default();
    let (floor, floor_triangles) = sheet(cells);
    let (small, small_triangles) = sheet(12);
    let lifted: Vec<[f32; 3]> = small.iter().map(|[x, _, z]| [0.0, 0.8 * (1.0 - x * x) * z, 0.0]).collect();
    let [floor, small, lifted] = [&floor, &small, &lifted].map(|rows| chunk.floats(rows));
    let [floor_indices, indices] = [&floor_triangles, &small_triangles].map(|list| chunk.indices(list));
    let (points, _) = sheet(12);
    let joints: Vec<u8> = points.iter().flat_map(|_| [0, 1, 0, 0]).collect();
    let joints = chunk.add(&joints, (5121, points.len(), "VEC4"), "");
    let weights: Vec<[f32; 4]> =
        points.iter().map(|p| [0.5 - 0.5 * p[0], 0.5 + 0.5 * p[0], 0.0, 0.0]).collect();
    let weights = chunk.floats(&weights);
    let times = chunk.floats(&[[0.0], [1.0], [2.0]]);
    let go = chunk.floats(&[[-1.0, 0.6, 0.0], [0.0, 1.2, 0.5], [1.0, 0.4, 0.0]]);
    let come = chunk.floats(&[[0.3, 0.3, 0.3], [0.0, 0.0, 0.0], [0.4, 0.4, 0.4]]);
    let turn =
        chunk.floats(&[[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.5, 0.866_025_4], [0.0, 0.0, -0.5, 0.866_025_4]]);
    let morph = chunk.floats(&[[0.0], [1.0], [0.3]]);
    let walk = chunk.floats(&[[0.0, 1.6, 4.2], [0.4, 1.7, 4.0], [0.8, 1.5, 3.8]]);
    let shine = chunk.floats(&[[0.0, 3.0, 1.0], [1.0, 3.0, 1.0], [-1.0, 3.0, 0.0]]);
    // Nodes stand in another order than their meshes.
    let nodes = [
        r#"{"mesh":2,"translation":[-0.6,0.9,-0.4],"scale":[0.4,1,0.4]}"#,
        r#"{"mesh":1,"scale":[0.3,0.3,0.3]}"#,
        r#"{"mesh":0,"scale":[2,1,2]}"#,
        r#"{"mesh":1,"translation":[0.9,0.5,0.3],"scale":[0.3,0.3,0.3]}"#,
        r#"{"mesh":1,"translation":[-1.1,0.4,0.5],"scale":[0.25,0.25,0.25],"name":"still"}"#,
        r#"{"mesh":3,"skin":0}"#,
        r#"{"translation":[0.5,0.8,-0.5],"scale":[0.5,0.5,0.5],"children":[7]}"#,
        r#"{"translation":[0.2,0,0]}"#,
        r#"{"camera":0,"name":"Front","translation":[0,1.6,4.2],"rotation":[-0.14,0,0,0.99]}"#,
        r#"{"name":"Lamp","extensions":{"KHR_lights_punctual":{"light":0}}}"#,
    ];
    let moves = [
        (1, "translation", go),
        (3, "scale", come),
        (7, "rotation", turn),
        (0, "weights", morph),
        (8, "translation", walk),
        (9, "translation", shine),
    ];
    let samplers = moves.map(|(_, _, output)| {
        let step = if output == come { r#","interpolation":"STEP""# } else { "" };
        format!(r#"{{"input":{times},"output":{output}{step}}}"#)
    });
    let channels = moves.iter().enumerate().map(|(i, (node, path, _))| {
        format!(r#"{{"sampler":{i},"target":{{"node":{node},"path":"{path}"}}}}"#)
    });
    let mesh = |name: &str, attributes: String, indices: usize, material: u32, more: &str| {
        format!(
            r#"{{"name":"{name}","primitives":[{{"attributes":{{{attributes}}},"indices":{indices},"material":{material}{more}}}]}}"#
        )
    };
    let meshes = [
        mesh("floor", format!(r#""POSITION":{floor}"#), floor_indices, 0, ""),
        mesh("sheet", format!(r#""POSITION":{small}"#), indices, 1, ""),
        mesh(
            "bump",
            format!(r#""POSITION":{small}"#),
            indices,
            2,
            &format!(r#","targets":[{{"POSITION":{lifted}}}]"#),
        ),
        mesh(
            "bent",
            format!(r#""POSITION":{small},"JOINTS_0":{joints},"WEIGHTS_0":{weights}"#),
            indices,
            1,
            "",
        ),
    ];
    let material = |name: &str, [r, g, b]: [f32; 3]| {
        format!(
            r#"{{"name":"{name}","doubleSided":true,"pbrMetallicRoughness":{{"baseColorFactor":[{r},{g},{b},1],"metallicFactor":0}}}}"#
        )
    };
    let materials = [
        material("Wood", [0.7, 0.7, 0.6]),
        material("Cloth", [0.8, 0.2, 0.1]),
        material("Paint", [0.1, 0.4, 0.8]),
    ];
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0,1,2,3,4,5,6,8,9]}}],"nodes":[{}],
"meshes":[{}],"materials":[{}],"skins":[{{"joints":[6,7]}}],
"cameras":[{{"name":"Front","type":"perspective","perspective":{{"yfov":0.7,"znear":0.1}}}}],
"extensionsUsed":["KHR_lights_punctual"],"extensions":{{"KHR_lights_punctual":{{"lights":[{{"name":"Lamp","type":"point","intensity":400}}]}}}},
"animations":[{{"samplers":[{}],"channels":[{}]}}],
"buffers":[{{"byteLength":{}}}],"bufferViews":[{}],"accessors":[{}]}}"#,
        nodes.join(","),
        meshes.join(","),
        materials.join(","),
        samplers.join(","),
        channels.collect::<Vec<_>>().join(","),
        chunk.bytes.len(),
        chunk.views.join(","),
        chunk.accessors.join(","),
    );
    let path = folder.join("animated.glb");
    std::fs::write(&path, glb(json.into_bytes(), &chunk.bytes)).expect("written");
    path
}

fn glb(mut json: Vec<u8>, binary: &[u8]) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    let word = |n: usize| (n as u32).to_le_bytes();
    [
        b"glTF".as_slice(),
        &word(2),
        &word(12 + 8 + json.len() + 8 + binary.len()),
        &word(json.len()),
        b"JSON",
        &json,
        &word(binary.len()),
        b"BIN\0",
        binary,
    ]
    .concat()
}
