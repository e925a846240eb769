//! Primitive modes: which triangles a list of vertices makes.

/// What `primitive.mode` says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    Triangles,
    Strip,
    Fan,
    /// Points or lines, with the name of the mode.
    NoSurface(&'static str),
}

impl Mode {
    /// From the number; triangles for an unknown one.
    pub(super) fn from_code(code: Option<usize>) -> Self {
        match code {
            Some(0) => Self::NoSurface("points"),
            Some(1) => Self::NoSurface("lines"),
            Some(2) => Self::NoSurface("line loops"),
            Some(3) => Self::NoSurface("line strips"),
            Some(5) => Self::Strip,
            Some(6) => Self::Fan,
            _ => Self::Triangles,
        }
    }

    /// Triangles over `corners`, each the number of a vertex. Incomplete triangles are left out; in strips and fans
    /// so are those with two equal corners, which only join pieces.
    pub(super) fn triangles(self, corners: &[u32]) -> Vec<[u32; 3]> {
        let proper = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        match self {
            Self::Triangles => corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
            Self::Strip => {
                let wound = |(i, w): (usize, &[u32])| {
                    if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] }
                };
                corners.windows(3).enumerate().map(wound).filter(proper).collect()
            }
            Self::Fan => match corners.split_first() {
                Some((&hub, rim)) => rim.windows(2).map(|w| [w[0], w[1], hub]).filter(proper).collect(),
                None => Vec::new(),
            },
            Self::NoSurface(_) => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_of_every_mode() {
        let corners = [0, 1, 2, 3, 4];
        assert_eq!(Mode::from_code(None).triangles(&corners), [[0, 1, 2]]);
        assert_eq!(Mode::from_code(Some(5)).triangles(&corners), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
        assert_eq!(Mode::from_code(Some(6)).triangles(&corners), [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
        assert!(Mode::from_code(Some(1)).triangles(&corners).is_empty());
        assert_eq!(Mode::Strip.triangles(&[0, 1, 1, 2]), [] as [[u32; 3]; 0]);
        assert_eq!(Mode::Fan.triangles(&[]), [] as [[u32; 3]; 0]);
    }
}
