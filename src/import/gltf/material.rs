//! Materials of glTF: metals and coated matter by their shares, glass, masks and what glows.

use std::rc::Rc;

use glam::{DMat2, DVec2};

use super::{CANDELA, Importer};
use crate::Result;
use crate::format::gltf::json::material::{AlphaMode, Material};
use crate::format::gltf::json::texture::{Info, MagFilter, WrappingMode};
use crate::format::gltf::json::validation::Checked;
use crate::import::layers::Palette;
use crate::import::picture::{Colour, Picture, Rough, Texels, Texture, Wrap, upward};
use crate::import::report::Deviation;
use crate::import::scene::Section;
use crate::import::surfaces::{self, Coat};
use crate::import::text;
use crate::spectral::{Curve, upsample};

/// What a material became, with and without textures.
#[derive(Debug, Clone)]
pub struct Look {
    pub material: String,
    pub emission: Option<String>,
    pub textured: bool,
    pub plain: String,
    pub plain_emission: Option<String>,
    /// How far the plain one is from the textured one.
    pub off_plain: Deviation,
}

/// (1 - cosine)^5 of the angle to the half vector, on the mean over all pairs of diffuse directions (by a sum over a million of them).
const MEAN_OF_SCHLICK: f64 = 0.0037;

/// A picture with where it lies.
struct Found {
    texture: Texture,
    /// The same picture's alpha, if it has some.
    alpha: Option<Texture>,
}

impl Importer<'_, '_> {
    pub fn look(&mut self, index: Option<usize>) -> Result<Look> {
        if let Some(known) = self.looks.get(&index) {
            return Ok(known.clone());
        }
        let default = Material::default();
        let (material, name) = match index {
            Some(index) => (&self.file.root.materials[index], self.file.material_name(index)),
            None => (&default, "default".to_owned()),
        };
        let path = index.map_or_else(|| "meshes".to_owned(), |index| format!("materials[{index}]"));
        let look = self.made(material, &name, &path)?;
        if index.is_some() {
            self.scene.report.translated("material", self.place(path));
        }
        self.looks.insert(index, look.clone());
        Ok(look)
    }

