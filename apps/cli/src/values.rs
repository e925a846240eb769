//! Values of arguments: resolutions, crops, durations, directions.

use std::ops::Range;
use std::time::Duration;
use vastlight::accel::cluster::Heuristic;
use vastlight::math::Vec3;
use vastlight::trace::UpdateMethod;
use vastlight::transport::Tile;
use vastlight::transport::photon::SearchKind;
use vastlight::{LARGEST_EDGE, default_size};

/// Picture size as it was asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Resolution {
    /// Width and height.
    Exact(u32, u32),
    /// Height, or the usual one; the width follows from the camera's shape, or 16:9.
    Rows(Option<u32>),
    /// Part of the default size.
    Scale(f32),
}

impl Resolution {
    /// Width and height for a camera with the given shape.
    pub(crate) fn size(self, aspect: Option<f32>) -> (u32, u32) {
        match self {
            Self::Exact(width, height) => (width, height),
            Self::Rows(rows) => default_size(rows, aspect),
            Self::Scale(scale) => {
                let (width, height) = default_size(None, aspect);
                let scaled = |n: u32| ((n as f32 * scale).round() as u32).clamp(1, LARGEST_EDGE);
                (scaled(width), scaled(height))
            }
        }
    }
}

impl Default for Resolution {
    fn default() -> Self {
        Self::Rows(None)
    }
}

/// `1920x1080`, `1080p`, `4k` or `50%`.
pub(crate) fn resolution(text: &str) -> Result<Resolution, String> {
    let expected = || "write 1920x1080, 1080p, 4k or 50%".to_owned();
    let edge = |t: &str| match t.parse() {
        Ok(n @ 1..=LARGEST_EDGE) => Ok(n),
        Ok(_) => Err(format!("edges are 1 to {LARGEST_EDGE} pixels")),
        Err(_) => Err(expected()),
    };
    if let Some((width, height)) = text.split_once('x') {
        Ok(Resolution::Exact(edge(width)?, edge(height)?))
    } else if let Some(rows) = text.strip_suffix('p') {
        edge(rows).map(|rows| Resolution::Rows(Some(rows)))
    } else if text == "4k" {
        Ok(Resolution::Rows(Some(2160)))
    } else {
        let percent: f32 = text.strip_suffix('%').and_then(|t| t.parse().ok()).ok_or_else(expected)?;
        if percent > 0.0 && percent <= 1000.0 {
            Ok(Resolution::Scale(percent / 100.0))
        } else {
            Err("between 0% and 1000%".into())
        }
    }
}

/// Numbers separated by commas, exactly `N`, all finite.
fn numbers<const N: usize>(text: &str, expected: &str) -> Result<[f32; N], String> {
    let values: Result<Vec<f32>, _> = text.split(',').map(|t| t.trim().parse()).collect();
    let values: Option<[f32; N]> = values.ok().and_then(|v| v.try_into().ok());
    values.filter(|v| v.iter().all(|x| x.is_finite())).ok_or_else(|| format!("write {expected}"))
}

/// `x0,y0,x1,y1` in pixels, the last two exclusive.
pub(crate) fn crop(text: &str) -> Result<Tile, String> {
    let expected = "x0,y0,x1,y1 in pixels with x0 < x1 and y0 < y1";
    let parts: Result<Vec<u32>, _> = text.split(',').map(|t| t.trim().parse()).collect();
    match parts.as_deref() {
        Ok(&[x0, y0, x1, y1]) if x0 < x1 && y0 < y1 => Ok(Tile { min: [x0, y0], max: [x1, y1] }),
        _ => Err(format!("write {expected}")),
    }
}

/// `ex,ey,ez,tx,ty,tz`: eye and target.
pub(crate) fn look_at(text: &str) -> Result<[Vec3; 2], String> {
    let [ex, ey, ez, tx, ty, tz] = numbers(text, "ex,ey,ez,tx,ty,tz: eye and target")?;
    let (eye, target) = (Vec3::new(ex, ey, ez), Vec3::new(tx, ty, tz));
    if eye == target { Err("eye and target are the same point".into()) } else { Ok([eye, target]) }
}

/// `azimuth,elevation` in degrees.
pub(crate) fn sun(text: &str) -> Result<[f32; 2], String> {
    let [azimuth, elevation] = numbers(text, "azimuth,elevation in degrees")?;
    if (-90.0..=90.0).contains(&elevation) {
        Ok([azimuth, elevation])
    } else {
        Err("the elevation is -90 to 90 degrees".into())
    }
}

/// A part of a frame's time for which a shutter is open.
pub(crate) fn shutter(text: &str) -> Result<f32, String> {
    let [part] = numbers(text, "a part of a frame's time, such as 0.5")?;
    if (0.0..=100.0).contains(&part) { Ok(part) } else { Err("between 0 and 100 frames".into()) }
}

/// An angle of view in degrees.
pub(crate) fn field_of_view(text: &str) -> Result<f32, String> {
    let [degrees] = numbers(text, "an angle in degrees")?;
    if degrees > 0.0 && degrees < 179.0 { Ok(degrees) } else { Err("between 0 and 179 degrees".into()) }
}

/// Numbers of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Frames {
    first: u32,
    last: u32,
    step: u32,
}

impl Frames {
    /// All of them, in order.
    pub(crate) fn iter(self) -> impl Iterator<Item = u32> {
        (self.first..=self.last).step_by(self.step as usize)
    }
}

