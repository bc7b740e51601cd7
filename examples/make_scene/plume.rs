//! The exhaust of a jet engine on a grid: share of exhaust and temperature of a turbulent round jet.

use std::fs;
use std::io;
use std::path::Path;

use glam::{DVec3, dvec3};
use serde_json::json;

/// Voxels along x, y, z.
const SIZE: [usize; 3] = [160, 40, 40];
/// The box in metres: the nozzle is in the middle of the face x = 0, the jet goes to -x.
pub const LENGTH: f64 = 26.0;
pub const HALF: f64 = 2.0;
/// Radius of the nozzle, m.
const NOZZLE: f64 = 0.44;
/// K, of the exhaust and the air.
const EXHAUST: f64 = 790.0;
const AIR: f64 = 288.2;
/// What the air itself has of CO2 (420 ppm), as a share of the exhaust's (3.5 %).
const BACKGROUND: f64 = 0.012;

/// The share of exhaust at `back` m behind the nozzle and `r` m from the axis: a core that mixing has used up after six
/// diameters, then a profile of Gaussian form whose half width grows by 0.094 m a metre and whose peak falls with
/// distance (Pope, *Turbulent Flows* (2000), section 5.1).
fn share(back: f64, r: f64) -> f64 {
    let core = 12.0 * NOZZLE;
    let half = 0.094 * back + 0.05;
    if back < core {
        let edge = NOZZLE * (1.0 - back / core);
        return (-std::f64::consts::LN_2 * ((r - edge).max(0.0) / half).powi(2)).exp();
    }
    core / back * (-std::f64::consts::LN_2 * (r / half).powi(2)).exp()
}

/// Writes `density.zarr` (relative to pure exhaust) and `temperature.zarr` (K).
pub fn write(folder: &Path) -> io::Result<()> {
    let [nx, ny, nz] = SIZE;
    let (mut density, mut temperature) = (Vec::new(), Vec::new());
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                let centre = |k: usize, n: usize| (k as f64 + 0.5) / n as f64;
                let back = LENGTH * (1.0 - centre(x, nx));
                let across = |t: f64| HALF * (2.0 * t - 1.0);
                let p = dvec3(back, across(centre(y, ny)), across(centre(z, nz)));
                // Eddies: they fold the edge and grow with the jet.
                let size = 0.25 + 0.11 * back;
                let eddies = noise(p / size) + 0.5 * noise(p / size * 2.1 + dvec3(7.3, 1.9, 4.1));
                let r = p.y.hypot(p.z) * (1.0 + 0.55 * eddies * (back / (back + 1.5)));
                let fade = ((LENGTH - back) / 4.0).min(1.0) * ((HALF - p.y.hypot(p.z)) / 0.3).clamp(0.0, 1.0);
                let share = share(back, r) * fade;
                density.push((share + BACKGROUND * (1.0 - share)) as f32);
                temperature.push((AIR + share * (EXHAUST - AIR)) as f32);
            }
        }
    }
    write_array(&folder.join("density.zarr"), SIZE, &density)?;
    write_array(&folder.join("temperature.zarr"), SIZE, &temperature)
}

/// A Zarr v3 array [z, y, x] of f32 in one chunk.
pub fn write_array(path: &Path, [nx, ny, nz]: [usize; 3], values: &[f32]) -> io::Result<()> {
    fs::create_dir_all(path.join("c/0/0"))?;
    let metadata = json!({
        "zarr_format": 3, "node_type": "array", "shape": [nz, ny, nx], "data_type": "float32",
        "chunk_grid": { "name": "regular", "configuration": { "chunk_shape": [nz, ny, nx] } },
        "chunk_key_encoding": { "name": "default", "configuration": { "separator": "/" } },
        "fill_value": 0.0, "codecs": [{ "name": "bytes", "configuration": { "endian": "little" } }],
        "dimension_names": ["z", "y", "x"], "attributes": {},
    });
    fs::write(path.join("zarr.json"), serde_json::to_vec_pretty(&metadata)?)?;
    fs::write(path.join("c/0/0/0"), values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>())?;
    println!("{}: {nz} x {ny} x {nx} voxels", path.display());
    Ok(())
}

/// Smooth noise between about -1 and 1: random numbers on the whole numbers, in between by smoothsteps.
pub fn noise(p: DVec3) -> f64 {
    let cell = p.floor();
    let f = p - cell;
    let s = f * f * (3.0 - 2.0 * f);
    let value = |dx: i64, dy: i64, dz: i64| {
        let hash = [cell.x as i64 + dx, cell.y as i64 + dy, cell.z as i64 + dz].iter().fold(0x51_7c_c1u64, |h, k| {
            let h = (h ^ *k as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            h ^ (h >> 29)
        });
        (hash.wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let mix = |a: f64, b: f64, t: f64| a + t * (b - a);
    let edge = |dy: i64, dz: i64| mix(value(0, dy, dz), value(1, dy, dz), s.x);
    mix(mix(edge(0, 0), edge(1, 0), s.y), mix(edge(0, 1), edge(1, 1), s.y), s.z)
}
