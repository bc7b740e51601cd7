//! The spectra that a scene needs on a device: which, under which ids, at which wavelengths, in tables of how many strata.

use std::collections::{BTreeMap, BTreeSet};

use crate::device::emission::Share;
use crate::device::parts::heat;
use crate::device::parts::surfaces::Needed;
use crate::scene::{Bsdf, Environment, Reflectance, Scene, Texels, Wavelengths};
use crate::spectral::table::{Exactness, SpectralTables, Tabulated, Wanted};
use crate::spectral::warp::Warp;
use crate::spectral::{Channels, Curve};
use crate::{Error, Result};

/// Spectra that may be held in registers while a pixel is evaluated; with more, each is looked up where it is needed.
pub const MAX_REGISTER_SPECTRA: usize = 8;
/// Vectors of four channels that spectra with kinks may fill in a thread's registers, and the most kinks of each. Measured on lavapipe,
/// four spectra: with one kink evaluation takes a seventh of the time that it takes with strata, with four a quarter, with six
/// several times as long.
const MOST_VECTORS: usize = 40;
const MOST_KINKS: usize = 4;

/// Spectrum ids have 16 bits in a record.
const MAX_SPECTRA: usize = 1 << 16;

/// Where spectra are among the curves of the tables.
pub struct SpectrumIds {
    /// Scene spectrum → position among the curves of the tables.
    pub factors: BTreeMap<usize, usize>,
    pub sources: BTreeMap<usize, usize>,
    /// Of each that materials of general scenes need.
    pub needed: Vec<usize>,
    /// That of what a path's throughput begins with, where it is not 1.
    pub path_weight: Option<usize>,
    pub names: Vec<String>,
}

/// The spectrum that multiplies all texels of a map of colours.
pub fn daylight(environment: &Environment) -> Option<usize> {
    match &environment.map()?.texels {
        Texels::Rgb { daylight, .. } => Some(*daylight),
        Texels::Spectral { .. } => None,
    }
}

