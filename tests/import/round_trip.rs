//! Scenes of the gallery, written as Mitsuba's and imported again: the same picture.

use std::fmt::Write;
use std::path::Path;

use glam::DVec3;
use spectile::scene::{
    self, Bsdf, Evaluation, Film, Filter, MaterialId, Object, Projection, Reflectance, Roughness, SMOOTH, Scene, Shape,
    SpectrumId, TextureKind, Weight,
};
use spectile::spectral::{Channels, Curve};

use super::import;
use crate::binary::repository;
use crate::device::{Settings, render};

/// What a scene of Mitsuba's cannot say: indices of glass and coats by wavelength, what rough metals scatter more than once, shares of
/// spectra by a picture, of which the first is taken.
fn as_mitsuba_can(mut scene: Scene) -> Scene {
    for material in &mut scene.materials {
        match &mut material.bsdf {
            Bsdf::Dielectric { eta, .. } | Bsdf::Plastic { eta, .. } => {
                let mean = scene.spectra[*eta].curve.mean(400.0, 700.0);
                scene.spectra[*eta].curve = Curve::Constant((mean * 1e4).round() / 1e4);
            }
            Bsdf::Conductor { energy_compensation, roughness: Roughness::Constant([along, _]), .. } => {
                *energy_compensation &= *along < SMOOTH;
            }
            Bsdf::Diffuse { reflectance } => {
                if let Reflectance::Texture(texture) = *reflectance
                    && let TextureKind::Mixture(endmembers) = &scene.textures[texture].kind
                {
                    *reflectance = Reflectance::Spectrum(endmembers[0]);
                }
            }
            _ => {}
        }
    }
    scene.integrator.evaluation = Evaluation::All;
    scene.integrator.wavelengths_per_channel = Some(1);
    // Small, of the same shape.
    let height = 24 * scene.film.height / scene.film.width;
    assert_eq!(height * scene.film.width, 24 * scene.film.height);
    scene.film = Film { width: 24, height, filter: Filter::Box, crop: [0, 0, 24, height] };
    scene.channels = Channels::equal(420.0, 700.0, 4);
    scene
}

fn spectrum(scene: &Scene, name: &str, id: SpectrumId) -> String {
    let value = match &scene.spectra[id].curve {
        Curve::Constant(value) => format!("{value:?}"),
        Curve::Linear { nm, value, .. } => {
            nm.iter().zip(value).map(|(nm, value)| format!("{nm:?}:{value:?}")).collect::<Vec<_>>().join(", ")
        }
        curve => (0..=500)
            .map(|i| 300.0 + f64::from(i))
            .map(|nm| format!("{nm:?}:{:?}", curve.eval(nm)))
            .collect::<Vec<_>>()
            .join(", "),
    };
    format!("<spectrum name=\"{name}\" value=\"{value}\"/>")
}

fn reflectance(scene: &Scene, name: &str, reflectance: Reflectance) -> String {
    let Reflectance::Spectrum(id) = reflectance else { panic!("no textures here") };
    spectrum(scene, name, id)
}

fn bsdf(scene: &Scene, id: MaterialId) -> String {
    let material = &scene.materials[id];
    let rough = |roughness: Roughness, kind: &str| {
        let Roughness::Constant([u, v]) = roughness else { panic!("no textures here") };
        match u < SMOOTH {
            true => (kind.to_owned(), String::new()),
            false => (
                format!("rough{kind}"),
                format!(
                    "<string name=\"distribution\" value=\"ggx\"/><float name=\"alpha_u\" value=\"{u:?}\"/><float name=\"alpha_v\" \
                     value=\"{v:?}\"/>"
                ),
            ),
        }
    };
    let index = |eta: SpectrumId| {
        let eta = scene.spectra[eta].curve.eval(550.0);
        format!("<float name=\"int_ior\" value=\"{eta:?}\"/><float name=\"ext_ior\" value=\"1\"/>")
    };
    let (kind, inner, is_opaque) = match material.bsdf {
        Bsdf::Black => ("diffuse".to_owned(), "<spectrum name=\"reflectance\" value=\"0\"/>".to_owned(), true),
        Bsdf::Diffuse { reflectance: of } => ("diffuse".to_owned(), reflectance(scene, "reflectance", of), true),
        Bsdf::Conductor { eta, k, roughness, .. } => {
            let (kind, facets) = rough(roughness, "conductor");
            (kind, facets + &spectrum(scene, "eta", eta) + &spectrum(scene, "k", k), true)
        }
        Bsdf::Plastic { reflectance: of, eta, roughness } => {
            let (kind, facets) = rough(roughness, "plastic");
            let base = reflectance(scene, "diffuse_reflectance", of);
            (kind, facets + "<boolean name=\"nonlinear\" value=\"true\"/>" + &index(eta) + &base, true)
        }
        Bsdf::Dielectric { eta, roughness, .. } => {
            let (kind, facets) = rough(roughness, "dielectric");
            (kind, facets + &index(eta), false)
        }
        Bsdf::Blend { a, b, weight: Weight::Constant(weight) } => {
            let inner = format!("<float name=\"weight\" value=\"{weight:?}\"/>{}{}", bsdf(scene, a), bsdf(scene, b));
            return format!("<bsdf type=\"blendbsdf\">{inner}</bsdf>");
        }
        ref other => panic!("{other:?}"),
    };
    let own = format!("<bsdf type=\"{kind}\">{inner}</bsdf>");
    if is_opaque && material.two_sided { format!("<bsdf type=\"twosided\">{own}</bsdf>") } else { own }
}

