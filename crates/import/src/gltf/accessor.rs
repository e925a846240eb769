//! Accessors to arrays: every component type, normalisation, strides, sparse values.

use super::buffers::{Buffers, Bytes};
use super::json::Json;
use super::model::{Accessor, Component, Sparse, View};
use crate::blob::Blob;
use std::borrow::Cow;
use std::collections::BTreeSet;
use vastlight_scene::Severity;

/// Why data of the file cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Fault {
    pub(super) what: String,
    pub(super) place: String,
    pub(super) hint: &'static str,
    /// A warning if the file is well-formed and only does not hold the data.
    pub(super) severity: Severity,
}

impl Fault {
    pub(super) fn new(what: impl Into<String>, place: impl Into<String>, hint: &'static str) -> Self {
        Self { what: what.into(), place: place.into(), hint, severity: Severity::Error }
    }
}

/// Most elements of an accessor that has no data of its own (its values are zero, or sparse).
const MAX_ZEROS: usize = 4 << 20;

/// Accessors and buffer views of a document with the bytes behind them.
#[derive(Debug, Default)]
pub(super) struct Data {
    accessors: Vec<Option<Accessor>>,
    views: Vec<Option<View>>,
    buffers: Buffers,
    /// Decompressed views; where one is `Some`, it stands for the view's own bytes.
    decoded: Vec<Option<Blob>>,
}

impl Data {
    /// Reads the tables of a document.
    pub(super) fn new(root: &Json<'_>, buffers: Buffers) -> Self {
        Self {
            accessors: root.list("accessors").iter().map(Accessor::read).collect(),
            views: root.list("bufferViews").iter().map(View::read).collect(),
            buffers,
            decoded: Vec::new(),
        }
    }

    /// Replaces the bytes of views by decompressed ones.
    pub(super) fn set_decoded(&mut self, decoded: Vec<Option<Blob>>) {
        self.decoded = decoded;
    }

    /// Most bytes of geometry that are made from the file: some times its size, and always room for a small one.
    pub(super) fn geometry_budget(&self) -> u64 {
        (256 << 20) + self.buffers.total().saturating_mul(64)
    }

    /// The buffers.
    pub(super) fn buffers(&self) -> &Buffers {
        &self.buffers
    }

    /// A well-formed accessor.
    pub(super) fn accessor(&self, index: usize) -> Option<&Accessor> {
        self.accessors.get(index)?.as_ref()
    }

    /// A well-formed buffer view.
    pub(super) fn view(&self, index: usize) -> Option<&View> {
        self.views.get(index)?.as_ref()
    }

    /// Whether the document says where values of an accessor stand; else they are zero.
    pub(super) fn has_values(&self, index: usize) -> bool {
        self.accessor(index).is_some_and(|a| a.view.is_some() || a.sparse.is_some())
    }

    /// All accessors.
    pub(super) fn accessors(&self) -> impl Iterator<Item = Option<&Accessor>> {
        self.accessors.iter().map(Option::as_ref)
    }

