//! Metals under a coat, and metals whose colour a picture says, by the metals and blends that scenes have.

use super::picture::{Colour, Texture, sampled};
use super::report::Deviation;
use super::scene::{Scene, Section};
use super::surfaces::COATED_CONDUCTOR;
use super::text;
use crate::Result;
use crate::spectral::hemisphere::fresnel::{conductor, dielectric};
use crate::spectral::{Curve, upsample};

/// Cosines in the middles of as many equal steps.
fn cosines() -> impl Iterator<Item = f64> {
    (0..32).map(|i| (f64::from(i) + 0.5) / 32.0)
}

/// n and k of a metal that reflects `wanted` at normal incidence, and at other angles as nearly as one can, weighted by the light that arrives.
fn fitted(wanted: &dyn Fn(f64) -> f64) -> [f64; 2] {
    let straight = wanted(1.0).clamp(1e-6, 0.9999);
    let root = straight.sqrt();
    // n lies between that of what does not absorb and its inverse.
    let largest = (1.0 + root) / (1.0 - root);
    let mut best = ([largest, 0.0], f64::INFINITY);
    for i in 0..=40 {
        let n = largest.powf(1.0 - f64::from(i) / 20.0).clamp(1e-3, 999.0);
        let k = (((straight * (n + 1.0) * (n + 1.0) - (n - 1.0) * (n - 1.0)) / (1.0 - straight)).max(0.0))
            .sqrt()
            .min(999.0);
        let off: f64 = cosines().map(|c| c * (conductor(c, n, k) - wanted(c).min(1.0)).powi(2)).sum();
        if off < best.1 {
            best = ([n, k], off);
        }
    }
    best.0
}

/// What a smooth coat of an index reflects by itself, and what a metal under it adds, at a cosine: light goes to and fro between both.
/// `metal` is n and k over those of what is outside.
fn shares(cosine: f64, coat: f64, [n, k]: [f64; 2]) -> [f64; 2] {
    let once = dielectric(cosine, coat);
    let below = (1.0 - (1.0 - cosine * cosine) / (coat * coat)).max(0.0).sqrt();
    let metal = conductor(below, n / coat, k / coat);
    [once, (1.0 - once) * (1.0 - once) * metal / (1.0 - metal * once)]
}

/// A metal, or two of which the first has `1 - weight`, in the place of a metal under a coat.
pub struct Coated {
    /// n and k of what is seen of the metal, or, without a `coat`, of both.
    pub metal: [Curve; 2],
    /// n and k of what the coat reflects by itself, and its weight.
    pub coat: Option<([Curve; 2], f64)>,
    pub off: Deviation,
}

/// One metal for both where their highlights are alike, else two.
pub fn coated(coat: &Curve, metal: &[Curve; 2], is_one: bool) -> Coated {
    let is_grey = coat.is_constant() && metal.iter().all(Curve::is_constant);
    let nm: Vec<f64> = if is_grey { vec![550.0] } else { (72..=166).map(|i| 5.0 * f64::from(i)).collect() };
    let at = |nm: f64| (coat.eval(nm).max(1.0), [metal[0].eval(nm), metal[1].eval(nm)]);
    let curves = |fit: &dyn Fn(f64) -> [f64; 2]| -> [Curve; 2] {
        let pairs: Vec<[f64; 2]> = nm.iter().map(|nm| fit(*nm)).collect();
        [0, 1].map(|i| match &pairs[..] {
            [one] => Curve::Constant(one[i]),
            all => {
                let value = all.iter().map(|pair| pair[i]).collect();
                Curve::Linear { nm: nm.clone(), value, outside: crate::spectral::Outside::Hold }
            }
        })
    };
    // The most that both together are off up to an angle.
    let off = |made: &dyn Fn(f64, f64) -> f64, degrees: f64| {
        let least = degrees.to_radians().cos();
        let of = |nm: f64, c: f64| {
            let (coat, metal) = at(nm);
            (made(nm, c) - shares(c, coat, metal).iter().sum::<f64>()).abs()
        };
        nm.iter()
            .flat_map(|nm| cosines().filter(|c| *c >= least).map(move |c| (*nm, c)))
            .map(|(nm, c)| of(nm, c))
            .fold(0.0, f64::max)
    };
    let said = |made: &dyn Fn(f64, f64) -> f64| {
        format!(
            "{} of what arrives up to 60 degrees, {} up to 80 degrees",
            text::up(off(made, 60.0)),
            text::up(off(made, 80.0))
        )
    };
    let eval = |[n, k]: &[Curve; 2], nm: f64, c: f64| conductor(c, n.eval(nm), k.eval(nm));
    if is_one {
        let both = curves(&|nm| {
            let (coat, metal) = at(nm);
            fitted(&|c| shares(c, coat, metal).iter().sum())
        });
        let off = Deviation::at_most(said(&|nm, c| eval(&both, nm, c)));
        return Coated { metal: both, coat: None, off };
    }
    let two = |weight: f64| {
        let part = |i: usize, weight: f64| {
            curves(&|nm| {
                let (coat, metal) = at(nm);
                fitted(&|c| shares(c, coat, metal)[i] / weight)
            })
        };
        [part(1, 1.0 - weight), part(0, weight)]
    };
    // Of both lobes, weighted by the light that arrives.
    let apart = |weight: f64, [seen, own]: &[[Curve; 2]; 2]| -> f64 {
        let middle = nm[nm.len() / 2];
        let (coat, metal) = at(middle);
        cosines()
            .map(|c| {
                let right = shares(c, coat, metal);
                let made = [weight * eval(own, middle, c), (1.0 - weight) * eval(seen, middle, c)];
                2.0 * c * ((made[0] - right[0]).abs() + (made[1] - right[1]).abs()) / 32.0
            })
            .sum()
    };
    let weights = [0.06, 0.08, 0.1, 0.12, 0.15, 0.2, 0.25, 0.3];
    let mut best: Option<(f64, f64, [[Curve; 2]; 2])> = None;
    for weight in weights {
        let made = two(weight);
        let off = apart(weight, &made);
        if best.as_ref().is_none_or(|(_, least, _)| off < *least) {
            best = Some((weight, off, made));
        }
    }
    let (weight, elsewhere, [seen, own]) = best.unwrap_or_else(|| (0.1, 0.0, two(0.1)));
    let off = Deviation::measured(format!(
        "{COATED_CONDUCTOR}; {} of the light is in the other of the two highlights",
        text::percent(elsewhere)
    ));
    Coated { metal: seen, coat: Some((own, weight)), off }
}

