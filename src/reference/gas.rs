//! Matter along a segment: for each channel, cell by cell, what it emits towards the start, what it lets through, and where it scatters.

use glam::{DAffine3, DVec3};

use super::bsdf::SpectralValues;
use crate::scene::{Component, Field, Interior, Medium, Phase, Scene, SpectrumId};
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
    /// The interiors that it is in, the innermost last.
    pub around: Vec<Interior>,
}

/// Part of a piece in which nothing changes.
pub struct Cell {
    /// Metres.
    length: f64,
    kelvin: Option<f64>,
    /// Of each kind of matter.
    densities: Vec<f64>,
}

/// The spectra of all media.
pub fn spectra(scene: &Scene) -> Vec<SpectrumId> {
    let of_scattering = |component: &Component| {
        let scattering = component.scattering.as_ref();
        let asymmetry = match scattering.map(|scattering| &scattering.phase) {
            Some(Phase::HenyeyGreenstein(g)) => Some(*g),
            _ => None,
        };
        scattering.map(|scattering| scattering.coefficient).into_iter().chain(asymmetry)
    };
    let components = || scene.media.iter().flat_map(|medium| &medium.components);
    scene.media.iter().flat_map(|medium| medium.absorption()).chain(components().flat_map(of_scattering)).collect()
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
                let absorbed = self.absorption(spectra, k, &cell);
                let lost = absorbed + self.scattering(spectra, k, &cell);
                let depth = cell.length * lost;
                if let (Some(radiance), Some(kelvin)) = (&mut radiance, cell.kelvin) {
                    let index =
                        |&(eta, mean): &(SpectrumId, Option<f64>)| mean.unwrap_or_else(|| spectra.value(eta, k));
                    let squares: f64 = self.indices.iter().map(|i| index(i).powi(2)).product();
                    let source = squares * planck::radiance(spectra.wavelength(k), kelvin);
                    let share = if lost > 0.0 { absorbed / lost } else { 0.0 };
                    radiance[k] += throughput[k] * source * share * -(-depth).exp_m1();
                }
                throughput[k] *= (-depth).exp();
            }
        }
    }

    /// m⁻¹.
    fn absorption(&self, spectra: &SpectralValues, k: usize, cell: &Cell) -> f64 {
        let kelvin = cell.kelvin;
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
        let of = |(component, density): (&Component, &f64)| density * component.absorbers.iter().map(term).sum::<f64>();
        self.medium.components.iter().zip(&cell.densities).map(of).sum()
    }

    /// m⁻¹.
    fn scattering(&self, spectra: &SpectralValues, k: usize, cell: &Cell) -> f64 {
        self.strengths(spectra, k, cell).map(|(strength, _)| strength).sum()
    }

    /// What each kind of matter that scatters does, m⁻¹, and where to.
    pub fn strengths<'s>(
        &'s self,
        spectra: &'s SpectralValues,
        k: usize,
        cell: &'s Cell,
    ) -> impl Iterator<Item = (f64, &'s Phase)> {
        let of = move |(component, density): (&'s Component, &'s f64)| {
            let scattering = component.scattering.as_ref()?;
            Some((density * spectra.value(scattering.coefficient, k), &scattering.phase))
        };
        self.medium.components.iter().zip(&cell.densities).filter_map(of)
    }

    /// Goes on through the piece until the depth of scattering that is `left` in channel `k` is used up, and takes from
    /// `throughput` what is absorbed on the way: where that is, and what is there.
    pub fn fly(
        &self,
        spectra: &SpectralValues,
        k: usize,
        left: &mut f64,
        throughput: &mut f64,
    ) -> Option<(DVec3, Cell)> {
        let direction = (self.to - self.from).normalize_or_zero();
        let mut passed = 0.0;
        for cell in self.cells() {
            let scattering = self.scattering(spectra, k, &cell);
            let absorption = self.absorption(spectra, k, &cell);
            if scattering * cell.length > *left {
                let way = *left / scattering;
                *throughput *= (-absorption * way).exp();
                return Some((self.from + (passed + way) * direction, cell));
            }
            *left -= scattering * cell.length;
            *throughput *= (-absorption * cell.length).exp();
            passed += cell.length;
        }
        None
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
        let densities = self.medium.components.iter().map(|component| value(&component.density)).collect();
        Cell { length, kelvin: self.medium.temperature.as_ref().map(value), densities }
    }
}
