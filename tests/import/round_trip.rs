//! Scenes of the gallery, written as Mitsuba's and imported again: the same picture.

use std::path::Path;

use glam::{DAffine3, DVec2, DVec3};
use spectile::scene::{
    self, Bsdf, Environment, MaterialId, Object, Projection, Reflectance, Roughness, Scene, Shape, Texels,
};

use super::as_mitsuba::as_mitsuba_can;
use super::import;
use crate::binary::repository;
use crate::device::{Epochs, Settings, render, rounding};
use crate::program::scenes::{made, make_scene};
use crate::size;
use crate::statistics::t_limit;

/// What a trip leaves of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Same {
    /// All its bits.
    Bits,
    /// The same random numbers make the same paths, but where the tenth digit of a text, or the last bit of a product, turns one round: more than
    /// this share of all values is the same up to rounding. The others differ within their noise, and so do the means.
    Paths(f64),
}

/// Of each epoch and pixel: few show it where paths are the same.
const SAMPLES: u32 = 4;

/// How far texels of a map are from each other, relatively, that two programs mix of four others in f32.
const OF_TEXELS: f64 = 16.0 * f32::EPSILON as f64;

/// The digits that an import writes are nine after the first.
const DIGITS: f64 = 1e-9;

fn comes_back(what: &str, scene: Scene, same: Same) {
    let written = as_mitsuba_can(scene);
    let scene = &written.scene;
    let folder = tempfile::tempdir().expect("a folder");
    let found = import(&written.write(folder.path()));
    let mut again = found.scene.clone();
    again.channels = scene.channels.clone();
    again.integrator = scene.integrator.clone();
    assert_same_frame(what, scene, &again);
    assert_same_map(what, scene, &again);
    assert_same_coats(what, scene, &mut again);
    let [ours, theirs] = [scene, &again].map(|scene| {
        let epochs = render(scene, 8, SAMPLES, Settings { seed: 7, ..Settings::default() });
        epochs.assert_clean();
        epochs
    });
    let of_map = if scene.environment.as_ref().and_then(Environment::map).is_some() { OF_TEXELS } else { 0.0 };
    let of_paths = rounding(thickest(scene) * scene.integrator.max_bounces, SAMPLES);
    assert_same_picture(what, [&ours, &theirs], same, of_map + of_paths);
}

/// Camera, film, objects and where they are placed.
fn assert_same_frame(what: &str, scene: &Scene, again: &Scene) {
    let frame = |scene: &Scene| match scene.camera.projection {
        Projection::Perspective { tan_half } => (tan_half, DVec2::ZERO),
        Projection::ThinLens { tan_half, aperture_radius, focus_distance } => {
            (tan_half, DVec2::new(aperture_radius, focus_distance))
        }
        Projection::Orthographic { half_size } => (half_size, DVec2::ZERO),
        ref other => panic!("{other:?}"),
    };
    let ((a, b), (of_a, of_b)) = (frame(scene), frame(again));
    assert!(
        (a - of_a).length() <= 1e-8 * a.length() && (b - of_b).length() <= DIGITS * b.length(),
        "{what}: {of_a} {of_b}"
    );
    assert_eq!(scene.film, again.film, "{what}");
    assert_eq!((scene.objects.len(), scene.lights.len()), (again.objects.len(), again.lights.len()), "{what}");
    for (ours, theirs) in scene.objects.iter().zip(&again.objects) {
        assert_eq!(ours.assembly, theirs.assembly, "{what}: {} and {}", ours.name, theirs.name);
        assert_eq!(ours.interior.map(|i| i.medium), theirs.interior.map(|i| i.medium), "{what}: {}", ours.name);
    }
    let places =
        |scene: &Scene| -> Vec<DAffine3> { scene.assemblies.iter().flat_map(|a| a.instances.clone()).collect() };
    let (ours, theirs) = (places(scene), places(again));
    assert_eq!(ours.len(), theirs.len(), "{what}");
    for (ours, theirs) in ours.iter().zip(&theirs) {
        let size = ours.to_cols_array().into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        assert!(ours.abs_diff_eq(*theirs, DIGITS * size), "{what}: {ours:?} came back as {theirs:?}");
    }
}

