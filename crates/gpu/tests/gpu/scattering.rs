//! The device's scattering against `vastlight-transport`, `bsdf`: all kinds of materials, all answers.

use crate::common::{answers, probe};
use vastlight_math::{Rng, Vec2, Vec3, warp};
use vastlight_scene::Conductor;
use vastlight_transport::bsdf::{Metal, Wavelength};
use vastlight_transport::words::{Words, put_albedo, tables};
use vastlight_transport::{Bsdf, BsdfParams};

probe!(BSDF_PROBE = "bsdf_probe", 3);

/// Relative to the largest number of an answer: narrow highlights magnify what rounds otherwise.
const TOLERANCE: f32 = 1e-3;
/// Records that may differ by more: a lobe or a side of a critical angle chosen otherwise by one rounding.
const ALLOWED: f64 = 5e-4;
const RECORD_WORDS: usize = 52;
const ANSWER_WORDS: usize = 20;

#[derive(Clone, Copy, Debug)]
struct Record {
    params: BsdfParams,
    wo: Vec3,
    wi: Vec3,
    lobe: f32,
    u: Vec2,
    /// Where in the range, and whether the path has gone on with it before.
    wavelength: Option<(f32, bool)>,
}

/// What one record is answered.
#[derive(Clone, Copy, Debug)]
struct Answer {
    eval: Vec3,
    eval_pdf: f32,
    wi: Vec3,
    pdf: f32,
    weight: Vec3,
    radiance_scale: f32,
    straight: Vec3,
    flags: u32,
    albedo: Vec3,
}

impl Record {
    fn words(&self) -> Vec<u32> {
        let p = &self.params;
        let mut words = Words::default();
        words.vec3(p.base_color);
        words.f32s(&[p.metallic, p.roughness, p.ior, p.specular]);
        words.vec3(p.specular_color);
        words.f32(p.transmission);
        words.vec3(p.transmission_tint);
        let flag = |is: bool| if is { 1.0 } else { 0.0 };
        words.f32s(&[flag(p.thin), p.dispersion, p.clearcoat, p.clearcoat_roughness]);
        words.vec3(p.clearcoat_normal);
        words.vec3(p.sheen_color);
        words.f32s(&[p.sheen_roughness, p.anisotropy]);
        words.vec2(p.anisotropy_direction);
        words.f32s(&[p.iridescence, p.iridescence_ior, p.iridescence_thickness]);
        words.f32(flag(p.conductor.is_some()));
        let (index, average) = p
            .conductor
            .map_or((Conductor { eta: Vec3::ZERO, k: Vec3::ZERO }, Vec3::ZERO), |m| (m.index(), m.average()));
        [index.eta, index.k, average, self.wo, self.wi].into_iter().for_each(|v| words.vec3(v));
        words.f32(self.lobe);
        words.vec2(self.u);
        let (u, chosen) = self.wavelength.unwrap_or((-1.0, false));
        words.f32s(&[u, flag(chosen)]);
        let words = words.finish();
        assert_eq!(words.len(), RECORD_WORDS);
        words
    }

    fn expected(&self) -> Answer {
        let mut params = self.params;
        if let Some((u, chosen)) = self.wavelength {
            Wavelength::new(u, chosen).apply(&mut params);
        }
        let bsdf = Bsdf::new(&params);
        let (eval, eval_pdf) = bsdf.eval_pdf(self.wo, self.wi);
        let sample = bsdf.sample(self.wo, self.lobe, self.u);
        let mut answer = Answer {
            eval,
            eval_pdf,
            wi: Vec3::ZERO,
            pdf: 0.0,
            weight: Vec3::ZERO,
            radiance_scale: 0.0,
            straight: bsdf.straight(self.wo),
            flags: 0,
            albedo: bsdf.albedo(),
        };
        let bits = [(16, bsdf.is_pane()), (32, bsdf.has_nondelta()), (64, bsdf.transmits())];
        let mut flags = bits.into_iter().filter(|bit| bit.1).map(|bit| bit.0).sum();
        if let Some(s) = sample {
            (answer.wi, answer.pdf, answer.weight, answer.radiance_scale) =
                (s.wi, s.pdf, s.weight, s.radiance_scale);
            let bits = [(1, true), (2, s.delta), (4, s.transmitted), (8, s.dispersed)];
            flags += bits.into_iter().filter(|bit| bit.1).map(|bit| bit.0).sum::<u32>();
        }
        answer.flags = flags;
        answer
    }
}

