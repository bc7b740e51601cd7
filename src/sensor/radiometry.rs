//! Optics and detector as one number a channel: what its radiance adds to the signal of a band.

use std::f64::consts::PI;

use crate::scene::{Detector, SensorModel};
use crate::spectral::planck::{self, C2, LIGHT_SPEED, PLANCK};
use crate::spectral::{Channels, Curve, Response};

/// Of a band, by the light that it sees, the channels must cover this much; one of which they do not is left out.
const COVERED: f64 = 0.99;
/// Where an integrand is no polynomial, an interval is cut into at least so many parts of three points each.
const PARTS: usize = 400;

/// One band of a sensor on a cube. A signal is in electrons, or W for a thermal detector.
#[derive(Debug, Clone)]
pub struct Optical {
    pub name: String,
    /// What it responds to; `None`: all that the channels cover.
    pub response: Option<Response>,
    /// (channel, signal per W m⁻² sr⁻¹ nm⁻¹ of it).
    pub weights: Vec<(usize, f64)>,
    /// Signal of the warm optics.
    pub background: f64,
    /// Signal of a black body at the reference temperature that fills the pixel, and its derivative by temperature, per K.
    pub black_body: [f64; 2],
    /// Mean wavelength of the response to a flat spectrum, nm.
    pub centre: f64,
}

impl Optical {
    /// Signal of a spectrally flat radiance, per W m⁻² sr⁻¹ nm⁻¹.
    pub fn sensitivity(&self) -> f64 {
        self.weights.iter().map(|(_, weight)| weight).sum()
    }
}

/// All bands of a sensor on the channels of a cube.
#[derive(Debug, Clone)]
pub struct Bands {
    pub bands: Vec<Optical>,
    /// Those left out, and how much of each the channels cover.
    pub left_out: Vec<(String, f64)>,
}

impl Bands {
    /// On axis: a pixel of area A gets the power π τ L A / (4 N²), N the F-number, from radiance L. Within a channel radiance
    /// is taken as constant, and shared evenly where channels overlap; the product of the curves is integrated exactly.
    pub fn new(model: &SensorModel, channels: &Channels) -> Bands {
        let (sensor, cone) = (Sensor::new(model), PI / (4.0 * model.optics.f_number.powi(2)));
        let hull = channels.hull().unwrap_or([1.0, 2.0]);
        let all = vec![("all".to_owned(), None)];
        let named = model
            .bands
            .as_ref()
            .map_or(all, |bands| bands.iter().map(|(name, response)| (name.clone(), Some(response.clone()))).collect());
        let mut ends = [0, 1].map(|end| channels.bounds.iter().map(|b| b[end]).collect::<Vec<f64>>());
        ends.iter_mut().for_each(|ends| ends.sort_by(f64::total_cmp));
        let (mut bands, mut left_out) = (Vec::new(), Vec::new());
        for (name, response) in named {
            let [from, to] = response.as_ref().map_or(hull, Response::support);
            let curves = sensor.curves(response.as_ref());
            let flat = |nm: f64| sensor.conversion(nm) * product(&curves, nm);
            // How many channels share a wavelength.
            let sharing = |nm: f64| {
                let [lower, upper] = [&ends[0], &ends[1]].map(|ends| ends.partition_point(|&end| end <= nm));
                (lower - upper).max(1) as f64
            };
            let weight = |k: usize| {
                let [a, b] = [channels.bounds[k][0].max(from), channels.bounds[k][1].min(to)];
                let mut knots = knots(&curves, a, b, 1);
                for ends in &ends {
                    let inside = ends.partition_point(|&e| e <= a)..ends.partition_point(|&e| e < b);
                    knots.extend(ends.get(inside).unwrap_or_default());
                }
                integral(knots, |nm| flat(nm) / sharing(nm))
            };
            let overlaps = |k: &usize| channels.bounds[*k][0] < to && channels.bounds[*k][1] > from;
            let inside: Vec<(usize, f64)> =
                (0..channels.len()).filter(overlaps).map(|k| (k, weight(k))).filter(|(_, w)| *w > 0.0).collect();
            let covered = inside.iter().map(|(_, weight)| weight).sum::<f64>() + 0.0;
            let whole = integral(knots(&curves, from, to, 1), flat);
            if !(covered > 0.0 && covered >= COVERED * whole) {
                left_out.push((name, if whole > 0.0 { covered / whole } else { 0.0 }));
                continue;
            }
            let smooth = |f: &dyn Fn(f64) -> f64| integral(knots(&curves, from, to, PARTS), f);
            let kelvin = model.reference_temperature;
            let shine = |nm: f64| flat(nm) * planck::radiance(nm, kelvin);
            // dB/dT = B x / (T (1 - e⁻ˣ)), x = hc / λkT.
            let slope = |nm: f64| {
                let x = C2 / (nm * 1e-9 * kelvin);
                shine(nm) * x / (kelvin * -(-x).exp_m1())
            };
            let warm = model.optics.temperature.map_or(0.0, |kelvin| {
                let solid_angle = model.optics.cold_shield.map_or(PI, |shield| PI / (4.0 * shield * shield));
                // The transmittance is the first of the curves: what warm optics emit has passed none of it.
                let behind = sensor.behind(response.as_ref());
                let emitted = |nm: f64| {
                    let absorbed = 1.0 - model.optics.transmittance.eval(nm);
                    absorbed * planck::radiance(nm, kelvin) * sensor.conversion(nm) * product(&behind, nm)
                };
                solid_angle * sensor.area_time * smooth(&emitted)
            });
            let scale = cone * sensor.area_time;
            let moment = integral(knots(&curves, from, to, 1), |nm| nm * flat(nm));
            bands.push(Optical {
                name,
                weights: inside.into_iter().map(|(k, weight)| (k, scale * weight)).collect(),
                background: warm,
                black_body: [scale * smooth(&shine), scale * smooth(&slope)],
                centre: moment / whole,
                response,
            });
        }
        Bands { bands, left_out }
    }
}

