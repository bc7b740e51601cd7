//! How optics pass on detail: modulation transfer functions.

use std::f64::consts::PI;

use super::radiometry::Optical;
use crate::scene::{Blur, SensorModel};
use crate::spectral::Channels;

/// How far interpolation between wavelengths may be from a channel's own function, anywhere.
const SAME: f64 = 5e-4;
/// The share of a point's light by which a blur is as wide as it is.
const INSIDE: f64 = 0.99;

/// The optics of a model; pixels have none here.
#[derive(Debug, Clone, Copy)]
pub struct Transfer<'a> {
    blur: &'a Blur,
    f_number: f64,
    /// m.
    pitch: f64,
}

impl<'a> Transfer<'a> {
    /// `None` of optics that do not blur.
    pub fn new(model: &'a SensorModel) -> Option<Transfer<'a>> {
        let transfer = Transfer { blur: &model.optics.blur, f_number: model.optics.f_number, pitch: model.pitch };
        (*transfer.blur != Blur::None).then_some(transfer)
    }

    /// Share of the contrast of a sine wave that is left, at light of `nm`; `frequency` in cycles a metre on the detector. Of a circular
    /// aperture 2/π (acos s - s √(1 - s²)), s = frequency · λN (Goodman, *Introduction to Fourier Optics*).
    pub fn at(&self, nm: f64, frequency: f64) -> f64 {
        match self.blur {
            Blur::None => 1.0,
            Blur::Gaussian(sigma) => (-2.0 * (PI * sigma * self.pitch * frequency).powi(2)).exp(),
            Blur::Diffraction => {
                let s = frequency * nm * 1e-9 * self.f_number;
                if s < 1.0 { 2.0 / PI * (s.acos() - s * (1.0 - s * s).sqrt()) } else { 0.0 }
            }
            Blur::Measured(table) => {
                let (at, x, y) = (1e-3 * frequency, &table.cycles_per_mm, &table.values);
                let i = x.partition_point(|x| *x <= at);
                if i == x.len() {
                    // The last value itself; beyond it nothing is measured, and nothing asked for (`check`).
                    return if at <= x[i - 1] { y[i - 1] } else { 0.0 };
                }
                y[i - 1] + (at - x[i - 1]) / (x[i] - x[i - 1]) * (y[i] - y[i - 1])
            }
        }
    }

    /// Where it is 0 from, cycles a metre; of a Gaussian where it is 1e-8.
    pub fn end(&self, nm: f64) -> f64 {
        match self.blur {
            Blur::None => f64::INFINITY,
            Blur::Gaussian(sigma) => (8.0 * 10f64.ln() / 2.0).sqrt() / (PI * sigma * self.pitch),
            Blur::Diffraction => 1.0 / (nm * 1e-9 * self.f_number),
            Blur::Measured(table) => 1e3 * table.cycles_per_mm[table.cycles_per_mm.len() - 1],
        }
    }

    /// Says what is wrong with a measured table for frequencies up to `highest`, cycles a metre.
    pub fn check(&self, highest: f64) -> Result<(), String> {
        let Blur::Measured(table) = self.blur else { return Ok(()) };
        let last = table.cycles_per_mm.len() - 1;
        let (end, value, needed) = (table.cycles_per_mm[last], table.values[last], 1e-3 * highest);
        // As it is written, to rounding.
        if value == 0.0 || end >= needed * (1.0 - 1e-6) {
            return Ok(());
        }
        Err(format!(
            "optics.mtf ends at {end} cycles/mm with {value}, and the cube's pixels hold waves of up to {needed:.1} cycles/mm (along \
             diagonals): go on to there, or to 0"
        ))
    }

    /// Radius, m, of the circle around a point's image that holds 99 % of its light, at `nm`: from there on. The light within r is
    /// 2πr ∫ MTF(ν) J₁(2πrν) dν.
    pub fn radius(&self, nm: f64) -> f64 {
        const POINTS: u32 = 4000;
        let end = self.end(nm);
        if !end.is_finite() {
            return 0.0;
        }
        let step = end / f64::from(POINTS);
        // The midpoint rule: waves of J₁ have hundreds of points each.
        let table: Vec<(f64, f64)> =
            (0..POINTS).map(|i| (f64::from(i) + 0.5) * step).map(|nu| (nu, self.at(nm, nu))).collect();
        let within = |r: f64| -> f64 {
            2.0 * PI * r * step * table.iter().map(|(nu, m)| m * libm::j1(2.0 * PI * r * nu)).sum::<f64>()
        };
        // A tenth of a wave to a hundred of them: an Airy pattern has 99 % within 20.
        let radii = (0..180).map(|i| 0.1 / end * 1.04f64.powi(i));
        radii.rev().find(|r| within(*r) < INSIDE).map_or(0.1 / end, |r| 1.04 * r)
    }
}

/// A transfer function to be drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferCurve {
    pub name: String,
    /// Cycles/mm on the detector, and the share of contrast that is left.
    pub points: Vec<(f64, f64)>,
    /// Whether others are to be compared with it.
    pub is_guide: bool,
}