/// How wide the highlight of a metal's facets of `alpha` is under a coat of index `eta` and facets of `above`: angles inside are η times larger
/// outside, and each crossing bends by (η - 1) of a facet's tilt.
pub fn seen_through(alpha: f64, eta: f64, above: f64) -> f64 {
    (eta * eta * alpha * alpha + 0.5 * ((eta - 1.0) * above).powi(2)).sqrt().min(1.0)
}

/// Two metals or eight whose reflectances at normal incidence a picture mixes, linearly, and so at all angles, nearly.
pub struct Palette {
    /// Of each metal the reflectance at normal incidence: of two or eight, whose bits are what is large in red, green, blue.
    colours: Vec<Curve>,
    /// Shares over the picture of the second metal, or of those that are large in red, green, blue.
    shares: Vec<Vec<f32>>,
    pub off: Deviation,
}

/// A line of colours is as good as all of them if none is further from it.
const NEAR: f64 = 0.02;

impl Palette {
    /// Of the colours of a texture, where `counts` says that a texel is seen.
    pub fn of(texture: &Texture, counts: &dyn Fn(usize) -> bool) -> Palette {
        if let Some(two) = &texture.endmembers {
            let shares = texture.picture.clone().raw().linear().iter().map(|texel| texel[1]).collect();
            let off = Deviation::at_most("nothing at normal incidence");
            return Palette { colours: two.iter().map(Colour::mean).collect(), shares: vec![shares], off };
        }
        let texels: Vec<[f64; 3]> =
            texture.picture.linear().iter().map(|rgb| rgb.map(|v| f64::from(v).clamp(0.0, 1.0))).collect();
        let seen: Vec<[f64; 3]> =
            texels.iter().enumerate().filter(|(i, _)| counts(*i)).map(|(_, texel)| *texel).collect();
        let seen = if seen.is_empty() { &texels } else { &seen };
        let (middle, axis) = principal(seen);
        let along = |texel: &[f64; 3]| (0..3).map(|c| (texel[c] - middle[c]) * axis[c]).sum::<f64>();
        let ends =
            seen.iter().map(along).fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], t| [low.min(t), high.max(t)]);
        let on_line = |t: f64| [0, 1, 2].map(|c| (middle[c] + t * axis[c]).clamp(0.0, 1.0));
        let from_line = |texel: &[f64; 3]| {
            let near = on_line(along(texel));
            (0..3).map(|c| (near[c] - texel[c]).abs()).fold(0.0, f64::max)
        };
        let residual = seen.iter().map(from_line).fold(0.0, f64::max);
        let share = |v: f64, [low, high]: [f64; 2]| {
            if high > low { ((v - low) / (high - low)).clamp(0.0, 1.0) as f32 } else { 0.0 }
        };
        if residual <= NEAR {
            let colours: Vec<Curve> = ends.iter().map(|t| upsample::reflectance(on_line(*t))).collect();
            let shares = texels.iter().map(|texel| share(along(texel), ends)).collect();
            let off = format!("{} of red, green or blue at normal incidence; {}", text::up(residual), mixed(&colours));
            return Palette { colours, shares: vec![shares], off: Deviation::at_most(off) };
        }
        let bounds = [0, 1, 2].map(|c| {
            seen.iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], texel| [low.min(texel[c]), high.max(texel[c])])
        });
        let corner = |i: usize| [0, 1, 2].map(|c| bounds[c][i >> c & 1]);
        let colours: Vec<Curve> = (0..8).map(|i| upsample::reflectance(corner(i))).collect();
        let shares = (0..3).map(|c| texels.iter().map(|texel| share(texel[c], bounds[c])).collect()).collect();
        let off = format!(
            "nothing of red, green and blue at normal incidence; {}",
            mixed(&[colours[0].clone(), colours[7].clone()])
        );
        Palette { colours, shares, off: Deviation::at_most(off) }
    }

    /// Adds the metals, by `put` of a wanted name and n and k, and blends of them; gives the one of all, of that name.
    pub fn write(
        &self,
        scene: &mut Scene,
        texture: &Texture,
        name: &str,
        index: &dyn Fn(&Curve) -> [Curve; 2],
        metal: &Section,
        last: &dyn Fn(Section) -> Section,
    ) -> Result<String> {
        let mut names = Vec::new();
        for (i, colour) in self.colours.iter().enumerate() {
            let [n, k] = index(colour);
            let mut section = Section::default();
            section.set("eta", scene.spectrum(&n, &format!("{name}-{i}-eta"))?);
            section.set("k", scene.spectrum(&k, &format!("{name}-{i}-k"))?);
            section.entries.extend(metal.entries.iter().cloned());
            names.push(scene.put(&format!("{name}-{i}"), "conductor", section));
        }
        let channels = if self.shares.len() == 1 { &["metals"][..] } else { &["red", "green", "blue"] };
        for (shares, channel) in self.shares.iter().zip(channels) {
            // Pictures of shares lie as the colours do, in full texels of them.
            let weight = texture.greys(scene, &format!("{name}-{channel}"), shares.clone())?;
            let is_last = names.len() == 2;
            let mut pairs = Vec::new();
            for pair in names.chunks(2) {
                let section = Section::default().with("a", text::quoted(&pair[0])).with("b", text::quoted(&pair[1]));
                let section = section.with("weight", weight.clone());
                let wanted = if is_last { name.to_owned() } else { format!("{name}-{channel}") };
                pairs.push(scene.put(&wanted, "blend", if is_last { last(section) } else { section }));
            }
            names = pairs;
        }
        Ok(names.swap_remove(0))
    }
}

