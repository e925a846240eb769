//! The chosen scene of a document: its nodes with their meshes, cameras and lights, and the materials that these use.

use super::accessor::Data;
use super::animation::{self, Movement};
use super::findings::Findings;
use super::json::Json;
use super::mesh::{self, Context, Shape};
use super::node::{self, Copies, Placed};
use super::skin::Skin;
use super::texture::Textures;
use super::uri::{self, Uri};
use super::{camera, extras, image, light, material, morph};
use crate::LoadOptions;
use crate::texels::{Deferral, Loaded};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicU64;
use vastlight_math::Affine3;
use vastlight_math::glam::DAffine3;
use vastlight_scene::{Instance, SceneDesc};

/// A document that was read but for its meshes.
#[derive(Debug)]
pub(super) struct Parsed {
    /// The chosen scene without meshes.
    pub(super) desc: SceneDesc,
    /// By number of the scene's mesh, what it shows.
    pub(super) shapes: Vec<Shape>,
    /// What meshes are made of.
    pub(super) context: Context,
    /// What moves, but for meshes.
    pub(super) movement: Movement,
    /// Files that the document names.
    pub(super) files: Vec<PathBuf>,
}

/// The files of buffers and images.
fn files(root: &Json<'_>, directory: &Path) -> Vec<PathBuf> {
    let named = ["buffers", "images"].into_iter().flat_map(|table| root.list(table));
    let uris = named.filter_map(|json| json.at("uri").text()).filter(|uri| !uri.starts_with("data:"));
    let file = |uri: &str| if let Uri::File(path) = uri::resolve(uri, directory) { Some(path) } else { None };
    uris.filter_map(file).collect()
}

/// Builds the description of the chosen scene, with what moves it if that is wanted.
pub(super) fn assemble(
    root: &Json<'_>,
    data: Data,
    directory: &Path,
    (options, animated): (&LoadOptions, bool),
    deferral: &mut Deferral,
    findings: &mut Findings,
) -> Parsed {
    let mut desc = SceneDesc::default();
    let roots = scene_roots(root, options, findings);
    let placed = node::place(root, &roots);
    let budget = AtomicU64::new(data.geometry_budget());
    let chosen = animation::choose(root, options.animation.as_deref(), findings).filter(|_| animated);
    let mut movement = chosen.map_or_else(Movement::default, |chosen| {
        Movement::new(root, chosen, &placed, &data, &budget, findings)
    });
    let shapes = place_meshes(root, &data, &placed, &mut movement, &mut desc, findings);
    place_cameras_and_lights(root, &placed, &mut movement, &mut desc, findings);
    desc.environment = extras::environment(root, findings);
    let (default_material, used) = read_materials(root, &mut desc);
    let images = image::load_all(root, &data, directory, &options.limits, deferral, findings);
    take_images(images, &used, deferral, &mut desc);
    let joints = pose_skins(root, &data, &placed, &shapes, &mut movement);
    let meshes = root.list("meshes").iter().map(Json::owned).collect();
    let (limits, moving_skins) = (options.limits, movement.moving_skins().collect());
    let files = files(root, directory);
    Parsed {
        desc,
        shapes,
        files,
        movement,
        context: Context { meshes, data, default_material, joints, moving_skins, limits, budget },
    }
}

/// The joints' matrices of every skin in use, at rest.
fn pose_skins(
    root: &Json<'_>,
    data: &Data,
    placed: &[Placed],
    shapes: &[Shape],
    movement: &mut Movement,
) -> BTreeMap<usize, Vec<Affine3>> {
    let mut world_from_node = vec![None; root.list("nodes").len()];
    for Placed { node, world_from_node: transform, .. } in placed {
        world_from_node[*node] = Some(*transform);
    }
    let at_rest = |node: usize| world_from_node.get(node).copied().flatten();
    let skins: BTreeSet<usize> = shapes.iter().filter_map(|shape| shape.skin).collect();
    let mut joints = BTreeMap::new();
    for index in skins {
        let skin = Skin::read(&root.list("skins")[index], data);
        joints.insert(index, skin.matrices(at_rest));
        movement.add_skin(index, skin, at_rest);
    }
    joints
}

/// Most copies that EXT_mesh_gpu_instancing makes: what the file has bytes for, and always some.
fn most_copies(data: &Data) -> usize {
    (1 << 20) + (data.buffers().total() / 4) as usize
}

