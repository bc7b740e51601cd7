//! The scene of a sky: a folder that a person may edit.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::json;

use super::air::{LAYERS, Profile};
use super::{Albedo, Atmosphere, RANGE, gas, particle};
use crate::files::output::Product;
use crate::spectral::SOLAR;
use crate::spectral::columns;
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

impl Atmosphere {
    /// Fills `folder` with `scene.toml`, the spectra and the grids that it names.
    ///
    /// # Errors
    /// [`Error::Storage`] where something cannot be written.
    pub fn write_scene(&self, folder: &Path) -> Result<()> {
        let write = |name: &str, text: String| {
            let path = folder.join(name);
            fs::write(&path, text).map_err(|error| Error::storage(&path, error))
        };
        write("particles.csv", self.particles())?;
        write("gases.csv", self.gases())?;
        let profile = Profile::standard();
        for component in self.components() {
            let shares = match component.name {
                "molecules" => profile.of_molecules,
                "aerosol" => Profile::of_aerosol(self.aerosol_height),
                "water" => profile.of_water,
                "ozone" => profile.of_ozone,
                _ => profile.of_mixed,
            };
            let path = folder.join(format!("{}.zarr", component.name));
            write_column(&path, &shares).map_err(|error| Error::storage(&path, error))?;
        }
        write("scene.toml", self.toml())
    }

    fn components(&self) -> impl Iterator<Item = Component> {
        let all = [
            (true, "molecules", MOLECULES.to_owned()),
            (self.aerosol_depth > 0.0, "aerosol", AEROSOL.to_owned()),
            (self.water > 0.0, "water", absorber("water", "water")),
            (self.ozone > 0.0, "ozone", absorber("ozone", "ozone")),
            (true, "mixed", absorber("mixed gases", "mixed")),
        ];
        all.into_iter().filter(|(is_there, ..)| *is_there).map(|(_, name, text)| Component { name, text })
    }

    fn particles(&self) -> String {
        let mut text = String::from(
            "# Vertical optical depth of the whole atmosphere, as if it stood in one kilometre: molecules by Bodhaine et al. (1999), aerosol by\n\
             # Shettle and Fenn (1979). Asymmetry: mean cosine of what the aerosol scatters\n\
             wavelength_nm,molecules (1/km),aerosol scattering (1/km),aerosol absorption (1/km),asymmetry\n",
        );
        for nm in particle::wavelengths() {
            let depths = self.depths(nm);
            let [scattering, absorption] = [depths.aerosol_scattering, depths.aerosol_absorption];
            let g = self.asymmetry(nm);
            writeln!(text, "{nm:.2},{:.6e},{scattering:.6e},{absorption:.6e},{g:.5}", depths.molecules)
                .expect("memory");
        }
        text
    }

    fn gases(&self) -> String {
        let mut text = format!(
            "# Vertical optical depth of the whole atmosphere, as if it stood in one kilometre, for light through {:.4} atmospheres: LOWTRAN7\n\
             wavelength_nm,water (1/km),ozone (1/km),mixed gases (1/km)\n",
            self.air_mass()
        );
        for nm in gas::wavelengths() {
            let depths = self.depths(nm);
            writeln!(text, "{nm:.2},{:.5e},{:.5e},{:.5e}", depths.water, depths.ozone, depths.mixed).expect("memory");
        }
        text
    }

    /// What the sun sends through the atmosphere, as CSV: nm, and the irradiance of a plane that faces it. The first line is `mark`.
    pub fn direct_csv(&self, mark: &str) -> String {
        let mut text = format!("{mark}\nwavelength_nm,direct normal irradiance (W/m2/nm)\n");
        for (nm, irradiance) in self.direct() {
            writeln!(text, "{nm},{irradiance:.6e}").expect("memory");
        }
        text
    }

    /// (nm, W m⁻² nm⁻¹) of direct light on a plane that faces it, at the wavelengths of the sun's own table within [`RANGE`].
    pub fn direct(&self) -> Vec<(f64, f64)> {
        let seen = columns::<3>(SOLAR).filter(|row| (RANGE[0]..=RANGE[1]).contains(&row[0]));
        seen.map(|[nm, sun, _]| (nm, sun * self.transmittance(nm))).collect()
    }

