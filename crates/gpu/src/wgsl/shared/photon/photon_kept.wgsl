// Which photons are kept: those whose place and power are numbers. Who includes this has the binding `photons`.
//#include photon_words

fn is_kept(photon: u32) -> bool {
    var kept = true;
    for (var i = 0u; i < PHOTON_FROM; i++) {
        kept = kept && (photons[photon * PHOTON_WORDS + i] & 0x7f800000u) != 0x7f800000u;
    }
    return kept;
}
