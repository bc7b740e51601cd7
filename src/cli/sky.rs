//! `spectile sky`: a clear sky as an environment map, and the sun behind it.

use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde_json::json;

use super::Output;
use super::progress::Reporter;
use super::render;
use super::scene::{SceneArgs, parse_override, parse_size};
use crate::cube::Cube;
use crate::files::output::{NewFolder, Product};
use crate::files::shown;
use crate::format::unit;
use crate::gpu::adapter::Selection;
use crate::scene::{self, Scene};
use crate::sky::{self, Aerosol, Albedo, Atmosphere, Irradiance, Sun};
use crate::{Error, Result, files};

/// Render a clear sky: an environment map, and the sun behind it
///
/// Makes a cube of the radiance that a clear sky sends to the ground from every direction, W m-2 sr-1 nm-1, anywhere from 380 to 20,000 nm: a
/// map that scenes name as their environment. The sun is not in it. Its own light at the ground goes to OUT-sun.csv, for a light of the scene,
/// and what both send to level ground to OUT-irradiance.csv.
///
/// The atmosphere is plane, 50 layers of a kilometre: the US standard atmosphere, whose molecules scatter by Rayleigh's law, an aerosol of
/// Shettle and Fenn, and absorption by water, ozone and the mixed gases as LOWTRAN7 has it, at a resolution of 20 cm-1 (0.6 nm at 550 nm, 12 nm
/// at 2,500 nm, 200 nm at 10 um). Where channels reach beyond 2,500 nm, and at night, layers and ground also send heat, each by its
/// temperature. It is a scene like any other, rendered like any other: --scene writes it instead. docs/sky.md says what is approximated, and
/// how the result compares with ASTM G173 and DISORT.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile sky --sun-elevation 40 -o sky.zarr
  spectile sky --sun-elevation 40 --sun-azimuth 135 --aerosol 0.2 --water 2 -o sky.zarr --spp 256
  spectile sky --sun-elevation 60 -o sky.zarr --size 120x60 --channels equal.count=80      a quick one
  spectile sky --night -o night.zarr                                    2,500 to 20,000 nm, heat alone
  spectile sky --sun-elevation 40 -o mwir.zarr --channels equal.from=3000 --channels equal.to=5000
  spectile sky --sun-elevation 25 --scene sky                           its scene, to edit and render

In a scene, with the same azimuth and elevation:
  [environment]
  map = \"sky.zarr\"
  up = [0, 0, 1]                    # or [0, 1, 0], as the scene's own up
  [[lights]]
  sun = { azimuth = 135, elevation = 40, up = [0, 0, 1], irradiance = { file = \"sky-sun.csv\" } }")]
#[command(group = clap::ArgGroup::new("product").required(true).args(["output", "scene"]))]
pub struct Args {
    /// The cube to make, a folder
    #[arg(short, long, value_name = "OUT.zarr")]
    pub output: Option<PathBuf>,

