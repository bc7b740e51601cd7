//! The scene of a sky: a folder that a person may edit.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::json;

use super::air::{self, LAYERS, Layers};
use super::thermal::{self, Gas};
use super::{Albedo, Atmosphere, RANGE, SUNNY, gas, particle};
use crate::files::output::Product;
use crate::spectral::{SOLAR, columns, planck};
use crate::{Error, Result};

/// What [`Atmosphere::write_scene`] fills. It is never replaced: somebody may have worked on it.
pub const FOLDER: Product = Product {
    name: "the scene of a sky",
    extensions: &[],
    is_stream: false,
    is_folder: true,
    check: |_| Err("is there already".into()),
};

/// From the middle to the sides, m: even half a degree above the horizon a ray leaves through the top.
const HALF_WIDTH: f64 = 6e6;
/// The thickness of a layer, m.
const LAYER: f64 = 1e3;
/// Where the sky sends heat, the lowest kilometres have layers of this thickness, m: air at the ground is what is seen in strong bands.
const LOW_LAYER: f64 = 100.0;
const LOW_LAYERS: usize = 20;
/// The sun's brightness temperature at 4,000 nm, where the standard's table ends; beyond it is a black body's shape here (K).
const SUN_TEMPERATURE: f64 = 5560.0;

/// Which of the tables of matter a scene needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parts {
    sunny: bool,
    heat: bool,
}

impl Parts {
    /// Of a sky whose channels lie in `from` to `to` (nm).
    pub fn of(atmosphere: &Atmosphere, [from, to]: [f64; 2]) -> Parts {
        let heat = to > SUNNY || atmosphere.sun.is_none();
        Parts { sunny: from < SUNNY || !heat, heat }
    }

    /// Whether air and ground have temperatures.
    pub fn have_heat(self) -> bool {
        self.heat
    }
}

/// A box of layers.
struct Body {
    /// Of its medium, and what the names of its grids begin with.
    name: &'static str,
    prefix: &'static str,
    half_width: f64,
    thickness: f64,
    layers: Layers,
}

impl Body {
    /// From the outside in.
    fn all(parts: Parts) -> Vec<Body> {
        let edges = |count: usize, thickness: f64| Layers((0..=count).map(|i| i as f64 * thickness / 1e3).collect());
        let high =
            Body { name: "air", prefix: "", half_width: HALF_WIDTH, thickness: LAYER, layers: edges(LAYERS, LAYER) };
        let low = Body {
            name: "low_air",
            prefix: "low_",
            // Within the other's sides.
            half_width: 0.98 * HALF_WIDTH,
            thickness: LOW_LAYER,
            layers: edges(LOW_LAYERS, LOW_LAYER),
        };
        if parts.heat { vec![high, low] } else { vec![high] }
    }

    fn toml(&self) -> String {
        let Body { name, half_width: w, thickness, layers, .. } = self;
        format!(
            "[[objects]]\n\
             cube = {{ min = [-{w:?}, -{w:?}, -{thickness:?}], max = [{w:?}, {w:?}, {:?}] }}\n\
             interior = \"{name}\"\n",
            1e3 * layers.0[layers.0.len() - 1],
        )
    }
}

impl Atmosphere {
    /// Fills `folder` with `scene.toml`, the spectra and the grids that it names. `channels` is the section of that name.
    ///
    /// # Errors
    /// [`Error::Storage`] where something cannot be written.
    pub fn write_scene(&self, folder: &Path, parts: Parts, channels: &str) -> Result<()> {
        let write = |name: &str, text: String| {
            let path = folder.join(name);
            fs::write(&path, text).map_err(|error| Error::storage(&path, error))
        };
        write("particles.csv", self.particles(parts))?;
        if parts.sunny {
            write("gases.csv", self.gases(parts))?;
        }
        if parts.heat {
            write("heat.csv", self.heat_gases())?;
            if self.sun.is_some() {
                write("sun.csv", above_the_air())?;
            }
        }
        for body in Body::all(parts) {
            let column = |name: &str, what: &str, unit: Option<&str>, values: Vec<f64>| {
                let path = folder.join(format!("{}{name}.zarr", body.prefix));
                write_column(&path, what, unit, &values).map_err(|error| Error::storage(&path, error))
            };
            let share = format!(
                "share of the whole column in each layer of {} m, per kilometre, from below the ground up",
                body.thickness
            );
            for component in self.components(parts, "") {
                let shares = component.matter.shares(self, &body.layers);
                let below = std::iter::once(0.0);
                let values = below.chain(shares.iter().map(|share| share * 1e3 / body.thickness));
                column(component.name, &share, None, values.collect())?;
            }
            if parts.heat {
                // Below the ground is nothing.
                let kelvin = std::iter::once(self.ground_temperature).chain(body.layers.temperatures());
                let what = format!("temperature of layers of {} m, from below the ground up", body.thickness);
                column("temperature", &what, Some("K"), kelvin.collect())?;
            }
        }
        write("scene.toml", self.toml(parts, channels))
    }

