//! The film as a whole: the same samples give the same bits in any order, grouping, tiling and cropping; mattes can be
//! decoded from the file alone.

use proptest::prelude::*;
use vastlight_film::{Aov, Cryptomatte, Film, FilmSettings, Picture, PixelSample, Window, name_hash};
use vastlight_math::Vec3;

const WIDTH: u32 = 13;
const HEIGHT: u32 = 9;
const NAMES: [&str; 5] = ["chair", "table", "lamp \"left\"", "стул", ""];

type Placed = (u32, u32, PixelSample);

fn film(window: Window, tile_size: u32, samples: &[Placed]) -> Film {
    let settings = FilmSettings {
        full_size: [WIDTH, HEIGHT],
        window,
        tile_size,
        aovs: Aov::ALL.to_vec(),
        squares: true,
    };
    let mut film = Film::new(settings);
    for (x, y, sample) in samples {
        film.tiles_mut().iter_mut().for_each(|tile| tile.add(*x, *y, sample));
    }
    film
}

fn mattes() -> Vec<Cryptomatte> {
    [Film::OBJECT_LAYER, Film::MATERIAL_LAYER].map(|layer| Cryptomatte::new(layer, NAMES)).into()
}

fn bits(picture: &Picture) -> Vec<(String, Vec<u32>)> {
    let plane_bits =
        |p: &vastlight_film::Plane| (p.name.clone(), p.values.iter().map(|v| v.to_bits()).collect());
    picture.planes.iter().map(plane_bits).collect()
}

fn vec3(scale: f32) -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-scale..scale).prop_map(Vec3::from_array)
}