    /// Write the scene into this folder, which must not be there, and render nothing
    #[arg(
        long,
        value_name = "FOLDER",
        conflicts_with_all = ["size", "spp", "time", "uncertainty", "seed", "resume", "overwrite", "preview"]
    )]
    pub scene: Option<PathBuf>,

    /// How far the sun is above the horizon, degrees: 5 to 90
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true, required_unless_present = "night")]
    pub sun_elevation: Option<f64>,

    /// No sun: what air and ground send as heat
    #[arg(long, conflicts_with_all = ["sun_elevation", "sun_azimuth"])]
    pub night: bool,

    /// Where the sun stands, degrees from north over east
    ///
    /// North is the middle of the map, in scenes whose up is +z the direction +y, in those with +y up -z: as a `sun` has it.
    #[arg(long, value_name = "DEGREES", default_value_t = 180.0, allow_hyphen_values = true)]
    pub sun_azimuth: f64,

    /// Vertical optical depth of the aerosol at 550 nm; about 0.05 in very clear air, 0.3 in hazy air
    #[arg(long, value_name = "DEPTH", default_value_t = 0.1, allow_hyphen_values = true)]
    pub aerosol: f64,

    /// Kind of the aerosol: rural, urban, maritime or tropospheric (Shettle and Fenn 1979, 70 % of relative humidity)
    #[arg(long, value_name = "KIND", default_value = "rural", value_parser = parse_aerosol)]
    pub aerosol_type: Aerosol,

    /// Height in which the aerosol falls to 1/e, km
    #[arg(long, value_name = "KM", default_value_t = 1.5, allow_hyphen_values = true)]
    pub aerosol_height: f64,

    /// Ozone above the ground, Dobson units
    #[arg(long, value_name = "DU", default_value_t = sky::STANDARD_OZONE, allow_hyphen_values = true)]
    pub ozone: f64,

    /// Water vapour above the ground, cm of liquid water
    #[arg(long, value_name = "CM", default_value_t = sky::STANDARD_WATER, allow_hyphen_values = true)]
    pub water: f64,

    /// What the ground around reflects: a number, or the file of a spectrum; else 0.2 to 2,500 nm, falling to 0.03 at 4,500 nm
    ///
    /// The rest is its emissivity.
    #[arg(long, value_name = "NUMBER|FILE", allow_hyphen_values = true)]
    pub albedo: Option<String>,

    /// Temperature of the ground around, a number of kelvins or with a unit, such as "20 C"; else that of the air on it, 288.2 K
    #[arg(long, value_name = "KELVIN", value_parser = parse_kelvin, allow_hyphen_values = true)]
    pub ground_temperature: Option<f64>,

    /// Keys of [channels], such as equal.count=400 (repeatable); else 200 equal ones from 380 to 2,500 nm, at night from 2,500 to 20,000 nm
    #[arg(long, value_name = "KEY=VALUE", value_parser = parse_override)]
    pub channels: Vec<(String, String)>,

    /// Size of the map in pixels, twice as wide as high; else 360x180: a pixel a degree
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Stop after this many samples per pixel; else after 16, which leave noise of 25 % in a pixel at 430 nm, 10 % from 700 nm on; at night 4
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: Option<u32>,

    /// Stop after this time, e.g. 90s or 10m
    #[arg(long, value_name = "TIME", value_parser = render::parse_time)]
    pub time: Option<Duration>,

    /// Store the standard error of every pixel and channel too (512 samples per pixel without --spp)
    #[arg(long)]
    pub uncertainty: bool,

    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,

    /// Go on with OUT.zarr, which the same command has begun
    #[arg(long, conflicts_with = "overwrite")]
    pub resume: bool,

    /// Replace OUT.zarr and the tables beside it if they exist
    #[arg(long)]
    pub overwrite: bool,

    /// Devices to render on, as in `spectile render`
    #[arg(long, value_name = "all|N|LIST", default_value = "all")]
    pub devices: Selection,

    /// Memory to use on each device, as in `spectile render`
    #[arg(long, value_name = "SIZE", value_parser = files::parse_bytes)]
    pub memory: Option<u64>,

    /// Keep a picture of the sky as it grows (PNG)
    #[arg(long, value_name = "FILE.png")]
    pub preview: Option<PathBuf>,

    /// One JSON object a line on stdout, instead of text
    #[arg(long)]
    pub json: bool,

    /// No progress; only warnings and errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// The first lines of the tables beside the map.
const SUN_MARK: &str = "# Spectile: sunlight at the ground, behind a clear sky";
const IRRADIANCE_MARK: &str = "# Spectile: irradiance at the ground under a clear sky, means over channels";

const SUN: Product = Product {
    name: "a table of sunlight by `spectile sky`",
    extensions: &["csv"],
    is_stream: false,
    is_folder: false,
    check: |path| begins_with(path, SUN_MARK),
};
const IRRADIANCE: Product = Product {
    name: "a table of irradiance by `spectile sky`",
    extensions: &["csv"],
    is_stream: false,
    is_folder: false,
    check: |path| begins_with(path, IRRADIANCE_MARK),
};

fn begins_with(path: &Path, mark: &str) -> std::result::Result<(), String> {
    let mut line = String::new();
    let read = File::open(path).and_then(|file| BufReader::new(file).read_line(&mut line));
    read.map_err(|error| format!("cannot be read as text ({error})"))?;
    if line.trim_end() == mark { Ok(()) } else { Err("begins otherwise".into()) }
}

