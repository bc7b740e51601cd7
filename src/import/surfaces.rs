//! Surfaces of other renderers by what Spectile has: how much a coat lets through, and metals by their colour.

use glam::DVec3;

use super::picture::{Colour, sampled};
use super::report::{Deviation, Place, Report};
use super::text;
use crate::spectral::Curve;
use crate::spectral::colour::Observer;
use crate::spectral::hemisphere::fresnel::dielectric;

/// Y of a light: 1 where ∫L ȳ dλ = ∫ȳ dλ (CIE 1931).
pub fn luminance(curve: &Curve) -> f64 {
    let observer = &Observer::Cie1931.curves()[1];
    let nm = || (0..=470).map(|i| 360.0 + f64::from(i));
    nm().map(|nm| observer.eval(nm) * curve.eval(nm)).sum::<f64>() / nm().map(|nm| observer.eval(nm)).sum::<f64>()
}

/// What the facets of a coat do with diffuse light, each once, as renderers have it that count no light between facets: some is lost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coat {
    eta: f64,
    /// The shares that are reflected outside, that get in, and that are reflected from inside.
    reflected: f64,
    through: f64,
    inside: f64,
}

impl Coat {
    /// Of GGX's facets of `alpha`; `eta` is the index over that outside. By facets that are seen (Heitz 2018) and Smith's shadows, at even places of
    /// both numbers that choose one.
    pub fn new(eta: f64, alpha: f64) -> Coat {
        let [reflected, through] = Coat::from_a_side(eta, alpha);
        Coat { eta, reflected, through, inside: Coat::from_a_side(1.0 / eta, alpha)[0] }
    }

    /// Of diffuse light from where the other side has an index of `eta`: what is reflected, and what gets to the other side.
    fn from_a_side(eta: f64, alpha: f64) -> [f64; 2] {
        const STEPS: u32 = 24;
        let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(STEPS);
        let shadow = |d: DVec3| {
            let square = (d.z * d.z).max(1e-12);
            0.5 * ((1.0 + alpha * alpha * (1.0 - square) / square).sqrt() - 1.0)
        };
        let mut sum = [0.0; 2];
        for (i, j, k) in (0..STEPS).flat_map(|i| (0..STEPS).flat_map(move |j| (0..STEPS).map(move |k| (i, j, k)))) {
            let cosine = middle(i);
            let o = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            let v = DVec3::new(alpha * o.x, 0.0, o.z).normalize();
            let (r, azimuth) = (middle(j).sqrt(), std::f64::consts::TAU * middle(k));
            let (x, y) = (r * azimuth.cos(), r * azimuth.sin());
            let s = 0.5 * (1.0 + v.z);
            let y = (1.0 - s) * (1.0 - x * x).max(0.0).sqrt() + s * y;
            let z = (1.0 - x * x - y * y).max(0.0).sqrt();
            let n = DVec3::new(-y * v.z + z * v.x, x, y * v.x + z * v.z);
            let h = DVec3::new(alpha * n.x, alpha * n.y, n.z.max(1e-9)).normalize();
            let c = o.dot(h);
            let once = dielectric(c, eta);
            let both = |i: DVec3| (1.0 + shadow(o)) / (1.0 + shadow(o) + shadow(i));
            let mirrored = 2.0 * c * h - o;
            let weight = 2.0 * cosine / f64::from(STEPS * STEPS * STEPS);
            if mirrored.z > 0.0 {
                sum[0] += weight * once * both(mirrored);
            }
            let refracted = -o / eta + (c / eta - (1.0 - (1.0 - c * c) / (eta * eta)).max(0.0).sqrt()) * h;
            if once < 1.0 && refracted.z < 0.0 {
                sum[1] += weight * (1.0 - once) * both(refracted);
            }
        }
        sum
    }

    /// Of diffuse light, what comes out of a coat over a base of reflectance `rho`, where light that a facet hides is lost; `once`: where it is coloured
    /// once, however often it goes to and fro.
    pub fn scattered(&self, rho: f64, once: bool) -> f64 {
        let again = self.inside * if once { 1.0 } else { rho };
        self.through * self.through / (self.eta * self.eta) * rho / (1.0 - again)
    }

    /// The base of Spectile's plastic, which loses nothing, that scatters `wanted` of diffuse light.
    fn base(&self, wanted: f64) -> f64 {
        let through = 1.0 - self.reflected;
        let inside = 1.0 - through / (self.eta * self.eta);
        let a = wanted / (through * (1.0 - inside));
        a / (1.0 + a * inside)
    }