prop_compose! {
    fn sample()(
        x in 0..WIDTH, y in 0..HEIGHT, radiance in vec3(1e7), hit in any::<bool>(), albedo in vec3(1.0),
        normal in vec3(1.0), depth in 0.0_f32..1e5, position in vec3(1e4), object in 0..NAMES.len(),
        material in 0..NAMES.len(), broken in prop::bool::weighted(0.05),
    ) -> Placed {
        let radiance = if broken { Vec3::splat(f32::NAN) } else { radiance };
        let (object, material) = (name_hash(NAMES[object]), name_hash(NAMES[material]));
        (x, y, PixelSample { radiance, hit, albedo, normal, depth, position, object, material })
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn order_grouping_and_tiling_do_not_change_a_bit(
        mut samples in prop::collection::vec(sample(), 1..120),
        cuts in prop::array::uniform2(any::<prop::sample::Index>()),
    ) {
        let whole = Window::whole(WIDTH, HEIGHT);
        let reference = film(whole, 4, &samples);
        let expected = bits(&reference.develop(mattes()));
        prop_assert_eq!(&bits(&film(whole, 64, &samples).develop(mattes())), &expected);

        let mut cuts = cuts.map(|c| c.index(samples.len()));
        cuts.sort_unstable();
        let parts = [&samples[..cuts[0]], &samples[cuts[0]..cuts[1]], &samples[cuts[1]..]];
        let [mut a, mut b, c] = parts.map(|part| film(whole, 4, part));
        b.merge(&c).expect("same settings");
        b.merge(&a).expect("same settings");
        prop_assert_eq!(&bits(&b.develop(mattes())), &expected);
        prop_assert_eq!(b.non_finite(), reference.non_finite());
        a.merge(&c).expect("same settings");
        prop_assert!(parts[1].is_empty() || a.samples() < reference.samples());

        samples.reverse();
        prop_assert_eq!(&bits(&film(whole, 4, &samples).develop(mattes())), &expected);
    }

    #[test]
    fn a_crop_is_the_crop_of_the_whole(samples in prop::collection::vec(sample(), 1..120)) {
        let crop = Window { x0: 3, y0: 2, x1: 11, y1: 8 };
        let whole = film(Window::whole(WIDTH, HEIGHT), 4, &samples).develop(mattes());
        let part = film(crop, 4, &samples).develop(mattes());
        for (full, cropped) in whole.planes.iter().zip(&part.planes) {
            for y in crop.y0..crop.y1 {
                for x in crop.x0..crop.x1 {
                    let i = crop.index(x, y).expect("inside");
                    let j = whole.window.index(x, y).expect("inside");
                    prop_assert_eq!(cropped.values[i].to_bits(), full.values[j].to_bits());
                }
            }
        }
    }
}

#[test]
fn films_of_different_settings_do_not_merge() {
    let mut a = film(Window::whole(WIDTH, HEIGHT), 4, &[]);
    let b = film(Window { x0: 1, y0: 0, x1: WIDTH, y1: HEIGHT }, 4, &[]);
    assert!(a.merge(&b).is_err());
}

#[test]
fn means_are_over_all_samples_and_depth_over_hits() {
    let hit = |radiance: f32, depth: f32| PixelSample {
        radiance: Vec3::splat(radiance),
        hit: true,
        albedo: Vec3::splat(0.5),
        normal: Vec3::Y,
        depth,
        position: Vec3::new(depth, 0.0, 0.0),
        ..PixelSample::default()
    };
    let sky = PixelSample { radiance: Vec3::splat(4.0), ..PixelSample::default() };
    let samples = [(2, 3, hit(1.0, 10.0)), (2, 3, hit(3.0, 30.0)), (2, 3, sky), (2, 3, sky)];
    let picture = film(Window::whole(WIDTH, HEIGHT), 4, &samples).develop(Vec::new());
    let at = |plane: &str| picture.plane(plane).expect("recorded")[3 * WIDTH as usize + 2];
    assert_eq!((at("R"), at("albedo.G"), at("normal.Y")), (3.0, 0.25, 0.5));
    assert_eq!((at("A"), at("depth.Z"), at("position.X")), (0.5, 20.0, 20.0));
    assert_eq!(picture.plane("R").expect("recorded")[0], 0.0);
}

/// Decodes a matte as a compositor does: by the manifest's ids and the ranked channels of the file.
#[test]
fn mattes_are_decoded_from_the_file_alone() {
    let of = |name: &str| PixelSample { hit: true, object: name_hash(name), ..PixelSample::default() };
    let samples: Vec<Placed> = ["table", "chair", "table", "lamp \"left\"", "table", "стул", "chair"]
        .map(|name| (5, 5, of(name)))
        .into_iter()
        .chain([(5, 5, PixelSample::default())])
        .collect();
    let picture = film(Window::whole(WIDTH, HEIGHT), 4, &samples).develop(mattes());
    let folder = tempfile::tempdir().expect("temporary folder");
    let path = folder.path().join("matte.exr");
    vastlight_film::write_exr(&path, &picture).expect("written");
    let read = vastlight_film::read_picture(&path).expect("read");

    let at = |name: &str| read.plane(name).expect("a rank")[5 * WIDTH as usize + 5];
    let coverage_of = |name: &str| -> f32 {
        let ranks = (0..Cryptomatte::RANKS).map(|rank| {
            let layer = format!("CryptoObject{:02}", rank / 2);
            let [id, coverage] = if rank % 2 == 0 { ["R", "G"] } else { ["B", "A"] };
            let matches = at(&format!("{layer}.{id}")).to_bits() == name_hash(name);
            if matches { at(&format!("{layer}.{coverage}")) } else { 0.0 }
        });
        ranks.sum()
    };
    assert_eq!(coverage_of("table"), 3.0 / 8.0);
    assert_eq!(coverage_of("chair"), 2.0 / 8.0);
    assert_eq!(coverage_of("lamp \"left\""), 1.0 / 8.0);
    assert_eq!(coverage_of("стул"), 1.0 / 8.0);
    assert_eq!(coverage_of("nobody"), 0.0);
    assert_eq!(at("CryptoObject00.R").to_bits(), name_hash("table"));
}