    /// The bytes of a view.
    pub(super) fn view_bytes(&self, index: usize) -> Result<Cow<'_, [u8]>, Fault> {
        let (blob, offset, length) = self.located(index)?;
        blob.read(offset, length).map_err(|error| unreadable(&error, index))
    }

    /// The part of a buffer that a view is.
    pub(super) fn view_part(&self, index: usize) -> Result<Blob, Fault> {
        let (blob, offset, length) = self.located(index)?;
        blob.part(offset, length).ok_or_else(|| unreadable(&std::io::ErrorKind::UnexpectedEof.into(), index))
    }

    /// Some of a view's bytes; `None` if it has not so many.
    fn bytes_within(
        &self,
        index: usize,
        start: usize,
        length: usize,
    ) -> Result<Option<Cow<'_, [u8]>>, Fault> {
        let (blob, offset, available) = self.located(index)?;
        let (start, length) = (start as u64, length as u64);
        if start.checked_add(length).is_none_or(|end| end > available) {
            return Ok(None);
        }
        blob.read(offset + start, length).map(Some).map_err(|error| unreadable(&error, index))
    }

    /// Where the bytes of a view are: offset and length.
    fn located(&self, index: usize) -> Result<(&Blob, u64, u64), Fault> {
        if let Some(bytes) = self.decoded.get(index).and_then(Option::as_ref) {
            return Ok((bytes, 0, bytes.len()));
        }
        let place = || format!("/bufferViews/{index}");
        let view =
            self.view(index).ok_or_else(|| Fault::new("the buffer view is not well-formed", place(), ""))?;
        match self.buffers.get(view.buffer) {
            Bytes::Known(bytes) => {
                let (offset, length) = (view.offset as u64, view.length as u64);
                let fits = offset.checked_add(length).is_some_and(|end| end <= bytes.len());
                let located = fits.then_some((bytes, offset, length));
                located.ok_or_else(|| Fault::new("the buffer view does not fit its buffer", place(), ""))
            }
            Bytes::Missing => Err(Fault::new("the data of the buffer view is missing", place(), "")),
            Bytes::Elsewhere => {
                let fault = Fault::new("the file does not hold the data of the buffer view", place(), "");
                Err(Fault { severity: Severity::Warning, ..fault })
            }
        }
    }

    /// An accessor's elements, located and checked against its view.
    pub(super) fn source(&self, index: usize) -> Result<Source<'_>, Fault> {
        let place = || format!("/accessors/{index}");
        let accessor = *self
            .accessor(index)
            .ok_or_else(|| Fault::new("the accessor is not well-formed", place(), ""))?;
        let short = || Fault::new("the accessor does not fit its buffer view", place(), "");
        let base = match accessor.view {
            Some(view) => {
                let size = accessor.element_size();
                let stride = self.view(view).and_then(|v| v.stride).unwrap_or(size);
                let span = span(accessor.count, stride, accessor.tight_size()).ok_or_else(short)?;
                let bytes = self.bytes_within(view, accessor.offset, span)?.ok_or_else(short)?;
                Some(Base { bytes, stride })
            }
            None if accessor.count > MAX_ZEROS => {
                let what = format!(
                    "{} elements without data are more than the limit of {MAX_ZEROS}",
                    accessor.count
                );
                return Err(Fault::new(what, place(), ""));
            }
            None => None,
        };
        let overrides =
            accessor.sparse.map(|sparse| self.overrides(&accessor, &sparse, &short)).transpose()?;
        Ok(Source { accessor, base, overrides })
    }

    fn overrides(
        &self,
        accessor: &Accessor,
        sparse: &Sparse,
        short: &dyn Fn() -> Fault,
    ) -> Result<Overrides<'_>, Fault> {
        let index_size = sparse.index_component.size();
        let length = span(sparse.count, index_size, index_size).ok_or_else(short)?;
        let indices = self.bytes_within(sparse.index_view, sparse.index_offset, length)?.ok_or_else(short)?;
        let size = accessor.element_size();
        // The last element has no padding behind it.
        let length = span(sparse.count, size, accessor.tight_size()).ok_or_else(short)?;
        let values = self.bytes_within(sparse.value_view, sparse.value_offset, length)?.ok_or_else(short)?;
        Ok(Overrides { count: sparse.count, indices, index_component: sparse.index_component, values })
    }

    /// Elements as floats, normalised where the accessor says so. Missing components are `fill`. Only those elements
    /// that `selection` lists, if there is one.
    pub(super) fn floats_of<const N: usize>(
        &self,
        index: usize,
        fill: f32,
        selection: Option<&[u32]>,
    ) -> Result<Vec<[f32; N]>, Fault> {
        self.source(index)?.floats(fill, selection).ok_or_else(|| too_large(index))
    }

    /// All elements as floats.
    pub(super) fn floats<const N: usize>(&self, index: usize, fill: f32) -> Result<Vec<[f32; N]>, Fault> {
        self.floats_of(index, fill, None)
    }

    /// Elements as whole numbers.
    pub(super) fn whole_of<const N: usize>(
        &self,
        index: usize,
        selection: Option<&[u32]>,
    ) -> Result<Vec<[u32; N]>, Fault> {
        self.source(index)?.whole(selection).ok_or_else(|| too_large(index))
    }

    /// All elements as whole numbers.
    pub(super) fn whole<const N: usize>(&self, index: usize) -> Result<Vec<[u32; N]>, Fault> {
        self.whole_of(index, None)
    }
}

fn too_large(index: usize) -> Fault {
    Fault::new("the accessor does not fit into memory", format!("/accessors/{index}"), "")
}

fn unreadable(error: &std::io::Error, view: usize) -> Fault {
    Fault::new(format!("the data cannot be read: {error}"), format!("/bufferViews/{view}"), "")
}

