//! What a render will need, before anything starts: features used and left out, tiles, waves, memory, disk.

use serde_json::{Map, Value, json};

use crate::cube::{self, BLOCK, Header};
use crate::files::format_bytes;
use crate::gpu::upload;
use crate::device::prepared::{Features, Prepared};
use crate::render::wave::{Budget, DeviceLimits, WavePlan};
use crate::scene::{Evaluator, Scene};
use crate::{Error, Result};

/// Side of a tile where nothing says otherwise, in pixels.
const DEFAULT_TILE: u32 = 64;
/// A tile with all its channels stays below this, so that a few fit into any device and any host.
const MAX_DEFAULT_TILE_BYTES: u64 = 64 << 20;

/// The attribute of a cube that names its evaluator.
const EVALUATOR: &str = "evaluator";

/// Width and height of the tiles: from the number of channels, the film and `--tile` alone, never from the device.
pub fn tile_size(scene: &Scene, asked: Option<u32>) -> [u32; 2] {
    let [width, height] = scene.film.cube_size();
    let mut side = asked.unwrap_or(DEFAULT_TILE);
    let bytes = |side: u32| u64::from(side.min(width)) * u64::from(side.min(height)) * scene.channels.len() as u64 * 4;
    while asked.is_none() && side > BLOCK && bytes(side) > MAX_DEFAULT_TILE_BYTES {
        side /= 2;
    }
    [side.min(width), side.min(height)]
}

/// The header of the cube that rendering `scene` makes, but for [`record_evaluator`].
pub fn header(scene: &Scene, tile: [u32; 2], seed: u64, uncertainty: bool) -> Header {
    let integrator = serde_json::to_value(&scene.integrator).expect("plain values");
    let mut attributes = Map::new();
    attributes.insert("scene_digest".into(), json!(scene.digest));
    attributes.insert("seed".into(), json!(seed));
    attributes.insert(
        "settings".into(),
        json!({
            "film": { "width": scene.film.width, "height": scene.film.height, "crop": scene.film.crop, "filter": scene.film.filter },
            "integrator": integrator,
        }),
    );
    let header = Header {
        size: scene.film.cube_size(),
        origin: [scene.film.crop[0], scene.film.crop[1]],
        tile,
        channels: scene.channels.clone(),
        epoch: scene.integrator.epoch,
        attributes,
    };
    if uncertainty { header.with_uncertainty() } else { header }
}

/// The evaluator for `scene` on a software device or a GPU; or the one with which the cube was begun that `there` describes, since
/// what `auto` stands for depends on who begins.
pub fn evaluator(scene: &Scene, there: Option<&Header>, software: bool) -> Result<Evaluator> {
    let Some(recorded) = there.and_then(|header| header.attributes.get(EVALUATOR)) else {
        return Ok(scene.integrator.evaluator.on(software, scene.channels.len()));
    };
    recorded.as_str().and_then(Evaluator::named).ok_or_else(|| {
        Error::Usage(format!("the cube was begun with the evaluator {recorded}, which this version does not have"))
    })
}

/// Writes down that a cube is begun with `evaluator`.
pub fn record_evaluator(header: &mut Header, evaluator: Evaluator) {
    header.attributes.insert(EVALUATOR.into(), json!(evaluator.name()));
}

/// One part of the renderer, and whether this scene needs it.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureLine {
    pub name: &'static str,
    pub used: bool,
    /// What leaving it out saves, or what it costs.
    pub effect: String,
}