    /// The base of Spectile's plastic that scatters on the whole `wanted` of what a colour is, and what share of that a base that is white
    /// lacks, where it would have to be more.
    pub fn under(&self, colour: &Colour, wanted: impl Fn(f64) -> f64) -> (Colour, f64) {
        let brightest = match colour {
            Colour::Spectrum(curve, _) => curve.max(360.0, 830.0),
            Colour::Texture(texture) => texture.range()[1],
        };
        // All that gets in comes out again.
        let white = 1.0 - self.reflected;
        let lacks = (1.0 - white / wanted(brightest).max(f64::MIN_POSITIVE)).max(0.0);
        (colour.map(|rho| self.base(wanted(rho)).min(1.0)), lacks)
    }
}

/// A metal that reflects `colour` at normal incidence, as n of no absorption: its reflectance grows to 1 at grazing angles as
/// Schlick's does.
pub fn metal(colour: &Curve) -> Curve {
    let index = |f0: f64| {
        let root = f0.clamp(0.0, 0.996).sqrt();
        (1.0 + root) / (1.0 - root)
    };
    match colour {
        Curve::Constant(value) => Curve::Constant(index(*value)),
        curve => sampled(&|nm| index(curve.eval(nm))),
    }
}

/// The index of a coat that reflects `f0` at normal incidence.
pub fn index_of(f0: f64) -> f64 {
    let root = f0.clamp(0.0, 0.99).sqrt();
    (1.0 + root) / (1.0 - root)
}

/// A reflectance and a transmittance, both scaled down where they pass on more light than arrives, which is told.
pub fn within_one(both: [Colour; 2], report: &mut Report, place: Place) -> [Colour; 2] {
    let [reflectance, transmittance] = [both[0].mean(), both[1].mean()];
    let sum = |nm: u32| reflectance.eval(f64::from(nm)) + transmittance.eval(f64::from(nm));
    let most = (360..=830).map(sum).fold(0.0, f64::max);
    if most <= 1.0 {
        return both;
    }
    let off = Deviation::at_most(format!("{} of what is written", text::percent(1.0 - 1.0 / most)));
    report.approximated(
        place,
        format!("a reflectance and a transmittance of {most:.3} in all, both scaled to 1 in all"),
        off,
    );
    // A little below 1, for what writing rounds.
    both.map(|colour| colour.map(|v| v * (1.0 - 1e-6) / most))
}

/// How far off materials are in even light, of those that tests/import/deviations.rs measures, which has these numbers too.
pub const PLASTIC: &str =
    "0.075 of what arrives up to 75 degrees from the normal, 0.025 of what arrives from everywhere";
pub const PRINCIPLED: &str =
    "0.11 of what arrives up to 75 degrees from the normal, 0.033 of what arrives from everywhere";
pub const METALLIC_ROUGHNESS: &str =
    "0.085 of what arrives up to 75 degrees from the normal, 0.02 of what arrives from everywhere";
pub const COATED_DIFFUSE: &str =
    "0.03 of what arrives up to 75 degrees from the normal, 0.017 of what arrives from everywhere";
pub const COATED_CONDUCTOR: &str =
    "0.2 of what arrives up to 75 degrees from the normal, 0.15 of what arrives from everywhere";
const BECKMANN: &str = "0.13 of what arrives up to 75 degrees from the normal, 0.11 of what arrives from everywhere";

/// A pane of index `eta`, in which light goes to and fro: the share that it reflects at normal incidence, which is all that its mirror
/// reflects at other angles; and how far off that is there.
pub fn pane(eta: f64) -> (f64, Deviation) {
    let share = |cosine: f64| {
        let once = dielectric(cosine, eta);
        2.0 * once / (1.0 + once)
    };
    let normal = share(1.0);
    let more = |degrees: f64| text::up(share(degrees.to_radians().cos()) - normal);
    let off = format!(
        "{} of what arrives up to 60 degrees from its normal, {} up to 80 degrees, {} at grazing angles: it reflects too little there and \
         lets too much through",
        more(60.0),
        more(80.0),
        text::up(1.0 - normal)
    );
    (normal, Deviation::at_most(off))
}

/// What GGX's facets have in the place of Beckmann's of the same α: ½∫|e^-t - (1 + t)^-2| dt of the shares of facets over t, the squared slope
/// over α², at every α. The curves meet where e^t = (1 + t)², at t = 2.5129.
pub fn beckmann() -> Deviation {
    let t: f64 = 2.512_862_417;
    let share = 1.0 / (1.0 + t) - (-t).exp();
    Deviation::at_most(format!(
        "{} of what it reflects, which goes to other angles: the peak is the same, the tails are longer; of rough metals besides, as measured, \
         {BECKMANN}",
        text::percent(share)
    ))
}