/// Bytes from the first to the last of `count` elements of `size` bytes at a distance of `stride`.
fn span(count: usize, stride: usize, size: usize) -> Option<usize> {
    count.checked_sub(1)?.checked_mul(stride)?.checked_add(size)
}

/// An accessor's elements in the file.
#[derive(Clone, Debug)]
pub(super) struct Source<'a> {
    pub(super) accessor: Accessor,
    base: Option<Base<'a>>,
    overrides: Option<Overrides<'a>>,
}

#[derive(Clone, Debug)]
struct Base<'a> {
    bytes: Cow<'a, [u8]>,
    stride: usize,
}

#[derive(Clone, Debug)]
struct Overrides<'a> {
    count: usize,
    indices: Cow<'a, [u8]>,
    index_component: Component,
    values: Cow<'a, [u8]>,
}

impl Overrides<'_> {
    /// Index and bytes of the value, in file order.
    fn iter(&self, element_size: usize) -> impl Iterator<Item = (usize, &[u8])> {
        let size = self.index_component.size();
        let index = move |bytes: &[u8]| match size {
            1 => usize::from(u8::from_le(bytes[0])),
            2 => usize::from(u16::read(bytes)),
            _ => u32::read(bytes) as usize,
        };
        self.indices.chunks_exact(size).map(index).zip(self.values.chunks(element_size)).take(self.count)
    }
}

impl<'a> Source<'a> {
    /// Elements that stand one after the other; `None` if there are fewer bytes than the accessor says.
    pub(super) fn packed(accessor: Accessor, bytes: &'a [u8]) -> Option<Self> {
        let stride = accessor.element_size();
        span(accessor.count, stride, accessor.tight_size()).filter(|&span| span <= bytes.len())?;
        Some(Self { accessor, base: Some(Base { bytes: Cow::Borrowed(bytes), stride }), overrides: None })
    }

    /// Elements as floats; `None` if memory does not suffice.
    pub(super) fn floats<const N: usize>(
        &self,
        fill: f32,
        selection: Option<&[u32]>,
    ) -> Option<Vec<[f32; N]>> {
        let n = self.accessor.normalized;
        match self.accessor.component {
            Component::I8 => self.decode(fill, selection, |x: i8| x.float(n)),
            Component::U8 => self.decode(fill, selection, |x: u8| x.float(n)),
            Component::I16 => self.decode(fill, selection, |x: i16| x.float(n)),
            Component::U16 => self.decode(fill, selection, |x: u16| x.float(n)),
            Component::U32 => self.decode(fill, selection, |x: u32| x.float(n)),
            Component::F32 => self.decode(fill, selection, |x: f32| x),
        }
    }

    /// Elements as whole numbers; negative and fractional ones become 0. `None` if memory does not suffice.
    pub(super) fn whole<const N: usize>(&self, selection: Option<&[u32]>) -> Option<Vec<[u32; N]>> {
        match self.accessor.component {
            Component::I8 => self.decode(0, selection, |x: i8| u32::try_from(x).unwrap_or(0)),
            Component::U8 => self.decode(0, selection, |x: u8| u32::from(x)),
            Component::I16 => self.decode(0, selection, |x: i16| u32::try_from(x).unwrap_or(0)),
            Component::U16 => self.decode(0, selection, |x: u16| u32::from(x)),
            Component::U32 => self.decode(0, selection, |x: u32| x),
            Component::F32 => self.decode(0, selection, |x: f32| x as u32),
        }
    }