impl Answer {
    fn read(words: &[u32]) -> Self {
        let n: Vec<f32> = words.iter().map(|&word| f32::from_bits(word)).collect();
        let v = |at: usize| Vec3::new(n[at], n[at + 1], n[at + 2]);
        let flags = n[15] as u32;
        let mut answer = Self {
            eval: v(0),
            eval_pdf: n[3],
            wi: v(4),
            pdf: n[7],
            weight: v(8),
            radiance_scale: n[11],
            straight: v(12),
            flags,
            albedo: v(16),
        };
        if flags & 1 == 0 {
            answer.flags = flags & !14;
            (answer.wi, answer.weight, answer.pdf, answer.radiance_scale) =
                (Vec3::ZERO, Vec3::ZERO, 0.0, 0.0);
        }
        answer
    }

    /// Whether it is the other up to the tolerance.
    fn is(&self, other: &Self) -> bool {
        let near = |a: f32, b: f32| (a - b).abs() <= TOLERANCE * a.abs().max(b.abs()).max(1e-3);
        let near3 = |a: Vec3, b: Vec3| {
            (a - b).abs().max_element() <= TOLERANCE * a.abs().max(b.abs()).max_element().max(1e-3)
                && !(a.is_nan() || b.is_nan())
        };
        self.flags == other.flags
            && near3(self.eval, other.eval)
            && near(self.eval_pdf, other.eval_pdf)
            && near3(self.wi, other.wi)
            && near(self.pdf, other.pdf)
            && near3(self.weight, other.weight)
            && near(self.radiance_scale, other.radiance_scale)
            && near3(self.straight, other.straight)
            && near3(self.albedo, other.albedo)
    }
}

/// Numbers of a material in their range, all at random.
fn any_params(rng: &mut Rng) -> BsdfParams {
    let mut number = || rng.next_1d();
    let mut three = || Vec3::new(number(), number(), number());
    let (base_color, specular_color, sheen_color) = (three(), three() * 1.5, three());
    let bent = three() - Vec3::new(0.5, 0.5, -0.3);
    BsdfParams {
        base_color,
        specular_color,
        sheen_color,
        clearcoat_normal: bent.normalize(),
        metallic: number(),
        roughness: number(),
        conductor: None,
        ior: 1.0 + 1.5 * number(),
        specular: number(),
        transmission: number(),
        transmission_tint: Vec3::ONE,
        thin: number() < 0.5,
        dispersion: 0.0,
        clearcoat: number(),
        clearcoat_roughness: number(),
        sheen_roughness: number(),
        anisotropy: number(),
        anisotropy_direction: Vec2::new(number() - 0.5, number() - 0.5).normalize_or(Vec2::X),
        iridescence: number(),
        iridescence_ior: 1.0 + number(),
        iridescence_thickness: 100.0 + 600.0 * number(),
    }
}