/// A mesh with a vertex for each corner.
fn ply(object: &Object) -> String {
    let Shape::Mesh(mesh) = &object.shape else { panic!("meshes only") };
    let normals = object.attributes.normals.as_ref();
    let mut out = format!("ply\nformat ascii 1.0\nelement vertex {}\n", 3 * mesh.triangles.len());
    let names = if normals.is_some() { &["x", "y", "z", "nx", "ny", "nz"][..] } else { &["x", "y", "z"] };
    for name in names {
        writeln!(out, "property double {name}").expect("text");
    }
    write!(out, "element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.triangles.len())
        .expect("text");
    let numbers = |v: DVec3| format!("{:?} {:?} {:?}", v.x, v.y, v.z);
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        for (c, vertex) in triangle.iter().enumerate() {
            out += &numbers(mesh.positions[*vertex as usize]);
            if let Some(normals) = normals {
                out += &format!(" {}", numbers(normals[t][c]));
            }
            out.push('\n');
        }
    }
    (0..mesh.triangles.len()).for_each(|t| writeln!(out, "3 {} {} {}", 3 * t, 3 * t + 1, 3 * t + 2).expect("text"));
    out
}

/// Writes `scene` as Mitsuba has it; gives the path.
fn written_as_mitsubas(scene: &Scene, folder: &Path) -> std::path::PathBuf {
    let camera = &scene.camera;
    let Projection::Perspective { tan_half } = camera.projection else { panic!("a pinhole") };
    let list = |v: DVec3| format!("{:?}, {:?}, {:?}", v.x, v.y, v.z);
    let mut out = format!(
        "<scene version=\"3.0.0\"><integrator type=\"path\"><integer name=\"max_depth\" value=\"{}\"/></integrator>\n\
         <sensor type=\"perspective\"><float name=\"fov\" value=\"{:?}\"/><string name=\"fov_axis\" value=\"x\"/>\
         <transform name=\"to_world\"><lookat origin=\"{}\" target=\"{}\" up=\"{}\"/></transform>\
         <film type=\"hdrfilm\"><integer name=\"width\" value=\"{}\"/><integer name=\"height\" value=\"{}\"/>\
         <rfilter type=\"box\"/></film></sensor>\n",
        scene.integrator.max_bounces + 1,
        2.0 * tan_half.x.atan().to_degrees(),
        list(camera.position),
        list(camera.position + camera.forward),
        list(camera.up),
        scene.film.width,
        scene.film.height,
    );
    for (i, object) in scene.objects.iter().enumerate() {
        let name = format!("{i}.ply");
        std::fs::write(folder.join(&name), ply(object)).expect("written");
        let faces = object.attributes.normals.is_none();
        write!(
            out,
            "<shape type=\"ply\"><string name=\"filename\" value=\"{name}\"/><boolean name=\"face_normals\" value=\"{faces}\"/>{}",
            bsdf(scene, object.material.expect("one"))
        )
        .expect("text");
        if let Some(emission) = &object.emission {
            let radiance = spectrum(scene, "radiance", emission.radiance);
            write!(out, "<emitter type=\"area\">{radiance}</emitter>").expect("text");
        }
        out += "</shape>\n";
    }
    let path = folder.join("scene.xml");
    std::fs::write(&path, out + "</scene>\n").expect("written");
    path
}

/// The same random numbers make the same paths, but for what the digits of text turn round.
fn comes_back(what: &str, scene: Scene) {
    let scene = as_mitsuba_can(scene);
    let folder = tempfile::tempdir().expect("a folder");
    let found = import(&written_as_mitsubas(&scene, folder.path()));
    let mut again = found.scene.clone();
    again.channels = scene.channels.clone();
    again.integrator = scene.integrator.clone();
    let tan_half = |scene: &Scene| match scene.camera.projection {
        Projection::Perspective { tan_half } => tan_half,
        ref other => panic!("{other:?}"),
    };
    assert!((tan_half(&scene) - tan_half(&again)).length() < 1e-6, "{what}: {}", found.toml);
    assert_eq!((again.objects.len(), again.film.cube_size()), (scene.objects.len(), scene.film.cube_size()), "{what}");
    let [ours, theirs] = [&scene, &again].map(|scene| {
        let epochs = render(scene, 8, 64, Settings { seed: 7, ..Settings::default() });
        epochs.assert_clean();
        epochs
    });
    for (k, (ours, theirs)) in ours.image_means().iter().zip(theirs.image_means()).enumerate() {
        let off = (ours.mean - theirs.mean).abs();
        println!("{what}, channel {k}: {} and {} ({:.1e})", ours.mean, theirs.mean, off / ours.mean);
        // A black body that came back as a table has another share of the light that is aimed at, so that paths are others.
        let bound = 4.0 * ours.error.hypot(theirs.error) + 5e-4 * ours.mean;
        assert!(off <= bound, "{what}, channel {k}: {ours:?} came back as {theirs:?}");
    }
    let pairs = ours.values().into_iter().zip(theirs.values());
    for (i, (ours, theirs)) in pairs.enumerate() {
        // Where a path turns another way it does so within its noise.
        let bound = 5.0 * ours.error.hypot(theirs.error) + 1e-3 * ours.mean;
        assert!((ours.mean - theirs.mean).abs() <= bound, "{what}, value {i}: {ours:?} came back as {theirs:?}");
    }
}

#[test]
fn the_cornell_box_comes_back() {
    comes_back("cornell", scene::load(&repository("scenes/cornell/cornell.toml"), &[]).expect("the scene"));
}

#[test]
#[ignore = "rooms of hundreds of thousands of triangles, written and read as text, minutes"]
fn rooms_come_back() {
    for name in ["conference", "lounge"] {
        let path = crate::program::scenes::made().join(format!("{name}/{name}.toml"));
        comes_back(name, scene::load(&path, &[]).expect(name));
    }
}