/// The moment of a frame, in seconds.
pub(crate) fn moment(frame: u32, fps: f32) -> f32 {
    (f64::from(frame) / f64::from(fps)) as f32
}

/// `7`, `1-100` or `1-100x2`.
pub(crate) fn frames(text: &str) -> Result<Frames, String> {
    /// More frames than any film has.
    const MOST: u32 = 100_000_000;
    let expected = || "write 7, 1-100 or 1-100x2".to_owned();
    let number = |text: &str| {
        let number: u32 = text.parse().map_err(|_| expected())?;
        if number <= MOST { Ok(number) } else { Err(format!("frames are 0 to {MOST}")) }
    };
    let (range, step) = match text.split_once('x') {
        Some((range, step)) => (range, number(step)?),
        None => (text, 1),
    };
    let (first, last) = match range.split_once('-') {
        Some((first, last)) => (number(first)?, number(last)?),
        None => (number(range)?, number(range)?),
    };
    match (first <= last, step > 0) {
        (true, true) => Ok(Frames { first, last, step }),
        (false, _) => Err("the last frame is before the first".into()),
        (_, false) => Err("the step is at least 1".into()),
    }
}

/// A finite number.
pub(crate) fn finite(text: &str) -> Result<f32, String> {
    numbers::<1>(text, "a number").map(|[x]| x)
}

/// A structure that finds photons.
pub(crate) fn photon_search(text: &str) -> Result<SearchKind, String> {
    let names = || SearchKind::ALL.map(SearchKind::name).join(", ");
    SearchKind::from_name(text).ok_or_else(|| format!("one of {} is expected", names()))
}

/// A way in which structures follow what moves.
pub(crate) fn update_method(text: &str) -> Result<UpdateMethod, String> {
    let names = || UpdateMethod::ALL.map(UpdateMethod::name).join(", ");
    UpdateMethod::from_name(text).ok_or_else(|| format!("one of {} is expected", names()))
}

/// What clusters should look like.
pub(crate) fn heuristic(text: &str) -> Result<Heuristic, String> {
    let names = || Heuristic::ALL.map(Heuristic::name).join(", ");
    Heuristic::from_name(text).ok_or_else(|| format!("one of {} is expected", names()))
}

/// A number above 0.
pub(crate) fn positive(text: &str) -> Result<f32, String> {
    let number = finite(text)?;
    if number > 0.0 { Ok(number) } else { Err("a number above 0 is expected".to_owned()) }
}

/// `90`, `90s`, `10m`, `1.5h`, `500ms`.
pub(crate) fn duration(text: &str) -> Result<Duration, String> {
    let expected = || "write 90s, 10m, 1.5h or 500ms".to_owned();
    let digits = text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
    let value: f64 = text[..digits].parse().map_err(|_| expected())?;
    let unit = match &text[digits..] {
        "" | "s" => 1.0,
        "ms" => 1e-3,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(expected()),
    };
    Duration::try_from_secs_f64(value * unit).map_err(|_| expected())
}

/// `17-32` or `5`, numbered from 1: the numbers from 0.
pub(crate) fn passes(text: &str) -> Result<Range<u32>, String> {
    let number = |text: &str| text.parse().ok().filter(|&n: &u32| n > 0);
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    match (number(first), number(last)) {
        (Some(first), Some(last)) if first <= last => Ok(first - 1..last),
        (Some(_), Some(_)) => Err("the last pass comes before the first".to_owned()),
        _ => Err("write 17-32, numbered from 1".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight::transport::PixelFilter;

    #[test]
    fn resolutions() {
        let size = |text: &str| resolution(text).map(|r| r.size(None));
        assert_eq!(size("640x480"), Ok((640, 480)));
        assert_eq!(size("1080p"), Ok((1920, 1080)));
        assert_eq!(size("50%"), Ok((640, 360)));
        assert_eq!(resolution("1080p").map(|r| r.size(Some(1.0))), Ok((1080, 1080)));
        for wrong in ["", "0x4", "640", "640x", "-3%", "axb", "70000x1"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn durations() {
        assert_eq!(duration("1.5h"), Ok(Duration::from_secs(5400)));
        assert_eq!(duration("500ms"), Ok(Duration::from_millis(500)));
        assert!(duration("soon").is_err() && duration("5 parsecs").is_err() && duration("").is_err());
    }

    #[test]
    fn lists_of_numbers() {
        assert_eq!(crop("1,2,3,4"), Ok(Tile { min: [1, 2], max: [3, 4] }));
        assert!(crop("3,2,3,4").is_err() && crop("1,2,3").is_err());
        assert!(look_at("0,0,0,0,0,0").is_err() && look_at("0,0,1,0,0,nan").is_err());
        assert!(sun("10,95").is_err() && sun("10,45").is_ok());
        assert!(field_of_view("180").is_err());
    }

    #[test]
    fn passes_are_numbered_from_one() {
        assert_eq!(passes("17-32"), Ok(16..32));
        assert_eq!(passes("5"), Ok(4..5));
        assert!(
            passes("0-4").is_err() && passes("4-3").is_err() && passes("1-").is_err() && passes("a").is_err()
        );
    }

    #[test]
    fn filters() {
        let filter = |text: &str| text.parse::<PixelFilter>();
        assert_eq!(filter("gaussian:2"), Ok(PixelFilter::Gaussian { radius: 2.0 }));
        assert!(filter("box:2").is_err() && filter("lanczos").is_err() && filter("triangle:99").is_err());
    }
}