    /// `prefix` is that of the grids.
    fn components(&self, parts: Parts, prefix: &str) -> Vec<Component> {
        let mut all = vec![(true, "molecules", Matter::Molecules, molecules(prefix))];
        all.push((self.aerosol_depth > 0.0, "aerosol", Matter::Aerosol, aerosol(prefix)));
        let (wet, rich) = (self.water > 0.0, self.ozone > 0.0);
        if parts.sunny {
            for (is_there, column, name, matter) in [
                (wet, "water", "water", Matter::Water),
                (rich, "ozone", "ozone", Matter::Ozone),
                (true, "mixed gases", "mixed", Matter::Mixed),
            ] {
                all.push((is_there, name, matter, absorber("gases.csv", column, prefix, name)));
            }
        }
        for gas in Gas::ALL.into_iter().filter(|_| parts.heat) {
            let is_there = match gas {
                Gas::Water | Gas::SelfContinuum | Gas::ForeignContinuum => wet,
                Gas::Ozone => rich,
                Gas::MixedBands | Gas::MixedContinua => true,
            };
            let [column, name] = gas.names();
            all.push((is_there, name, Matter::Heat(gas), absorber("heat.csv", column, prefix, name)));
        }
        let there = all.into_iter().filter(|(is_there, ..)| *is_there);
        there.map(|(_, name, matter, text)| Component { name, matter, text }).collect()
    }

    fn particles(&self, parts: Parts) -> String {
        let mut text = String::from(
            "# Vertical optical depth of the whole atmosphere, as if it stood in one kilometre: molecules by Bodhaine et al. (1999), aerosol by\n\
             # Shettle and Fenn (1979). Asymmetry: mean cosine of what the aerosol scatters\n\
             wavelength_nm,molecules (1/km),aerosol scattering (1/km),aerosol absorption (1/km),asymmetry\n",
        );
        for nm in particle::wavelengths(parts.heat) {
            let depths = self.depths(nm);
            let [scattering, absorption] = [depths.aerosol_scattering, depths.aerosol_absorption];
            let g = self.asymmetry(nm);
            writeln!(text, "{nm:.2},{:.6e},{scattering:.6e},{absorption:.6e},{g:.5}", depths.molecules)
                .expect("memory");
        }
        text
    }

    fn gases(&self, parts: Parts) -> String {
        let mut text = format!(
            "# Vertical optical depth of the whole atmosphere, as if it stood in one kilometre, for light through {:.4} atmospheres: LOWTRAN7\n\
             wavelength_nm,water (1/km),ozone (1/km),mixed gases (1/km)\n",
            self.air_mass()
        );
        let of_sunlight = |nm: &f64| !parts.heat || *nm < SUNNY;
        for nm in gas::wavelengths().filter(of_sunlight).chain(parts.heat.then_some(SUNNY)) {
            let [water, ozone, mixed] = gas::depths(nm, self.water, self.ozone, self.air_mass());
            writeln!(text, "{nm:.2},{water:.5e},{ozone:.5e},{mixed:.5e}").expect("memory");
        }
        if parts.heat {
            writeln!(text, "{:.2},0,0,0\n{:.2},0,0,0", SUNNY + 0.01, RANGE[1] + 500.0).expect("memory");
        }
        text
    }

    fn heat_gases(&self) -> String {
        let names = Gas::ALL.map(|gas| format!(",{} (1/km)", gas.names()[0])).concat();
        let mut text = format!(
            "# Vertical optical depth of the whole atmosphere, as if it stood in one kilometre, for light through {} atmospheres: LOWTRAN7\n\
             wavelength_nm{names}\n",
            thermal::DIFFUSE
        );
        let mut row = |nm: f64, depths: [f64; 6]| {
            let cells = depths.map(|depth| format!(",{depth:.5e}")).concat();
            writeln!(text, "{nm:.2}{cells}").expect("memory");
        };
        row(RANGE[0] - 10.0, [0.0; 6]);
        row(SUNNY, [0.0; 6]);
        let beyond = thermal::wavelengths().filter(|nm| *nm > SUNNY + 0.01);
        for nm in std::iter::once(SUNNY + 0.01).chain(beyond) {
            row(nm, thermal::depths(nm, self.water, self.ozone, thermal::DIFFUSE));
        }
        text
    }

    /// What the sun sends through the atmosphere, as CSV: nm, and the irradiance of a plane that faces it. The first line is `mark`.
    pub fn direct_csv(&self, parts: Parts, mark: &str) -> String {
        let mut text = format!("{mark}\nwavelength_nm,direct normal irradiance (W/m2/nm)\n");
        for (nm, irradiance) in self.direct(parts) {
            writeln!(text, "{nm},{irradiance:.6e}").expect("memory");
        }
        text
    }

