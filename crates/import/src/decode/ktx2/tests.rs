use super::*;
use base64::Engine as _;
use proptest::prelude::*;

fn bytes(text: &str) -> Vec<u8> {
    base64::engine::general_purpose::STANDARD.decode(text).expect("base64")
}

/// Channels, a texture of 10 x 7 texels that the reference encoder wrote, and what the reference decodes it to, as RGBA:
/// ETC1S with alpha, UASTC without, UASTC with alpha; the last two with Zstandard.
#[rustfmt::skip]
const CASES: [(u8, &str, &str); 3] = [
    (4, "q0tUWCAyMLsNChoKAAAAAAEAAAAKAAAABwAAAAAAAAAAAAAAAQAAAAEAAAABAAAAaAAAADwAAACkAAAAJAAAAMgAAAAAAAAAxQAAAAAAAACNAQAAAAAAAAkAAAAAAAAAAAAAAAAAAAA8AAAAAAAAAAIAOACjAQIAAwMAAAgIAAAAAAAAAAA/AAAAAAAAAAAA/////0AAPw8AAAAAAAAAAP////8fAAAAS1RYd3JpdGVyAEJhc2lzIFVuaXZlcnNhbCAyLjEwAAALAAsAQQAAAC0AAAAvAAAAAAAAAAAAAAAAAAAABAAAAAQAAAAFAAAAFECUAAAAAAAICwQgwBsAAQCAYPPskFxKbYoHEDdAAAAAEERBHzgmAhABQAAAABBC12z2SVigDUqYv9sOkCSSsg2sUv3/B6hU/weoUv0HqFJXB6jU13/bsrB427IoeNswMHhd0zD4X7UKWLUKCAAAwUQAAAAAAADyX20BmAIAAAAABIBkGFqAh2EDAABD0gOwigBgAgAAAAAAAAEEABISa0X2XYdxCA==", "AA9R8wAPUfMAD1HfAA9R33IYUcJyGFHCchhRrnIYUZzDBj+EwwY/hBQsbvMULG7fFCxu3y5GiM2PNW7CjzVuro81bpyPNW6c7TBphO0waXguRojfLkaI3y5GiM1LY6W5qU+IrqlPiJypT4icqU+IiP9UjXj/VI1uS2Ol30tjpc1LY6W5S2OlucZspZzGbKWcxmyliMZspYj/frdu/363YgC0UcIAtFHCALRRrgC0UZxyvVqQcr1akHK9WnxyvVpq3bRRW920UU8U0W7CFNFurhTRbpwu64icj9p3kI/ad3yP2ndqj9p3Vv/YdU//2HVFLuuIri7riJxL/6WcS/+liKn0kXyp9JFqqfSRVsb/rlb//59F//+fOQ=="),
    (3, "q0tUWCAyMLsNChoKAAAAAAEAAAAKAAAABwAAAAAAAAAAAAAAAQAAAAEAAAACAAAAaAAAACwAAACUAAAAJAAAAAAAAAAAAAAAAAAAAAAAAAC4AAAAAAAAAEAAAAAAAAAAYAAAAAAAAAAsAAAAAAAAAAIAKACmAQIAAwMAABAAAAAAAAAAAAB/AAAAAAAAAAAA/////x8AAABLVFh3cml0ZXIAQmFzaXMgVW5pdmVyc2FsIDIuMTAAACi1L/0gYL0BAIQC25LGgw8o8P9DyFHZYupz+9uShoHPHwaBfwKiDmoP6A3OZ8/fRmd/wgUAYCOAE2AKMIjhZhM=", "AACB/xsAgf84AIH/VACB/3EAgf+NAIH/qgCB/8YAgf/hAIH/6wCB/wApgf8bKYH/OCmB/1Qpgf9xKYH/jSmB/6opgf/GKYH/4SmB/+spgf8AVIH/G1SB/zhUgf9UVIH/cVSB/41Ugf+qVIH/xlSB/+FUgf/rVIH/AH6B/xt+gf84foH/VH6B/3F+gf+NfoH/qn6B/8Z+gf/hfoH/636B/wCmgf8bpoH/OKaB/1Smgf9xpoH/jaaB/6qmgf/GpoH/4aaB/+umgf8AwoH/G8KB/zjCgf9UwoH/ccKB/43Cgf+qwoH/xsKB/+HCgf/rwoH/AN+B/xvfgf8434H/VN+B/3Hfgf+N34H/qt+B/8bfgf/h34H/69+B/w=="),
    (4, "q0tUWCAyMLsNChoKAAAAAAEAAAAKAAAABwAAAAAAAAAAAAAAAQAAAAEAAAACAAAAaAAAACwAAACUAAAAJAAAAAAAAAAAAAAAAAAAAAAAAAC4AAAAAAAAAF4AAAAAAAAAYAAAAAAAAAAsAAAAAAAAAAIAKACmAQIAAwMAABAAAAAAAAAAAAB/AwAAAAAAAAAA/////x8AAABLVFh3cml0ZXIAQmFzaXMgVW5pdmVyc2FsIDIuMTAAACi1L/0gYK0CAKQEKGlh+4KC/89ByFHZYupz+yhpwRv5gf/nQyxrQbtMgP8/SGlJ+oJu/GcTMpi63P7c/khpqVr7bfy/EiySAPlObPyrQchR2WLqc/sDAIE8AIlNNvE=", "AACD6hwAg+o6AIPqVgCD6nEAg7OMAIOzqQCDs8QAg7PkAIOI7QCDiAAog94cKIPeOiiD3lYog95xKIOnjCiDp6kog6fEKIOn5CiDe+0og3sAU4PRHFOD0TpTg9FWU4PRcVODmoxTg5qpU4OaxFODmuRTg27tU4NuAHyDxBx8g8Q6fIPEVnyDxHF8g46MfIOOqXyDjsR8g47kfINh7XyDYQCjg7kco4OtOqODoFajg5Nxo4ODjKODdqmjg2nEo4Nc5KmDVu2pg1YA3oO5HN6DrTreg6BW3oOTcd6Dg4zeg3ap3oNpxN6DXOTEg03txINNAPqDuRz6g606+oOgVvqDk3H6g4OM+oN2qfqDacT6g1zk4INE7eCDRA=="),
];

