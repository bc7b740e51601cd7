mod device;
mod scene_builder;
use device::*;
use glam::{DVec2, DVec3};
use scene_builder::*;
use spectile::scene::*;
use spectile::spectral::*;

#[test]
fn self_test_passes() {
    spectile::gpu::self_test::run(&spectile::gpu::adapter::Gpu::open().unwrap()).unwrap();
}

#[test]
fn sphere_cavity() {
    let t = std::time::Instant::now();
    let scene = Builder::new()
        .camera(look(DVec3::new(0.0, 0.0, 0.5), DVec3::ZERO, DVec3::Y, Projection::Perspective { tan_half: DVec2::splat(0.7) }))
        .film(16, 16, Filter::Box)
        .channels(Channels::equal(400.0, 700.0, 5))
        .bounces(8)
        .glowing(sphere(DVec3::ZERO, 1.0), 0.5, 0.5, Sides::Both)
        .build();
    let e = render(&scene, 4, 64, Settings::default());
    let (m, s) = e.estimate();
    println!("{:?} {:?} {:?}", &m[..10], &s[..10], e.counters);
    println!("{:?}", m.iter().sum::<f64>() / m.len() as f64);
    let r = spectile::reference::render_image(&scene, 256, 1);
    println!("{:?}", r.mean.iter().sum::<f64>() / m.len() as f64);
    println!("{:?}", t.elapsed());
}

#[test]
fn room_with_lamp() {
    let scene = Builder::new()
        .camera(look(DVec3::new(0.0, 0.0, 0.9), DVec3::ZERO, DVec3::Y, Projection::Perspective { tan_half: DVec2::splat(0.7) }))
        .film(16, 16, Filter::Box)
        .channels(Channels::equal(400.0, 700.0, 5))
        .bounces(3)
        .diffuse(room(DVec3::splat(-1.0), DVec3::splat(1.0)), 0.5)
        .lamp(quad(DVec3::new(-0.3, 0.9, -0.3), DVec3::X * 0.6, DVec3::Z * 0.6), 1.0, Sides::Front)
        .build();
    let e = render(&scene, 4, 64, Settings::default());
    let (m, s) = e.estimate();
    println!("{:?} {:?} {:?}", &m[..10], &s[..10], e.counters);
    println!("{:?}", m.iter().sum::<f64>() / m.len() as f64);
    let r = spectile::reference::render_image(&scene, 256, 1);
    println!("{:?}", r.mean.iter().sum::<f64>() / m.len() as f64);
}
