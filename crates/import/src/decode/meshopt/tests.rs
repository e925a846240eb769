use super::*;
use MeshoptFilter as Filter;
use MeshoptMode as Mode;
use base64::Engine as _;
use proptest::prelude::*;

struct Case {
    mode: Mode,
    filter: Filter,
    count: usize,
    stride: usize,
    stream: Vec<u8>,
    elements: Vec<u8>,
}

fn case(mode: Mode, filter: Filter, count: usize, stride: usize, stream: &str, elements: &str) -> Case {
    let bytes = |text: &str| base64::engine::general_purpose::STANDARD.decode(text).expect("base64");
    Case { mode, filter, count, stride, stream: bytes(stream), elements: bytes(elements) }
}

fn decode(case: &Case, stream: &[u8]) -> Result<Vec<u8>, ImportError> {
    meshopt(stream, case.count, case.stride, case.mode, case.filter, &Limits::default(), "test")
}

/// Streams of both versions that meshoptimizer itself wrote, and what it decodes them to.
#[rustfmt::skip]
fn cases() -> Vec<Case> { vec![
    case(Mode::Attributes, Filter::None, 17, 12, "oAcAAT2HqtGX3j3YKPLjRi1zwAAAAAkHADmbemZUqZpnmm3PYfZ7HcAAAACvBwDV1LMsAyPbEfhNCoZgUgXAAAAAUAEBNsAg//0HACgd9WoOntEBlIm44zF8OcAAAABABwAoL1yLFd8Mc3EIZRDOQCXAAAAAxQcAcJ28QuAv1kGO1EvQmVwAwAAAABoBBiT2yP7//QcAxNAefi9L1ltTMi5ukLDwwAAAAEgHAOjhUGwur1XPzUG9ccKR+sAAAAB/BwC9P/dQXpPkZm6H9SN/pojAAAAACAE/gMPf/f79/P39/gQAAAAAAAAAAAAAAAAAAAAAAAAAAB0FBLzdDjG8IcQMug==", "HQUEvN0OMbwhxAy6HOiZvPEiabyDOK07/ZoDvOIKGrvrx426udepu2c4eLz67xE7Dgq/u5zymbw5JTk8pTS9O6PnCb0hPGg8Wd+rOvJ38bz75B48yCw9O4l9XLxmuZA8qfg0vIhDOzs4UcO6FUWwvNIKgrsO6vq6KQ6JvI0O7Lonyba6oqaOvOnbxrs+ajs7MHXRvHfjLjx1MSm8U/ABvV5K4Ty9kum7PLIqvZxqDz0VSTw6AqMnvX9XDz2NxoA8/UtPvZ/0HD2xhoQ8"),
    case(Mode::Attributes, Filter::None, 17, 8, "oYmZAgMhEjA0EBETAQABAgBkAAACAgIhQxITJDQBAAMBAgBkJgEAAQAAAAAAAAAAAAAAAAAAAgAAAP7///8BAQ==", "AgAAAP7///8AAAAA/////wEAAAD/////AAAAAAAAAAD/////AQAAAAAAAAAAAAAA/v///wIAAAD+////AAAAAPz//////////v///wAAAAD9//////////3////9/////P////7////7////AAAAAPr////+////+P///wAAAAD3/////v///w=="),
    case(Mode::Attributes, Filter::None, 17, 4, "oX8ACGmyIVQY+RVpU5RSaN588ADv00XoiwtzQlssXkX+7ktVAAK/CBWSWIkBCMH2/TnjVDsCDjLw4Okk4zAPAQADAAAAAAAAAAAAAAAAAAAAAAAAAEnfDbwS", "Sd8NvM2oDLt5QdM6oGPXO7CXXbwa0hS8ltc4u2pufDtgz3y81OL4OP10mLm3W+O7HvmdvCoGAb1F8fC8+9TavAN+R70="),
    case(Mode::Triangles, Filter::None, 54, 4, "4f4N/hP+Er8NrwKeAZ8NnwKeAQ8K8wTyAgQEBAQAdodWZ3iphmWJaJgBaQAA", "AAAAAAEAAAAFAAAAAAAAAAUAAAAEAAAAAgAAAAYAAAABAAAAAQAAAAYAAAAFAAAAAwAAAAcAAAACAAAAAgAAAAcAAAAGAAAABAAAAAUAAAAJAAAABAAAAAkAAAAIAAAABQAAAAYAAAAKAAAABQAAAAoAAAAJAAAABgAAAAcAAAALAAAABgAAAAsAAAAKAAAACAAAAAkAAAANAAAACAAAAA0AAAAMAAAACQAAAAoAAAAOAAAACQAAAA4AAAANAAAACgAAAAsAAAAPAAAACgAAAA8AAAAOAAAA"),
    case(Mode::Triangles, Filter::None, 54, 4, "4f///////////////v/+//////8EDAYfAg//DAoANwV/Bw0vAha/EwBUA/waEf8QBwDzCQCfBlsCFPUEB58ABfQMBi8CAAB2h1ZneKmGZYlomAFpAAA=", "AgAAAAgAAAALAAAADAAAAAsAAAAEAAAACgAAAA8AAAAPAAAADAAAAAoAAAAIAAAACAAAAAsAAAABAAAAAgAAAAgAAAANAAAAAwAAAAsAAAADAAAAAQAAAAEAAAACAAAADgAAAAUAAAAEAAAADQAAAAkAAAAJAAAABAAAAAQAAAANAAAAAAAAAAMAAAAHAAAACAAAAAkAAAADAAAAAQAAAAgAAAAEAAAACgAAAAYAAAAEAAAABgAAAAkAAAADAAAACQAAAAwAAAAKAAAADQAAAAkAAAANAAAA"),
    case(Mode::Triangles, Filter::None, 54, 4, "4P4PPxAPEC8PBz8PXxEpLz8RDw8KAQQCCAEKAQkICQgAdodWZ3iphmWJaJgBaQAA", "AAAAAAEAAAAFAAAAAAAAAAUAAAAEAAAABQAAAAEAAAAGAAAABgAAAAEAAAACAAAABgAAAAIAAAAHAAAABwAAAAIAAAADAAAABgAAAAcAAAALAAAABgAAAAsAAAAKAAAABgAAAAoAAAAFAAAACgAAAAsAAAAPAAAACgAAAA8AAAAOAAAABQAAAAoAAAAJAAAACQAAAAoAAAAOAAAABQAAAAkAAAAEAAAACQAAAA4AAAANAAAABAAAAAkAAAAIAAAACAAAAAkAAAANAAAACAAAAA0AAAAMAAAA"),
    case(Mode::Indices, Filter::None, 54, 4, "0QgYDAQCGhgUAAoGBgAMJgQYFCYgHgYABDAiAiQOABIAJCYQGiAEFgQKHAgOBggMFhgMBgwOEAAAAAA=", "AgAAAAgAAAALAAAADAAAAAsAAAAEAAAACgAAAA8AAAAPAAAADAAAAAoAAAAIAAAACAAAAAsAAAABAAAAAgAAAAgAAAANAAAAAwAAAAsAAAADAAAAAQAAAAEAAAACAAAADgAAAAUAAAAEAAAADQAAAAkAAAAJAAAABAAAAAQAAAANAAAAAwAAAAcAAAAAAAAACAAAAAkAAAADAAAABAAAAAEAAAAIAAAACgAAAAYAAAAEAAAABgAAAAkAAAADAAAACQAAAAwAAAAKAAAADQAAAAkAAAANAAAA"),
    case(Mode::Attributes, Filter::Octahedral, 16, 8, "oAMAEP43DUTo2MPt9fM4+8dZAwCEdR0jUA0Nfs0PWjNCRjkDADMLA2x5tFxeUiflOYhz8gMAuGcgP2bXRHIXeaIILZVkAAADAKRdc2Oci9OHrfIAguBcCwMARu+CFlbxpy8LvUV4sVG5AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA2zQgIv9/sfo=", "FFooOudFsfonAvEJaYADHQJPZWQe+NSllTO0dN71muZ4K2VgH0ho8bccImIBs7YcW1XhAV1fcKNLWag8xkQGT+kyexHgi8I33xFxdA4yazH9BQYYlH3k0iopzHSj3+SvOhzYfEkAJesYRc9q1/GVkl15QgjTJ8NpSF6MVUENvQw="),
    case(Mode::Attributes, Filter::Octahedral, 16, 4, "oAMAqBZ4e87sOdabo2r2/BT8AwAhveB5embBXBIRAAAdHgAAAwDYIy7YDQFKylH7iuw97CAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAlgB/cQ==", "gwAZceLped30ggXLRABs4uyhUk51ADBHr1YvRpO/BmsmAHnQuQ1op38AASmVAEVuPwBu5InrKMWZAEo7SABoSw=="),
    case(Mode::Attributes, Filter::Quaternion, 16, 8, "oAMAwBfNjRqyzymAC/o5daFbAgWp52CwozYiAwC4LsVSzFGdq2JJ7O6mMaoCAJQF4ZAWEDgDANldbuMIB8XWoXhNb4F+kgIDQSkcIXYFYAIAIxQ2VjEEAgAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAADU/+4CPgL+Aw==", "W0LIMuJgG/zYM34SME0BqjAao8ShO9Rc2SkOYHu20//KUr1OzexpNuGxhcUiUkv1AAAeQctMhK7qNygvpy2ZXiAgKq70zMRN07NJ0fQvGU6q2ohbiiRdt0F6p+sa7ykbBWtw0vvi2yyt0yjjSnMqEdG6rixiXKUgOjNIBn0cnXE="),
    case(Mode::Attributes, Filter::Exponential, 16, 12, "oAMABRRM2WKHWIBtZtzi3MLjAwC0i/n6cC1pVUrmQBOCrJkDABJEKYk3zmWLugr91PMCsgMALXNdQAkoeFiJUjIHDgA1AwB6pwOt+olpB3HHQDI0LT4DAAja60qXcRbc4HNrMsBbKwMASkgMMcnUEAMGSKs0vuNpAwDL7mWpKMDvdI2rd6O4d4QDAJPavKcQqx0D3t9OJmZdDAMACUbn2/wSvnNdtVZT3XuEAwDr0GaRqQ46g2/cx7mhm0cDAOLrmCI+PFw440Q3II4c5QAAAAAAAAAAAAAAAAAAAAAAAAAAgBZGSLibnD+WGxxe", "AC2MbpDIRuqw3OB4+uAeYyyA+bZo0zOyDlViRvia1/GQm+N1Wlu5LghLI9guigMdAFK5PeASNa6gB/Wj4LETuorf2jhqVDi1WpZERgAmI+gWQyrEZFm8Y9T6AqxoCuPaOKMw+eRCCck4+XXpxCCMV5AHf6WmqRswKgcXbEC1HHk6DQnB9HNN+GygIt0USS8z0GVadnTc3LNgrDC5PEoG+vSjnGFg6K3eep8F+jQKFMRCm7dliB63a/Y3fuWcPtwr"),
    case(Mode::Attributes, Filter::Color, 16, 4, "of8AuLYdeInUPQE7em2V4R30AIJ/MJ7ZojdyjRbmu1UhBwCDUSAELhxIoe63YAQXNMEAVYhZVyoUQhkHRptWhBV9AAAAAAAAAAAAAAAAAAAAAAAAALWtOMwA", "Ku3QmAkHLUNNOfHLRjq6cM94pRgGSrZDs8LBV1THmpjddbF/Ac5jd6Wv8byxqBcgBl8od3bi7vs87dbkEwa1Zw=="),
    case(Mode::Attributes, Filter::Color, 16, 8, "oXd3ANjDnjpNaBO+WqNDdPBoqQILgG/vp2UxJRAQAMb6fz1wYMgBur3GET1/AgILb4SwVY/hUBATAJkV76/KmRmezNpGJK+pSwIEMamlMe1/shoAU4yXCkH9hGEolANQJ6SBAgGWA0FQ5xQFAAAAAAAAAAAAAAAAAAAiB5X7CP8NDwEA", "8zqmYlzIveG8zJ7suZ193B3fyIV0QDIlh3c3c+3guZvhDI//L/pJnKAHYiPqrTVYt3re8fZqSIgjMWRA4RSHcBiKRmv7vXEKX/x5nJzU8QxyGizOl34+9l/8MzYSJPd1TebxEi7v9VpREf/8Ey55mOZd6qqs0riCAiM4i6mXgzo="),
] }

