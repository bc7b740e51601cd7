//! Surfaces of other renderers by what Spectile has: how much a coat lets through, and metals by their colour.

use super::picture::{Colour, sampled};
use super::report::{Place, Report};
use crate::spectral::Curve;
use crate::spectral::colour::Observer;

/// Y of a light: 1 where ∫L ȳ dλ = ∫ȳ dλ (CIE 1931).
pub fn luminance(curve: &Curve) -> f64 {
    let observer = &Observer::Cie1931.curves()[1];
    let nm = || (0..=470).map(|i| 360.0 + f64::from(i));
    nm().map(|nm| observer.eval(nm) * curve.eval(nm)).sum::<f64>() / nm().map(|nm| observer.eval(nm)).sum::<f64>()
}

/// Unpolarised reflectance of a boundary of relative index `eta` at an angle of this cosine (Born and Wolf, section 1.5.2).
pub fn fresnel(cosine: f64, eta: f64) -> f64 {
    let sine_inside = (1.0 - cosine * cosine) / (eta * eta);
    if sine_inside >= 1.0 {
        return 1.0;
    }
    let inside = (1.0 - sine_inside).sqrt();
    let s = (cosine - eta * inside) / (cosine + eta * inside);
    let p = (eta * cosine - inside) / (eta * cosine + inside);
    0.5 * (s * s + p * p)
}

/// Of diffuse light, the share that a boundary reflects from outside, and from inside.
pub fn diffuse_fresnel(eta: f64) -> [f64; 2] {
    const STEPS: u32 = 2000;
    let sum: f64 = (0..STEPS)
        .map(|i| {
            let cosine = (f64::from(i) + 0.5) / f64::from(STEPS);
            2.0 * cosine * fresnel(cosine, eta)
        })
        .sum();
    let outside = sum / f64::from(STEPS);
    // What gets in gets out the other way round, over the n² larger cone (Egan and Hilgeman 1973).
    [outside, 1.0 - (1.0 - outside) / (eta * eta)]
}

/// The base under a coat in which light goes to and fro and is coloured each time, that is as bright as one where it is coloured
/// once: ρ' / (1 - ρ' F) = ρ / (1 - F).
pub fn recoloured(colour: &Colour, eta: f64) -> Colour {
    let [_, inside] = diffuse_fresnel(eta);
    colour.map(|rho| rho / (1.0 - inside + rho * inside))
}

/// The base under a coat that scatters on the whole as much as diffuse matter of `colour` times `factor` without a coat; and
/// whether it would have to be more than white.
pub fn under_coat(colour: &Colour, eta: f64, factor: f64) -> (Colour, bool) {
    let [outside, inside] = diffuse_fresnel(eta);
    let through = (1.0 - outside) * (1.0 - inside);
    let base = |rho: f64| {
        let a = rho * factor / through;
        a / (1.0 + a * inside)
    };
    let brightest = match colour {
        Colour::Spectrum(curve, _) => curve.max(360.0, 830.0),
        Colour::Texture(texture) => match &texture.endmembers {
            Some(of) => of.iter().map(|colour| colour.mean().max(360.0, 830.0)).fold(0.0, f64::max),
            None => texture.picture.linear().iter().flatten().fold(0.0, |a, b| f64::max(a, (*b).into())),
        },
    };
    (colour.map(|rho| base(rho).min(1.0)), base(brightest) > 1.0)
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
    report
        .approximated(place, format!("a reflectance and a transmittance of {most:.3} in all, both scaled to 1 in all"));
    // A little below 1, for what writing rounds.
    both.map(|colour| colour.map(|v| v * (1.0 - 1e-6) / most))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coats_let_through_what_is_known() {
        // Published for n = 1.5: 0.0918 and 0.5963 (Egan and Hilgeman; Duntley 1942).
        let [outside, inside] = diffuse_fresnel(1.5);
        assert!((outside - 0.0918).abs() < 2e-4 && (inside - 0.5963).abs() < 2e-4, "{outside} {inside}");
        assert!((fresnel(1.0, 1.5) - 0.04).abs() < 1e-12 && (fresnel(0.0, 1.5) - 1.0).abs() < 1e-12);
        assert!((index_of(0.04) - 1.5).abs() < 1e-12);
    }

    #[test]
    fn bases_are_as_bright_as_they_are_to_be() {
        let value = |colour: Colour| colour.mean().eval(550.0);
        let [outside, inside] = diffuse_fresnel(1.5);
        for rho in [0.0, 0.2, 0.8] {
            let (base, too_bright) = under_coat(&Colour::grey(rho), 1.5, 0.9);
            let base = value(base);
            let seen = (1.0 - outside) * (1.0 - inside) * base / (1.0 - base * inside);
            assert!((seen - 0.9 * rho).abs() < 1e-12 && !too_bright, "{rho}: {seen}");
            let once = value(recoloured(&Colour::grey(rho), 1.5));
            assert!((once / (1.0 - once * inside) - rho / (1.0 - inside)).abs() < 1e-12);
        }
        assert!(under_coat(&Colour::grey(1.0), 1.5, 1.0).1);
    }
}