fn assert_same_map(what: &str, scene: &Scene, again: &Scene) {
    let map = |scene: &Scene| scene.environment.as_ref().and_then(Environment::map).cloned();
    let (Some(ours), Some(theirs)) = (map(scene), map(again)) else {
        assert_eq!(map(scene).is_some(), map(again).is_some(), "{what}");
        return;
    };
    assert!(ours.to_map.abs_diff_eq(theirs.to_map, 1e-8), "{what}: {} came back as {}", ours.to_map, theirs.to_map);
    assert_eq!((ours.size, ours.scale), (theirs.size, theirs.scale), "{what}");
    let (Texels::Rgb { rgb: ours, .. }, Texels::Rgb { rgb: theirs, .. }) = (&ours.texels, &theirs.texels) else {
        panic!("{what}: maps of colours")
    };
    for (ours, theirs) in ours.as_chunks::<3>().0.iter().zip(theirs.as_chunks::<3>().0) {
        let bound = OF_TEXELS as f32 * ours.iter().copied().fold(0.0, f32::max);
        assert!(
            ours.iter().zip(theirs).all(|(a, b)| (a - b).abs() <= bound),
            "{what}: {ours:?} came back as {theirs:?}"
        );
    }
}

/// Rough coats lose light in Mitsuba that they do not lose here, for which an import has a darker base below the same coat (`deviations`
/// holds that to what Mitsuba makes of it). The base that was is put back, so that pictures can be compared.
fn assert_same_coats(what: &str, scene: &Scene, again: &mut Scene) {
    fn pairs(scene: &Scene, again: &Scene, [ours, theirs]: [MaterialId; 2], found: &mut Vec<[MaterialId; 2]>) {
        match (&scene.materials[ours].bsdf, &again.materials[theirs].bsdf) {
            (Bsdf::Blend { a, b, .. }, Bsdf::Blend { a: c, b: d, .. }) => {
                pairs(scene, again, [*a, *c], found);
                pairs(scene, again, [*b, *d], found);
            }
            (Bsdf::Plastic { roughness, .. }, _) if *roughness != Roughness::even(0.0) => found.push([ours, theirs]),
            _ => {}
        }
    }
    let mut found = Vec::new();
    for (ours, theirs) in scene.objects.iter().zip(&again.objects) {
        if let (Some(ours), Some(theirs)) = (ours.material, theirs.material) {
            pairs(scene, again, [ours, theirs], &mut found);
        }
    }
    found.sort_unstable();
    found.dedup();
    let coat = |scene: &Scene, id: MaterialId| match scene.materials[id].bsdf {
        Bsdf::Plastic { reflectance: Reflectance::Spectrum(base), eta, roughness: Roughness::Constant(alpha) } => {
            (alpha, scene.spectra[eta].curve.clone(), scene.spectra[base].curve.clone())
        }
        ref other => panic!("{what}: {other:?}"),
    };
    for [ours, theirs] in found {
        let (coat, of_import) = (coat(scene, ours), coat(again, theirs));
        assert_eq!((coat.0, &coat.1), (of_import.0, &of_import.1), "{what}");
        let (base, darker) = (coat.2, of_import.2);
        let changes = (84..=140).map(|i| 5.0 * f64::from(i)).map(|nm| darker.eval(nm) - base.eval(nm));
        let [low, high] = changes.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
        println!("{what}: a base under a coat of roughness {} changed by {low:.4} to {high:.4}", coat.0[0]);
        assert!(high <= 0.0, "{what}: a base of {base:?} came back as {darker:?}");
        let Bsdf::Plastic { reflectance, .. } = &mut again.materials[theirs].bsdf else { panic!("{what}: a plastic") };
        *reflectance = Reflectance::Spectrum(again.spectra.len());
        let name = "the base that was".to_owned();
        again.spectra.push(scene::Spectrum { name, curve: base, definition: None });
    }
}