    fn toml(&self) -> String {
        let [azimuth, elevation] = [self.azimuth, self.elevation].map(f64::to_radians);
        // North is +y, east is +x; light comes from there.
        let towards = [azimuth.sin() * elevation.cos(), azimuth.cos() * elevation.cos(), elevation.sin()];
        let [x, y, z] = towards.map(|along| format!("{:.9}", 0.0 - along));
        let albedo = match &self.albedo {
            Albedo::Constant(albedo) => format!("{albedo:?}"),
            Albedo::File(path) => format!("{{ file = {} }}", toml::Value::from(path.display().to_string())),
        };
        let components: String = self.components().map(|component| component.text).collect();
        let [from, to] = RANGE;
        format!(
            "# A clear sky, made by `spectile sky`. The sun stands {} degrees above the horizon, {} degrees from north over east; {} aerosol of\n\
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
             [channels]\n\
             equal = {{ from = {from:?}, to = {to:?}, count = 200 }}\n\
             \n\
             [integrator]\n\
             max_bounces = 30\n\
             forced_collision = true\n\
             techniques = 4\n\
             wavelengths_per_channel = 1\n\
             evaluation = \"all\"\n\
             \n\
             [[lights]]\n\
             directional = {{ direction = [{x}, {y}, {z}], irradiance = \"am0\" }}\n\
             \n\
             [materials.ground.diffuse]\n\
             reflectance = {albedo}\n\
             \n\
             [[objects]]\n\
             quad = {{ corner = [-{HALF_WIDTH:?}, -{HALF_WIDTH:?}, 0.0], edge_u = [{:?}, 0.0, 0.0], edge_v = [0.0, {:?}, 0.0] }}\n\
             material = \"ground\"\n\
             \n\
             # {} layers of a kilometre; the first is below the ground and empty.\n\
             [[objects]]\n\
             cube = {{ min = [-{HALF_WIDTH:?}, -{HALF_WIDTH:?}, -{LAYER:?}], max = [{HALF_WIDTH:?}, {HALF_WIDTH:?}, {:?}] }}\n\
             interior = \"air\"\n\
             {components}",
            self.elevation,
            self.azimuth,
            self.aerosol,
            self.aerosol_depth,
            self.aerosol_height,
            self.ozone,
            self.water,
            2.0 * HALF_WIDTH,
            2.0 * HALF_WIDTH,
            LAYERS + 1,
            LAYERS as f64 * LAYER,
        )
    }
}

/// A kind of matter: its grid is `NAME.zarr`, each layer's share of the column, per kilometre.
struct Component {
    name: &'static str,
    text: String,
}

const MOLECULES: &str = r#"
[[media.air.components]]
scattering = { file = "particles.csv", column = "molecules (1/km)" }
phase = { rayleigh = 0.0279 }
density = { grid = "molecules.zarr" }
"#;
const AEROSOL: &str = r#"
[[media.air.components]]
scattering = { file = "particles.csv", column = "aerosol scattering (1/km)" }
absorption = { file = "particles.csv", column = "aerosol absorption (1/km)" }
phase = { hg = { file = "particles.csv", column = "asymmetry" } }
density = { grid = "aerosol.zarr" }
"#;
/// Matter that absorbs only: a column of `gases.csv`, and its grid.
fn absorber(column: &str, name: &str) -> String {
    format!(
        "\n[[media.air.components]]\nabsorption = {{ file = \"gases.csv\", column = \"{column} (1/km)\" }}\ndensity = {{ grid = \"{name}.zarr\" }}\n"
    )
}

/// A grid [z, 1, 1] of f32, the lowest layer empty: it is below the ground.
fn write_column(path: &Path, shares: &[f64; LAYERS]) -> std::io::Result<()> {
    let layers = LAYERS + 1;
    fs::create_dir_all(path.join("c/0/0"))?;
    let metadata = json!({
        "zarr_format": 3, "node_type": "array", "shape": [layers, 1, 1], "data_type": "float32",
        "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": [layers, 1, 1] } },
        "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
        "fill_value": 0.0, "codecs": [{ "name": "bytes", "configuration": { "endian": "little" } }],
        "dimension_names": ["z", "y", "x"],
        "attributes": { "long_name": "share of the whole column in each kilometre of height, from -1 km" },
    });
    fs::write(path.join("zarr.json"), serde_json::to_vec_pretty(&metadata)?)?;
    let values = std::iter::once(0.0).chain(shares.iter().copied());
    fs::write(path.join("c/0/0/0"), values.flat_map(|share| (share as f32).to_le_bytes()).collect::<Vec<_>>())
}
