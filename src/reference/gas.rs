//! Gases along a segment: for each channel, cell by cell, what they emit towards the start and what they let through.

use glam::{DAffine3, DVec3};

use super::bsdf::SpectralValues;
use crate::scene::{Field, Medium, Scene, SpectrumId};
use crate::spectral::planck;

/// A straight way through one medium, in the order in which a path goes.
pub struct Piece<'a> {
    pub medium: &'a Medium,
    pub to_grid: DAffine3,
    /// Whether it is the medium outside all interiors.
    pub outer: bool,
    pub from: DVec3,
    pub to: DVec3,
    /// Indices of refraction of the bodies around, and the one that all channels are bent by where it is not their own: in
    /// matter of index n a source is n² B, as radiance there is n² of that in a vacuum.
    pub indices: Vec<(SpectrumId, Option<f64>)>,
}

/// Part of a piece in which nothing changes.
struct Cell {
    /// Metres.
    length: f64,
    kelvin: Option<f64>,
    density: f64,
}

/// The spectra of all media.
pub fn spectra(scene: &Scene) -> Vec<SpectrumId> {
    scene.media.iter().flat_map(|m| &m.absorbers).flat_map(|a| &a.columns).map(|column| column.1).collect()
}

impl Piece<'_> {
    /// Goes through the piece in channels `alive`: adds what it emits to `radiance`, seen through `throughput`, and
    /// takes what it absorbs from that. Its spectra are filled in.
    pub fn pass(
        &self,
        spectra: &SpectralValues,
        alive: std::ops::Range<usize>,
        throughput: &mut [f64],
        mut radiance: Option<&mut [f64]>,
    ) {
        for cell in self.cells() {
            for k in alive.clone() {
                let depth = cell.length * cell.density * self.absorption(spectra, k, cell.kelvin);
                if let (Some(radiance), Some(kelvin)) = (&mut radiance, cell.kelvin) {
                    let index =
                        |&(eta, mean): &(SpectrumId, Option<f64>)| mean.unwrap_or_else(|| spectra.value(eta, k));
                    let squares: f64 = self.indices.iter().map(|i| index(i).powi(2)).product();
                    let source = squares * planck::radiance(spectra.wavelength(k), kelvin);
                    radiance[k] += throughput[k] * source * -(-depth).exp_m1();
                }
                throughput[k] *= (-depth).exp();
            }
        }
    }

    /// m⁻¹ at density 1.
    fn absorption(&self, spectra: &SpectralValues, k: usize, kelvin: Option<f64>) -> f64 {
        let term = |absorber: &crate::scene::Absorber| {
            let columns = &absorber.columns;
            let value = |column: usize| spectra.value(columns[column].1, k);
            let last = columns.len() - 1;
            let table = match kelvin {
                Some(kelvin) if last > 0 && kelvin > columns[0].0 => {
                    let above = columns.partition_point(|column| column.0 < kelvin);
                    if above > last {
                        value(last)
                    } else {
                        let (low, high) = (columns[above - 1].0, columns[above].0);
                        let place = (kelvin - low) / (high - low);
                        (1.0 - place) * value(above - 1) + place * value(above)
                    }
                }
                _ => value(0),
            };
            absorber.strength * table
        };
        self.medium.absorbers.iter().map(term).sum()
    }

    fn cells(&self) -> Vec<Cell> {
        let length = (self.to - self.from).length();
        let Some(size) = self.medium.grid_size() else {
            return vec![self.cell(length, None)];
        };
        // Where the segment meets the planes between voxels, as fractions of it.
        let [a, b] = [self.from, self.to].map(|p| self.to_grid.transform_point3(p) * DVec3::from(size.map(f64::from)));
        let mut cuts = vec![0.0, 1.0];
        for axis in 0..3 {
            let (a, b) = (a[axis], b[axis]);
            if a != b {
                cuts.extend((0..=size[axis]).map(|plane| (f64::from(plane) - a) / (b - a)));
            }
        }
        cuts.retain(|cut| (0.0..=1.0).contains(cut));
        cuts.sort_by(f64::total_cmp);
        let cell = |pair: &[f64]| {
            let middle = a.lerp(b, 0.5 * (pair[0] + pair[1]));
            let voxel: [usize; 3] =
                std::array::from_fn(|axis| (middle[axis].max(0.0) as usize).min(size[axis] as usize - 1));
            let index = voxel[0] + size[0] as usize * (voxel[1] + size[1] as usize * voxel[2]);
            self.cell(length * (pair[1] - pair[0]), Some(index))
        };
        cuts.windows(2).map(cell).collect()
    }

    fn cell(&self, length: f64, voxel: Option<usize>) -> Cell {
        let value = |field: &Field| match field {
            Field::Constant(value) => *value,
            Field::Grid(grid) => f64::from(grid.values[voxel.expect("a medium with a grid has voxels")]),
        };
        Cell { length, kelvin: self.medium.temperature.as_ref().map(value), density: value(&self.medium.density) }
    }
}