    /// A texture of a material.
    fn found(&mut self, info: &Info, path: &str) -> Result<Option<Found>> {
        let index = info.index.value();
        let root = &self.file.root;
        let texture = root.textures.get(index);
        let texture =
            texture.ok_or_else(|| self.error(format!("`{path}` names texture {index}, which does not exist")))?;
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
        let set = transform.and_then(|transform| transform.tex_coord).unwrap_or(info.tex_coord);
        if set != 0 {
            self.scene
                .report
                .left_out(self.place(path), format!("a texture by TEXCOORD_{set}: only TEXCOORD_0 is read"));
            return Ok(None);
        }
        let source = texture.source.value();
        let image = root.images.get(source);
        let image = image
            .ok_or_else(|| self.error(format!("`textures[{index}]` names image {source}, which does not exist")))?;
        let at = format!("images[{source}]");
        let bytes = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => self.file.bytes_of(uri, &at).map_err(|message| self.error(message))?.0,
            (None, Some(view)) => self.file.view(view.value()).map_err(|message| self.error(message))?.to_vec(),
            (None, None) => return Err(self.error(format!("`{at}` has no `uri` and no `bufferView`"))),
        };
        let picture = Picture::parse(&bytes).map_err(|message| self.error(format!("`{at}` {message}")))?;
        let (mut nearest, mut wrap) = (false, [Wrap::Repeat; 2]);
        if let Some(sampler) = texture.sampler.and_then(|sampler| root.samplers.get(sampler.value())) {
            nearest = sampler.mag_filter == Some(Checked::Valid(MagFilter::Nearest));
            wrap = [&sampler.wrap_s, &sampler.wrap_t].map(|mode| match mode {
                Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
                Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
                _ => Wrap::Repeat,
            });
        }
        let (mut matrix, mut offset) = (DMat2::IDENTITY, DVec2::ZERO);
        if let Some(transform) = transform {
            let scale = DVec2::from_array(transform.scale.0.map(f64::from));
            offset = DVec2::from_array(transform.offset.0.map(f64::from));
            // Counter-clockwise as it is seen, where v runs down.
            matrix = DMat2::from_angle(-f64::from(transform.rotation.0)) * DMat2::from_diagonal(scale);
        }
        // v of the file runs down, that of the mesh here up.
        let texture = Texture {
            picture,
            name: image.name.clone().filter(|name| !name.is_empty()).unwrap_or_else(|| format!("image-{source}")),
            endmembers: None,
            nearest,
            scale: [1.0; 2],
            offset: [0.0; 2],
            file: None,
        };
        // A picture of alpha lies as that of colours does.
        let alpha = Picture::alpha(&bytes).map(|alpha| Texture {
            picture: Picture {
                size: texture.picture.size,
                texels: Texels::Floats(alpha.into_iter().map(|v| [v; 3]).collect()),
            },
            ..texture.clone()
        });
        let (matrix, offset) = upward(matrix, offset, false);
        let mut finished = |texture: Texture| {
            let (texture, off) = texture.placed(matrix, offset);
            if let Some(off) = off {
                let what = "a texture that is turned by other than quarters of a turn as one that is not";
                self.scene.report.approximated(self.place(path), what, off);
            }
            let (texture, off) = texture.wrapped(wrap);
            if let Some(off) = off {
                let what =
                    "a texture that does not repeat as one that does, beyond coordinates of the surface from 0 to 1";
                self.scene.report.approximated(self.place(path), what, off);
            }
            texture
        };
        let texture = finished(texture);
        Ok(Some(Found { texture, alpha: alpha.map(finished) }))
    }

    /// A linear colour times its texture.
    fn tinted(&mut self, factor: [f64; 3], found: Option<&Found>) -> Colour {
        match found {
            None if factor == [factor[0]; 3] => Colour::grey(factor[0]),
            None => {
                let written = format!("{{ rgb = {} }}", text::list(factor));
                Colour::Spectrum(upsample::reflectance(factor), Some(written))
            }
            Some(found) => {
                let mut texture = found.texture.clone();
                if factor != [1.0; 3] {
                    let texels = texture.picture.linear();
                    let tint = |rgb: &[f32; 3]| [0, 1, 2].map(|c| (f64::from(rgb[c]) * factor[c]) as f32);
                    texture.picture.texels = Texels::Floats(texels.iter().map(tint).collect());
                }
                Colour::Texture(Rc::new(texture))
            }
        }
    }

    /// One channel of a picture times a factor, as text of a number's texture; and its mean.
    fn channel(&mut self, found: &Found, channel: usize, factor: f64, name: &str) -> Result<(String, f64)> {
        let raw = found.texture.picture.clone().raw();
        let value = |rgb: &[f32; 3]| (f64::from(rgb[channel]) * factor).clamp(0.0, 1.0) as f32;
        let values: Vec<f32> = raw.linear().iter().map(value).collect();
        let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len().max(1) as f64;
        Ok((found.texture.greys(self.scene, name, values)?, mean))
    }

    fn made(&mut self, material: &Material, name: &str, path: &str) -> Result<Look> {
        let pbr = &material.pbr_metallic_roughness;
        let unit = |v: f32| f64::from(v).clamp(0.0, 1.0);
        let transmission = material.extensions.as_ref().and_then(|e| e.transmission.as_ref());
        let factors = pbr.base_color_factor.0.into_iter().chain([pbr.metallic_factor.0, pbr.roughness_factor.0]);
        let factors = factors.chain(transmission.map(|t| t.transmission_factor.0));
        let beyond = factors.map(|factor| f64::from((factor - factor.clamp(0.0, 1.0)).abs())).fold(0.0, f64::max);
        if beyond > 0.0 {
            let (what, off) = ("factors outside of 0 to 1, which are clipped to that", text::up(beyond));
            self.scene.report.approximated(self.place(path), what, Deviation::at_most(off));
        }
        let [r, g, b, alpha] = pbr.base_color_factor.0.map(unit);
        let base_path = format!("{path}.pbrMetallicRoughness.baseColorTexture");
        let base = pbr.base_color_texture.as_ref().map(|info| self.found(info, &base_path)).transpose()?.flatten();
        let shares_path = format!("{path}.pbrMetallicRoughness.metallicRoughnessTexture");
        let shares =
            pbr.metallic_roughness_texture.as_ref().map(|info| self.found(info, &shares_path)).transpose()?.flatten();
        for (is_there, what) in [
            (material.normal_texture.is_some(), "normalTexture: the surface is smooth"),
            (material.occlusion_texture.is_some(), "occlusionTexture: light is traced"),
        ] {
            if is_there {
                self.scene.report.left_out(self.place(path), what);
            }
        }
        let extensions = material.extensions.as_ref();
        if extensions.is_some_and(|e| e.unlit.is_some()) {
            let off = Deviation::unbounded("it is as bright as what shines on it makes it, not as its colour says");
            self.scene.report.approximated(self.place(path), "an unlit material as one that is lit", off);
        }
        for (is_there, what) in [
            (extensions.is_some_and(|e| e.specular.is_some()), "KHR_materials_specular"),
            (extensions.is_some_and(|e| e.pbr_specular_glossiness.is_some()), "KHR_materials_pbrSpecularGlossiness"),
        ] {
            if is_there {
                self.scene.report.left_out(self.place(path), what);
            }
        }
        for other in extensions.iter().flat_map(|e| e.others.keys()) {
            let shown: String = other.chars().take(60).collect();
            self.scene.report.left_out(self.place(path), shown.escape_debug().to_string());
        }
        let colour = self.tinted([r, g, b], base.as_ref());
        let opacity = self.opacity(material, alpha, base.as_ref(), name, path)?;
        let metallic = unit(pbr.metallic_factor.0);
        let factor = unit(pbr.roughness_factor.0);
        let mut rough = Rough::Pair([(factor * factor).max(1e-3); 2]);
        let mut metal_weight = (text::rounded(metallic), metallic, None);
        if let Some(found) = &shares {
            let texture = Texture { picture: found.texture.picture.clone().raw(), ..found.texture.clone() };
            let said = ("roughnesses", self.place(path));
            rough = texture.rough(self.scene, said, name, &|rgb| f64::from(rgb[1]), &|v| (v * factor).powi(2))?;
            if metallic > 0.0 {
                let (text, mean) = self.channel(found, 2, metallic, &format!("{name}-metalness"))?;
                metal_weight = (text, mean, Some(found.texture.picture.clone()));
            }
        }
        let what = "metallic-roughness as a coat over diffuse matter of the same brightness on the whole, and a metal whose reflectance at \
                    normal incidence is the colour";
        self.scene.report.approximated(self.place(path), what, Deviation::measured(surfaces::METALLIC_ROUGHNESS));
        let factor = transmission.map_or(0.0, |t| unit(t.transmission_factor.0));
        let mut clear = (text::rounded(factor), factor);
        let clear_path = format!("{path}.extensions.KHR_materials_transmission.transmissionTexture");
        if let Some(info) = transmission.and_then(|t| t.transmission_texture.as_ref())
            && let Some(found) = self.found(info, &clear_path)?
        {
            clear = self.channel(&found, 0, factor, &format!("{name}-clear"))?;
        }
        let textured = colour.is_texture()
            || clear.0.starts_with('{')
            || rough.is_texture()
            || metal_weight.0.starts_with('{')
            || opacity.as_ref().is_some_and(|o| o.starts_with('{'));
        let material_name = self.surface(material, name, path, &colour, &rough, &metal_weight, &clear, opacity)?;
        let plain = if textured {
            let mean = Colour::Spectrum(colour.mean(), None);
            let weight = (text::rounded(metal_weight.1), metal_weight.1, None);
            self.surface(
                material,
                &format!("{name}-mean"),
                path,
                &mean,
                &Rough::Pair([rough.mean(); 2]),
                &weight,
                &(text::rounded(clear.1), clear.1),
                None,
            )?
        } else {
            material_name.clone()
        };
        let (emission, plain_emission) = self.emission(material, path)?;
        let lit = emission.as_ref().is_some_and(|text| text.contains("texture ="));
        let off_plain = if colour.is_texture() {
            colour.off_its_mean()
        } else {
            Deviation::unbounded("its numbers differ from place to place, as its textures say")
        };
        Ok(Look { material: material_name, emission, textured: textured || lit, plain, plain_emission, off_plain })
    }

    fn opacity(
        &mut self,
        material: &Material,
        alpha: f64,
        base: Option<&Found>,
        name: &str,
        path: &str,
    ) -> Result<Option<String>> {
        let mode = match material.alpha_mode {
            Checked::Valid(mode) => mode,
            Checked::Invalid => return Err(self.error(format!("`{path}.alphaMode` is unknown"))),
        };
        let cutoff = material.alpha_cutoff.map_or(0.5, |cutoff| f64::from(cutoff.0));
        let share = |a: f64| match mode {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask => f64::from(a >= cutoff),
            AlphaMode::Blend => a.clamp(0.0, 1.0),
        };
        if mode == AlphaMode::Opaque {
            return Ok(None);
        }
        match base.and_then(|found| found.alpha.as_ref()) {
            Some(texture) => {
                let values = texture.picture.linear().iter().map(|v| share(f64::from(v[0]) * alpha) as f32).collect();
                Ok(Some(texture.greys(self.scene, &format!("{name}-alpha"), values)?))
            }
            None => Ok(Some(text::rounded(share(alpha))).filter(|_| share(alpha) < 1.0)),
        }
    }

    #[expect(clippy::too_many_arguments, reason = "what one surface is made of")]
    fn surface(
        &mut self,
        material: &Material,
        name: &str,
        path: &str,
        colour: &Colour,
        rough: &Rough,
        metal: &(String, f64, Option<Picture>),
        (clear_weight, clear): &(String, f64),
        opacity: Option<String>,
    ) -> Result<String> {
        let extensions = material.extensions.as_ref();
        let ior = extensions.and_then(|e| e.ior.as_ref()).map_or(1.5, |ior| f64::from(ior.ior.0));
        let is_index = (1.0..=1000.0).contains(&ior);
        if !is_index {
            // As the extension has it, 0 reflects everything.
            let straight = if ior == 0.0 { 1.0 } else { ((ior - 1.0) / (ior + 1.0)).powi(2) };
            let off =
                Deviation::at_most(format!("{} of reflectance at normal incidence", text::up((straight - 0.04).abs())));
            self.scene.report.approximated(self.place(path), format!("an `ior` of {ior} as 1.5"), off);
        }
        let eta = if is_index { ior } else { 1.5 };
        let alpha = rough.even().unwrap_or_default();
        let clear = *clear;
        let mut parts: Vec<(&str, Section)> = Vec::new();
        if clear < 1.0 && metal.1 < 1.0 {
            // What is below has Schlick's share of what the coat lets through, by the angle to the half vector: its mean over both directions.
            let straight = ((eta - 1.0) / (eta + 1.0)).powi(2);
            let through = (1.0 - straight) * (1.0 - MEAN_OF_SCHLICK);
            let (base, _) = Coat::new(eta, rough.mean()).under(colour, |rho| through * rho);
            let section = Section::default().with("reflectance", base.toml(self.scene, &format!("{name}-base"))?);
            parts.push(("plastic", section.with("eta", text::rounded(eta)).with("roughness", alpha.clone())));
        }
        if clear > 0.0 {
            self.scene.report.left_out(
                self.place(path),
                "the colour of glass, and what it absorbs (`interior` with a medium would)",
            );
            let volume = extensions.and_then(|e| e.volume.as_ref()).is_some_and(|v| v.thickness_factor.0 > 0.0);
            let section = Section::default();
            if volume {
                parts.push(("dielectric", section.with("eta", text::rounded(eta)).with("roughness", alpha.clone())));
            } else {
                // Within a blend there is no opacity.
                if clear == 1.0 {
                    let (share, off) = surfaces::pane(eta);
                    let what = "glass without a volume as a mirror of the opacity that a pane has at normal incidence";
                    self.scene.report.approximated(self.place(path), what, off);
                    let section = section.comment("a pane").with("eta", "0.01").with("k", "100.0");
                    return Ok(self.scene.put(name, "conductor", section.with("opacity", text::rounded(share))));
                }
                let what = "glass without a volume, in a mixture, as glass with one: it bends light";
                let off = Deviation::unbounded("where what is behind it is seen, which depends on how far that is");
                self.scene.report.approximated(self.place(path), what, off);
                let section = Section::default().with("eta", text::rounded(eta)).with("roughness", alpha.clone());
                parts.push(("dielectric", section));
            }
        }
        let named = |count: usize, kind: &str| if count == 1 { name.to_owned() } else { format!("{name}-{kind}") };
        let count = parts.len() + usize::from(metal.1 > 0.0);
        let put_opacity = |section: Section, is_last: bool| match &opacity {
            Some(opacity) if is_last => section.with("opacity", opacity.clone()),
            _ => section,
        };
        let mut before = None::<String>;
        for (i, (kind, section)) in parts.into_iter().enumerate() {
            let own = self.scene.put(&named(count, kind), kind, put_opacity(section, count == 1));
            before = Some(match before {
                None => own,
                Some(first) => {
                    let blend = Section::default().with("a", text::quoted(&first)).with("b", text::quoted(&own));
                    // The second one is what is clear, of all that is no metal.
                    let blend = blend.with("weight", clear_weight.clone());
                    let is_last = i + 1 == count;
                    self.scene.put(
                        &if is_last { name.to_owned() } else { format!("{name}-mix") },
                        "blend",
                        put_opacity(blend, is_last),
                    )
                }
            });
        }
        if metal.1 > 0.0 {
            let section = Section::default().with("roughness", alpha).with("energy_compensation", "false");
            let index = |colour: &Curve| [surfaces::metal(colour), Curve::Constant(0.0)];
            let own = match colour {
                Colour::Texture(texture) => {
                    // Of the colours only those count where there is metal.
                    let seen =
                        metal.2.as_ref().filter(|shares| shares.size == texture.picture.size).map(Picture::linear);
                    let palette = Palette::of(texture, &|i| seen.as_ref().is_none_or(|shares| shares[i][2] > 0.0));
                    let what = "the colour of a metal by a texture as a mixture of metals";
                    self.scene.report.approximated(self.place(path), what, palette.off.clone());
                    let last = |section: Section| put_opacity(section, count == 1);
                    palette.write(self.scene, texture, &named(count, "metal"), &index, &section, &last)?
                }
                Colour::Spectrum(curve, _) => {
                    let [eta, _] = index(curve);
                    let eta = self.scene.spectrum(&eta, &format!("{name}-metal"))?;
                    let own = Section::default().with("eta", eta).with("k", "0.0");
                    let own = Section { entries: [own.entries, section.entries].concat(), ..own };
                    self.scene.put(&named(count, "metal"), "conductor", put_opacity(own, count == 1))
                }
            };
            before = Some(match before {
                None => own,
                Some(first) => {
                    let blend = Section::default().with("a", text::quoted(&first)).with("b", text::quoted(&own));
                    self.scene.put(name, "blend", put_opacity(blend.with("weight", metal.0.clone()), true))
                }
            });
        }
        Ok(before.unwrap_or_else(|| self.scene.put(name, "black", Section::default())))
    }

    /// Emission as text, with and without its texture.
    fn emission(&mut self, material: &Material, path: &str) -> Result<(Option<String>, Option<String>)> {
        let factor = material.emissive_factor.0.map(f64::from);
        let strength = material.extensions.as_ref().and_then(|e| e.emissive_strength.as_ref());
        let strength = strength.map_or(1.0, |strength| f64::from(strength.emissive_strength.0)) / CANDELA;
        if factor.iter().any(|v| !(0.0..1e30).contains(v)) || !(0.0..1e30).contains(&strength) {
            return Err(self.error(format!("`{path}` has an emission that is negative or not finite")));
        }
        if factor == [0.0; 3] {
            return Ok((None, None));
        }
        let emissive_path = format!("{path}.emissiveTexture");
        let found =
            material.emissive_texture.as_ref().map(|info| self.found(info, &emissive_path)).transpose()?.flatten();
        let plain = |rgb: [f64; 3]| format!("{{ rgb = {}, scale = {} }}", text::list(rgb), text::rounded(strength));
        match found {
            None => Ok((Some(plain(factor)), Some(plain(factor)))),
            Some(found) => {
                let mean = found.texture.picture.mean();
                let Colour::Texture(texture) = self.tinted(factor, Some(&found)) else { return Ok((None, None)) };
                let text = texture.toml(self.scene, &format!(", strength = {}", text::rounded(strength)))?;
                Ok((Some(text), Some(plain([0, 1, 2].map(|c| mean[c] * factor[c])))))
            }
        }
    }
}
