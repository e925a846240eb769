use super::*;
use proptest::prelude::*;

fn parse(text: &str) -> Result<IesProfile, ImportError> {
    parse_ies(text.as_bytes(), "test.ies", &mut Diagnostics::default())
}

/// A file of the revision that `head` names.
fn file(head: &str, tilt: &str, kind: u8, vertical: &[f32], horizontal: &[f32], candela: &[f32]) -> String {
    let list = |values: &[f32]| values.iter().map(f32::to_string).collect::<Vec<_>>().join(" ");
    format!(
        "{head}\n[MANUFAC] nobody\n{tilt}\n1 1000 2.0 {} {} {kind} 2 0.1 0.1 0\n0.5 1.0 20\n{}\n{}\n{}\n",
        vertical.len(),
        horizontal.len(),
        list(vertical),
        list(horizontal),
        list(candela)
    )
}

const NONE: &str = "TILT=NONE";

#[test]
fn revisions_and_factors() {
    for head in ["a label of 1986", "IESNA91", "IESNA:LM-63-1995", "IESNA:LM-63-2002", "IES:LM-63-2019"] {
        let text = file(head, NONE, 1, &[0.0, 45.0, 90.0], &[0.0], &[100.0, 50.0, 0.0]);
        let profile = parse(&text).expect("well formed");
        assert_eq!(profile.candela, [1.0, 0.5, 0.0]);
        assert_eq!(profile.peak_candela, 100.0, "100 cd, multiplier 2, ballast 0.5");
        assert_eq!(profile.vertical, [0.0, 45.0, 90.0]);
        assert_eq!(profile.horizontal, [0.0]);
        assert_eq!(parse(&text.replace('\n', "\r\n")).expect("well formed"), profile);
        assert_eq!(parse(&text.replace("45 90", "45,\t90")).expect("well formed"), profile);
    }
}

#[test]
fn tilt_tables_are_skipped_and_files_named() {
    let include =
        file("IESNA91", "TILT=INCLUDE\n1\n3\n0 45 90\n1 0.9 0.8", 1, &[0.0, 90.0], &[0.0], &[2.0, 1.0]);
    assert_eq!(parse(&include).expect("well formed").candela, [1.0, 0.5]);
    let mut found = Diagnostics::default();
    let other = file("IESNA91", "TILT=tilt.dat", 1, &[0.0, 90.0], &[0.0], &[2.0, 1.0]);
    assert!(parse_ies(other.as_bytes(), "test.ies", &mut found).is_ok());
    assert!(found.items()[0].what.contains("another file"));
}

/// The value at a stored horizontal angle, first vertical angle.
fn at(profile: &IesProfile, horizontal: f32) -> f32 {
    let row = profile.horizontal.iter().position(|&h| (h - horizontal).abs() < 1e-3).expect("an angle");
    profile.candela[row * profile.vertical.len()]
}

#[test]
fn symmetries_are_unfolded() {
    let unfold = |horizontal: &[f32], candela: &[f32]| {
        parse(&file("IESNA91", NONE, 1, &[30.0], horizontal, candela)).expect("well formed")
    };
    let quadrant = unfold(&[0.0, 30.0, 90.0], &[1.0, 2.0, 4.0]);
    assert_eq!(quadrant.horizontal, [0.0, 30.0, 90.0, 150.0, 180.0, 210.0, 270.0, 330.0]);
    for (h, expected) in [(0.0, 0.25), (30.0, 0.5), (150.0, 0.5), (180.0, 0.25), (270.0, 1.0), (330.0, 0.5)] {
        assert_eq!(at(&quadrant, h), expected, "{h}");
    }
    let half = unfold(&[0.0, 45.0, 180.0], &[1.0, 2.0, 4.0]);
    assert_eq!(half.horizontal, [0.0, 45.0, 180.0, 315.0]);
    assert_eq!(at(&half, 315.0), 0.5);
    let other_half = unfold(&[90.0, 120.0, 270.0], &[1.0, 2.0, 4.0]);
    assert_eq!(other_half.horizontal, [60.0, 90.0, 120.0, 270.0]);
    assert_eq!(at(&other_half, 60.0), 0.5);
    let full = unfold(&[0.0, 90.0, 180.0, 270.0, 360.0], &[1.0, 2.0, 3.0, 4.0, 1.0]);
    assert_eq!(full.horizontal, [0.0, 90.0, 180.0, 270.0]);
    assert!(parse(&file("IESNA91", NONE, 1, &[30.0], &[10.0, 50.0], &[1.0, 2.0])).is_err());
}