/// Every optional part, used or left out.
pub fn feature_lines(prepared: &Prepared, waves: &WavePlan) -> Vec<FeatureLine> {
    let f: &Features = &prepared.features;
    let module = |m: crate::device::text::Module| format!("{} lines of shader", m.text.lines().count());
    let bounces = prepared.frame.max_bounces + 1;
    let line = |name, used, effect: String| FeatureLine { name, used, effect };
    use crate::device::text as s;
    vec![
        line("area lights", f.emitters, format!("{bounces} records of {} bytes a path", prepared.record_bytes())),
        line("environment", f.environment, "one light to choose from".into()),
        line(
            "BVH",
            !f.few_triangles,
            match f.few_triangles {
                true => format!(
                    "every ray tests all {} triangles, constants of its kernel",
                    prepared.accel.primitives.len()
                ),
                false => format!("{} nodes, a stack of {} a ray", prepared.accel.nodes.len(), prepared.accel.depth),
            },
        ),
        line("spheres, disks, cylinders", f.shapes, format!("{}, a test per primitive", module(s::SHAPES))),
        line(
            "next-event estimation",
            f.emitters || f.environment || f.general.is_some_and(|g| g.lamps || g.map.is_some()),
            format!("{}, a shadow ray a bounce", module(s::LIGHT)),
        ),
        line("thin lens", f.thin_lens, "a pair of random numbers a path".into()),
        line("orthographic camera", f.orthographic, "its own camera rays".into()),
        line("Gaussian filter", f.gaussian, "an inverse error function a path".into()),
        line("Russian roulette", f.roulette, "4 bytes a path, a load and a store a bounce".into()),
        line("Owen-scrambled Sobol", !f.independent, "nets in every epoch instead of independent numbers".into()),
        line("wavelength strata", f.strata, format!("tables x {}", 1u64 << prepared.tables.stratum_bits)),
        line(
            "wavelengths by emission",
            prepared.warp.bits() > 0,
            format!("drawn from {} strata a channel, a weight a path and channel", 1u64 << prepared.warp.bits()),
        ),
        line(
            "responses",
            prepared.integration.is_some(),
            match &prepared.integration {
                Some(integration) => format!("{} strata of wavelength", integration.inner.len()),
                None => "weights of wavelengths, and sums of channels".into(),
            },
        ),
        line("exact spectral knots", f.knots, "a search per lookup and channel".into()),
        line(
            "spectra in registers",
            f.registers,
            match (prepared.factors + prepared.sources, prepared.tables.kinks) {
                (spectra, 0) => format!("no table lookups per vertex; {spectra} spectra here"),
                (spectra, kinks) => {
                    format!("no table lookups per vertex; {spectra} spectra, up to {kinks} kinks in a channel")
                }
            },
        ),
        line(
            "materials of several lobes",
            f.general.is_some(),
            format!("records of 16 bytes instead of 8; {}", module(s::BSDF)),
        ),
        line(
            "textures",
            f.general.is_some_and(|g| g.textures),
            format!("{}, a record for each spectrum that a texture mixes", module(s::TEXTURE)),
        ),
        line(
            "texture coordinates and normals",
            f.general.is_some_and(|g| g.attributes),
            format!(
                "{}; {}",
                module(s::ATTRIBUTES),
                format_bytes(size_of_val(prepared.accel.attributes.as_slice()) as u64)
            ),
        ),
        line(
            "point, directional, sun lights",
            f.general.is_some_and(|g| g.lamps),
            format!("{}, 32 bytes a light", module(s::LAMP)),
        ),
        line(
            "environment map",
            f.general.is_some_and(|g| g.map.is_some()),
            format!("{}, two records a bounce", module(s::MAP)),
        ),
        line(
            "heat that depends on the angle",
            f.general.is_some_and(|g| g.hot),
            "256 spectra for each hot material that is not diffuse".into(),
        ),
        line(
            "media",
            f.general.is_some_and(|g| g.media.is_some()),
            format!("{}, 16 bytes a path, a record for each stretch of a way", module(s::MEDIUM)),
        ),
        line(
            "camera rays that start in different media",
            f.general.is_some_and(|g| g.media.is_some_and(|m| m.camera_is_cut)),
            "a way through the lens or window for each path".into(),
        ),
        line(
            "media of voxels",
            f.general.is_some_and(|g| g.media.is_some_and(|m| m.grids.is_some())),
            "a march through its cells for each stretch and channel".into(),
        ),
        line("dispersion", f.general.is_some_and(|g| g.dispersion), "16 bytes a path".into()),
        line(
            "windowed geometry",
            upload::windows(prepared, waves.limits.binding).is_ok_and(|w| w.nodes.count > 1 || w.primitives.count > 1),
            "a switch per load".into(),
        ),
    ]
}

/// Memory of a render on the host, bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HostMemory {
    /// The flattened scene: BVH, primitives, materials, lights, spectra.
    pub scene: u64,
    /// What a thread holds while it merges: one a software device, up to `pool::MERGE_THREADS` a GPU. The units themselves
    /// are merged from where the device put them, in its two transfers.
    pub merge: u64,
}

/// Adds up what `prepared` and merging into a cube of `header` take.
pub fn host_memory(prepared: &Prepared, header: &Header) -> HostMemory {
    let accel = &prepared.accel;
    let scene = size_of_val(accel.nodes.as_slice())
        + size_of_val(accel.primitives.as_slice())
        + size_of_val(accel.attributes.as_slice())
        + size_of_val(prepared.materials.as_slice())
        + prepared.surfaces.as_ref().map_or(0, |s| {
            let textures =
                s.textures.as_ref().map_or(0, |t| size_of_val(t.words.as_slice()) + size_of_val(t.texels.as_slice()));
            textures
                + size_of_val(s.materials.as_slice())
                + size_of_val(s.parts.as_slice())
                + size_of_val(s.tables.as_slice())
        })
        + prepared.sky.as_ref().map_or(0, |s| size_of_val(s.table.as_slice()) + size_of_val(s.texels.as_slice()))
        + size_of_val(prepared.lamps.as_slice())
        + size_of_val(prepared.emitters.as_slice())
        + size_of_val(prepared.picks.cdf.as_slice())
        + size_of_val(prepared.tables.strata.as_slice())
        + size_of_val(prepared.tables.knots.as_slice())
        + size_of_val(prepared.tables.knot_starts.as_slice());
    HostMemory { scene: scene as u64, merge: cube::merge_bytes(header) }
}

/// Waves for a device that is not there: what a GPU of common limits would get.
pub fn waves_without_device(prepared: &Prepared, tile: [u32; 2], budget: Budget) -> Result<WavePlan> {
    let limits = DeviceLimits { binding: 128 << 20, uniform_alignment: 256, software: false };
    WavePlan::new(prepared, tile, limits, budget)
}

/// Refuses what cannot work, before anything is written.
pub fn check(scene: &Scene) -> Result<()> {
    let [width, height] = scene.film.cube_size();
    if width == 0 || height == 0 || scene.channels.is_empty() {
        return Err(Error::input(&scene.file, "there is nothing to render: no pixels or no channels"));
    }
    Ok(())
}

/// The spectra in use, and how exactly their tables hold them.
pub fn table_bounds(prepared: &Prepared) -> Value {
    let each = prepared.spectrum_names.iter().zip(&prepared.tables.bounds).skip(1);
    each.map(|(name, b)| json!({ "name": name, "pointwise": b.pointwise, "mean": b.mean })).collect()
}