    /// (nm, W m⁻² nm⁻¹) of direct light on a plane that faces it, from 380 nm to as far as the parts go; of nothing but zeros at night.
    pub fn direct(&self, parts: Parts) -> Vec<(f64, f64)> {
        if self.sun.is_none() {
            return RANGE.map(|nm| (nm, 0.0)).to_vec();
        }
        let to = if parts.heat { RANGE[1] } else { SUNNY };
        let seen = sun_above_the_air(parts.heat).into_iter().filter(|(nm, _)| (RANGE[0]..=to).contains(nm));
        seen.map(|(nm, sun)| (nm, sun * self.transmittance(nm))).collect()
    }

    fn toml(&self, parts: Parts, channels: &str) -> String {
        let bodies = Body::all(parts);
        let albedo = match &self.albedo {
            Albedo::Land if parts.heat => {
                "{ samples = [[380, 0.2], [2500, 0.2], [4500, 0.03], [20000, 0.03]], outside = \"hold\" }".to_owned()
            }
            Albedo::Land => "0.2".to_owned(),
            Albedo::Constant(albedo) => format!("{albedo:?}"),
            Albedo::File(path) => format!("{{ file = {} }}", toml::Value::from(path.display().to_string())),
        };
        let temperature =
            if parts.heat { format!("temperature = {:?}\n", self.ground_temperature) } else { String::new() };
        // Of a path that marches through all matter there is, a device can evaluate fewer bounces.
        let most = match parts {
            Parts { heat: false, .. } => 30,
            Parts { sunny: true, .. } => 20,
            _ => 10,
        };
        let mut bounces = format!("max_bounces = {most}\n");
        if parts.heat {
            // Where air absorbs strongly nothing is left of what was scattered, and ways are marched through.
            bounces += "russian_roulette_start = 1\n";
        }
        let mut media = String::new();
        for body in &bodies {
            if parts.heat {
                let [name, prefix] = [body.name, body.prefix];
                write!(media, "\n[media.{name}]\ntemperature = {{ grid = \"{prefix}temperature.zarr\" }}\n")
                    .expect("memory");
            }
            for component in self.components(parts, body.prefix) {
                media += &component.text.replace("media.air", &format!("media.{}", body.name));
            }
        }
        let bodies = bodies.iter().map(Body::toml).collect::<Vec<_>>().join("\n");
        let layers = if parts.heat {
            format!("{} layers of a kilometre, the lowest two kilometres in layers of {LOW_LAYER} m", LAYERS + 1)
        } else {
            format!("{} layers of a kilometre", LAYERS + 1)
        };
        let (what, light) = self.sun_toml(parts);
        format!(
            "# A clear sky, made by `spectile sky`. {what} {} aerosol of\n\
             # {} at 550 nm, falling to 1/e in {} km; {} Dobson units of ozone, {} cm of water. North is +y, up is +z; lengths are metres.\n\
             # Not in the picture: the sun itself.\n\
             \n\
             [camera.latlong]\n\
             position = [0.0, 0.0, 1.0]\n\
             up = [0.0, 0.0, 1.0]\n\
             \n\
             [film]\n\
             width = 360\n\
             height = 180\n\
             \n\
             {channels}\
             \n\
             [integrator]\n\
             {bounces}\
             forced_collision = true\n\
             techniques = 4\n\
             wavelengths_per_channel = 1\n\
             evaluation = \"all\"\n\
             \n\
             {light}\
             [materials.ground.diffuse]\n\
             reflectance = {albedo}\n\
             {temperature}\
             \n\
             [[objects]]\n\
             quad = {{ corner = [-{HALF_WIDTH:?}, -{HALF_WIDTH:?}, 0.0], edge_u = [{:?}, 0.0, 0.0], edge_v = [0.0, {:?}, 0.0] }}\n\
             material = \"ground\"\n\
             \n\
             # {layers}; the first is below the ground and empty.\n\
             {bodies}\
             {media}",
            self.aerosol,
            self.aerosol_depth,
            self.aerosol_height,
            self.ozone,
            self.water,
            2.0 * HALF_WIDTH,
            2.0 * HALF_WIDTH,
        )
    }

