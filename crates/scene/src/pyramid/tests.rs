use super::*;

fn noise(count: usize, seed: u32) -> impl Iterator<Item = u32> {
    let mut state = seed.wrapping_mul(2_654_435_761).wrapping_add(12_345);
    (0..count).map(move |_| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state >> 8
    })
}

fn image(width: u32, height: u32, channels: u8, texels: Texels) -> Image {
    Image { name: String::new(), width, height, channels, texels }
}

fn float_image(width: u32, height: u32, channels: u8) -> Image {
    let count = (width * height) as usize * usize::from(channels);
    let texels = noise(count, width + 31 * height).map(|x| (x % 1000) as f32 / 999.0).collect();
    image(width, height, channels, Texels::F32(texels))
}

/// The mean over an area of the image itself, by brute force, in double precision. Sides are in texels.
fn mean_over(image: &Image, weight: impl Fn(Vec4) -> f64, x: [f64; 2], y: [f64; 2]) -> [f64; 4] {
    let reader = TexelReader::new(Encoding::Linear);
    let (mut sums, mut total) = ([0.0; 4], 0.0);
    let overlap = |i: u32, [a, b]: [f64; 2]| (b.min(f64::from(i) + 1.0) - a.max(f64::from(i))).max(0.0);
    for row in 0..image.height {
        for column in 0..image.width {
            let v = reader.read(&image.texels, image.channels, (row * image.width + column) as usize);
            let area = overlap(column, x) * overlap(row, y) * weight(v);
            for (sum, v) in sums.iter_mut().zip(v.to_array()) {
                *sum += f64::from(v) * area;
            }
            total += area;
        }
    }
    sums.map(|sum| sum / total)
}

/// A texel of a level covers the area that it stands for: edges of a texel at level `n` are edges of texels at level
/// `n - 1` or lie between them in the ratio of the sizes.
#[test]
fn texels_are_the_means_of_their_areas() {
    for (width, height) in [(16, 16), (5, 7), (13, 1), (1, 9), (64, 3), (21, 34), (3, 2)] {
        let image = float_image(width, height, 1);
        let levels = pyramid(&image, Content::Data);
        assert_eq!(levels.len() + 1, level_sizes(width, height).len());
        for level in &levels {
            let Texels::F32(texels) = &level.texels else { panic!("stored like the image") };
            assert_eq!(texels.len(), (level.width * level.height) as usize);
            let sx = f64::from(width) / f64::from(level.width);
            let sy = f64::from(height) / f64::from(level.height);
            for (i, &texel) in texels.iter().enumerate() {
                let (x, y) = (i as u32 % level.width, i as u32 / level.width);
                let side = |i: u32, s: f64| [f64::from(i) * s, f64::from(i + 1) * s];
                let mean = mean_over(&image, |_| 1.0, side(x, sx), side(y, sy))[0];
                // Exact where a level lies on the one before it; else means of means.
                let exact = width.is_power_of_two() && height.is_power_of_two() || level.width * 3 > width;
                let slack = if exact { 1e-5 } else { 0.2 };
                assert!((f64::from(texel) - mean).abs() < slack, "{width}x{height}: {texel} {mean}");
            }
        }
        let last = levels.last().map(|l| l.texels.clone());
        let whole = mean_over(&image, |_| 1.0, [0.0, width.into()], [0.0, height.into()])[0];
        let Some(Texels::F32(last)) = last else { panic!("a last level") };
        assert!((f64::from(last[0]) - whole).abs() < 1e-5, "the last is the mean of all");
    }
}

#[test]
fn colours_are_weighted_by_alpha_and_averaged_in_linear_light() {
    // Black and white, sRGB: half the light is 188, not 128.
    let grey = image(2, 1, 1, Texels::U8(vec![0, 255]));
    assert_eq!(pyramid(&grey, Content::Color)[0].texels, Texels::U8(vec![188]));
    assert_eq!(pyramid(&grey, Content::Data)[0].texels, Texels::U8(vec![128]));
    // What is not to be seen does not shine through.
    let leaf = image(2, 1, 4, Texels::U8(vec![200, 100, 50, 255, 0, 0, 0, 0]));
    assert_eq!(pyramid(&leaf, Content::Color)[0].texels, Texels::U8(vec![200, 100, 50, 128]));
    let clear = image(2, 1, 4, Texels::U8(vec![200, 100, 50, 0, 200, 100, 50, 0]));
    assert_eq!(pyramid(&clear, Content::Color)[0].texels, Texels::U8(vec![200, 100, 50, 0]));
    let image = float_image(8, 8, 4);
    let last = pyramid(&image, Content::Color).pop().map(|l| l.texels);
    let all = [0.0, 8.0];
    let expected = mean_over(&image, |v| f64::from(v.w), all, all);
    let alpha = mean_over(&image, |_| 1.0, all, all)[3];
    let Some(Texels::F32(last)) = last else { panic!("floats") };
    for (found, expected) in last.iter().zip([expected[0], expected[1], expected[2], alpha]) {
        assert!((f64::from(*found) - expected).abs() < 1e-4, "{found} {expected}");
    }
}

#[test]
fn normals_are_averaged_as_vectors_and_unit_again() {
    let normals = [Vec3::new(0.6, 0.0, 0.8), Vec3::new(-0.6, 0.0, 0.8), Vec3::new(0.0, 0.6, 0.8), Vec3::Z];
    let texels = normals.iter().flat_map(|n| ((*n + 1.0) * 0.5).to_array()).collect();
    let image = image(2, 2, 3, Texels::F32(texels));
    let Texels::F32(found) = &pyramid(&image, Content::Normals)[0].texels else { panic!("floats") };
    let expected = normals.iter().sum::<Vec3>().normalize();
    assert!((Vec3::from_slice(found) * 2.0 - 1.0 - expected).length() < 1e-5);
    let Texels::F32(found) = &pyramid(&image, Content::Data)[0].texels else { panic!("floats") };
    assert!((Vec3::from_slice(found) * 2.0 - 1.0).length() < 0.99, "numbers are not made unit");
}

#[test]
fn a_pyramid_of_words_is_near_that_of_floats() {
    let floats = float_image(33, 20, 3);
    let Texels::F32(values) = &floats.texels else { panic!("floats") };
    let words = values.iter().map(|x| (x * 65_535.0).round() as u16).collect();
    let words = image(33, 20, 3, Texels::U16(words));
    let (words, floats) = (pyramid(&words, Content::Data), pyramid(&floats, Content::Data));
    for (a, b) in words.iter().zip(&floats) {
        let reader = TexelReader::new(Encoding::Linear);
        for i in 0..(a.width * a.height) as usize {
            let difference = reader.read(&a.texels, 3, i) - reader.read(&b.texels, 3, i);
            assert!(difference.abs().max_element() < 2.0 / 65_535.0);
        }
    }
}

#[test]
fn images_that_are_not_whole_have_no_pyramid() {
    assert!(pyramid(&image(4, 4, 3, Texels::U8(vec![1; 47])), Content::Color).is_empty());
    assert!(pyramid(&image(0, 4, 3, Texels::U8(Vec::new())), Content::Color).is_empty());
    assert!(pyramid(&image(1, 1, 3, Texels::U8(vec![1; 3])), Content::Color).is_empty());
    assert_eq!(level_sizes(u32::MAX, 1).len(), 32);
}
