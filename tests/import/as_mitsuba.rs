//! Scenes as Mitsuba 3 has them: what it cannot say replaced by the nearest thing that it can, so that `mitsuba_xml` can write it.

use spectile::scene::{
    Absorber, Bsdf, Component, Environment, EnvironmentMap, Evaluation, Field, Film, Light, Medium, MediumId, Phase,
    PhaseTable, Profile, Reflectance, Roughness, SMOOTH, Scattering, Scene, Spectrum, SpectrumId, Texels, TextureKind,
};
use spectile::spectral::colour::{Observer, xyz_to_linear_srgb};
use spectile::spectral::{Channels, Curve, Outside, upsample};

/// Where what Mitsuba has once, and a scene over wavelength, is taken.
pub const NM: f64 = 550.0;
/// Columns and rows of a map of light as it is written, and by how much an import makes such a small one finer.
pub const SKY: [usize; 2] = [32, 17];
const FINER: usize = 8;

/// A scene of which Mitsuba can say everything.
pub struct AsMitsuba {
    pub scene: Scene,
    /// Its map of light as Mitsuba has it: [`SKY`], rows from pole to pole.
    pub sky: Option<Vec<[f32; 3]>>,
}

/// Replaces what a scene of Mitsuba's cannot say.
///
/// Of materials: indices of glass and coats by wavelength; what rough metals scatter more than once; leaves that let light through, which are as
/// opaque as paper here; heat; shares of spectra by a picture, of which the first is taken. Of media: gases, heat and grids, by matter of the
/// same mean everywhere, in tables; shares of kinds of matter that differ by wavelength, by those at [`NM`], and so tables of phase functions,
/// by Henyey and Greenstein's of their mean cosine; Rayleigh's with a depolarisation, by that without. Of light: suns with a size, by such
/// without; the edges of spots, by linear ones; black bodies times a factor, by tables; maps over wavelength, by their colours in 32 x 17
/// directions.
pub fn as_mitsuba_can(mut scene: Scene) -> AsMitsuba {
    for material in &mut scene.materials {
        material.temperature = None;
        match &mut material.bsdf {
            Bsdf::Dielectric { eta, .. } | Bsdf::Plastic { eta, .. } => {
                let mean = scene.spectra[*eta].curve.mean(400.0, 700.0);
                scene.spectra[*eta].curve = Curve::Constant((mean * 1e4).round() / 1e4);
            }
            Bsdf::Conductor { energy_compensation, roughness, .. } => {
                *energy_compensation &= matches!(roughness, Roughness::Constant([along, _]) if *along < SMOOTH);
            }
            Bsdf::Translucent { reflectance, .. } => {
                (material.bsdf, material.two_sided) = (Bsdf::Diffuse { reflectance: *reflectance }, true);
            }
            _ => {}
        }
        if let Bsdf::Diffuse { reflectance } = &mut material.bsdf
            && let Reflectance::Texture(texture) = *reflectance
            && let TextureKind::Mixture(endmembers) = &scene.textures[texture].kind
        {
            *reflectance = Reflectance::Spectrum(endmembers[0]);
        }
    }
    for id in 0..scene.media.len() {
        scene.media[id] = even_matter(&mut scene, id);
    }
    scene.camera_medium = None;
    for light in &mut scene.lights {
        match light {
            Light::Sun { direction, irradiance, .. } => {
                *light = Light::Directional { direction: *direction, irradiance: *irradiance };
            }
            Light::Spot { cone, .. } => cone.profile = Profile::Linear,
            Light::Point { .. } | Light::Directional { .. } => {}
        }
    }
    for spectrum in &mut scene.spectra {
        if let Curve::Blackbody { scale, .. } = spectrum.curve
            && scale != 1.0
        {
            spectrum.curve = table(300.0, 1.0, 900.0, &|nm| spectrum.curve.eval(nm));
        }
    }
    let sky = sky(&mut scene);
    scene.integrator.evaluation = Evaluation::All;
    scene.integrator.wavelengths_per_channel = Some(1);
    // Small, of the same shape.
    let height = 24 * scene.film.height / scene.film.width;
    assert_eq!(height * scene.film.width, 24 * scene.film.height);
    scene.film = Film { width: 24, height, filter: scene.film.filter, crop: [0, 0, 24, height] };
    scene.channels = Channels::equal(420.0, 700.0, 4);
    AsMitsuba { scene, sky }
}