/// The root nodes of the scene to show.
fn scene_roots(root: &Json<'_>, options: &LoadOptions, findings: &mut Findings) -> Vec<usize> {
    let scenes = root.list("scenes");
    let chosen = match &options.scene {
        Some(wanted) => find_scene(scenes, wanted, findings),
        None => root.index("scene").or((!scenes.is_empty()).then_some(0)),
    };
    if scenes.len() > 1 {
        let others = scenes.iter().enumerate().filter(|(i, _)| Some(*i) != chosen);
        let names: Vec<String> = others.map(|(i, scene)| scene_name(scene, i)).collect();
        let what =
            format!("only one of {} scenes is shown; the others are {}", scenes.len(), names.join(", "));
        findings.warn("SEVERAL_SCENES", what, "/scenes", "");
    }
    match chosen.and_then(|i| scenes.get(i)) {
        Some(scene) => scene.list("nodes").iter().filter_map(Json::integer).collect(),
        None => parentless(root),
    }
}

fn scene_name(scene: &Json<'_>, index: usize) -> String {
    scene.at("name").text().map_or_else(|| index.to_string(), |name| format!("\"{name}\""))
}

fn find_scene(scenes: &[Json<'_>], wanted: &str, findings: &mut Findings) -> Option<usize> {
    let by_name = scenes.iter().position(|scene| scene.at("name").text() == Some(wanted));
    let by_number = || wanted.parse::<usize>().ok().filter(|&i| i < scenes.len());
    let found = by_name.or_else(by_number);
    if found.is_none() {
        let names: Vec<String> = scenes.iter().enumerate().map(|(i, scene)| scene_name(scene, i)).collect();
        let what = format!("there is no scene \"{wanted}\", the file has {}", names.join(", "));
        findings.error("NO_SUCH_SCENE", what, "/scenes", "");
    }
    found
}

/// Nodes that are no node's children: what a document without scenes shows.
fn parentless(root: &Json<'_>) -> Vec<usize> {
    let nodes = root.list("nodes");
    let mut is_child = vec![false; nodes.len()];
    for child in nodes.iter().flat_map(|n| n.list("children")).filter_map(Json::integer) {
        if let Some(flag) = is_child.get_mut(child) {
            *flag = true;
        }
    }
    (0..nodes.len()).filter(|&i| !is_child[i]).collect()
}

/// Adds the instances; returns what each entry of the scene's mesh table shows.
fn place_meshes(
    root: &Json<'_>,
    data: &Data,
    placed: &[Placed],
    movement: &mut Movement,
    desc: &mut SceneDesc,
    findings: &mut Findings,
) -> Vec<Shape> {
    let most = placed.len() + most_copies(data);
    let mut shapes = Vec::new();
    let mut numbers: BTreeMap<Shape, u32> = BTreeMap::new();
    let mut names = Names::default();
    for Placed { node: index, world_from_node, .. } in placed {
        let node = &root.list("nodes")[*index];
        let Some(mesh_index) = node.index("mesh").filter(|&m| m < root.list("meshes").len()) else {
            continue;
        };
        let shape = Shape { track: movement.weights_of(*index), ..shape_of(root, node, mesh_index) };
        // The vertices of a skinned mesh are moved to world space.
        let is_skinned = shape.skin.is_some();
        let world_from_mesh = if is_skinned { DAffine3::IDENTITY } else { *world_from_node };
        let mesh = *numbers.entry(shape).or_insert_with_key(|shape| {
            shapes.push(shape.clone());
            (shapes.len() - 1) as u32
        });
        let name = names.number(instance_name(root, node, mesh_index), &mut desc.names);
        let place = format!("/nodes/{index}");
        let copies = node::gpu_instances(node, data, &place, findings);
        let count = copies.as_ref().map_or(1, Copies::len);
        if desc.instances.len() + count > most {
            let what = format!("there are more than {most} instances, too many for a file of this size");
            findings.error("TOO_MANY_INSTANCES", what, &place, "");
            break;
        }
        let first = desc.instances.len();
        let node_from_copy =
            |i| copies.as_ref().map_or(DAffine3::IDENTITY, |copies| copies.node_from_copy(i));
        desc.instances.extend((0..count).map(|i| {
            let world_from_object = node::to_f32(&(world_from_mesh * node_from_copy(i)));
            Instance { world_from_object, mesh, name }
        }));
        if !is_skinned {
            movement.add_instances(*index, first, copies);
        }
    }
    shapes
}

fn shape_of(root: &Json<'_>, node: &Json<'_>, mesh: usize) -> Shape {
    let json = &root.list("meshes")[mesh];
    let weights = morph::weights(json, node).into_iter().map(f32::to_bits).collect();
    let is_skinned = json.list("primitives").iter().any(|p| p.at("attributes").get("JOINTS_0").is_some());
    let skin = node.index("skin").filter(|&s| is_skinned && s < root.list("skins").len());
    Shape { mesh, weights, skin, track: None }
}

fn instance_name(root: &Json<'_>, node: &Json<'_>, mesh: usize) -> String {
    match node.at("name").text() {
        Some(name) if !name.is_empty() => name.to_owned(),
        _ => mesh::name_of(&root.list("meshes")[mesh], mesh),
    }
}

/// Numbers of names, each kept once.
#[derive(Debug, Default)]
struct Names {
    numbers: BTreeMap<String, u32>,
}

impl Names {
    fn number(&mut self, name: String, table: &mut Vec<String>) -> u32 {
        *self.numbers.entry(name).or_insert_with_key(|name| {
            table.push(name.clone());
            (table.len() - 1) as u32
        })
    }
}

fn place_cameras_and_lights(
    root: &Json<'_>,
    placed: &[Placed],
    movement: &mut Movement,
    desc: &mut SceneDesc,
    findings: &mut Findings,
) {
    let lights = root.extension(light::EXTENSION).map_or(&[][..], |e| e.list("lights"));
    for Placed { node: index, world_from_node, .. } in placed {
        let node = &root.list("nodes")[*index];
        let (cameras, lights_before) = (desc.cameras.len(), desc.lights.len());
        if let Some((i, json)) = referenced(root.list("cameras"), node.index("camera")) {
            let name = object_name(json, node, "camera", i);
            desc.cameras.extend(camera::read(json, i, name, world_from_node, findings));
        }
        let light = node.extension(light::EXTENSION).and_then(|e| e.index("light"));
        if let Some((i, json)) = referenced(lights, light) {
            let name = object_name(json, node, "light", i);
            desc.lights.extend(light::read(json, name, world_from_node));
        }
        movement.add_cameras(*index, cameras..desc.cameras.len());
        movement.add_lights(*index, lights_before..desc.lights.len());
    }
}

fn referenced<'j, 'a>(list: &'j [Json<'a>], index: Option<usize>) -> Option<(usize, &'j Json<'a>)> {
    let index = index?;
    Some((index, list.get(index)?))
}