#[test]
fn same_as_the_reference() {
    for case in cases() {
        assert_eq!(
            decode(&case, &case.stream).as_ref(),
            Ok(&case.elements),
            "{:?} {:?}",
            case.mode,
            case.filter
        );
    }
}

#[test]
fn a_broken_stream_does_not_decode_to_the_same() {
    // Negative control: the comparison above can fail.
    for case in cases() {
        let mut stream = case.stream.clone();
        stream[2] ^= 0x55;
        assert_ne!(decode(&case, &stream).as_ref(), Ok(&case.elements), "{:?} {:?}", case.mode, case.filter);
    }
}

#[test]
fn every_truncation_is_an_error() {
    for case in cases() {
        for length in 0..case.stream.len() {
            assert!(decode(&case, &case.stream[..length]).is_err(), "{length}");
        }
    }
}

#[test]
fn short_indices() {
    let case = cases().into_iter().find(|c| c.mode == Mode::Indices).expect("a sequence");
    let short = meshopt(&case.stream, case.count, 2, case.mode, case.filter, &Limits::default(), "test");
    let words = case.elements.as_chunks::<4>().0.iter();
    let expected: Vec<u8> = words.flat_map(|w| [w[0], w[1]]).collect();
    assert_eq!(short, Ok(expected));
}