fn assert_same_picture(what: &str, [ours, theirs]: [&Epochs; 2], same: Same, rounding: f64) {
    let off =
        ours.means.iter().flatten().zip(theirs.means.iter().flatten()).map(|(a, b)| match a.to_bits() == b.to_bits() {
            true => 0.0,
            false => (f64::from(*a) - f64::from(*b)).abs() / f64::from(a.abs()),
        });
    let off: Vec<f64> = off.collect();
    let share = |bound: f64| off.iter().filter(|off| **off <= bound).count() as f64 / off.len() as f64;
    let (bits, same_paths) = (share(0.0), share(rounding));
    println!("{what}: {bits:.4} of all values have the same bits, {same_paths:.4} are the same up to rounding");
    let Same::Paths(least) = same else {
        assert_eq!(bits, 1.0, "{what}");
        return;
    };
    assert!(same_paths > least, "{what}: only {same_paths} of all values are the same up to rounding");
    for (noun, ours, theirs) in
        [("channel", ours.image_means(), theirs.image_means()), ("value", ours.values(), theirs.values())]
    {
        for (i, (one, other)) in ours.iter().zip(&theirs).enumerate() {
            let off = one.minus(other);
            let bound = t_limit(ours.len(), off.freedom) * off.error + rounding * one.mean;
            assert!(off.mean.abs() <= bound, "{what}, {noun} {i}: {one:?} came back as {other:?}");
        }
        let off = ours.iter().zip(&theirs).map(|(a, b)| (a.mean - b.mean).abs() / a.mean);
        println!("{what}: a {noun} is {:.1e} off at most", off.fold(0.0, f64::max));
    }
}

/// By how many times more a coefficient's last bit shows behind matter: exp(-τ) is τ as far off, relatively, as τ is.
fn thickest(scene: &Scene) -> u32 {
    let of = |object: &Object| {
        let [low, high] = object.shape.bounds();
        let medium = &scene.media[object.interior?.medium];
        let scattering = medium.components.iter().flat_map(|one| &one.scattering).map(|one| one.coefficient);
        let all = scattering.chain(medium.absorption()).map(|id| scene.spectra[id].curve.max(420.0, 700.0));
        Some(low.distance(high) * all.sum::<f64>())
    };
    1 + scene.objects.iter().filter_map(of).fold(0.0, f64::max).ceil() as u32
}

/// A scene of the gallery that needs nothing that is made.
fn committed(name: &str) -> Scene {
    scene::load(&repository(&format!("scenes/{name}.toml")), &[]).expect(name)
}

/// One that does, made alone.
fn small(name: &str) -> Scene {
    let folder = tempfile::tempdir().expect("a folder");
    let to = |path: &str| folder.path().join(path);
    copy(&repository("scenes").join(name), &to(name));
    for other in ["matter", "haze/spectra"] {
        copy(&repository("scenes").join(other), &to(other));
    }
    make_scene::make(name, &to(name)).expect(name);
    scene::load(&to(&format!("{name}/{name}.toml")), &[]).expect(name)
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name");
        if path.is_file() {
            std::fs::copy(&path, to.join(name)).expect("copied");
        } else if name != "generated" {
            copy(&path, &to.join(name));
        }
    }
}

