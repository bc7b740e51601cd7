//! A scene of which Mitsuba 3 can say everything, written as its XML and files.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DVec3};
use spectile::scene::{
    Bsdf, Emission, Environment, EnvironmentMap, Filter, Light, MaterialId, MediumId, Object, Phase, Projection,
    Reflectance, Roughness, SMOOTH, Scene, Shape, Sides, SpectrumId, TextureFilter, TextureId, TextureKind, Weight,
};
use spectile::spectral::{Curve, Outside};

use super::as_mitsuba::{AsMitsuba, NM, SKY, of_matter};

impl AsMitsuba {
    /// Writes it as Mitsuba has it into `folder`; gives the path of the scene.
    pub fn write(&self, folder: &Path) -> PathBuf {
        let writer = Writer { scene: &self.scene, folder };
        let mut out = String::from("<scene version=\"3.0.0\">\n");
        writer.integrator(&mut out);
        let scene = &self.scene;
        for id in 0..scene.media.len() {
            out += &writer.medium(id);
        }
        // A medium around a camera has to be there before it.
        out += &writer.sensor();
        for id in 0..scene.materials.len() {
            out += &writer.bsdf(id);
        }
        for light in &scene.lights {
            out += &writer.light(light);
        }
        match &scene.environment {
            Some(Environment::Uniform(radiance)) => {
                out += &format!("<emitter type=\"constant\">{}</emitter>\n", writer.spectrum("radiance", *radiance));
            }
            Some(Environment::Map(map)) => {
                let sky = self.sky.as_ref().expect("a map as Mitsuba has it");
                out += &writer.map(map, sky);
            }
            None => {}
        }
        for (i, object) in scene.objects.iter().enumerate().filter(|(_, object)| object.assembly.is_none()) {
            out += &writer.shape(i, object);
        }
        for (id, assembly) in scene.assemblies.iter().enumerate() {
            write!(out, "<shape type=\"shapegroup\" id=\"group{id}\">").expect("text");
            for (i, object) in scene.objects.iter().enumerate().filter(|(_, object)| object.assembly == Some(id)) {
                out += &writer.shape(i, object);
            }
            out += "</shape>\n";
            for to_world in &assembly.instances {
                let to_world = transform("to_world", to_world);
                writeln!(out, "<shape type=\"instance\"><ref id=\"group{id}\"/>{to_world}</shape>").expect("text");
            }
        }
        let path = folder.join("scene.xml");
        std::fs::write(&path, out + "</scene>\n").expect("written");
        path
    }
}

struct Writer<'a> {
    scene: &'a Scene,
    folder: &'a Path,
}

fn list(v: DVec3) -> String {
    format!("{:?}, {:?}, {:?}", v.x, v.y, v.z)
}

fn transform(name: &str, affine: &DAffine3) -> String {
    let (m, t) = (affine.matrix3, affine.translation);
    let rows = (0..3).flat_map(|i| [m.x_axis[i], m.y_axis[i], m.z_axis[i], t[i]]).map(|v| format!("{v:?} "));
    format!("<transform name=\"{name}\"><matrix value=\"{}0 0 0 1\"/></transform>", rows.collect::<String>())
}