#[test]
fn types_b_and_a_turn_about_their_own_axes() {
    // All light at 60 degrees across and 0 along, and none elsewhere.
    let angles = [-90.0, -60.0, 0.0, 60.0, 90.0];
    let mut candela = [0.0; 25];
    candela[3 * 5 + 2] = 7.0;
    for kind in [2, 3] {
        let profile = parse(&file("IESNA91", NONE, kind, &angles, &angles, &candela)).expect("well formed");
        let value = |h: usize, v: usize| profile.candela[h * profile.vertical.len() + v];
        assert!((value(0, 60) - 1.0).abs() < 1e-5, "to the right");
        assert!(value(180, 60) < 1e-5 && value(0, 0) < 1e-5);
        assert!(value(90, 60) < 1e-5, "nothing upwards");
    }
    // 60 up and 60 across: in type B nearer to the side (sine of the latitude), in type A nearer to the pole.
    let mut candela = [0.0; 25];
    candela[3 * 5 + 3] = 7.0;
    let direction = |kind| {
        let profile = parse(&file("IESNA91", NONE, kind, &angles, &angles, &candela)).expect("well formed");
        let brightest = profile.candela.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        brightest.map_or(0, |b| b.0) / profile.vertical.len()
    };
    // Type B: x = sin 60, y = cos 60 sin 60; type A: x = cos 60 sin 60, y = sin 60.
    assert!(direction(2).abs_diff(27) <= 1, "{}", direction(2));
    assert!(direction(3).abs_diff(63) <= 1, "{}", direction(3));
}

#[test]
fn mirrored_quarters() {
    let quarter = file("IESNA91", NONE, 2, &[0.0, 90.0], &[0.0, 90.0], &[4.0, 4.0, 2.0, 2.0]);
    let profile = parse(&quarter).expect("well formed");
    let value = |h: usize, v: usize| profile.candela[h * profile.vertical.len() + v];
    assert!((value(0, 45) - 0.75).abs() < 1e-5 && (value(180, 45) - 0.75).abs() < 1e-5);
}

#[test]
fn errors_say_what_and_where() {
    let good = file("IESNA91", NONE, 1, &[0.0, 90.0], &[0.0], &[2.0, 1.0]);
    let message = |text: &str| parse(text).expect_err("malformed").to_string();
    assert!(message("hello").contains("no line TILT="));
    assert!(
        message(&good.replace("20\n0 90", "20\n90 0"))
            .contains("test.ies:6: the vertical angles do not ascend")
    );
    assert!(message(&good.replace("2 1\n", "2 x\n")).contains("\"x\" is not a number"));
    assert!(message(&good.replace("2 1\n", "0 0\n")).contains("no light"));
    assert!(message(&good.replace("2 1 1 2", "2 1 9 2")).contains("photometric type 9"));
}

#[test]
fn every_truncation_is_an_error_not_a_panic() {
    let good = file("IESNA91", NONE, 1, &[0.0, 90.0], &[0.0, 90.0], &[2.0, 1.0, 3.0, 4.0]);
    for length in 0..good.len() - 2 {
        assert!(parse(&good[..length]).is_err(), "{length}");
    }
}

proptest! {
    #[test]
    fn garbage_never_panics(
        at in any::<proptest::sample::Index>(),
        garbage in "[-0-9. a-z]{1,6}",
        kind in 1_u8..4,
    ) {
        let mut text = file("IESNA91", NONE, kind, &[0.0, 90.0], &[0.0, 90.0], &[2.0, 1.0, 3.0, 4.0]);
        let first = at.index(text.len());
        text.replace_range(first..text.len().min(first + garbage.len()), &garbage);
        let _ = parse(&text);
    }
}