fn table(from: f64, step: f64, to: f64, f: &dyn Fn(f64) -> f64) -> Curve {
    let nm: Vec<f64> = (0..=((to - from) / step) as u32).map(|i| from + step * f64::from(i)).collect();
    let value = nm.iter().map(|nm| f(*nm)).collect();
    Curve::Linear { nm, value, outside: Outside::Hold }
}

/// Every 5 nm, in which products of tables have no other values between.
pub fn of_matter(f: &dyn Fn(f64) -> f64) -> Curve {
    table(360.0, 5.0, 830.0, f)
}

fn new_spectrum(scene: &mut Scene, curve: Curve) -> SpectrumId {
    scene.spectra.push(Spectrum { name: "as Mitsuba can".to_owned(), curve, definition: None });
    scene.spectra.len() - 1
}

/// The mean cosine of a phase function at [`NM`].
fn mean_cosine(table: &PhaseTable) -> f64 {
    let degrees = (0..1800).map(|i| 0.1 * (f64::from(i) + 0.5));
    let of = |degrees: f64| {
        let angle = degrees.to_radians();
        let share = angle.sin() * table.value(degrees, NM);
        (share, share * angle.cos())
    };
    let (all, along) = degrees.map(of).fold((0.0, 0.0), |sum, x| (sum.0 + x.0, sum.1 + x.1));
    along / all
}

fn even_matter(scene: &mut Scene, id: MediumId) -> Medium {
    let medium = scene.media[id].clone();
    let density = |component: &Component| match &component.density {
        Field::Constant(density) => *density,
        Field::Grid(grid) => grid.values.iter().map(|v| f64::from(*v)).sum::<f64>() / grid.values.len() as f64,
    };
    let spectra: Vec<Curve> = scene.spectra.iter().map(|spectrum| spectrum.curve.clone()).collect();
    let absorption = |nm: f64| -> f64 {
        let of =
            |one: &Component| one.absorbers.iter().map(|a| a.strength * spectra[a.columns[0].1].eval(nm)).sum::<f64>();
        medium.components.iter().map(|one| density(one) * of(one)).sum()
    };
    let scattered_by = |one: &Component, nm: f64| {
        one.scattering.as_ref().map_or(0.0, |scattering| density(one) * spectra[scattering.coefficient].eval(nm))
    };
    let scattering = |nm: f64| -> f64 { medium.components.iter().map(|one| scattered_by(one, nm)).sum() };
    let column = new_spectrum(scene, of_matter(&absorption));
    let absorber = Absorber { strength: 1.0, columns: vec![(300.0, column)] };
    let scatters = medium.components.iter().filter_map(|one| Some((one, one.scattering.as_ref()?)));
    let mut components: Vec<Component> = scatters
        .map(|(one, own)| {
            let share = scattered_by(one, NM) / scattering(NM);
            let phase = match &own.phase {
                Phase::HenyeyGreenstein(g) => spectra[*g].eval(NM),
                Phase::Table(table) => mean_cosine(table),
                Phase::Rayleigh { .. } => f64::NAN,
            };
            let phase = match phase.is_nan() {
                true => Phase::Rayleigh { depolarisation: 0.0 },
                false => Phase::HenyeyGreenstein(new_spectrum(scene, Curve::Constant((phase * 1e4).round() / 1e4))),
            };
            let coefficient = new_spectrum(scene, of_matter(&|nm| share * scattering(nm)));
            let scattering = Some(Scattering { coefficient, phase });
            Component { absorbers: Vec::new(), scattering, density: Field::Constant(1.0) }
        })
        .collect();
    match components.first_mut() {
        Some(first) => first.absorbers.push(absorber),
        None => {
            let density = Field::Constant(1.0);
            components.push(Component { absorbers: vec![absorber], scattering: None, density });
        }
    }
    Medium { name: medium.name, components, temperature: None }
}

