//! Light that matter scatters, of the one channel that a path has in such scenes.

use glam::DVec3;

use super::bsdf::SpectralValues;
use super::gas::Piece;
use super::path::{Path, Tracer};
use super::phase;
use super::primitive::Ray;
use super::rng::Rng;

/// What becomes of a path between two surfaces.
pub enum Flight {
    /// It comes to the next.
    Passed,
    /// Matter scatters it, into this ray with this density by solid angle.
    Scattered {
        next: Ray,
        density: f64,
    },
    Ended,
}

impl Tracer<'_> {
    /// How far the one channel that is alive goes through `pieces` until it is scattered, and where to then: what is
    /// scattered weighs the same wherever it goes, what is absorbed is taken from the throughput.
    pub(super) fn scatter(
        &self,
        pieces: &[Piece],
        direction: DVec3,
        event: u32,
        rng: &mut Rng,
        path: &mut Path,
    ) -> Flight {
        let integrator = &self.scene.integrator;
        let k = path.alive.start;
        let mut left = -(1.0 - rng.uniform()).ln();
        let before = path.throughput[k];
        let Path { spectra, throughput, .. } = &mut *path;
        let fly = |piece| Some((piece, Piece::fly(piece, spectra, k, &mut left, &mut throughput[k])?));
        let Some((piece, (position, cell))) = pieces.iter().find_map(fly) else { return Flight::Passed };
        let strengths: Vec<_> = piece.strengths(&path.spectra, k, &cell).map(|(s, phase)| (s, phase.clone())).collect();
        let all: f64 = strengths.iter().map(|(strength, _)| strength).sum();
        let density = |spectra: &SpectralValues, to: DVec3| -> f64 {
            strengths.iter().map(|(s, p)| s / all * phase::density(p, spectra, k, direction, to)).sum()
        };
        if let Some(aim) = self.aim(position, rng) {
            self.look_up(&aim.emitted, path);
            if let Some(pieces) = self.way_to(position, piece.around.clone(), &aim, rng) {
                let Path { spectra, throughput, alive, radiance, emitted, .. } = &mut *path;
                pieces.iter().for_each(|piece| piece.pass(spectra, alive.clone(), emitted, None));
                let scattered = density(spectra, aim.direction);
                let weight = aim.density.map_or(1.0, |density| 1.0 / (density + scattered));
                radiance[k] += throughput[k] * scattered * emitted[k] * weight;
            }
        }
        if integrator.russian_roulette_start > 0 && event + 1 >= integrator.russian_roulette_start {
            let survival = (path.throughput[k] / before).clamp(0.05, 1.0);
            if rng.uniform() >= survival {
                return Flight::Ended;
            }
            path.throughput[k] /= survival;
        }
        let mut chosen = all * rng.uniform();
        let kind = strengths.iter().find(|(strength, _)| {
            chosen -= strength;
            chosen < 0.0
        });
        let Some((_, pattern)) = kind.or(strengths.last()) else { return Flight::Ended };
        let to = phase::sample(pattern, &path.spectra, k, direction, rng);
        path.interiors.clone_from(&piece.around);
        Flight::Scattered { next: Ray { origin: position, direction: to }, density: density(&path.spectra, to) }
    }
}
