use vastlight_scene::*;
use vastlight_trace::*;
use vastlight_transport::photon::*;
use vastlight_transport::*;
fn main() {
    let desc = generate::by_name("caustic-sphere", &generate::GenerateOptions::default()).unwrap();
    let scene = Scene::new(desc).unwrap();
    let tracer = Tracer::new(&scene, &TracerConfig::default()).unwrap();
    let materials = MaterialTable::new(&scene);
    let lights = Lights::new(&scene, &materials);
    let mut s = RenderSettings::new(scene.cameras()[0].clone(), 256, 256);
    s.max_depth = 8;
    s.caustics = Some(PhotonSettings { photons: Some(131072), ..Default::default() });
    let r = Renderer::new(&scene, &tracer, &materials, &lights, s);
    let t = std::time::Instant::now();
    let plan = r.photon_plan().unwrap().unwrap();
    println!("plan {:?}", t.elapsed());
    for pass in 0..3 {
        let t = std::time::Instant::now();
        let (p, rays) = r.photons(&plan, pass).unwrap();
        let e = t.elapsed();
        let t = std::time::Instant::now();
        let m = plan.maps(&p, pass);
        let near: Vec<_> = p
            .iter()
            .filter(|p| (p.position - vastlight_math::Vec3::new(-1.37, 0.0, 0.0)).length() < 0.7)
            .collect();
        let w: Vec<f64> = near.iter().map(|p| p.flux.x as f64).collect();
        let (a, b) = (w.iter().sum::<f64>(), w.iter().map(|x| x * x).sum::<f64>());
        println!(
            "landed {} rays {} {:?} maps {:?} roi {} flux {} neff {} maps {:?}",
            p.len(),
            rays,
            e,
            t.elapsed(),
            near.len(),
            a,
            a * a / b,
            m.maps().iter().map(|m| (m.radius(), m.len())).collect::<Vec<_>>()
        );
    }
}