/// Tables of the constant 1, of what multiplies throughput, then of what emits; the weights of responses and wavelengths last.
/// With them, where in the channels wavelengths are drawn, by what is `emitted`. `in_registers`: evaluation holds the spectra of a
/// plain scene in registers where they are few, and then kinks take the place of strata. Without `values` nobody evaluates: ids are all
/// that is needed, of tables that hold nothing.
pub fn spectral_tables<'a>(
    scene: &Scene,
    heat: &heat::Heat,
    needed: &[Needed],
    in_registers: bool,
    values: bool,
    responses: Option<&[Curve]>,
    emitted: impl FnOnce() -> Vec<Share<'a>>,
) -> Result<(SpectralTables, SpectrumIds, Warp)> {
    // General scenes have all of theirs among those needed.
    let plain = if needed.is_empty() { &scene.materials[..] } else { &[] };
    let factors = plain.iter().filter_map(|m| match m.bsdf {
        Bsdf::Diffuse { reflectance: Reflectance::Spectrum(reflectance) } => Some(reflectance),
        _ => None,
    });
    let kinds = scene.objects.iter().zip(&heat.kinds);
    let sources = kinds.filter(|(_, kind)| !matches!(kind, heat::Kind::ByPlace(_)));
    let sources = sources.filter_map(|(object, _)| object.emission.as_ref().map(|e| e.radiance));
    let sources = sources.chain(scene.environment.as_ref().and_then(|e| e.uniform().or(daylight(e))));
    let sources = sources.chain(scene.lights.iter().map(|light| light.spectrum()));
    let sources = sources.chain(heat.by_angle.iter().flatten().flatten().copied());
    let mut curves = vec![&Curve::Constant(1.0)];
    let mut names = vec!["1".to_owned()];
    let mut number = |list: BTreeSet<usize>| -> BTreeMap<usize, usize> {
        list.into_iter()
            .map(|s| {
                curves.push(&scene.spectra[s].curve);
                names.push(scene.spectra[s].name.clone());
                (s, curves.len() - 1)
            })
            .collect()
    };
    let (factors, sources) = (number(factors.collect()), number(sources.collect()));
    let first = curves.len();
    let mut wanted: Vec<Wanted> = curves.into_iter().map(|curve| Tabulated::Same(curve).into()).collect();
    for spectrum in needed {
        let (name, curve, exactness) = match spectrum {
            Needed::Scene(id) => (&scene.spectra[*id].name, &scene.spectra[*id].curve, Exactness::Peak),
            Needed::Derived(name, curve) => (name, curve, Exactness::Peak),
            Needed::Pointwise(name, curve) => (name, curve, Exactness::Pointwise),
            Needed::Exact(name, curve) => (name, curve, Exactness::Exact),
        };
        wanted.push(Wanted { exactness, ..Tabulated::Same(curve).into() });
        names.push(name.clone());
    }
    let needed_at = (first..wanted.len()).collect();
    // Weights come last.
    let spectrum = responses.map_or(Tabulated::Same(&Curve::Constant(1.0)), Tabulated::PerChannel);
    let weights = Wanted { weighted: true, ..spectrum.into() };
    // Beside the constant 1, each takes two vectors, and two for every kink.
    let beside = wanted.len() - 1;
    let kinks = (MOST_VECTORS / beside.max(1)).saturating_sub(2) / 2;
    let make = |warp: &Warp| {
        if in_registers && beside <= MAX_REGISTER_SPECTRA && warp.bits() == 0 {
            let curves: Vec<&Curve> = same(&wanted).collect();
            if let Some(bent) = SpectralTables::with_kinks(&curves, &scene.channels, kinks.min(MOST_KINKS)) {
                return bent;
            }
        }
        let is_weighted = responses.is_some() || warp.bits() > 0;
        let wanted: Vec<Wanted> = wanted.iter().copied().chain(is_weighted.then_some(weights)).collect();
        SpectralTables::warped(&wanted, &scene.channels, warp)
    };
    if !values {
        let channels = Channels::equal(400.0, 500.0, 1);
        let none = Wanted::from(Tabulated::Same(&Curve::Constant(1.0)));
        let tables = SpectralTables::warped(&vec![none; wanted.len()], &channels, &Warp::uniform(&channels));
        let ids = SpectrumIds { factors, sources, needed: needed_at, path_weight: None, names };
        return Ok((tables, ids, Warp::uniform(&scene.channels)));
    }
    let mut warp = Warp::uniform(&scene.channels);
    let mut tables = None;
    if scene.integrator.wavelengths == Wavelengths::Emission {
        let emitted = emitted();
        let emitted: Vec<(&Curve, f64)> = emitted.iter().map(|(curve, factor)| (&**curve, *factor)).collect();
        let curves = same(&wanted);
        let most_bits = SpectralTables::most_bits(wanted.len() + 1, &scene.channels);
        let drawn = Warp::of_emission(&scene.channels, &emitted, responses, &curves.collect::<Vec<_>>(), most_bits);
        // Not where a path would cost more than its share of noise that goes.
        if drawn.bits() > 0 {
            let [even_tables, drawn_tables] = [&warp, &drawn].map(make);
            let dearer = WEIGHT_COST * lookup_cost(&drawn_tables) / lookup_cost(&even_tables);
            if drawn.gain(&scene.channels, &emitted, responses) > dearer {
                (warp, tables) = (drawn, Some(drawn_tables));
            } else {
                tables = Some(even_tables);
            }
        }
    }
    let tables = tables.unwrap_or_else(|| make(&warp));
    let path_weight = (responses.is_some() || warp.bits() > 0).then_some(wanted.len());
    if path_weight.is_some() {
        names.push("weights of wavelengths".to_owned());
    }
    if names.len() > MAX_SPECTRA {
        return Err(Error::input(
            &scene.file,
            format!("{} spectra in use, at most {MAX_SPECTRA} are supported", names.len()),
        ));
    }
    Ok((tables, SpectrumIds { factors, sources, needed: needed_at, path_weight, names }, warp))
}

/// The curves that are one in all channels.
fn same<'a>(wanted: &[Wanted<'a>]) -> impl Iterator<Item = &'a Curve> {
    wanted.iter().filter_map(|wanted| match wanted.spectrum {
        Tabulated::Same(curve) => Some(curve),
        Tabulated::PerChannel(_) => None,
    })
}

/// What drawn wavelengths cost a path by themselves: one more spectrum to look up, the weights.
const WEIGHT_COST: f64 = 1.15;

/// Time of a path with such tables, generation included, relative to one with a single stratum. Measured on lavapipe in the Cornell box
/// of 8 to 400 channels under a mercury lamp (with the weights 1.24 in 20 channels, 1.31 in 40, 1.75 in 100); a search among knots is
/// what costs most.
fn lookup_cost(tables: &SpectralTables) -> f64 {
    match (tables.has_knots(), tables.stratum_bits) {
        (true, _) => 2.6,
        (false, 0) => 1.0,
        (false, _) => 1.1,
    }
}
