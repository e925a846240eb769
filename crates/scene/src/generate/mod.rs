//! Procedural scenes: every demo is a function of its options alone, the same bits on every machine.
//!
//! [`names`] lists the demos, [`by_name`] makes one, [`stream`] makes one mesh by mesh. A demo builds shapes (`shape`, `solids`, `lathe`, `tube`,
//! `extrude`), gives them materials (`palette`, `surfaces`) and collects them in a [`SceneDesc`] (`builder`). Chance
//! comes from the counter-based generator in `chance`, natural form from `noise`.

mod atrium;
mod bodies;
mod builder;
mod caustic_sphere;
mod chance;
mod city;
mod cloth;
mod cornell;
mod explosion;
mod extrude;
mod julia;
mod lathe;
mod metaballs;
mod moments;
mod noise;
mod noise_lanes;
mod palette;
mod plant;
mod prism;
mod record;
mod rigid;
mod shape;
mod solids;
mod statue;
mod still_life;
mod terrain;
mod textured_hall;
mod textures;
mod traffic;
mod tree;
mod tube;
mod walker;
mod water;

use crate::{SceneDesc, SceneError, SceneStream};

pub use record::{has_motion, motion};

/// What a procedural scene may vary in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GenerateOptions {
    /// Triangles wanted, all instances counted; `None` for the demo's own size. Met within 1 %.
    pub triangles: Option<u64>,
    /// Bytes of texture wanted, for demos that can be asked for them; `None` for the demo's own size.
    pub texture_bytes: Option<u64>,
    /// Chance: the same seed gives the same scene, bit by bit.
    pub seed: u64,
    /// The moment in seconds, for demos that move; 0 for others.
    pub time: f32,
}

/// How large a scene will be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DemoSize {
    /// Triangles, each mesh counted once; 0 where that is the demo's own size and small.
    pub triangles: u64,
    /// Placements of meshes, where there are many.
    pub instances: u64,
}

/// A demo: its name, whether its size and that of its textures can be chosen, how large it gets if meshes are placed more
/// than once, and the function that makes it.
struct Demo {
    name: &'static str,
    sizes: Option<Sizes>,
    texture_bytes: Option<Sizes>,
    instanced: Option<fn(&GenerateOptions) -> DemoSize>,
    /// Whether it is a function of time.
    moves: bool,
    make: Make,
}

/// How a demo is made.
enum Make {
    /// At once.
    Whole(fn(&GenerateOptions) -> SceneDesc),
    /// Mesh by mesh, in memory that does not grow with the number of triangles.
    Pieces(fn(&GenerateOptions) -> SceneStream),
}

/// What a demo can be asked for.
struct Sizes {
    least: u64,
    most: u64,
}

impl Demo {
    /// A demo of its own size.
    const fn new(name: &'static str, make: Make) -> Self {
        Self { name, sizes: None, texture_bytes: None, instanced: None, moves: false, make }
    }

    /// A demo of its own size that moves.
    const fn moving(name: &'static str, make: fn(&GenerateOptions) -> SceneDesc) -> Self {
        Self { moves: true, ..Self::new(name, Make::Whole(make)) }
    }

    /// A demo of `least` to `most` triangles that moves.
    const fn moving_sized(
        name: &'static str,
        least: u64,
        most: u64,
        make: fn(&GenerateOptions) -> SceneDesc,
    ) -> Self {
        Self { sizes: Some(Sizes { least, most }), ..Self::moving(name, make) }
    }

    /// A demo of `least` to `most` triangles.
    const fn sized(name: &'static str, least: u64, most: u64, make: Make) -> Self {
        Self { sizes: Some(Sizes { least, most }), ..Self::new(name, make) }
    }
}

const DEMOS: &[Demo] = &[
    Demo::new("atrium", Make::Whole(atrium::atrium)),
    Demo::moving_sized("bodies", 30_000, 100_000_000, bodies::bodies),
    Demo::sized("caustic-sphere", 1_000, 1_000_000_000, Make::Whole(caustic_sphere::caustic_sphere)),
    Demo {
        instanced: Some(city::size),
        ..Demo::sized("city", 200_000, 20_000_000_000, Make::Pieces(city::city))
    },
    Demo::moving_sized("cloth", 20_000, 100_000_000, cloth::cloth),
    Demo::new("cornell", Make::Whole(cornell::cornell)),
    Demo::moving_sized("explosion", 20_000, 100_000_000, explosion::explosion),
    Demo::moving("julia", julia::julia),
    Demo::moving("metaballs", metaballs::metaballs),
    Demo::sized("plant", 400_000, 1_000_000_000, Make::Pieces(plant::plant)),
    Demo::new("prism", Make::Whole(prism::prism)),
    Demo::sized("statue", 20_000, 4_000_000_000, Make::Whole(statue::statue)),
    Demo::new("still-life", Make::Whole(still_life::still_life)),
    Demo::sized("terrain", 20_000, 4_000_000_000, Make::Pieces(terrain::terrain)),
    Demo {
        texture_bytes: Some(textured_hall::TEXTURE_BYTES),
        ..Demo::new("textured-hall", Make::Pieces(textured_hall::textured_hall))
    },
    Demo {
        instanced: Some(traffic::size),
        ..Demo::moving_sized("traffic", 400_000, 4_000_000_000, traffic::traffic)
    },
    Demo::moving("walker", walker::walker),
    Demo::moving("water", water::water),
];