/// What turns power into signal.
struct Sensor<'a> {
    model: &'a SensorModel,
    efficiency: &'a Curve,
    is_photon: bool,
    /// Sensitive area, m², times the exposure where photons are counted, s.
    area_time: f64,
}

impl<'a> Sensor<'a> {
    fn new(model: &'a SensorModel) -> Sensor<'a> {
        let area = model.pitch * model.pitch * model.fill_factor;
        match &model.kind {
            Detector::Photon { quantum_efficiency, integration_time, .. } => {
                Sensor { model, efficiency: quantum_efficiency, is_photon: true, area_time: area * integration_time }
            }
            Detector::Thermal { absorptance, .. } => {
                Sensor { model, efficiency: absorptance, is_photon: false, area_time: area }
            }
        }
    }

    /// Photons a joule, or 1.
    fn conversion(&self, nm: f64) -> f64 {
        if self.is_photon { nm * 1e-9 / (PLANCK * LIGHT_SPEED) } else { 1.0 }
    }

    fn behind(&self, response: Option<&'a Response>) -> Vec<&'a Curve> {
        std::iter::once(self.efficiency).chain(response.map(Response::curve)).collect()
    }

    fn curves(&self, response: Option<&'a Response>) -> Vec<&'a Curve> {
        std::iter::once(&self.model.optics.transmittance).chain(self.behind(response)).collect()
    }
}

fn product(curves: &[&Curve], nm: f64) -> f64 {
    curves.iter().map(|curve| curve.eval(nm)).product()
}

/// Ends of intervals from `a` to `b`, at least `parts`, within which all curves are linear.
fn knots(curves: &[&Curve], a: f64, b: f64, parts: usize) -> Vec<f64> {
    let mut knots: Vec<f64> = (0..=parts).map(|i| a + (b - a) * (i as f64 / parts as f64)).collect();
    for curve in curves {
        if let Curve::Linear { nm, .. } = curve {
            knots.extend(nm.iter().filter(|nm| a < **nm && **nm < b));
        }
    }
    knots
}

/// Of three points an interval (Gauss): exact for polynomials of up to the fifth degree, such as three linear curves and λ.
fn integral(mut knots: Vec<f64>, f: impl Fn(f64) -> f64) -> f64 {
    knots.sort_by(f64::total_cmp);
    let aside = 0.6f64.sqrt();
    let piece = |w: &[f64]| {
        let (middle, half) = (0.5 * (w[0] + w[1]), 0.5 * (w[1] - w[0]));
        if half == 0.0 {
            return 0.0;
        }
        half / 9.0 * (5.0 * f(middle - aside * half) + 8.0 * f(middle) + 5.0 * f(middle + aside * half))
    };
    knots.windows(2).map(piece).sum()
}
