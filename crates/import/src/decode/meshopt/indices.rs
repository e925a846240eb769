//! Index streams: triangles over two small queues of recent edges and vertices, or plain differences.

use super::{Bytes, Fault};

/// Sixteen entries, the newest replaces the oldest.
#[derive(Clone, Copy, Debug)]
struct Recent<T> {
    entries: [T; 16],
    end: usize,
}

impl<T: Copy> Recent<T> {
    fn new(fill: T) -> Self {
        Self { entries: [fill; 16], end: 0 }
    }

    fn push(&mut self, entry: T) {
        self.entries[self.end] = entry;
        self.end = (self.end + 1) & 15;
    }

    /// The entry that was pushed `back` pushes ago, from 1.
    fn get(&self, back: usize) -> T {
        self.entries[self.end.wrapping_sub(back) & 15]
    }
}

struct Decoder<'a> {
    data: Bytes<'a>,
    edges: Recent<[u32; 2]>,
    vertices: Recent<u32>,
    next: u32,
    last: u32,
}

/// Decodes a triangle list of `count` indices.
pub(super) fn triangles(bytes: &[u8], count: usize) -> Result<Vec<u32>, Fault> {
    if !count.is_multiple_of(3) {
        return Err("the number of indices is not a multiple of 3");
    }
    let mut stream = Bytes(bytes);
    // In version 0 a shared vertex could be 14 steps back, version 1 uses two of these codes for neighbours of the last.
    let recent_codes = match stream.byte()? {
        0xe0 => 15,
        0xe1 => 13,
        _ => return Err("this is no triangle stream of a known version"),
    };
    let codes = stream.take(count / 3)?;
    let data = stream.0.len().checked_sub(16).ok_or("the stream is too short")?;
    let (data, table) = stream.0.split_at(data);
    let mut decoder = Decoder {
        data: Bytes(data),
        edges: Recent::new([u32::MAX; 2]),
        vertices: Recent::new(u32::MAX),
        next: 0,
        last: 0,
    };
    let mut out = Vec::with_capacity(count);
    for &code in codes {
        let triangle = match code {
            0..0xf0 => decoder.on_edge(usize::from(code >> 4), usize::from(code & 15), recent_codes)?,
            0xf0..0xfe => decoder.tabulated(table[usize::from(code & 15)]),
            _ => decoder.free(code == 0xfe)?,
        };
        out.extend(triangle);
    }
    if decoder.data.0.is_empty() { Ok(out) } else { Err("the stream is too long") }
}

impl Decoder<'_> {
    /// A triangle that shares a recent edge.
    fn on_edge(&mut self, edge: usize, corner: usize, recent_codes: usize) -> Result<[u32; 3], Fault> {
        let [a, b] = self.edges.get(edge + 1);
        let c = if corner == 0 {
            self.new_vertex()
        } else if corner < recent_codes {
            self.vertices.get(corner + 1)
        } else {
            self.last = match corner {
                15 => self.difference(self.last)?,
                13 => self.last.wrapping_sub(1),
                _ => self.last.wrapping_add(1),
            };
            self.vertices.push(self.last);
            self.last
        };
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        Ok([a, b, c])
    }

    /// A triangle with a new vertex and two that are new or recent, by one of the stream's sixteen frequent codes.
    fn tabulated(&mut self, code: u8) -> [u32; 3] {
        let before = self.vertices;
        let a = self.new_vertex();
        let [b, c] = [code >> 4, code & 15].map(|back| match back {
            0 => self.new_vertex(),
            back => before.get(usize::from(back)),
        });
        self.push_edges([a, b, c])
    }

    /// A triangle whose corners are each new, recent, or stored as differences.
    fn free(&mut self, first_is_new: bool) -> Result<[u32; 3], Fault> {
        let code = self.data.byte()?;
        if code == 0 {
            self.next = 0;
        }
        let backs = [if first_is_new { 0 } else { 15 }, code >> 4, code & 15];
        let before = self.vertices;
        // First what the queue gives, then what the stream gives: both count up in their order.
        let mut corners = [0; 3];
        for (corner, back) in corners.iter_mut().zip(backs) {
            *corner = match back {
                0 => {
                    self.next = self.next.wrapping_add(1);
                    self.next.wrapping_sub(1)
                }
                15 => 0,
                back => before.get(usize::from(back)),
            };
        }
        for (corner, back) in corners.iter_mut().zip(backs) {
            if back == 15 {
                self.last = self.difference(self.last)?;
                *corner = self.last;
            }
            if back == 0 || back == 15 {
                self.vertices.push(*corner);
            }
        }
        Ok(self.push_edges(corners))
    }

    fn new_vertex(&mut self) -> u32 {
        let vertex = self.next;
        self.next = self.next.wrapping_add(1);
        self.vertices.push(vertex);
        vertex
    }

    fn push_edges(&mut self, [a, b, c]: [u32; 3]) -> [u32; 3] {
        self.edges.push([b, a]);
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        [a, b, c]
    }

    fn difference(&mut self, from: u32) -> Result<u32, Fault> {
        Ok(from.wrapping_add(unzigzag(varint(&mut self.data)?)))
    }
}

/// Decodes a sequence of `count` indices: differences to one of two baselines.
pub(super) fn sequence(bytes: &[u8], count: usize) -> Result<Vec<u32>, Fault> {
    const TAIL_BYTES: usize = 4;
    let mut stream = Bytes(bytes);
    if !matches!(stream.byte()?, 0xd0 | 0xd1) {
        return Err("this is no index stream of a known version");
    }
    let data =
        stream.0.len().checked_sub(TAIL_BYTES).filter(|&n| n >= count).ok_or("the stream is too short")?;
    let mut data = Bytes(&stream.0[..data]);
    let mut baselines = [0_u32; 2];
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        let coded = varint(&mut data)?;
        let baseline = &mut baselines[(coded & 1) as usize];
        *baseline = baseline.wrapping_add(unzigzag(coded >> 1));
        out.push(*baseline);
    }
    if data.0.is_empty() { Ok(out) } else { Err("the stream is too long") }
}

fn unzigzag(coded: u32) -> u32 {
    (coded >> 1) ^ 0_u32.wrapping_sub(coded & 1)
}

/// Seven bits a byte, the lowest first; at most five bytes.
fn varint(data: &mut Bytes<'_>) -> Result<u32, Fault> {
    let mut value = 0;
    for shift in [0, 7, 14, 21, 28] {
        let byte = data.byte()?;
        value |= u32::from(byte & 127) << shift;
        if byte < 128 {
            return Ok(value);
        }
    }
    Ok(value)
}

/// Indices as little-endian integers of `stride` bytes.
pub(super) fn narrow(indices: Vec<u32>, stride: usize) -> Result<Vec<u8>, Fault> {
    match stride {
        4 => Ok(indices.iter().flat_map(|i| i.to_le_bytes()).collect()),
        2 if indices.iter().all(|&i| i <= u32::from(u16::MAX)) => {
            Ok(indices.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect())
        }
        2 => Err("an index does not fit into 16 bits"),
        _ => Err("the stride of indices is not 2 or 4"),
    }
}