/// Whether the demo of this name is a function of time.
#[must_use]
pub fn moves(name: &str) -> bool {
    DEMOS.iter().any(|demo| demo.name == name && demo.moves)
}

/// The names that [`by_name`] knows, in alphabetical order.
#[must_use]
pub fn names() -> Vec<&'static str> {
    DEMOS.iter().map(|demo| demo.name).collect()
}

/// Makes the demo scene `name`.
///
/// # Errors
/// No demo has this name, or it cannot be made with so many triangles.
pub fn by_name(name: &str, options: &GenerateOptions) -> Result<SceneDesc, SceneError> {
    let desc = match find(name, options)?.make {
        Make::Whole(make) => make(options),
        Make::Pieces(make) => make(options).collect()?,
    };
    if desc.motion.is_some() { desc.at(options.time) } else { Ok(desc) }
}

/// Makes the demo scene `name` mesh by mesh.
///
/// # Errors
/// No demo has this name, or it cannot be made with so many triangles.
pub fn stream(name: &str, options: &GenerateOptions) -> Result<SceneStream, SceneError> {
    match find(name, options)?.make {
        Make::Whole(_) => Ok(by_name(name, options)?.into()),
        Make::Pieces(make) => Ok(make(options)),
    }
}

/// How large the demo scene `name` will be, without making it.
///
/// # Errors
/// Those of [`by_name`].
pub fn size(name: &str, options: &GenerateOptions) -> Result<DemoSize, SceneError> {
    let as_wanted = DemoSize { triangles: options.triangles.unwrap_or(0), instances: 0 };
    Ok(find(name, options)?.instanced.map_or(as_wanted, |size| size(options)))
}

/// The demo `name`, if it can be made with these options.
fn find(name: &str, options: &GenerateOptions) -> Result<&'static Demo, SceneError> {
    let place = || format!("demo:{name}");
    let Some(demo) = DEMOS.iter().find(|demo| demo.name == name) else {
        return Err(SceneError::new(
            "there is no such demo scene",
            place(),
            format!("there are {}", names().join(", ")),
        ));
    };
    let (triangles, bytes) = ("the number of triangles", "the size of the textures");
    check(triangles, options.triangles, demo.sizes.as_ref(), name)?;
    check(bytes, options.texture_bytes, demo.texture_bytes.as_ref(), name)?;
    check_time(options.time, demo)?;
    Ok(demo)
}

/// Whether a demo can be asked for a moment.
fn check_time(time: f32, demo: &Demo) -> Result<(), SceneError> {
    /// Longer times have no room for fractions of a second.
    const LONGEST: f32 = 1e5;
    let place = format!("demo:{}", demo.name);
    if time != 0.0 && !demo.moves {
        return Err(SceneError::new("nothing moves in this scene", place, "leave the time out"));
    }
    if time.abs() <= LONGEST {
        return Ok(());
    }
    Err(SceneError::new(format!("the time is out of range: {time} s"), place, "at most 100000 s"))
}

/// Whether a demo can be asked for so much of something.
fn check(what: &str, wanted: Option<u64>, sizes: Option<&Sizes>, demo: &str) -> Result<(), SceneError> {
    let place = format!("demo:{demo}");
    match (wanted, sizes) {
        (None, _) => Ok(()),
        (Some(_), None) => {
            Err(SceneError::new(format!("{what} of this scene is fixed"), place, "leave the number out"))
        }
        (Some(wanted), Some(Sizes { least, most })) if !(least..=most).contains(&&wanted) => {
            let hint = format!("from {least} to {most}");
            Err(SceneError::new(format!("{what} is out of range: {wanted}"), place, hint))
        }
        (Some(_), Some(_)) => Ok(()),
    }
}

#[cfg(test)]
mod tests;