/// How far the mean of two metals is from the metal of their mean colour, beside normal incidence.
fn mixed(colours: &[Curve]) -> String {
    let index = |curve: &Curve, nm: f64, more: f64| {
        let root = (0.5 * (curve.eval(nm) + more)).clamp(0.0, 0.996).sqrt();
        (1.0 + root) / (1.0 - root)
    };
    let mut most = 0.0f64;
    for nm in [450.0, 550.0, 650.0] {
        let [a, b] = [&colours[0], &colours[colours.len() - 1]].map(|curve| curve.eval(nm));
        for c in cosines() {
            let of = |curve: &Curve, more: f64| conductor(c, index(curve, nm, more), 0.0);
            let mean = 0.5 * (of(&colours[0], a) + of(&colours[colours.len() - 1], b));
            most = most.max((mean - of(&colours[0], b)).abs());
        }
    }
    format!("{} beside it, in the middle of two", text::up(most))
}

/// The mean of colours, and the direction in which they differ most: of the largest eigenvalue of their covariance, by its powers.
fn principal(colours: &[[f64; 3]]) -> ([f64; 3], [f64; 3]) {
    let count = colours.len().max(1) as f64;
    let middle = [0, 1, 2].map(|c| colours.iter().map(|colour| colour[c]).sum::<f64>() / count);
    let mut matrix = [[0.0; 3]; 3];
    for colour in colours {
        let d = [0, 1, 2].map(|c| colour[c] - middle[c]);
        (0..3).for_each(|i| (0..3).for_each(|j| matrix[i][j] += d[i] * d[j]));
    }
    let mut axis = [0.577, 0.578, 0.576];
    for _ in 0..100 {
        let next = [0, 1, 2].map(|i| (0..3).map(|j| matrix[i][j] * axis[j]).sum::<f64>());
        let length = next.iter().map(|v| v * v).sum::<f64>().sqrt();
        if length < 1e-30 {
            break;
        }
        axis = next.map(|v| v / length);
    }
    let length = axis.iter().map(|v| v * v).sum::<f64>().sqrt();
    (middle, axis.map(|v| v / length))
}

