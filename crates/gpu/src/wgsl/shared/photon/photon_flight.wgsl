// What photons on their way are besides rays: random numbers by their numbers, as in `vastlight-transport`, `photon::flight`. Who
// includes this has in `parameters` pass_first, the number of the pass's first photon, and seed.
//#include random

/// Stands where a pixel's column would in the keys of random numbers.
const PHOTON_KEY: u32 = 0x94070a5eu;
/// What keys of decisions about blended surfaces grow by with each segment.
const PHOTON_KEY_STEP: u32 = 0x9e3779b9u;

fn photon_sampler(number: u32) -> Sampler {
    let key = hash_more(hash_pair(PHOTON_KEY, 0u), parameters.seed);
    return Sampler(key, reverseBits(parameters.pass_first + number));
}

/// The key of a photon's segment of a number.
fn photon_ray_key(number: u32, depth: u32) -> u32 {
    let key = hash_more(hash_pair(PHOTON_KEY, parameters.pass_first + number), parameters.seed).y;
    return key + depth * PHOTON_KEY_STEP;
}
