//! Camera rays: pixel filter and projection by importance sampling, so that every sample weighs 1.

use glam::DVec2;

use super::primitive::Ray;
use super::rng::Rng;
use crate::scene::{Camera, Film, Filter, Projection};

/// Standard deviation and cut of the Gaussian filter, pixels per axis.
const SIGMA: f64 = 0.5;
const CUT: f64 = 2.0;

/// A ray through pixel (x, y) of the full film.
pub fn ray(camera: &Camera, film: &Film, [x, y]: [u32; 2], rng: &mut Rng) -> Ray {
    let place = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)
        + DVec2::new(filter_offset(film.filter, rng), filter_offset(film.filter, rng));
    let lens = match camera.projection {
        Projection::ThinLens { .. } => DVec2::from(rng.unit_disk()),
        Projection::Pushbroom { .. } => DVec2::new(2.0 * rng.uniform() - 1.0, 0.0),
        _ => DVec2::ZERO,
    };
    let [origin, direction] = camera.ray(film, place, lens);
    Ray { origin, direction }
}

/// Distance from the pixel's centre along one axis, in pixels.
fn filter_offset(filter: Filter, rng: &mut Rng) -> f64 {
    match filter {
        Filter::Box => rng.uniform() - 0.5,
        Filter::Gaussian => loop {
            let offset = SIGMA * rng.normal();
            if offset.abs() <= CUT {
                return offset;
            }
        },
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    const WIDE: Film = Film { width: 400, height: 200, filter: Filter::Box, crop: [0, 0, 400, 200] };

    fn camera(projection: Projection) -> Camera {
        Camera {
            position: DVec3::new(1.0, 2.0, 3.0),
            forward: DVec3::NEG_Z,
            right: DVec3::X,
            up: DVec3::Y,
            projection,
            distortion: None,
        }
    }

    /// Where a ray crosses the plane one metre in front of the camera, relative to the axis.
    fn at_one_metre(ray: &Ray) -> DVec2 {
        let p = ray.origin + ray.direction * ((2.0 - ray.origin.z) / ray.direction.z);
        DVec2::new(p.x - 1.0, p.y - 2.0)
    }

    /// The top left and bottom right pixels lie at the corners of the field of view, row 0 on top, within one pixel.
    #[test]
    fn pixels_span_the_field_of_view() {
        let mut rng = Rng::from_keys(&[5]);
        let tan_half = DVec2::new(2.0, 1.0);
        let lens = Projection::ThinLens { tan_half, aperture_radius: 0.3, focus_distance: 1.0 };
        for projection in [Projection::Perspective { tan_half }, lens, Projection::Orthographic { half_size: tan_half }]
        {
            for (pixel, corner) in [([0, 0], DVec2::new(-2.0, 1.0)), ([399, 199], DVec2::new(2.0, -1.0))] {
                for _ in 0..100 {
                    let crossing = at_one_metre(&ray(&camera(projection.clone()), &WIDE, pixel, &mut rng));
                    // A pixel measures 0.01 there, and lies towards the axis.
                    let inwards = (corner - crossing) * corner.signum();
                    assert!(inwards.cmpge(DVec2::splat(-1e-12)).all() && inwards.cmple(DVec2::splat(0.01)).all());
                }
            }
        }
    }

    /// Lens rays start evenly on the aperture (mean square radius a²/2) and are all unit vectors.
    #[test]
    fn lens_is_filled() {
        const N: usize = 20_000;
        let mut rng = Rng::from_keys(&[6]);
        let lens = Projection::ThinLens { tan_half: DVec2::ONE, aperture_radius: 0.4, focus_distance: 7.0 };
        let mut sum = 0.0;
        for _ in 0..N {
            let ray = ray(&camera(lens.clone()), &WIDE, [17, 20], &mut rng);
            let radius = ray.origin.distance(DVec3::new(1.0, 2.0, 3.0));
            assert!(radius <= 0.4 && ray.origin.z == 3.0 && (ray.direction.length() - 1.0).abs() < 1e-15);
            sum += radius * radius;
        }
        // r² is uniform on [0, a²]: its deviation is a²/√12.
        let bound = 5.0 * 0.16 / (12.0 * N as f64).sqrt();
        assert!((sum / N as f64 - 0.08).abs() < bound);
    }

    /// The Gaussian filter has the variance of a normal cut at ±4σ, σ²(1 - 8 φ(4) / (2Φ(4) - 1)), and stays in ±2 px.
    #[test]
    fn gaussian_filter_moments() {
        const N: usize = 100_000;
        let mut rng = Rng::from_keys(&[8]);
        let offsets: Vec<f64> = (0..N).map(|_| filter_offset(Filter::Gaussian, &mut rng)).collect();
        assert!(offsets.iter().all(|x| x.abs() <= 2.0));
        let mean = offsets.iter().sum::<f64>() / N as f64;
        let variance = offsets.iter().map(|x| x * x).sum::<f64>() / N as f64;
        let phi = (-8.0f64).exp() / std::f64::consts::TAU.sqrt();
        let expected = 0.25 * (1.0 - 8.0 * phi / 0.999_936_657_516);
        assert!(mean.abs() < 5.0 * 0.5 / (N as f64).sqrt());
        assert!((variance - expected).abs() < 5.0 * 0.25 * (2.0 / N as f64).sqrt(), "{variance} {expected}");
    }
}
