//! Text STL: words, wherever lines end.

use super::weld::Welder;
use crate::number::parse_f32;
use crate::scan::Source;
use crate::{ImportError, Limits};
use std::io::Read;
use vastlight_math::Vec3;
use vastlight_scene::Mesh;

pub(super) fn read<R: Read>(mut source: Source<R>, limits: &Limits) -> Result<Mesh, ImportError> {
    let mut welder = Welder::new();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    // The name after "solid" may be any words.
    source.line()?;
    let (mut corners, mut ended) = (Vec::new(), false);
    while let Some(word) = source.token()? {
        match word.to_ascii_lowercase().as_slice() {
            b"vertex" => {
                let corner = Vec3::new(number(&mut source)?, number(&mut source)?, number(&mut source)?);
                corners.push(welder.vertex(corner, 0));
            }
            b"endfacet" => {
                let Ok(triangle) = <[u32; 3]>::try_from(corners.as_slice()) else {
                    return Err(source.error(format!("a facet has {} vertices instead of 3", corners.len())));
                };
                triangles.push(triangle);
                corners.clear();
                limits.check_count(triangles.len() as u64, limits.triangles, "triangles", source.file())?;
            }
            b"normal" => {
                for _ in 0..3 {
                    source.token()?;
                }
            }
            b"facet" | b"outer" | b"loop" | b"endloop" => {}
            b"endsolid" => {
                ended = true;
                source.line()?;
            }
            b"solid" => {
                source.line()?;
            }
            other => {
                let what = format!("unknown word \"{}\"", other.escape_ascii());
                return Err(source.error(what));
            }
        }
    }
    if !ended || !corners.is_empty() {
        return Err(source.error("the file ends within a solid"));
    }
    Ok(Mesh { positions: welder.positions, triangles, ..Mesh::default() })
}

fn number<R: Read>(source: &mut Source<R>) -> Result<f32, ImportError> {
    let value = source.token()?.and_then(parse_f32);
    value.ok_or_else(|| source.error("a vertex needs three numbers"))
}