/// Of each mesh of thousands every so manieth triangle.
fn thinned(mut scene: Scene, step: usize) -> Scene {
    for object in &mut scene.objects {
        let Shape::Mesh(mesh) = &mut object.shape else { continue };
        if mesh.triangles.len() < 1000 {
            continue;
        }
        fn thin<T: Copy>(of: &[T], step: usize) -> Vec<T> {
            of.iter().copied().step_by(step).collect()
        }
        mesh.triangles = thin(&mesh.triangles, step);
        object.attributes.normals = object.attributes.normals.as_ref().map(|all| thin(all, step));
        object.attributes.uv = object.attributes.uv.as_ref().map(|all| thin(all, step));
    }
    scene
}

fn whole(name: &str) -> Scene {
    scene::load(&made().join(format!("{name}.toml")), &[]).expect(name)
}

#[test]
fn the_cornell_box_comes_back() {
    comes_back("cornell", committed("cornell/cornell"), Same::Bits);
}

#[test]
fn panels_come_back() {
    comes_back("panels", committed("panels/panels"), Same::Paths(0.99));
}

/// A tenth of the leaves of the trees around where the camera looks. What is 200 m from the origin is known to 0.015 mm, which turns every
/// thousandth path that meets edges of leaves of some centimetres all the way round.
#[test]
fn a_part_of_the_grove_comes_back() {
    let (mut scene, looked_at) = (thinned(small("grove"), 10), DVec3::new(0.0, 6.0, 160.0));
    for assembly in &mut scene.assemblies {
        assembly.instances.retain(|place| place.translation.distance(looked_at) < 60.0);
    }
    comes_back("grove", scene, Same::Paths(0.5));
}

#[test]
fn haze_comes_back() {
    comes_back("haze", small("haze"), Same::Paths(0.99));
}

#[test]
fn a_cloud_comes_back() {
    let mut scene = small("cloud");
    scene.integrator.max_bounces = 16;
    comes_back("cloud", scene, Same::Paths(0.99));
}

/// Through a lens, and by parallel rays.
#[test]
fn what_the_gallery_lacks_comes_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = |name: &str, size: [usize; 2], of: fn(usize, usize) -> [f32; 3]| {
        let texel = |x: usize, y: usize| <(f32, f32, f32)>::from(of(x, y));
        exr::prelude::write_rgb_file(folder.path().join(name), size[0], size[1], texel).expect("written");
    };
    // Nothing in them is the same upside down, mirrored or turned.
    picture("paint.exr", [5, 4], |x, y| [0.1 + 0.15 * x as f32, 0.2 + 0.1 * (x * y % 5) as f32, 0.05 + 0.2 * y as f32]);
    picture("grey.exr", [4, 3], |x, y| [0.05 + 0.1 * (x + 2 * y) as f32; 3]);
    picture("lamp.exr", [3, 2], |x, y| [1.0 + x as f32, 0.5 + y as f32, 2.0 - 0.5 * x as f32]);
    let file = folder.path().join("things.toml");
    std::fs::write(&file, include_str!("things.toml")).expect("written");
    let mut scene = scene::load(&file, &[]).expect("things");
    let parallel = Projection::Orthographic { half_size: DVec2::new(2.4, 1.6) };
    for projection in size::first(1, [scene.camera.projection.clone(), parallel]) {
        scene.camera.projection = projection;
        comes_back("things", scene.clone(), Same::Paths(0.99));
    }
}

#[test]
#[ignore = "rooms of hundreds of thousands of triangles, written and read as text, minutes"]
fn rooms_come_back() {
    comes_back("conference/conference", whole("conference/conference"), Same::Bits);
    comes_back("lounge/lounge", whole("lounge/lounge"), Same::Paths(0.99));
}

#[test]
#[ignore = "scenes of hundreds of thousands of triangles, written and read as text, minutes"]
fn scenes_outdoors_come_back() {
    for name in ["statues/statues", "aircraft/aircraft", "aircraft/aircraft-sky", "cloud/cloud"] {
        comes_back(name, whole(name), Same::Paths(0.99));
    }
    // Of ten thousand trees.
    comes_back("grove/grove", whole("grove/grove"), Same::Paths(0.5));
}