/// The object's own name, else its node's, else its kind and number.
fn object_name(json: &Json<'_>, node: &Json<'_>, kind: &str, index: usize) -> String {
    let own = json.at("name").text().filter(|name| !name.is_empty());
    let of_node = node.at("name").text().filter(|name| !name.is_empty());
    own.or(of_node).map_or_else(|| format!("{kind} {index}"), str::to_owned)
}

/// Reads all materials and their textures; returns the number of glTF's default material, and the images that are used by their
/// numbers in the document.
fn read_materials(root: &Json<'_>, desc: &mut SceneDesc) -> (u32, Vec<usize>) {
    let mut textures = Textures::default();
    for (i, json) in root.list("materials").iter().enumerate() {
        let name = json.at("name").text().map_or_else(|| format!("material {i}"), str::to_owned);
        desc.materials.push(material::read(root, json, name, &mut textures));
    }
    let default_material = desc.materials.len() as u32;
    if uses_default_material(root) {
        desc.materials.push(material::read(root, &Json::Null, "default".into(), &mut textures));
    }
    let (list, numbers) = textures.finish();
    desc.textures = list;
    (default_material, numbers)
}

/// Takes the images that are used into the scene.
fn take_images(images: Vec<Loaded>, used: &[usize], deferral: &mut Deferral, desc: &mut SceneDesc) {
    let mut images: Vec<Option<Loaded>> = images.into_iter().map(Some).collect();
    for image in used.iter().filter_map(|&i| images[i].take()) {
        deferral.add(image, desc);
    }
}

fn uses_default_material(root: &Json<'_>) -> bool {
    let mut primitives = root.list("meshes").iter().flat_map(|mesh| mesh.list("primitives"));
    primitives.any(|primitive| primitive.index("material").is_none())
}
