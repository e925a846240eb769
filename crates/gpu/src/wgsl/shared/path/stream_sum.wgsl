// Sums of colours in fixed point, whose bits do not depend on the order: each channel a low and a high word, two's complement, in
// units of 2^-28, and behind the channels a word that tells of colours which are not finite. As in `vastlight-transport`,
// `stream::records`, with fewer digits. Who includes this has the binding `tails`, behind whose counters they stand.
//#include real

const SUM_FIRST: u32 = 8u;
const SUM_WORDS: u32 = 7u;
/// Brighter colours are cut to this.
const SUM_MOST: f32 = 17179869184.0;

fn sum_add(sample: u32, color: vec3<f32>) {
    let at = SUM_FIRST + sample * SUM_WORDS;
    if (!real_is_finite3(color)) {
        atomicStore(&tails[at + 6u], 1u);
        return;
    }
    for (var channel = 0u; channel < 3u; channel++) {
        let x = clamp(color[channel], -SUM_MOST, SUM_MOST) * (1.0 / 16.0);
        let whole = floor(x);
        // Less than 2^32, also where it was rounded.
        let low = u32(min((x - whole) * 4294967296.0, 4294967040.0));
        let old = atomicAdd(&tails[at + 2u * channel], low);
        let carry = select(0u, 1u, old > 0xffffffffu - low);
        let high = bitcast<u32>(i32(whole)) + carry;
        if (high != 0u) {
            atomicAdd(&tails[at + 2u * channel + 1u], high);
        }
    }
}