#[test]
fn what_does_not_fit_is_refused() {
    let attributes = |stride, filter| {
        meshopt(&[0xa0; 400], 3, stride, Mode::Attributes, filter, &Limits::default(), "test").is_err()
    };
    assert!(attributes(6, Filter::None) && attributes(0, Filter::None) && attributes(12, Filter::Octahedral));
    let tiny = Limits { decoded_bytes: 10, ..Limits::default() };
    let huge = meshopt(&[0xa0], usize::MAX, 4, Mode::Attributes, Filter::None, &tiny, "test");
    assert_eq!(huge.expect_err("too large").kind, crate::ErrorKind::Limit);
    let promises =
        meshopt(&[0xa0; 64], 1 << 28, 4, Mode::Attributes, Filter::None, &Limits::default(), "test");
    assert!(promises.is_err(), "a count that the stream cannot hold");
}

proptest! {
    #[test]
    fn garbage_never_panics(
        which in 0_usize..13,
        at in any::<proptest::sample::Index>(),
        garbage in proptest::collection::vec(any::<u8>(), 1..8),
    ) {
        let case = cases().swap_remove(which);
        let mut stream = case.stream.clone();
        let first = at.index(stream.len());
        for (byte, &new) in stream[first..].iter_mut().zip(&garbage) {
            *byte = new;
        }
        let _ = decode(&case, &stream);
    }
}