impl Writer<'_> {
    fn integrator(&self, out: &mut String) {
        let kind = if self.scene.media.is_empty() { "path" } else { "volpath" };
        let depth = self.scene.integrator.max_bounces + 1;
        writeln!(out, "<integrator type=\"{kind}\"><integer name=\"max_depth\" value=\"{depth}\"/></integrator>")
            .expect("text");
    }

    fn sensor(&self) -> String {
        let camera = &self.scene.camera;
        let fov = |half: f64| format!("<float name=\"fov\" value=\"{:?}\"/>", 2.0 * half.atan().to_degrees());
        let axis = "<string name=\"fov_axis\" value=\"x\"/>";
        let (kind, own, scale) = match &camera.projection {
            Projection::Perspective { tan_half } => ("perspective", fov(tan_half.x) + axis, 1.0),
            Projection::ThinLens { tan_half, aperture_radius, focus_distance } => {
                let lens = format!(
                    "<float name=\"aperture_radius\" value=\"{aperture_radius:?}\"/><float name=\"focus_distance\" value=\"{focus_distance:?}\"/>"
                );
                ("thinlens", fov(tan_half.x) + axis + &lens, 1.0)
            }
            Projection::Orthographic { half_size } => ("orthographic", String::new(), half_size.x),
            other => panic!("Mitsuba has no {other:?}"),
        };
        let film = &self.scene.film;
        let filter = match film.filter {
            Filter::Box => "<rfilter type=\"box\"/>",
            Filter::Gaussian => "<rfilter type=\"gaussian\"><float name=\"stddev\" value=\"0.5\"/></rfilter>",
        };
        let around = self.scene.objects.iter().find_map(|object| {
            let [low, high] = object.shape.bounds();
            let is_within = camera.position.cmpge(low).all() && camera.position.cmple(high).all();
            object.interior.filter(|_| is_within)
        });
        let around = around.map_or_else(String::new, |interior| format!("<ref id=\"medium{}\"/>", interior.medium));
        let (origin, target, up) = (list(camera.position), list(camera.position + camera.forward), list(camera.up));
        let (width, height) = (film.width, film.height);
        format!(
            "<sensor type=\"{kind}\">{own}<transform name=\"to_world\"><scale x=\"{scale:?}\" y=\"{scale:?}\"/>\
             <lookat origin=\"{origin}\" target=\"{target}\" up=\"{up}\"/></transform>{around}\
             <film type=\"hdrfilm\"><integer name=\"width\" value=\"{width}\"/><integer name=\"height\" value=\"{height}\"/>{filter}</film>\
             </sensor>\n"
        )
    }

    fn spectrum(&self, name: &str, id: SpectrumId) -> String {
        curve(name, &self.scene.spectra[id].curve)
    }

    /// The medium as one colour of what is scattered of what meets it, and what meets it.
    fn medium(&self, id: MediumId) -> String {
        let medium = &self.scene.media[id];
        let of = |id: SpectrumId| &self.scene.spectra[id].curve;
        let absorbed = of(medium.components[0].absorbers[0].columns[0].1);
        let scattered: Vec<(&Curve, &Phase)> =
            medium.components.iter().flat_map(|one| &one.scattering).map(|s| (of(s.coefficient), &s.phase)).collect();
        let scattering = |nm: f64| scattered.iter().map(|(curve, _)| curve.eval(nm)).sum::<f64>();
        let extinction = |nm: f64| absorbed.eval(nm) + scattering(nm);
        // Where there is nothing, nothing is scattered.
        let albedo = curve("albedo", &of_matter(&|nm| scattering(nm) / extinction(nm).max(f64::MIN_POSITIVE)));
        let extinction = curve("sigma_t", &of_matter(&extinction));
        let shares: Vec<(f64, &Phase)> =
            scattered.iter().map(|(curve, phase)| (curve.eval(NM) / scattering(NM), *phase)).collect();
        let phases = self.phases(&shares);
        format!("<medium type=\"homogeneous\" id=\"medium{id}\">{albedo}{extinction}{phases}</medium>\n")
    }

    fn phases(&self, shares: &[(f64, &Phase)]) -> String {
        let one = |phase: &Phase| match phase {
            Phase::HenyeyGreenstein(g) => {
                let g = self.scene.spectra[*g].curve.eval(NM);
                format!("<phase type=\"hg\"><float name=\"g\" value=\"{g:?}\"/></phase>")
            }
            Phase::Rayleigh { .. } => "<phase type=\"rayleigh\"/>".to_owned(),
            Phase::Table(_) => panic!("no tables here"),
        };
        match shares {
            [] => String::new(),
            [(_, phase)] => one(phase),
            [(first, phase), others @ ..] => {
                let rest: f64 = others.iter().map(|(share, _)| share).sum();
                let weight = rest / (first + rest);
                let (a, b) = (one(phase), self.phases(others));
                format!("<phase type=\"blendphase\"><float name=\"weight\" value=\"{weight:?}\"/>{a}{b}</phase>")
            }
        }
    }

    /// A picture as a texture of Mitsuba's, whose v runs down.
    fn bitmap(&self, name: &str, id: TextureId) -> String {
        let texture = &self.scene.textures[id];
        let channels = texture.channels();
        let is_number = matches!(texture.kind, TextureKind::Number);
        assert!(is_number || channels == 3, "{:?}", texture.kind);
        let file = format!("texture{id}.exr");
        let texels: Vec<[f32; 3]> =
            texture.texels.chunks(channels).map(|texel| [0, 1, 2].map(|c| texel[c % channels])).collect();
        self.picture(&file, texture.size, &texels);
        let (scale, offset) = (texture.placement.scale, texture.placement.offset);
        let filter = match texture.placement.filter {
            TextureFilter::Bilinear => "bilinear",
            TextureFilter::Nearest => "nearest",
        };
        format!(
            "<texture type=\"bitmap\" name=\"{name}\"><string name=\"filename\" value=\"{file}\"/>\
             <boolean name=\"raw\" value=\"{is_number}\"/><string name=\"filter_type\" value=\"{filter}\"/>\
             <transform name=\"to_uv\"><scale x=\"{:?}\" y=\"{:?}\"/><translate x=\"{:?}\" y=\"{:?}\"/></transform></texture>",
            scale.x,
            scale.y,
            offset.x,
            1.0 - scale.y - offset.y
        )
    }

    fn picture(&self, file: &str, [width, height]: [u32; 2], texels: &[[f32; 3]]) {
        let at = |x: usize, y: usize| <(f32, f32, f32)>::from(texels[y * width as usize + x]);
        exr::prelude::write_rgb_file(self.folder.join(file), width as usize, height as usize, at).expect("written");
    }

    fn reflectance(&self, name: &str, of: Reflectance) -> String {
        match of {
            Reflectance::Spectrum(id) => self.spectrum(name, id),
            Reflectance::Texture(id) => self.bitmap(name, id),
        }
    }

    fn weight(&self, name: &str, of: Weight) -> String {
        match of {
            Weight::Constant(value) => format!("<float name=\"{name}\" value=\"{value:?}\"/>"),
            Weight::Texture(id) => self.bitmap(name, id),
        }
    }

    fn bsdf(&self, id: MaterialId) -> String {
        let material = &self.scene.materials[id];
        let rough = |roughness: Roughness, kind: &str| {
            let alphas = match roughness {
                Roughness::Constant([u, _]) if u < SMOOTH => return (kind.to_owned(), String::new()),
                Roughness::Constant([u, v]) if u == v => format!("<float name=\"alpha\" value=\"{u:?}\"/>"),
                Roughness::Constant([u, v]) => {
                    format!("<float name=\"alpha_u\" value=\"{u:?}\"/><float name=\"alpha_v\" value=\"{v:?}\"/>")
                }
                Roughness::Texture(id) => self.bitmap("alpha", id),
            };
            (format!("rough{kind}"), format!("<string name=\"distribution\" value=\"ggx\"/>{alphas}"))
        };
        let index = |eta: SpectrumId| {
            let eta = self.scene.spectra[eta].curve.eval(NM);
            format!("<float name=\"int_ior\" value=\"{eta:?}\"/><float name=\"ext_ior\" value=\"1\"/>")
        };
        let (kind, inner, has_sides) = match material.bsdf {
            Bsdf::Black => ("diffuse".to_owned(), "<spectrum name=\"reflectance\" value=\"0\"/>".to_owned(), true),
            Bsdf::Diffuse { reflectance } => ("diffuse".to_owned(), self.reflectance("reflectance", reflectance), true),
            Bsdf::Conductor { eta, k, roughness, .. } => {
                let (kind, facets) = rough(roughness, "conductor");
                (kind, facets + &self.spectrum("eta", eta) + &self.spectrum("k", k), true)
            }
            Bsdf::Plastic { reflectance, eta, roughness } => {
                let (kind, facets) = rough(roughness, "plastic");
                let base = self.reflectance("diffuse_reflectance", reflectance);
                (kind, facets + "<boolean name=\"nonlinear\" value=\"true\"/>" + &index(eta) + &base, true)
            }
            Bsdf::Dielectric { eta, roughness, .. } => {
                let (kind, facets) = rough(roughness, "dielectric");
                (kind, facets + &index(eta), false)
            }
            Bsdf::Blend { a, b, weight } => {
                let weight = self.weight("weight", weight);
                ("blendbsdf".to_owned(), format!("{weight}<ref id=\"material{a}\"/><ref id=\"material{b}\"/>"), false)
            }
            Bsdf::Translucent { .. } => panic!("Mitsuba has no leaves"),
        };
        let mut around = vec![("bsdf", kind, inner)];
        if has_sides && material.two_sided {
            around.push(("bsdf", "twosided".to_owned(), String::new()));
        }
        if let Some(opacity) = material.opacity {
            around.push(("bsdf", "mask".to_owned(), self.weight("opacity", opacity)));
        }
        let mut out = String::new();
        let outermost = around.len() - 1;
        for (i, (tag, kind, inner)) in around.into_iter().enumerate() {
            let name = if i == outermost { format!(" id=\"material{id}\"") } else { String::new() };
            out = format!("<{tag} type=\"{kind}\"{name}>{inner}{out}</{tag}>");
        }
        out + "\n"
    }

    fn light(&self, light: &Light) -> String {
        let (kind, inner) = match light {
            Light::Point { position, intensity } => {
                let place = format!("<point name=\"position\" value=\"{}\"/>", list(*position));
                ("point", place + &self.spectrum("intensity", *intensity))
            }
            Light::Spot { position, direction, intensity, cone } => {
                let (at, to, up) =
                    (list(*position), list(*position + *direction), list(direction.any_orthonormal_vector()));
                let [half, falloff] = [cone.half_angle, cone.falloff].map(f64::to_degrees);
                let place = format!(
                    "<transform name=\"to_world\"><lookat origin=\"{at}\" target=\"{to}\" up=\"{up}\"/></transform>\
                     <float name=\"cutoff_angle\" value=\"{half:?}\"/><float name=\"beam_width\" value=\"{falloff:?}\"/>"
                );
                ("spot", place + &self.spectrum("intensity", *intensity))
            }
            Light::Directional { direction, irradiance } => {
                let place = format!("<vector name=\"direction\" value=\"{}\"/>", list(*direction));
                ("directional", place + &self.spectrum("irradiance", *irradiance))
            }
            Light::Sun { .. } => panic!("no suns here"),
        };
        format!("<emitter type=\"{kind}\">{inner}</emitter>\n")
    }

    /// Mitsuba's left edge looks along its -z, where a scene's middle does.
    fn map(&self, map: &EnvironmentMap, sky: &[[f32; 3]]) -> String {
        self.picture("sky.exr", SKY.map(|side| side as u32), sky);
        let to_world = map.to_map.transpose() * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, -1.0));
        format!(
            "<emitter type=\"envmap\"><string name=\"filename\" value=\"sky.exr\"/><float name=\"scale\" value=\"{:?}\"/>{}</emitter>\n",
            map.scale,
            transform("to_world", &DAffine3::from_mat3(to_world))
        )
    }

    fn shape(&self, i: usize, object: &Object) -> String {
        let (kind, mut inner) = match &object.shape {
            Shape::Mesh(_) => {
                let name = format!("{i}.ply");
                std::fs::write(self.folder.join(&name), ply(object)).expect("written");
                let faces = object.attributes.normals.is_none();
                let own = format!(
                    "<string name=\"filename\" value=\"{name}\"/><boolean name=\"face_normals\" value=\"{faces}\"/>\
                     <boolean name=\"flip_tex_coords\" value=\"true\"/>"
                );
                ("ply", own)
            }
            // Mitsuba's z is the axis from pole to pole, which is y here, and its longitudes begin at +x, which is where they end at -z here.
            Shape::Sphere { center, radius } => {
                let axes = object.attributes.axes.unwrap_or(DMat3::IDENTITY);
                let turn = axes * DMat3::from_cols(DVec3::NEG_Z, DVec3::NEG_X, DVec3::Y);
                let to_world = DAffine3 { matrix3: turn, translation: *center };
                ("sphere", format!("<float name=\"radius\" value=\"{radius:?}\"/>{}", transform("to_world", &to_world)))
            }
            Shape::Disk { center, normal, radius } => {
                let (x, y) = normal.any_orthonormal_pair();
                let matrix3 = DMat3::from_cols(x, y, *normal) * *radius;
                ("disk", transform("to_world", &DAffine3 { matrix3, translation: *center }))
            }
            Shape::Cylinder { from, to, radius } => {
                let (from, to) = (list(*from), list(*to));
                let own = format!(
                    "<point name=\"p0\" value=\"{from}\"/><point name=\"p1\" value=\"{to}\"/><float name=\"radius\" value=\"{radius:?}\"/>"
                );
                ("cylinder", own)
            }
        };
        inner += &match object.material {
            Some(id) => format!("<ref id=\"material{id}\"/>"),
            None => "<bsdf type=\"null\"/>".to_owned(),
        };
        if let Some(interior) = object.interior {
            write!(inner, "<ref name=\"interior\" id=\"medium{}\"/>", interior.medium).expect("text");
        }
        if let Some(Emission { radiance, sides, texture }) = &object.emission {
            assert_eq!(*sides, Sides::Front);
            let radiance = match texture {
                Some(id) => self.bitmap("radiance", *id),
                None => self.spectrum("radiance", *radiance),
            };
            write!(inner, "<emitter type=\"area\">{radiance}</emitter>").expect("text");
        }
        format!("<shape type=\"{kind}\" id=\"object{i}\">{inner}</shape>\n")
    }
}