    /// What a comment says of the sun, and the light.
    fn sun_toml(&self, parts: Parts) -> (String, String) {
        let Some(sun) = self.sun else { return ("Night;".into(), String::new()) };
        let [azimuth, elevation] = [sun.azimuth, sun.elevation].map(f64::to_radians);
        // North is +y, east is +x; light comes from there.
        let towards = [azimuth.sin() * elevation.cos(), azimuth.cos() * elevation.cos(), elevation.sin()];
        let [x, y, z] = towards.map(|along| format!("{:.9}", 0.0 - along));
        let irradiance = if parts.heat { "{ file = \"sun.csv\" }" } else { "\"am0\"" };
        (
            format!(
                "The sun stands {} degrees above the horizon, {} degrees from north over east;",
                sun.elevation, sun.azimuth
            ),
            format!("[[lights]]\ndirectional = {{ direction = [{x}, {y}, {z}], irradiance = {irradiance} }}\n\n"),
        )
    }
}

/// (nm, W m⁻² nm⁻¹) above the air at one astronomical unit: ASTM G173's, and with `heat` a black body's shape where that ends.
fn sun_above_the_air(heat: bool) -> Vec<(f64, f64)> {
    let mut all: Vec<(f64, f64)> = columns::<3>(SOLAR).map(|row| (row[0], row[1])).collect();
    let (end, last) = all[all.len() - 1];
    if heat {
        let beyond = thermal::wavelengths().filter(|nm| *nm > end);
        let black = |nm: f64| planck::radiance(nm, SUN_TEMPERATURE);
        all.extend(beyond.map(|nm| (nm, last * black(nm) / black(end))));
    }
    all
}

fn above_the_air() -> String {
    let mut text = String::from(
        "# Sunlight above the air: ASTM G173-03, beyond 4,000 nm a black body's shape\nwavelength_nm,irradiance (W/m2/nm)\n",
    );
    for (nm, irradiance) in sun_above_the_air(true) {
        writeln!(text, "{nm},{irradiance:.6e}").expect("memory");
    }
    text
}

/// What a grid is of.
#[derive(Clone, Copy)]
enum Matter {
    Molecules,
    Aerosol,
    Water,
    Ozone,
    Mixed,
    Heat(Gas),
}

impl Matter {
    fn shares(self, atmosphere: &Atmosphere, layers: &Layers) -> Vec<f64> {
        match self {
            Matter::Molecules => layers.shares(|step| step.molecules, 1.0),
            Matter::Water => layers.shares(air::weighed_water, 1.0),
            Matter::Ozone => layers.shares(|step| step.molecules * step.ozone_ppm, 1.0),
            Matter::Mixed => layers.shares(air::weighed_air, 1.0),
            Matter::Aerosol => layers.of_aerosol(atmosphere.aerosol_height),
            Matter::Heat(gas) => gas.shares(layers),
        }
    }
}

/// A kind of matter: its grid is `NAME.zarr`, each layer's share of the column, per kilometre.
struct Component {
    name: &'static str,
    matter: Matter,
    text: String,
}

fn molecules(prefix: &str) -> String {
    format!(
        "\n[[media.air.components]]\n\
         scattering = {{ file = \"particles.csv\", column = \"molecules (1/km)\" }}\n\
         phase = {{ rayleigh = 0.0279 }}\n\
         density = {{ grid = \"{prefix}molecules.zarr\" }}\n"
    )
}

fn aerosol(prefix: &str) -> String {
    format!(
        "\n[[media.air.components]]\n\
         scattering = {{ file = \"particles.csv\", column = \"aerosol scattering (1/km)\" }}\n\
         absorption = {{ file = \"particles.csv\", column = \"aerosol absorption (1/km)\" }}\n\
         phase = {{ hg = {{ file = \"particles.csv\", column = \"asymmetry\" }} }}\n\
         density = {{ grid = \"{prefix}aerosol.zarr\" }}\n"
    )
}

/// Matter that absorbs only: a column of a table of gases, and its grid.
fn absorber(file: &str, column: &str, prefix: &str, name: &str) -> String {
    format!(
        "\n[[media.air.components]]\nabsorption = {{ file = \"{file}\", column = \"{column} (1/km)\" }}\n\
         density = {{ grid = \"{prefix}{name}.zarr\" }}\n"
    )
}

/// A grid [z, 1, 1] of f32, from below the ground up.
fn write_column(path: &Path, what: &str, unit: Option<&str>, values: &[f64]) -> std::io::Result<()> {
    fs::create_dir_all(path.join("c/0/0"))?;
    let mut attributes = json!({ "long_name": what });
    if let Some(unit) = unit {
        attributes["units"] = unit.into();
    }
    let metadata = json!({
        "zarr_format": 3, "node_type": "array", "shape": [values.len(), 1, 1], "data_type": "float32",
        "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": [values.len(), 1, 1] } },
        "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
        "fill_value": 0.0, "codecs": [{ "name": "bytes", "configuration": { "endian": "little" } }],
        "dimension_names": ["z", "y", "x"],
        "attributes": attributes,
    });
    fs::write(path.join("zarr.json"), serde_json::to_vec_pretty(&metadata)?)?;
    fs::write(path.join("c/0/0/0"), values.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect::<Vec<_>>())
}