/// The transfer functions of every band, at its mean wavelength: of the optics, and with the pixel, sin(πpν)/(πpν) of its pitch p along an
/// axis; those of the pixel and of the highest frequency that it samples beside them.
pub fn curves(model: &SensorModel, bands: &[Optical]) -> Vec<TransferCurve> {
    const POINTS: u32 = 400;
    let transfer = Transfer::new(model);
    let pixel = |nu: f64| {
        let x = PI * model.pitch * nu;
        if x == 0.0 { 1.0 } else { (x.sin() / x).abs() }
    };
    let end = |band: &Optical| transfer.map_or(0.0, |transfer| transfer.end(band.centre));
    // Up to where a pixel's is 0, or the optics' where that is not far beyond.
    let highest = bands.iter().map(end).fold(0.0, f64::max).clamp(1.0 / model.pitch, 2.0 / model.pitch);
    let curve = |name: String, is_guide: bool, of: &dyn Fn(f64) -> f64| {
        let frequency = |i: u32| highest * f64::from(i) / f64::from(POINTS);
        let points = (0..=POINTS).map(frequency).map(|nu| (1e-3 * nu, of(nu))).collect();
        TransferCurve { name, points, is_guide }
    };
    let mut curves = Vec::new();
    for (band, transfer) in bands.iter().filter_map(|band| Some((band, transfer?))) {
        let (name, nm) = (&band.name, band.centre);
        curves.push(curve(format!("{name}, {nm:.0} nm: optics"), false, &|nu| transfer.at(nm, nu)));
        curves.push(curve(format!("{name}: with the pixel"), false, &|nu| transfer.at(nm, nu) * pixel(nu)));
    }
    curves.push(curve("pixel".into(), true, &pixel));
    let nyquist = 0.5e-3 / model.pitch;
    let line = vec![(nyquist, 0.0), (nyquist, 1.0)];
    curves.push(TransferCurve { name: format!("Nyquist frequency, {nyquist:.1}"), points: line, is_guide: true });
    curves
}

/// How the channels of a band are gathered before they are blurred: each between two wavelengths.
#[derive(Debug, Clone)]
pub struct Nodes {
    /// nm.
    pub nm: Vec<f64>,
    /// For each of the band's weights the first of its two nodes, and the share of the second.
    pub places: Vec<(usize, f64)>,
}

impl Nodes {
    /// As few wavelengths as keep every channel's function within [`SAME`], up to `highest` cycles a metre; a channel's function is that of
    /// its centre. All shares of a channel add up to 1, so that no light is lost.
    pub fn new(transfer: Option<Transfer>, band: &Optical, channels: &Channels, highest: f64) -> Nodes {
        let centres: Vec<f64> = band.weights.iter().map(|(k, _)| channels.centre(*k)).collect();
        let one = || Nodes { nm: vec![centres[0]], places: vec![(0, 0.0); centres.len()] };
        let Some(transfer) = transfer.filter(|transfer| *transfer.blur == Blur::Diffraction) else { return one() };
        let mut all = centres.clone();
        all.sort_by(f64::total_cmp);
        all.dedup();
        let (first, last) = (all[0], all[all.len() - 1]);
        let mut count = 2;
        while count < all.len() {
            let ratio = (last / first).powf(1.0 / (count - 1) as f64);
            let nm: Vec<f64> = (0..count).map(|i| first * ratio.powi(i as i32)).collect();
            let nodes = Nodes { places: centres.iter().map(|centre| place(&nm, *centre)).collect(), nm };
            if nodes.error(transfer, &centres, highest) <= SAME {
                return nodes;
            }
            count = count * 3 / 2 + 1;
        }
        // As many as channels: each its own.
        Nodes { places: centres.iter().map(|centre| place(&all, *centre)).collect(), nm: all }
    }