/// A metal times a colour: the reflectance at normal incidence is right, and `weight`, the largest of the colour, is that of a blend with
/// what is not black; how far off that is at other angles.
pub fn tinted(metal: &[Curve; 2], tint: &Curve) -> ([Curve; 2], f64, Deviation) {
    let largest = tint.max(360.0, 830.0).clamp(1e-6, 1.0);
    let pair = |nm: f64| {
        let share = (tint.eval(nm) / largest).clamp(0.0, 1.0);
        if share > 1.0 - 1e-9 {
            return [metal[0].eval(nm).max(1e-4), metal[1].eval(nm)];
        }
        fitted(&|c| share * conductor(c, metal[0].eval(nm).max(1e-4), metal[1].eval(nm)))
    };
    let made = [0, 1].map(|i| sampled(&|nm| pair(nm)[i]));
    let off = |degrees: f64| {
        let least = degrees.to_radians().cos();
        let mut most = 0.0f64;
        for nm in (80..=140).map(|i| 5.0 * f64::from(i)) {
            for c in cosines().filter(|c| *c >= least) {
                let right = tint.eval(nm) * conductor(c, metal[0].eval(nm).max(1e-4), metal[1].eval(nm));
                most = most.max((largest * conductor(c, made[0].eval(nm), made[1].eval(nm)) - right).abs());
            }
        }
        text::up(most)
    };
    let said = format!("{} of what arrives up to 60 degrees, {} up to 80 degrees", off(60.0), off(80.0));
    (made, largest, Deviation::at_most(said))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::combine;
    use crate::import::picture::{Picture, Texels};

    #[test]
    fn metals_are_fitted_by_metals() {
        for [n, k] in [[0.2, 3.4], [1.5, 0.0], [2.5, 3.0]] {
            let found = fitted(&|c| conductor(c, n, k));
            let off =
                cosines().map(|c| (conductor(c, found[0], found[1]) - conductor(c, n, k)).abs()).fold(0.0, f64::max);
            assert!(off < 0.02, "{n} + {k} i: {found:?}, off by {off}");
        }
    }

    /// A coat without an index is none; one over a mirror leaves a mirror; one over black matter is itself.
    #[test]
    fn coats_are_what_they_are() {
        let gold = [0.2, 3.4];
        for c in [1.0, 0.5, 0.1] {
            let [own, below] = shares(c, 1.0, gold);
            assert!(own.abs() < 1e-12 && (below - conductor(c, gold[0], gold[1])).abs() < 1e-12);
            let [own, below] = shares(c, 1.5, [1e-6, 1e6]);
            assert!((own + below - 1.0).abs() < 1e-4, "{own} {below}");
        }
        let curves = gold.map(Curve::Constant);
        let Coated { metal, coat, .. } = coated(&Curve::Constant(1.5), &curves, false);
        let (own, weight) = coat.expect("two");
        let at = |[n, k]: &[Curve; 2]| conductor(1.0, n.eval(550.0), k.eval(550.0));
        let [right, below] = shares(1.0, 1.5, gold);
        assert!((weight * at(&own) - right).abs() < 1e-9 && ((1.0 - weight) * at(&metal) - below).abs() < 1e-9);
    }

    #[test]
    fn palettes_bring_colours_back() {
        let texture = |texels: Vec<[f32; 3]>| Texture {
            picture: Picture { size: [texels.len() as u32, 1], texels: Texels::Floats(texels) },
            name: "a".to_owned(),
            endmembers: None,
            nearest: false,
            scale: [1.0; 2],
            offset: [0.0; 2],
            file: None,
        };
        // Shades of one colour need two metals, others eight; what is not seen does not count.
        let shades = texture(vec![[0.9, 0.6, 0.3], [0.6, 0.4, 0.2], [0.3, 0.2, 0.1], [0.0, 0.0, 1.0]]);
        let two = Palette::of(&shades, &|i| i < 3);
        assert_eq!((two.colours.len(), two.shares.len()), (2, 1), "{}", two.off);
        let eight = Palette::of(&shades, &|_| true);
        assert_eq!((eight.colours.len(), eight.shares.len()), (8, 3), "{}", eight.off);
        for (palette, places) in [(two, 3), (eight, 4)] {
            for (i, right) in shades.picture.linear().iter().enumerate().take(places) {
                let mut found = [0.0; 3];
                for (j, colour) in palette.colours.iter().enumerate() {
                    let share = |(bit, shares): (usize, &Vec<f32>)| {
                        let share = f64::from(shares[i]);
                        if j >> bit & 1 == 1 { share } else { 1.0 - share }
                    };
                    let weight: f64 = palette.shares.iter().enumerate().map(share).product();
                    let rgb = combine::rgb_of(colour);
                    found = [0, 1, 2].map(|c| found[c] + weight * rgb[c]);
                }
                assert!((0..3).all(|c| (found[c] - f64::from(right[c])).abs() < 0.01), "{i}: {found:?} for {right:?}");
            }
        }
    }
}
