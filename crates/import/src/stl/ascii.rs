//! Text STL: words, wherever lines end.

use super::facets::Facets;
use crate::number::parse_f32;
use crate::scan::Source;
use crate::single::Stopped;
use crate::{ImportError, Limits};
use std::io::Read;
use vastlight_math::Vec3;
use vastlight_scene::MeshSink;

pub(super) fn read<R: Read>(
    mut source: Source<R>,
    limits: &Limits,
    sink: &mut dyn MeshSink,
) -> Result<(), Stopped> {
    let mut facets = Facets::new(source.file(), limits, None, sink);
    // The name after "solid" may be any words.
    source.line()?;
    let (mut corners, mut ended) = (Vec::new(), false);
    while let Some(word) = source.token()? {
        match word.to_ascii_lowercase().as_slice() {
            b"vertex" => {
                corners.push(Vec3::new(number(&mut source)?, number(&mut source)?, number(&mut source)?));
                if corners.len() > 3 {
                    return Err(source.error("a facet has more than 3 vertices").into());
                }
            }
            b"endfacet" => {
                let Ok(facet) = <[Vec3; 3]>::try_from(corners.as_slice()) else {
                    let what = format!("a facet has {} vertices instead of 3", corners.len());
                    return Err(source.error(what).into());
                };
                facets.push(facet, 0)?;
                corners.clear();
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
                return Err(source.error(what).into());
            }
        }
    }
    if !ended || !corners.is_empty() {
        return Err(source.error("the file ends within a solid").into());
    }
    facets.finish()
}

fn number<R: Read>(source: &mut Source<R>) -> Result<f32, ImportError> {
    let value = source.token()?.and_then(parse_f32);
    value.ok_or_else(|| source.error("a vertex needs three numbers"))
}
