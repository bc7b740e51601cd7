//! What a render will need, before anything starts: features used and left out, tiles, waves, memory, disk.

use serde_json::{Map, json};

use crate::cube::{self, BLOCK, Header, Layer};
use crate::device::evaluator;
use crate::device::facts;
use crate::device::part::OnDevice;
use crate::device::prepared::Prepared;
use crate::device::separable;
use crate::device::windows::Windows;
use crate::render::layers;
use crate::render::wave::{Budget, DeviceLimits, WavePlan};
use crate::scene::{Evaluator, Georeference, Scene};
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

/// The header of the cube that rendering `scene` makes, but for [`record_evaluator`]. Errors: layers that the scene does not have.
pub fn header(scene: &Scene, tile: [u32; 2], seed: u64, uncertainty: bool, layers: &[Layer]) -> Result<Header> {
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
    if let Some(tangent) = scene.camera.pixel_tangent(&scene.film) {
        attributes.insert(cube::PIXEL_TANGENT.into(), json!(tangent));
    }
    if let Some(Georeference { crs, affine: [a, b, c, d, e, f] }) = &scene.georeference {
        // Of the cube, not of the full film.
        let [x, y] = [scene.film.crop[0], scene.film.crop[1]].map(f64::from);
        attributes.insert(cube::CRS.into(), json!(crs));
        attributes.insert(cube::AFFINE.into(), json!([a, b, a * x + b * y + c, d, e, d * x + e * y + f]));
    }
    let header = Header {
        size: scene.film.cube_size(),
        origin: [scene.film.crop[0], scene.film.crop[1]],
        tile,
        channels: scene.channels.clone(),
        epoch: scene.integrator.epoch,
        attributes,
    };
    let header = if uncertainty { header.with_uncertainty() } else { header };
    let header = header.with_layers(&layers::names(scene, layers)?);
    if !scene.is_factored() {
        return Ok(header);
    }
    let separated = separable::of(scene)?;
    let beside = separated.spectra_of_remainder(scene);
    let most_factors = separated.most_factors(scene.integrator.max_bounces);
    Ok(header.with_weights(&separated.basis, most_factors, &separated.remainder, &beside))
}

/// The evaluator for `scene` on a software device or a GPU; or the one with which the cube was begun that `there` describes, since
/// what `auto` stands for depends on who begins.
pub fn evaluator(scene: &Scene, there: Option<&Header>, software: bool) -> Result<Evaluator> {
    let Some(recorded) = there.and_then(|header| header.attributes.get(EVALUATOR)) else {
        return Ok(evaluator::resolve(scene, software));
    };
    if scene.is_factored() {
        return Ok(Evaluator::Factored);
    }
    recorded.as_str().and_then(Evaluator::named).ok_or_else(|| {
        Error::Usage(format!("the cube was begun with the evaluator {recorded}, which this version does not have"))
    })
}

/// Writes down that a cube is begun with `evaluator`.
pub fn record_evaluator(header: &mut Header, evaluator: Evaluator) {
    header.attributes.insert(EVALUATOR.into(), json!(evaluator.name()));
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
    let scene = facts::host_bytes(&OnDevice { prepared, windows: Windows::WHOLE });
    HostMemory { scene, merge: cube::merge_bytes(header) }
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
    if scene.is_factored() { separable::basis(scene).map(drop) } else { Ok(()) }
}