pub fn run(args: &Args, output: &Output) -> Result<()> {
    let atmosphere = atmosphere(args)?;
    let tables = match &args.output {
        Some(cube) => Some(Tables::beside(cube, args.resume || args.overwrite)?),
        None => None,
    };
    let temporary = Temporary::create()?;
    let cube = args.output.as_deref().unwrap_or(&temporary.0);
    let render_args = render_args(args, cube, &temporary.0);
    let (mut scene, parts) = made(&atmosphere, &render_args, &temporary.0)?;
    if args.ground_temperature.is_some() && !parts.have_heat() {
        return Err(Error::Usage(format!(
            "--ground-temperature: no channel reaches beyond {} nm, so that heat is left out; leave it out too, or ask for such channels",
            sky::SUNNY
        )));
    }
    let Some(tables) = tables else {
        for warning in atmosphere.warnings() {
            output.warn(&warning)?;
        }
        let folder = args.scene.as_deref().expect("one of the two is given");
        sky::FOLDER.new_target(folder)?;
        let new = NewFolder::create(folder, sky::FOLDER)?;
        let of_channels = |(key, _): &&(String, String)| key.starts_with("channels.");
        let overrides: Vec<_> = render_args.scene.overrides.iter().filter(of_channels).cloned().collect();
        atmosphere.write_scene(new.aside(), parts, &scene::written(&channels(&atmosphere), &overrides)?)?;
        new.finish()?;
        output.event("done", json!({ "output": shown(folder) }))?;
        return output.text(&format!("{0}: render {0}/scene.toml\n", folder.display()));
    };
    render::check(&render_args)?;
    scene.warnings.extend(atmosphere.warnings());
    let mut totals = None;
    render::render(&render_args, scene, output, |reporter: &Reporter| {
        let cube = Cube::open(cube)?;
        let found = Irradiance::of(&atmosphere, parts, &cube)?;
        let sun = atmosphere.sun.map(|_| &tables.sun);
        if let Some(sun) = sun {
            SUN.write(sun, atmosphere.direct_csv(parts, SUN_MARK).as_bytes())?;
        }
        IRRADIANCE.write(&tables.irradiance, found.csv(IRRADIANCE_MARK).as_bytes())?;
        let [normal, direct, diffuse] =
            [&found.direct_normal, &found.direct, &found.diffuse].map(|spectrum| found.total(spectrum));
        totals = Some([normal, direct, diffuse]);
        reporter.emit(
            "irradiance",
            json!({
                "direct_normal": normal, "direct_horizontal": direct, "diffuse_horizontal": diffuse,
                "global_horizontal": direct + diffuse, "sun": sun.map(|sun| shown(sun)), "table": shown(&tables.irradiance),
            }),
        )
    })?;
    let Some([normal, direct, diffuse]) = totals.filter(|_| !args.quiet) else { return Ok(()) };
    let of_sun = match args.night {
        true => format!("irradiance in these channels, W/m2: sky {diffuse:.1}\n"),
        false => format!(
            "irradiance in these channels, W/m2: sun {normal:.1} facing it, {direct:.1} on level ground; sky {diffuse:.1}; together {:.1}\n\
             {}: the sun, for a light\n",
            direct + diffuse,
            tables.sun.display()
        ),
    };
    output.text(&format!("{of_sun}{}: all of it by channel\n", tables.irradiance.display()))
}

/// The scene in `folder`, checked, with the tables of matter that its channels need.
fn made(atmosphere: &Atmosphere, args: &render::Args, folder: &Path) -> Result<(Scene, sky::Parts)> {
    // The channels decide what is needed, and are known once there is a scene.
    let needed = |scene: &Scene| sky::Parts::of(atmosphere, scene.channels.hull().unwrap_or(sky::RANGE));
    let all = sky::Parts::of(atmosphere, sky::RANGE);
    atmosphere.write_scene(folder, all, &channels(atmosphere))?;
    let first = args.scene.load()?;
    check_channels(&first)?;
    let parts = needed(&first);
    if parts == all {
        return Ok((first, parts));
    }
    atmosphere.write_scene(folder, parts, &channels(atmosphere))?;
    Ok((args.scene.load()?, parts))
}

/// The section where nothing else is asked for.
fn channels(atmosphere: &Atmosphere) -> String {
    let [from, to] = if atmosphere.sun.is_some() { [sky::RANGE[0], sky::SUNNY] } else { [sky::SUNNY, sky::RANGE[1]] };
    format!("[channels]\nequal = {{ from = {from:?}, to = {to:?}, count = 200 }}\n")
}

fn atmosphere(args: &Args) -> Result<Atmosphere> {
    let albedo = match args.albedo.as_deref().map(|albedo| (albedo, albedo.parse::<f64>())) {
        None => Albedo::Land,
        Some((_, Ok(albedo))) => Albedo::Constant(albedo),
        // The scene lies elsewhere.
        Some((file, Err(_))) => Albedo::File(fs::canonicalize(file).map_err(|error| {
            Error::Usage(format!("--albedo {file}: is no number, and no file that can be read ({error})"))
        })?),
    };
    let atmosphere = Atmosphere {
        sun: args.sun_elevation.map(|elevation| Sun { elevation, azimuth: args.sun_azimuth }),
        aerosol: args.aerosol_type,
        aerosol_depth: args.aerosol,
        aerosol_height: args.aerosol_height,
        ozone: args.ozone,
        water: args.water,
        albedo,
        ground_temperature: args.ground_temperature.unwrap_or_else(sky::ground_temperature),
    };
    atmosphere.check()?;
    Ok(atmosphere)
}

