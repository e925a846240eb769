// A photon as it lies in memory: place, power, and where it came from and the surface's normal, packed with the number of its
// segments, as in `vastlight-transport`, `photon::map`.

const PHOTON_WORDS: u32 = 8u;
const PHOTON_FLUX: u32 = 3u;
const PHOTON_FROM: u32 = 6u;
const PHOTON_NORMAL: u32 = 7u;