    /// The largest distance from the channels' own functions.
    fn error(&self, transfer: Transfer, centres: &[f64], highest: f64) -> f64 {
        const FREQUENCIES: u32 = 512;
        let each = centres.iter().zip(&self.places).flat_map(|(centre, &(node, share))| {
            let end = transfer.end(*centre).min(highest);
            (1..=FREQUENCIES).map(move |i| {
                let nu = end * f64::from(i) / f64::from(FREQUENCIES);
                let next = (node + 1).min(self.nm.len() - 1);
                let [a, b] = [node, next].map(|node| transfer.at(self.nm[node], nu));
                (a + share * (b - a) - transfer.at(*centre, nu)).abs()
            })
        });
        each.fold(0.0, f64::max)
    }
}

/// Between which of the ascending `nm` a wavelength lies.
fn place(nm: &[f64], at: f64) -> (usize, f64) {
    let i = nm.partition_point(|nm| *nm <= at).clamp(1, nm.len().max(2) - 1);
    if nm.len() < 2 {
        return (0, 0.0);
    }
    let share = ((at - nm[i - 1]) / (nm[i] - nm[i - 1])).clamp(0.0, 1.0);
    if share == 1.0 { (i, 0.0) } else { (i - 1, share) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AIRY: Transfer = Transfer { blur: &Blur::Diffraction, f_number: 2.5, pitch: 15e-6 };

    /// 400 channels from 3 to 5 um are gathered between far fewer wavelengths, all shares of which are shares, and every channel's function is
    /// kept at frequencies that no choice has looked at.
    #[test]
    fn many_channels_share_few_wavelengths() {
        let channels = Channels::equal(3000.0, 5000.0, 400);
        let band = Optical {
            name: "band".into(),
            response: None,
            weights: (0..400).map(|k| (k, 1.0)).collect(),
            background: 0.0,
            black_body: [0.0; 2],
            centre: 4000.0,
        };
        let highest = 0.5 * 2.0f64.sqrt() / AIRY.pitch;
        // Of coarse pixels, whose waves end far before the cut-off, and of fine ones.
        for (highest, most) in [(highest, 40), (10.0 * highest, 80)] {
            let nodes = Nodes::new(Some(AIRY), &band, &channels, highest);
            assert!(nodes.nm.len() < most && nodes.places.len() == 400, "{}", nodes.nm.len());
            let mut worst = 0.0f64;
            for (k, &(node, share)) in nodes.places.iter().enumerate() {
                assert!(
                    (0.0..1.0).contains(&share) && node < nodes.nm.len() && (share == 0.0 || node + 1 < nodes.nm.len())
                );
                for i in 0..977 {
                    let nu = highest * f64::from(i) / 977.0;
                    let second = if share > 0.0 { share * AIRY.at(nodes.nm[node + 1], nu) } else { 0.0 };
                    let found = (1.0 - share) * AIRY.at(nodes.nm[node], nu) + second;
                    worst = worst.max((found - AIRY.at(channels.centre(k), nu)).abs());
                }
            }
            println!("{} wavelengths, off by {worst:e}", nodes.nm.len());
            // Between the frequencies that were looked at a little more.
            assert!(worst < 1.1 * SAME, "{worst}");
        }
        let table = Blur::Gaussian(0.5);
        let one = Nodes::new(Some(Transfer { blur: &table, ..AIRY }), &band, &channels, highest);
        assert_eq!((one.nm.len(), one.places[399]), (1, (0, 0.0)));
    }

    /// Light within r of an Airy pattern: 1 - J₀² - J₁² of πr/λN (Rayleigh 1881). Of a Gaussian 1 - e^(-r²/2σ²).
    #[test]
    fn circles_hold_99_percent() {
        let lambda_n = 4e-6 * 2.5;
        let radius = AIRY.radius(4000.0);
        let within = |r: f64| 1.0 - libm::j0(PI * r / lambda_n).powi(2) - libm::j1(PI * r / lambda_n).powi(2);
        println!("{} λN", radius / lambda_n);
        assert!(within(radius) >= INSIDE - 1e-4 && within(radius / 1.09) < INSIDE, "{radius}");
        let gaussian = Transfer { blur: &Blur::Gaussian(0.7), ..AIRY };
        let expected = 0.7 * 15e-6 * (2.0 * 100f64.ln()).sqrt();
        let radius = gaussian.radius(4000.0);
        assert!(radius >= expected * 0.999 && radius < 1.05 * expected, "{radius} {expected}");
    }
}