/// A curve as Mitsuba has it, where a table is 0 beyond its ends.
fn curve(name: &str, curve: &Curve) -> String {
    let pairs: Vec<(f64, f64)> = match curve {
        Curve::Constant(value) => return format!("<spectrum name=\"{name}\" value=\"{value:?}\"/>"),
        Curve::Linear { nm, value, outside } => {
            let mut pairs: Vec<(f64, f64)> = nm.iter().copied().zip(value.iter().copied()).collect();
            if *outside == Outside::Hold {
                let ends = [pairs[0], pairs[pairs.len() - 1]];
                (ends[0].0 > 300.0).then(|| pairs.insert(0, (300.0, ends[0].1)));
                (ends[1].0 < 900.0).then(|| pairs.push((900.0, ends[1].1)));
            }
            pairs
        }
        Curve::Blackbody { kelvin, .. } => {
            let kelvin = format!("<float name=\"temperature\" value=\"{kelvin:?}\"/>");
            return format!("<spectrum name=\"{name}\" type=\"blackbody\">{kelvin}</spectrum>");
        }
    };
    let pairs = pairs.into_iter().map(|(nm, value)| format!("{nm:?}:{value:?}")).collect::<Vec<_>>().join(", ");
    format!("<spectrum name=\"{name}\" value=\"{pairs}\"/>")
}

