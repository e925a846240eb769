//! The scene: what an importer or a generator describes, and the validated form that everything else reads.
//!
//! [`SceneDesc`] is plain data, filled by an importer, a generator or a program. [`Scene::new`] checks it, snaps every
//! mesh to its lattice, and reports what it had to repair. Nothing here knows about files, rays or devices.

mod camera;
mod desc;
mod diagnostics;
mod environment;
pub mod generate;
mod image;
mod implicit;
mod instances;
mod large;
mod lattice;
mod light;
mod material;
mod mesh;
mod metals;
mod motion;
mod pyramid;
mod scene;
mod shutter;
mod stream;
mod tangents;
mod texel;
mod texture_use;
mod world;

pub use camera::{Camera, Projection};
pub use desc::{Instance, SceneDesc};
pub use diagnostics::{Diagnostic, Diagnostics, SceneError, Severity};
pub use environment::{Environment, Sky};
pub use image::{Encoding, Filter, Image, Texels, Texture, TextureTransform, Wrap};
pub use implicit::{ImplicitPoint, ImplicitShape, Julia, Metaball, Metaballs, Quaternion};
pub use instances::{InstanceNames, Instances};
pub use large::{LargeMesh, MeshSink, ReadMesh};
pub use lattice::Lattice;
pub use light::{IesProfile, Light, LightKind};
pub use material::{AlphaMode, Channel, ColorInput, Conductor, Material, NormalMap, ScalarInput};
pub use mesh::{Mesh, Part};
pub use motion::{MeshPose, Motion, MotionRecord, Pose, renumbered};
pub use pyramid::{Content, PyramidRows, level_sizes, pyramid};
pub use scene::{Change, MeshExtent, MeshPreparation, Scene, TriangleFindings, can_be_placed, is_usable};
pub use shutter::{InstanceKeys, MeshKey, Shutter};
pub use stream::{ImageRows, NextRow, Piece, PieceInstance, Pieces, SceneStream, read_ahead};
pub use texel::TexelReader;
pub use texture_use::{TextureRole, TextureUse, texture_uses};