    fn decode<S: Scalar, T: Copy + Default, const N: usize>(
        &self,
        fill: T,
        selection: Option<&[u32]>,
        convert: impl Fn(S) -> T,
    ) -> Option<Vec<[T; N]>> {
        let components = self.accessor.shape.components().min(N);
        let element = |bytes: &[u8]| {
            let mut out = [fill; N];
            for (c, value) in out.iter_mut().enumerate().take(components) {
                *value = convert(S::read(&bytes[self.accessor.component_offset(c)..]));
            }
            out
        };
        let mut out: Vec<[T; N]> = Vec::new();
        out.try_reserve_exact(selection.map_or(self.accessor.count, <[u32]>::len)).ok()?;
        match (&self.base, selection) {
            (Some(base), None) if !self.accessor.shape.is_matrix() && components == N => {
                // The common case, with offsets known to the compiler.
                out.extend(elements(base, S::SIZE * N, self.accessor.count).map(|bytes| {
                    std::array::from_fn(|c| convert(S::read(&bytes[c * S::SIZE..(c + 1) * S::SIZE])))
                }));
            }
            (Some(base), None) => {
                out.extend(elements(base, self.accessor.tight_size(), self.accessor.count).map(element));
            }
            (Some(base), Some(selection)) => {
                let bytes = |i: &u32| base.bytes.get(*i as usize * base.stride..);
                out.extend(selection.iter().map(|i| bytes(i).map_or([fill; N], element)));
            }
            (None, _) => {
                let mut zero = [fill; N];
                zero[..components].fill(T::default());
                out.resize(selection.map_or(self.accessor.count, <[u32]>::len), zero);
            }
        }
        for (i, bytes) in self.overrides.iter().flat_map(|o| o.iter(self.accessor.element_size())) {
            let position = selection.map_or(Some(i), |s| s.binary_search(&(i as u32)).ok());
            if let Some(slot) = position.and_then(|p| out.get_mut(p)) {
                *slot = element(bytes);
            }
        }
        Some(out)
    }

    /// Smallest and largest raw value of each component; `None` if one is not finite.
    pub(super) fn bounds(&self) -> Option<Vec<(f64, f64)>> {
        match self.accessor.component {
            Component::I8 => self.bounds_of::<i8>(),
            Component::U8 => self.bounds_of::<u8>(),
            Component::I16 => self.bounds_of::<i16>(),
            Component::U16 => self.bounds_of::<u16>(),
            Component::U32 => self.bounds_of::<u32>(),
            Component::F32 => self.bounds_of::<f32>(),
        }
    }

    fn bounds_of<S: Scalar + Into<f64>>(&self) -> Option<Vec<(f64, f64)>> {
        let a = &self.accessor;
        let offsets: Vec<usize> = (0..a.shape.components()).map(|c| a.component_offset(c)).collect();
        let mut bounds = vec![(f64::INFINITY, f64::NEG_INFINITY); offsets.len()];
        let mut finite = true;
        let mut grow = |bytes: &[u8]| {
            for (bound, &offset) in bounds.iter_mut().zip(&offsets) {
                let x: f64 = S::read(&bytes[offset..]).into();
                finite &= x.is_finite();
                *bound = (bound.0.min(x), bound.1.max(x));
            }
        };
        let replaced: BTreeSet<usize> = self.sparse_indices().into_iter().collect();
        match &self.base {
            Some(base) => elements(base, a.tight_size(), a.count)
                .enumerate()
                .filter(|(i, _)| !replaced.contains(i))
                .for_each(|(_, bytes)| grow(bytes)),
            None if replaced.len() < a.count => grow(&[0; 64]),
            None => {}
        }
        self.overrides.iter().flat_map(|o| o.iter(a.element_size())).for_each(|(_, bytes)| grow(bytes));
        finite.then_some(bounds)
    }

    /// The indices of sparse values, in file order.
    pub(super) fn sparse_indices(&self) -> Vec<usize> {
        let size = self.accessor.element_size();
        self.overrides.iter().flat_map(|o| o.iter(size)).map(|(i, _)| i).collect()
    }
}

/// The bytes of each element; `source` has checked that they are there.
fn elements<'b>(base: &'b Base<'_>, size: usize, count: usize) -> impl Iterator<Item = &'b [u8]> {
    (0..count).map(move |i| &base.bytes[i * base.stride..i * base.stride + size])
}

/// A number that accessors store.
trait Scalar: Copy {
    const SIZE: usize;
    fn read(bytes: &[u8]) -> Self;
    fn float(self, normalized: bool) -> f32;
}

macro_rules! scalar {
    ($type:ty, $divisor:expr) => {
        impl Scalar for $type {
            const SIZE: usize = size_of::<$type>();
            #[inline]
            fn read(bytes: &[u8]) -> Self {
                let mut raw = [0; size_of::<$type>()];
                raw.copy_from_slice(&bytes[..size_of::<$type>()]);
                Self::from_le_bytes(raw)
            }
            #[inline]
            fn float(self, normalized: bool) -> f32 {
                if normalized { (self as f32 / $divisor).max(-1.0) } else { self as f32 }
            }
        }
    };
}

scalar!(i8, 127.0);
scalar!(u8, 255.0);
scalar!(i16, 32767.0);
scalar!(u16, 65535.0);
scalar!(u32, 1.0);
scalar!(f32, 1.0);