/// Gives a scene with a map what Mitsuba would show of it, and gives the map that shows that.
fn sky(scene: &mut Scene) -> Option<Vec<[f32; 3]>> {
    let map = scene.environment.as_ref()?.map()?.clone();
    let colours = linear_srgb(&map.texels);
    let [width, height] = map.size.map(|side| side as usize);
    let sky: Vec<[f32; 3]> = (0..SKY[1])
        .flat_map(|y| (0..SKY[0]).map(move |x| (x, y)))
        .map(|(x, y)| {
            let row = (y * height / (SKY[1] - 1)).min(height - 1);
            colours[row * width + (2 * x + 1) * width / (2 * SKY[0])]
        })
        .collect();
    let [width, height] = SKY.map(|side| side * FINER);
    let rgb = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).flat_map(|(x, y)| {
        let at = |i: usize, of: usize| (i as f64 + 0.5) / of as f64;
        shown_by_mitsuba(&sky, at(x, width), at(y, height))
    });
    let texels = Texels::Rgb { rgb: rgb.collect(), daylight: new_spectrum(scene, upsample::daylight()) };
    let size = [width as u32, height as u32];
    scene.environment = Some(Environment::Map(EnvironmentMap { size, texels, ..map }));
    Some(sky)
}

/// Linear sRGB of each texel, as upsampling has it: of light over daylight, none of it negative.
fn linear_srgb(texels: &Texels) -> Vec<[f32; 3]> {
    let (nm, radiance) = match texels {
        Texels::Rgb { rgb, .. } => return rgb.as_chunks::<3>().0.to_vec(),
        Texels::Spectral { nm, radiance } => (nm, radiance),
    };
    let luminance = Observer::Cie1931.xyz(&upsample::daylight())[1];
    // Of each band, which is a line up to it from the one before and down to the next.
    let bands: Vec<[f64; 3]> = (0..nm.len())
        .map(|band| {
            let value = (0..nm.len()).map(|i| if i == band { 1.0 } else { 0.0 }).collect();
            let curve = Curve::Linear { nm: nm.clone(), value, outside: Outside::Zero };
            xyz_to_linear_srgb(Observer::Cie1931.xyz(&curve)).map(|v| v / luminance)
        })
        .collect();
    let of = |texel: &[f32]| {
        let add =
            |sum: [f64; 3], (value, band): (&f32, &[f64; 3])| [0, 1, 2].map(|c| sum[c] + f64::from(*value) * band[c]);
        texel.iter().zip(&bands).fold([0.0; 3], add).map(|v| v.max(0.0) as f32)
    };
    radiance.chunks(nm.len()).map(of).collect()
}

/// A map of Mitsuba's at (u, v) in [0, 1]: columns are centred, rows go from pole to pole, hue and brightness are mixed apart.
fn shown_by_mitsuba(sky: &[[f32; 3]], u: f64, v: f64) -> [f32; 3] {
    let [width, height] = SKY;
    let (x, y) = (u * width as f64 - 0.5, v * (height - 1) as f64);
    let (left, top) = (x.floor(), y.floor().min((height - 2) as f64));
    let (mut hue, mut bright) = ([0.0; 3], 0.0);
    for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let share = |along: f64, far: usize| if far == 1 { along } else { 1.0 - along };
        let share = share(x - left, i) * share(y - top, j);
        let texel = sky[(top as usize + j) * width + (left + i as f64).rem_euclid(width as f64) as usize];
        let brightness = texel[0].max(texel[1]).max(texel[2]);
        let of = |c: usize| if brightness > 0.0 { f64::from(texel[c]) / f64::from(brightness) } else { 0.0 };
        hue = [0, 1, 2].map(|c| hue[c] + share * of(c));
        bright += share * f64::from(brightness);
    }
    hue.map(|v| (v * bright) as f32)
}