/// Refuses what the tables of matter do not cover.
fn check_channels(scene: &Scene) -> Result<()> {
    let Some([from, to]) = scene.channels.hull() else { return Ok(()) };
    let [least, most] = sky::RANGE;
    if to > most {
        return Err(Error::Usage(format!("--channels reach to {to} nm; what is known of the air ends at {most} nm")));
    }
    if from < least {
        return Err(Error::Usage(format!(
            "--channels begin at {from} nm; what is known of the air begins at {least} nm"
        )));
    }
    let [width, height] = [scene.film.width, scene.film.height];
    if width != 2 * height {
        return Err(Error::Usage(format!(
            "--size {width}x{height}: a map of all directions is twice as wide as high, such as {}x{height}",
            2 * height
        )));
    }
    Ok(())
}

fn render_args(args: &Args, cube: &Path, folder: &Path) -> render::Args {
    let overrides = args.channels.iter().map(|(key, value)| {
        // A file is looked for from where the command was given.
        let is_file = key == "responses";
        let whole = is_file.then(|| fs::canonicalize(value.trim_matches(['"', '\''])).ok()).flatten();
        (format!("channels.{key}"), whole.map_or_else(|| value.clone(), |path| path.display().to_string()))
    });
    let is_bare = args.time.is_none() && !args.uncertainty;
    render::Args {
        output: cube.to_owned(),
        spp: args.spp.or(is_bare.then_some(if args.night { 4 } else { 16 })),
        time: args.time,
        error: None,
        error_per: render::ErrorOf::Image,
        uncertainty: args.uncertainty,
        factored: false,
        layers: Vec::new(),
        seed: args.seed,
        resume: args.resume,
        overwrite: args.overwrite,
        tiles: None,
        scene: SceneArgs {
            scene: folder.join("scene.toml"),
            overrides: overrides.collect(),
            size: args.size,
            tile: None,
            given: None,
        },
        devices: args.devices.clone(),
        memory: args.memory,
        preview: args.preview.clone(),
        exposure: None,
        listen: None,
        public_host: Vec::new(),
        tev: None,
        profile: false,
        json: args.json,
        quiet: args.quiet,
    }
}

/// Where the tables go.
struct Tables {
    sun: PathBuf,
    irradiance: PathBuf,
}

impl Tables {
    /// Beside `cube`, refused early where they may not be written.
    fn beside(cube: &Path, may_be_there: bool) -> Result<Tables> {
        let stem = cube.file_stem().unwrap_or_default().to_owned();
        let named = |what: &str| {
            let mut name = stem.clone();
            name.push(what);
            cube.with_file_name(name)
        };
        let tables = Tables { sun: named("-sun.csv"), irradiance: named("-irradiance.csv") };
        for (product, path) in [(SUN, &tables.sun), (IRRADIANCE, &tables.irradiance)] {
            if may_be_there { product.check_target(path)? } else { product.new_target(path).map(drop)? }
        }
        Ok(tables)
    }
}

/// A folder that goes when its owner does.
struct Temporary(PathBuf);

impl Temporary {
    fn create() -> Result<Temporary> {
        let path = std::env::temp_dir().join(format!("spectile-sky-{}", files::random_suffix()));
        fs::create_dir(&path).map_err(|error| Error::storage(&path, error))?;
        Ok(Temporary(path))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // Nobody needs it any more; if it stays, the system's own cleaning takes it.
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn parse_aerosol(text: &str) -> std::result::Result<Aerosol, String> {
    let names = Aerosol::ALL.map(Aerosol::name).join(", ");
    let found = Aerosol::ALL.into_iter().find(|kind| kind.name() == text);
    found.ok_or_else(|| format!("kinds of aerosol are {names}"))
}

fn parse_kelvin(text: &str) -> std::result::Result<f64, String> {
    let kelvin = text.trim().parse().ok().or_else(|| unit::kelvin(text));
    kelvin.ok_or_else(|| "a temperature is a number of kelvins, or has the unit K, C or F: \"20 C\"".into())
}