/// What facets of GGX's α 1 have in the place of those of `alpha` above 1: the curves of shares meet at a squared slope of α.
pub fn too_rough(alpha: f64) -> Deviation {
    let share = (alpha - 1.0) / (alpha + 1.0);
    Deviation::at_most(format!("{} of what it scatters, which goes to other angles", text::percent(share)))
}

/// What facets that are alike in all directions have in the place of GGX's of two α, by half of what the distributions of slopes do not share.
pub fn unbrushed([u, v]: [f64; 2]) -> Deviation {
    const STEPS: u32 = 400;
    // In units of the geometric mean: 1 / (π (1 + (x/r)² + (y r)²)²). Over squared radii q / (1 - q) the even one is uniform in q.
    let r = (u / v).sqrt().max(1e-6);
    let mut sum = 0.0;
    for i in 0..STEPS {
        for j in 0..STEPS {
            let q = (f64::from(i) + 0.5) / f64::from(STEPS);
            let azimuth = std::f64::consts::FRAC_PI_2 * (f64::from(j) + 0.5) / f64::from(STEPS);
            let (square, sine) = (q / (1.0 - q), azimuth.sin().powi(2));
            let other = 1.0 + square * ((1.0 - sine) / (r * r) + sine * r * r);
            sum += (((1.0 + square) / other).powi(2) - 1.0).abs();
        }
    }
    let share = 0.5 * sum / f64::from(STEPS * STEPS);
    Deviation::at_most(format!("{} of what it scatters, which goes to other angles", text::percent(share)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of diffuse light, the share that a boundary reflects from outside, and from inside.
    fn diffuse_fresnel(eta: f64) -> [f64; 2] {
        const STEPS: u32 = 2000;
        let sum: f64 = (0..STEPS)
            .map(|i| {
                let cosine = (f64::from(i) + 0.5) / f64::from(STEPS);
                2.0 * cosine * dielectric(cosine, eta)
            })
            .sum();
        let outside = sum / f64::from(STEPS);
        // What gets in gets out the other way round, over the n² larger cone (Egan and Hilgeman 1973).
        [outside, 1.0 - (1.0 - outside) / (eta * eta)]
    }

    #[test]
    fn coats_let_through_what_is_known() {
        // Published for n = 1.5: 0.0918 and 0.5963 (Egan and Hilgeman; Duntley 1942).
        let [outside, inside] = diffuse_fresnel(1.5);
        assert!((outside - 0.0918).abs() < 2e-4 && (inside - 0.5963).abs() < 2e-4, "{outside} {inside}");
        assert!((dielectric(1.0, 1.5) - 0.04).abs() < 1e-12 && (dielectric(0.0, 1.5) - 1.0).abs() < 1e-12);
        assert!((index_of(0.04) - 1.5).abs() < 1e-12);
    }

    #[test]
    fn bases_are_as_bright_as_they_are_to_be() {
        let value = |colour: Colour| colour.mean().eval(550.0);
        let [outside, inside] = diffuse_fresnel(1.5);
        // A smooth coat loses nothing: the base stays what it is, and, coloured once, is darker.
        let smooth = Coat::new(1.5, 1e-4);
        let near = |a: f64, b: f64| (a - b).abs() < 3e-3;
        assert!(
            near(smooth.reflected, outside) && near(smooth.through, 1.0 - outside) && near(smooth.inside, inside),
            "{smooth:?}"
        );
        for rho in [0.0, 0.2, 0.8] {
            let (base, lacks) = smooth.under(&Colour::grey(rho), |rho| smooth.scattered(rho, false));
            assert!((value(base) - rho).abs() < 0.01 && lacks == 0.0, "{rho}");
            let once = (1.0 - outside) * (1.0 - inside) * rho / (1.0 - inside);
            assert!((smooth.scattered(rho, true) - once).abs() < 0.01, "{rho}");
        }
        // White under it is (1 - 0.0918) of what arrives there.
        let (_, lacks) = smooth.under(&Colour::grey(1.0), |rho| rho);
        assert!((lacks - outside).abs() < 3e-3, "{lacks}");
        // Facets hide some from each other.
        let rough = Coat::new(1.5, 0.6);
        assert!(rough.reflected + rough.through < 0.95, "{rough:?}");
    }
}
