//! The principled BSDF (Burley 2012, 2015): a coat over diffuse matter, metal and glass in their shares.

use super::Importer;
use super::bsdf::Made;
use super::colour::Of;
use super::values::Plugin;
use crate::Result;
use crate::import::picture::{Colour, Rough, grey};
use crate::import::report::Deviation;
use crate::import::scene::Section;
use crate::import::surfaces::{self, Coat};
use crate::import::text;

/// How much brighter than Lambert's law Burley's diffuse lobe is on the whole at this roughness: the mean over both directions.
fn diffuse_factor(roughness: f64) -> f64 {
    const STEPS: u32 = 24;
    let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(STEPS);
    let schlick = |cosine: f64| (1.0 - cosine).powi(5);
    let (mut sum, mut weight) = (0.0, 0.0);
    for i in 0..STEPS {
        for j in 0..STEPS {
            for k in 0..STEPS {
                let (a, b, azimuth) = (middle(i), middle(j), std::f64::consts::PI * middle(k));
                let between = a * b + ((1.0 - a * a) * (1.0 - b * b)).sqrt() * azimuth.cos();
                // Of the half vector: cos² θd = (1 + cosine between) / 2.
                let retro = 2.0 * roughness * 0.5 * (1.0 + between);
                let (fa, fb) = (schlick(a), schlick(b));
                let lobe = (1.0 - 0.5 * fa) * (1.0 - 0.5 * fb) + retro * (fa + fb + fa * fb * (retro - 1.0));
                sum += a * b * lobe;
                weight += a * b;
            }
        }
    }
    sum / weight
}

/// The material of a `principled` plugin.
pub fn principled<'n>(
    importer: &mut Importer<'n, '_>,
    plugin: &Plugin<'n>,
    name: &str,
    two_sided: bool,
    opacity: Option<String>,
    flip: bool,
) -> Result<Made> {
    let colour = importer.colour(plugin, "base_color", Of::Reflectance, flip)?.unwrap_or(Colour::grey(0.5));
    let mut share = |key: &str, default: f64| -> Result<f64> {
        let value = importer.mean_number(plugin, key, default)?;
        Ok(importer.scene.report.within(plugin.place(), &format!("`{key}` of a principled BSDF"), value, [0.0, 1.0]))
    };
    let (metallic, glass) = (share("metallic", 0.0)?, share("spec_trans", 0.0)?);
    let rough = match importer.texture_of_numbers(plugin, "roughness", flip)? {
        Some(texture) => texture
            .rough(importer.scene, ("roughnesses", plugin.place()), name, &grey, &|roughness| roughness * roughness)?,
        None => {
            let roughness = importer.mean_number(plugin, "roughness", 0.5)?;
            let place = plugin.place();
            let roughness =
                importer.scene.report.within(place, "`roughness` of a principled BSDF", roughness, [0.0, 1.0]);
            Rough::Pair([(roughness * roughness).max(1e-3); 2])
        }
    };
    let alpha = rough.even().unwrap_or_default();
    let specular = plugin.float("specular")?.unwrap_or(0.5);
    let specular =
        importer.scene.report.within(plugin.place(), "`specular` of a principled BSDF", specular, [0.0, f64::MAX]);
    let eta = match plugin.float("eta")? {
        Some(eta) => eta,
        // Burley 2015: the reflectance at normal incidence is 0.08 specular.
        None => surfaces::index_of(0.08 * specular),
    };
    let eta = importer.scene.report.within(plugin.place(), "`eta` of a principled BSDF", eta, [1.0, 1000.0]);
    for key in ["anisotropic", "sheen", "clearcoat", "flatness", "spec_tint"] {
        if importer.mean_number(plugin, key, 0.0)? != 0.0 {
            importer.scene.report.left_out(plugin.place(), format!("`{key}` of a principled BSDF"));
        }
    }
    for key in ["sheen_tint", "clearcoat_gloss"] {
        // Say nothing without what they go with.
        plugin.get(key);
    }
    let what = "a principled BSDF as a coat over diffuse matter of the same brightness on the whole, and metal and glass by their shares";
    importer.scene.report.approximated(plugin.place(), what, Deviation::measured(surfaces::PRINCIPLED));
    let mut parts = Vec::new();
    if metallic < 1.0 && glass < 1.0 {
        let factor = diffuse_factor(rough.mean().sqrt());
        let (base, too_bright) = Coat::new(eta, rough.mean()).under(&colour, |rho| factor * rho);
        if too_bright > 0.0 {
            let what = "a principled BSDF brighter than a white base under its coat, as that";
            let off = Deviation::at_most(format!("{} of what it scatters", text::percent(too_bright)));
            importer.scene.report.approximated(plugin.place(), what, off);
        }
        let mut section = Section::default();
        section.set("reflectance", base.toml(importer.scene, &format!("{name}-base"))?);
        section.set("eta", text::rounded(eta));
        section.set("roughness", alpha.clone());
        parts.push(((1.0 - metallic) * (1.0 - glass), "plastic", section, colour.is_texture() || rough.is_texture()));
    }
    if metallic > 0.0 {
        if colour.is_texture() {
            let what = "the colour of a metal by a texture as its mean";
            importer.scene.report.approximated(plugin.place(), what, colour.off_its_mean());
        }
        let metal = surfaces::metal(&colour.mean());
        let mut section = Section::default().with("eta", importer.scene.spectrum(&metal, &format!("{name}-metal"))?);
        section.set("k", "0.0");
        section.set("roughness", alpha.clone());
        section.set("energy_compensation", "false");
        parts.push((metallic, "conductor", section, rough.is_texture()));
    }
    if metallic < 1.0 && glass > 0.0 {
        let section = Section::default().with("eta", text::rounded(eta)).with("roughness", alpha);
        parts.push(((1.0 - metallic) * glass, "dielectric", section, rough.is_texture()));
    }
    let textured = parts.iter().any(|(.., textured)| *textured);
    let count = parts.len();
    let (mut share, mut made) = (0.0, None);
    for (i, (weight, kind, section, _)) in parts.into_iter().enumerate() {
        let is_last = i + 1 == count;
        let part_name = if count == 1 { name.to_owned() } else { format!("{name}-{kind}") };
        let part_opacity = opacity.clone().filter(|_| count == 1);
        let part = importer.put_made(&part_name, kind, section, two_sided, part_opacity, textured);
        share += weight;
        made = Some(match (made, &part) {
            (Some(Made::Material { name: before, .. }), Made::Material { name: now, .. }) => {
                let blend = Section::default().with("a", text::quoted(&before)).with("b", text::quoted(now));
                let blend = blend.with("weight", text::rounded(weight / share));
                let blend_name = if is_last { name.to_owned() } else { format!("{name}-mix") };
                importer.put_made(&blend_name, "blend", blend, two_sided, opacity.clone().filter(|_| is_last), textured)
            }
            _ => part,
        });
    }
    Ok(made.unwrap_or(Made::Nothing))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Burley 2012 has grazing retro-reflection that smooth surfaces lack and rough ones have.
    #[test]
    fn the_diffuse_lobe_is_near_lamberts() {
        let [smooth, rough] = [0.0, 1.0].map(diffuse_factor);
        assert!(
            smooth < 1.0 && rough > smooth && (0.85..1.2).contains(&smooth) && (0.85..1.2).contains(&rough),
            "{smooth} {rough}"
        );
    }
}