/// One of the kinds of materials that there are.
fn params(kind: u32, rng: &mut Rng) -> BsdfParams {
    let any = any_params(rng);
    let smooth = if rng.next_1d() < 0.3 { 0.0 } else { any.roughness };
    let plain = BsdfParams {
        base_color: any.base_color,
        roughness: smooth,
        ior: any.ior,
        specular: 1.0,
        ..BsdfParams::diffuse(Vec3::ONE)
    };
    let glass = BsdfParams { transmission: 1.0, thin: false, ..plain };
    let names = ["gold", "silver", "copper", "aluminium"];
    let measured = names.into_iter().filter_map(Conductor::named).nth((any.metallic * 3.0) as usize);
    match kind {
        0 => BsdfParams::diffuse(any.base_color),
        1 => plain,
        2 => BsdfParams { metallic: 1.0, ..plain },
        3 => BsdfParams { metallic: 1.0, conductor: measured.map(Metal::new), ..plain },
        4 => glass,
        5 => BsdfParams { thin: true, ..glass },
        6 => BsdfParams { ior: 1.0 / plain.ior, ..glass },
        7 => BsdfParams { clearcoat: any.clearcoat, clearcoat_roughness: smooth, ..plain },
        8 => BsdfParams {
            clearcoat: 1.0,
            clearcoat_roughness: any.roughness,
            clearcoat_normal: any.clearcoat_normal,
            ..plain
        },
        9 => BsdfParams { sheen_color: any.sheen_color, sheen_roughness: any.sheen_roughness, ..plain },
        10 => BsdfParams {
            anisotropy: any.anisotropy,
            anisotropy_direction: any.anisotropy_direction,
            metallic: 1.0,
            ..plain
        },
        11 => BsdfParams {
            iridescence: any.iridescence,
            iridescence_ior: any.iridescence_ior,
            iridescence_thickness: any.iridescence_thickness,
            ..plain
        },
        12 => BsdfParams { dispersion: 2.0 * any.specular, ..glass },
        13 => BsdfParams { ior: 0.0, specular_color: any.specular_color, ..plain },
        14 => BsdfParams { transmission: any.transmission, thin: any.thin, ..plain },
        15 => BsdfParams {
            iridescence: 1.0,
            iridescence_thickness: any.iridescence_thickness,
            thin: any.thin,
            ..glass
        },
        16 => any,
        _ => BsdfParams { conductor: measured.map(Metal::new), dispersion: any.specular, ..any },
    }
}

/// Numbers as they come from files: some out of range, some none at all.
fn spoil(p: &mut BsdfParams, rng: &mut Rng) {
    let spoilt = [0.0, 1.0, -1.0, f32::NAN, f32::INFINITY, 1e30, 1e-30, 2.0];
    let mut maybe = |x: &mut f32| {
        if rng.next_1d() < 0.2 {
            *x = spoilt[(rng.next_1d() * 8.0) as usize];
        }
    };
    for v in [&mut p.base_color, &mut p.specular_color, &mut p.transmission_tint, &mut p.sheen_color] {
        v.as_mut().iter_mut().for_each(&mut maybe);
    }
    p.clearcoat_normal.as_mut().iter_mut().for_each(&mut maybe);
    p.anisotropy_direction.as_mut().iter_mut().for_each(&mut maybe);
    let numbers = [
        &mut p.metallic,
        &mut p.roughness,
        &mut p.ior,
        &mut p.specular,
        &mut p.transmission,
        &mut p.dispersion,
        &mut p.clearcoat,
        &mut p.clearcoat_roughness,
        &mut p.sheen_roughness,
        &mut p.anisotropy,
        &mut p.iridescence,
        &mut p.iridescence_ior,
        &mut p.iridescence_thickness,
    ];
    numbers.into_iter().for_each(&mut maybe);
}

/// Directions, some along the normal, some near the horizon or on it.
fn direction(rng: &mut Rng) -> Vec3 {
    let d = warp::uniform_sphere(rng.next_2d());
    match (rng.next_1d() * 24.0) as u32 {
        0 => Vec3::Z,
        1 => -Vec3::Z,
        2 => warp::direction(1e-3 * d.z, 6.0 * rng.next_1d()),
        3 => Vec3::new(0.6, -0.8, 0.0),
        _ => d,
    }
}

const KINDS: u32 = 18;