/// A mesh with a vertex for each corner.
fn ply(object: &Object) -> String {
    let Shape::Mesh(mesh) = &object.shape else { panic!("meshes only") };
    let (normals, uv) = (object.attributes.normals.as_ref(), object.attributes.uv.as_ref());
    let mut out = format!("ply\nformat ascii 1.0\nelement vertex {}\n", 3 * mesh.triangles.len());
    let names = [(true, &["x", "y", "z"][..]), (normals.is_some(), &["nx", "ny", "nz"]), (uv.is_some(), &["u", "v"])];
    for name in names.into_iter().filter(|(is_there, _)| *is_there).flat_map(|(_, names)| names) {
        writeln!(out, "property double {name}").expect("text");
    }
    write!(out, "element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.triangles.len())
        .expect("text");
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        for (c, vertex) in triangle.iter().enumerate() {
            let p = mesh.positions[*vertex as usize];
            write!(out, "{:?} {:?} {:?}", p.x, p.y, p.z).expect("text");
            if let Some(normals) = normals {
                let n = normals[t][c];
                write!(out, " {:?} {:?} {:?}", n.x, n.y, n.z).expect("text");
            }
            if let Some(uv) = uv {
                write!(out, " {:?} {:?}", uv[t][c].x, uv[t][c].y).expect("text");
            }
            out.push('\n');
        }
    }
    (0..mesh.triangles.len()).for_each(|t| writeln!(out, "3 {} {} {}", 3 * t, 3 * t + 1, 3 * t + 2).expect("text"));
    out
}