fn decode(bytes: &[u8]) -> Result<Image, ImportError> {
    ktx2(bytes, "test", &Limits::default())
}

#[test]
fn same_as_the_reference() {
    for (channels, file, expected) in CASES {
        let image = decode(&bytes(file)).expect("well formed");
        assert_eq!((image.width, image.height, image.channels), (10, 7, channels));
        let expected = keep(&bytes(expected), usize::from(channels));
        assert_eq!(image.texels, Texels::U8(expected.clone()));
        // Negative control: another payload gives another picture, or none.
        let mut broken = bytes(file);
        let last = broken.len() - 20;
        broken[last] ^= 0xff;
        assert!(decode(&broken).map_or(true, |i| i.texels != Texels::U8(expected)));
        assert_eq!(crate::decode_image(&bytes(file), "test", &Limits::default()), Ok(image));
    }
}

#[test]
fn other_formats_and_sizes_are_named() {
    let with = |offset: usize, value: u32| {
        let mut file = bytes(CASES[1].1);
        file[offset..offset + 4].copy_from_slice(&value.to_le_bytes());
        decode(&file).expect_err("refused")
    };
    assert!(with(12, 145).what.contains("VkFormat 145"));
    assert_eq!(with(20, 1 << 30).kind, crate::ErrorKind::Limit);
    assert!(with(28, 2).what.contains("volume"));
    assert_eq!(with(100, 1).kind, crate::ErrorKind::Limit, "a level that inflates to 4 GiB");
    assert!(decode(b"no texture").is_err());
}

#[test]
fn truncations_never_panic() {
    for (_, file, _) in CASES {
        let file = bytes(file);
        (0..file.len()).for_each(|length| drop(decode(&file[..length])));
        assert!(decode(&file[..file.len() / 2]).is_err());
    }
}

proptest! {
    #[test]
    fn garbage_never_panics(
        which in 0_usize..3,
        at in any::<proptest::sample::Index>(),
        garbage in proptest::collection::vec(any::<u8>(), 1..8),
    ) {
        let mut file = bytes(CASES[which].1);
        let first = at.index(file.len());
        for (byte, &new) in file[first..].iter_mut().zip(&garbage) {
            *byte = new;
        }
        let limits = Limits { decoded_bytes: 1 << 24, ..Limits::default() };
        let _ = ktx2(&file, "test", &limits);
    }
}