fn records(count: u32) -> Vec<Record> {
    let mut rng = Rng::new(41);
    let mut record = |i: u32| {
        let mut p = params(i % KINDS, &mut rng);
        if i / KINDS % 4 == 3 {
            spoil(&mut p, &mut rng);
        }
        let wo = direction(&mut rng);
        // Near the highlight, where most is to be seen, and anywhere.
        let near = (Vec3::new(-wo.x, -wo.y, wo.z) + 0.2 * direction(&mut rng)).normalize();
        let wi = if rng.next_1d() < 0.5 { near } else { direction(&mut rng) };
        let wavelength = (p.dispersion > 0.0).then(|| (rng.next_1d(), rng.next_1d() < 0.3));
        Record { params: p, wo, wi, lobe: rng.next_1d(), u: rng.next_2d(), wavelength }
    };
    (0..count).map(&mut record).collect()
}

/// The device's answers; none without one.
fn found(records: &[Record]) -> Option<Vec<Answer>> {
    let mut table = Words::new(tables::HEADER);
    table.section(tables::ALBEDO);
    put_albedo(&mut table);
    let words: Vec<u32> = records.iter().flat_map(Record::words).collect();
    let found = answers(&BSDF_PROBE, &[&words, &table.finish()], records.len(), ANSWER_WORDS)?;
    Some(found.chunks_exact(ANSWER_WORDS).map(Answer::read).collect())
}

type Change = fn(&mut Record);

/// How many answers are not those that records expect.
fn differences(records: &[Record], found: &[Answer]) -> usize {
    records.iter().zip(found).filter(|(record, found)| !found.is(&record.expected())).count()
}

#[test]
fn every_material_scatters_as_on_the_cpu() {
    let records = records(1000 * KINDS);
    let Some(found) = found(&records) else { return };
    let far = differences(&records, &found);
    assert!(far as f64 <= ALLOWED * found.len() as f64, "{far} of {}", found.len());
    let has = |flag: u32| found.iter().filter(|answer| answer.flags & flag != 0).count();
    // Samples, mirrors, transmitted and dispersed ones, panes, and both other properties.
    let least = [(1, 15_000), (2, 2000), (4, 2000), (8, 300), (16, 400), (32, 10_000), (64, 1000)];
    for (flag, least) in least {
        assert!((least..found.len()).contains(&has(flag)), "{flag}: {}", has(flag));
    }
}

#[test]
fn a_number_that_is_a_little_off_is_found() {
    let records = records(50 * KINDS);
    let Some(found) = found(&records) else { return };
    assert_eq!(differences(&records, &found), 0);
    let changes: [(&str, Change); 16] = [
        ("base color", |r| r.params.base_color.y *= 0.98),
        ("metallic", |r| r.params.metallic *= 0.98),
        ("roughness", |r| r.params.roughness *= 0.99),
        ("conductor", |r| r.params.conductor = None),
        ("ior", |r| r.params.ior *= 0.99),
        ("specular", |r| r.params.specular *= 0.98),
        ("specular color", |r| r.params.specular_color.x *= 0.95),
        ("transmission", |r| r.params.transmission *= 0.98),
        ("thin", |r| r.params.thin ^= true),
        ("clearcoat", |r| r.params.clearcoat *= 0.95),
        ("clearcoat normal", |r| r.params.clearcoat_normal.x += 0.02),
        ("sheen", |r| r.params.sheen_roughness *= 0.95),
        ("anisotropy", |r| r.params.anisotropy *= 0.98),
        ("iridescence", |r| r.params.iridescence_thickness *= 0.98),
        ("wavelength", |r| r.wavelength = r.wavelength.map(|(u, chosen)| (0.9 * u, chosen))),
        ("random numbers", |r| r.u.x *= 0.99),
    ];
    for (name, change) in changes {
        let changed: Vec<Record> = records.iter().copied().map(|mut r| (change(&mut r), r).1).collect();
        let far = differences(&changed, &found);
        assert!(far > 20, "{name}: {far} of {}", found.len());
    }
}
