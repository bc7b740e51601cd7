//! Lights of pbrt, and their scales.

use glam::{DAffine3, DMat3, DVec3};

use super::colour::Of;
use super::token::{At, Parameters, shown};
use super::{Importer, beside};
use crate::Result;
use crate::import::environment::Frame;
use crate::import::picture::{Colour, Picture, Texels};
use crate::import::report::Deviation;
use crate::import::scene::Section;
use crate::import::surfaces::luminance;
use crate::import::text;
use crate::spectral::Curve;

impl Importer<'_> {
    /// The light of a parameter times `scale`, or, where a photometric quantity is given, of that luminance.
    pub fn light(&mut self, parameters: &Parameters, key: &str, scale: f64, name: &str) -> Result<String> {
        let colour = self.colour(parameters, key, Of::Light)?;
        let scale = scale * parameters.number("scale")?.unwrap_or(1.0);
        Ok(match colour {
            None => scaled("{ rgb = [1.0, 1.0, 1.0] }", scale),
            Some(Colour::Texture(_)) => scaled("{ rgb = [1.0, 1.0, 1.0] }", scale),
            Some(Colour::Spectrum(_, Some(text))) => scaled(&text, scale),
            // A number is that much of D65.
            Some(Colour::Spectrum(Curve::Constant(value), _)) => scaled("{ rgb = [1.0, 1.0, 1.0] }", value * scale),
            Some(Colour::Spectrum(curve, _)) => self.scene.spectrum(&curve.scaled(scale), name)?,
        })
    }

    /// What `power` or `illuminance` makes of a light whose luminance 1 amounts to `unit` of it.
    pub fn photometric(&mut self, parameters: &Parameters, key: &str, light: &str, unit: f64) -> Result<f64> {
        let Some(wanted) = parameters.number(key)?.filter(|wanted| *wanted > 0.0) else { return Ok(1.0) };
        let own = match self.colour(parameters, light, Of::Light)? {
            Some(Colour::Spectrum(curve, _)) => luminance(&curve),
            _ => 1.0,
        };
        // Its colour stays, its amount does not.
        Ok(wanted / (unit * own.max(f64::MIN_POSITIVE)))
    }

    pub fn source(&mut self, kind: &str, parameters: &Parameters, ctm: &DAffine3, at: &At) -> Result<()> {
        let pi = std::f64::consts::PI;
        let name = format!("{kind}-{}", at.line);
        let point = |name: &str, default: DVec3| -> Result<DVec3> { Ok(parameters.vector(name)?.unwrap_or(default)) };
        match kind {
            "point" => {
                let scale = self.photometric(parameters, "power", "I", 4.0 * pi)?;
                let intensity = self.light(parameters, "I", scale, &name)?;
                let position = text::vector(ctm.transform_point3(point("from", DVec3::ZERO)?));
                let value = format!("{{ position = {position}, intensity = {intensity} }}");
                self.scene.lights.push(Section::new("[[lights]]").with("point", value));
            }
            "spot" => {
                let half = parameters.number("coneangle")?.unwrap_or(30.0);
                let half = self.scene.report.within(at.place(), "`coneangle`", half, [1e-3, 180.0]);
                let edge = parameters.number("conedeltaangle")?.unwrap_or(5.0);
                let falloff = half - self.scene.report.within(at.place(), "`conedeltaangle`", edge, [0.0, half]);
                let (start, end) = (falloff.to_radians().cos(), half.to_radians().cos());
                let scale =
                    self.photometric(parameters, "power", "I", 2.0 * pi * (1.0 - start + 0.5 * (start - end)))?;
                let intensity = self.light(parameters, "I", scale, &name)?;
                let from = ctm.transform_point3(point("from", DVec3::ZERO)?);
                let to = ctm.transform_point3(point("to", DVec3::Z)?);
                let value = format!(
                    "{{ position = {}, direction = {}, intensity = {intensity}, half_angle = {}, falloff = {} }}",
                    text::vector(from),
                    text::vector(to - from),
                    text::rounded(half),
                    text::rounded(falloff)
                );
                self.scene.lights.push(Section::new("[[lights]]").with("spot", value));
            }
            "distant" => {
                let scale = self.photometric(parameters, "illuminance", "L", 1.0)?;
                let irradiance = self.light(parameters, "L", scale, &name)?;
                let travels = ctm.transform_vector3(point("to", DVec3::Z)? - point("from", DVec3::ZERO)?);
                let value = format!("{{ direction = {}, irradiance = {irradiance} }}", text::vector(travels));
                self.scene.lights.push(Section::new("[[lights]]").with("directional", value));
            }
            "infinite" => self.infinite(parameters, ctm, at, &name)?,
            other => {
                self.scene.report.left_out(at.place(), format!("the light `{}`", shown(other)));
                return Ok(());
            }
        }
        parameters.finish(&format!("the light `{kind}`"), &mut self.scene.report);
        self.scene.report.translated(format!("LightSource `{kind}`"), at.place());
        Ok(())
    }

    fn infinite(&mut self, parameters: &Parameters, ctm: &DAffine3, at: &At, name: &str) -> Result<()> {
        let mut section = Section::new("[environment]");
        match parameters.text("filename")? {
            None => {
                let scale = self.photometric(parameters, "illuminance", "L", std::f64::consts::PI)?;
                section.set("radiance", self.light(parameters, "L", scale, name)?);
            }
            Some(file) => {
                let path = at.file(file)?;
                let picture = Picture::read(&path).map_err(|problem| beside(at, &problem))?;
                if picture.size[0] != picture.size[1] {
                    let [width, height] = picture.size;
                    let message = format!("{file} has {width} x {height} pixels: maps of pbrt-v4 are square");
                    return Err(at.problem(message).into());
                }
                if parameters.get("illuminance").is_some() {
                    self.scene.report.left_out(at.place(), "the `illuminance` of a map of light");
                }
                let scale = parameters.number("scale")?.unwrap_or(1.0);
                // From directions of a map, whose top is +y, to those of the light, whose pole is +z.
                let to_light = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y);
                let frame = Frame::of(ctm.matrix3 * to_light);
                let map = unrolled(&picture);
                let map = if frame.mirrored { map.flipped(false) } else { map };
                let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                section.set("map", text::quoted(&map.write(self.scene, &stem)?));
                frame.write(&mut section);
                if scale != 1.0 {
                    section.set("scale", text::rounded(scale));
                }
                let what = "a map of equal areas as one in longitude and latitude of twice its resolution";
                // The means over all directions of both: rows of the new one are as large as their sines.
                let mean = |map: &Picture, weight: &dyn Fn(u32) -> f64| -> f64 {
                    let rows = map.linear();
                    let all = rows.chunks(map.size[0] as usize).zip(0..).map(|(row, y)| {
                        (
                            weight(y) * row.iter().flatten().map(|v| f64::from(*v)).sum::<f64>(),
                            weight(y) * row.len() as f64,
                        )
                    });
                    let (sum, count) = all.fold((0.0, 0.0), |(sum, count), (s, c)| (sum + s, count + c));
                    sum / count
                };
                let height = f64::from(map.size[1]);
                let even = mean(&picture, &|_| 1.0);
                let rolled = mean(&map, &|y| (std::f64::consts::PI * (f64::from(y) + 0.5) / height).sin());
                let off = Deviation::at_most(format!(
                    "{} degrees to the side, as edges between its texels are smoothed; {} of its light",
                    text::up(180.0 / height),
                    text::percent(if even > 0.0 { (rolled / even - 1.0).abs() } else { 0.0 })
                ));
                self.scene.report.approximated(at.place(), what, off);
            }
        }
        if self.scene.environment.is_some() {
            self.scene.report.left_out(at.place(), "a second infinite light: the first one is there");
        } else {
            self.scene.environment = Some(section);
        }
        Ok(())
    }
}

/// A spectrum in place, times a factor.
fn scaled(text: &str, scale: f64) -> String {
    if scale == 1.0 {
        return text.to_owned();
    }
    let inner = text.trim_end_matches('}').trim_end();
    format!("{inner}, scale = {} }}", text::rounded(scale))
}

/// The place of a direction, whose pole is +z, in a square of equal areas (Clarberg 2008).
fn square_of(d: DVec3) -> [f64; 2] {
    let (x, y, z) = (d.x.abs(), d.y.abs(), d.z.abs());
    let r = (1.0 - z).max(0.0).sqrt();
    let (a, b) = (x.max(y), x.min(y));
    let phi = if a == 0.0 { 0.0 } else { (b / a).atan() * std::f64::consts::FRAC_2_PI };
    let phi = if x < y { 1.0 - phi } else { phi };
    let (mut u, mut v) = (r - phi * r, phi * r);
    if d.z < 0.0 {
        (u, v) = (1.0 - v, 1.0 - u);
    }
    [(u.copysign(d.x) + 1.0) * 0.5, (v.copysign(d.y) + 1.0) * 0.5]
}

/// A square map of equal areas as one in longitude and latitude, with +z at the top.
fn unrolled(square: &Picture) -> Picture {
    /// Samples of a texel along each side.
    const WITHIN: u32 = 2;
    let side = square.size[0];
    let height = (2 * side).min(4096);
    let width = 2 * height;
    let texels = square.linear();
    let at = |u: f64, v: f64| {
        let place = |t: f64| ((t * f64::from(side)) as u32).min(side - 1);
        texels[(place(v) * side + place(u)) as usize]
    };
    let pi = std::f64::consts::PI;
    let mut out = Vec::with_capacity((width * height) as usize);
    for y in 0..height {
        for x in 0..width {
            let mut sum = [0.0f32; 3];
            for k in 0..WITHIN * WITHIN {
                let part = |i: u32| (f64::from(i) + 0.5) / f64::from(WITHIN);
                let polar = pi * (f64::from(y) + part(k / WITHIN)) / f64::from(height);
                let azimuth = 2.0 * pi * ((f64::from(x) + part(k % WITHIN)) / f64::from(width) - 0.5);
                // In the map: x = sin, -z = cos; then +y is the pole, and -z of the map the light's y.
                let d = DVec3::new(polar.sin() * azimuth.sin(), polar.sin() * azimuth.cos(), polar.cos());
                let [u, v] = square_of(d);
                let texel = at(u, v);
                sum = [0, 1, 2].map(|c| sum[c] + texel[c] / (WITHIN * WITHIN) as f32);
            }
            out.push(sum);
        }
    }
    Picture { size: [width, height], texels: Texels::Floats(out) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions spread evenly spread evenly over the square: by quarters, by poles, and by their mean.
    #[test]
    fn squares_have_equal_areas() {
        let (n, mut sum) = (200, [0usize; 16]);
        for i in 0..n {
            for j in 0..2 * n {
                let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(n);
                let azimuth = std::f64::consts::PI * (f64::from(j) + 0.5) / f64::from(n);
                let r = (1.0 - z * z).sqrt();
                let [u, v] = square_of(DVec3::new(r * azimuth.cos(), r * azimuth.sin(), z));
                sum[(4.0 * u) as usize + 4 * (4.0 * v) as usize] += 1;
            }
        }
        let expected = f64::from(2 * n * n) / 16.0;
        assert!(sum.iter().all(|count| (*count as f64 / expected - 1.0).abs() < 0.02), "{sum:?}");
        assert_eq!(square_of(DVec3::Z), [0.5, 0.5]);
        let [u, v] = square_of(DVec3::X);
        assert!((u - 1.0).abs() < 1e-9 && (v - 0.5).abs() < 1e-9, "{u} {v}");
        let [u, v] = square_of(DVec3::NEG_Z);
        assert!(u > 0.999_999 && v > 0.999_999);
    }

    #[test]
    fn maps_keep_what_lies_where() {
        // White at the pole, in the middle of the square; black elsewhere.
        let side = 16;
        let texel = |i: u32| {
            let (x, y) = (i % side, i / side);
            if (7..9).contains(&x) && (7..9).contains(&y) { [1.0; 3] } else { [0.0; 3] }
        };
        let square = Picture { size: [side; 2], texels: Texels::Floats((0..side * side).map(texel).collect()) };
        let map = unrolled(&square);
        let all = map.linear();
        assert_eq!(map.size, [64, 32]);
        assert_eq!((all[0], all[63], all[64 * 31]), ([1.0; 3], [1.0; 3], [0.0; 3]));
        // Of the sphere, as much as of the square: 4 of 256.
        let weight = |y: usize| (std::f64::consts::PI * (y as f64 + 0.5) / 32.0).sin();
        let sum: f64 =
            (0..32).map(|y| weight(y) * all[64 * y..64 * (y + 1)].iter().map(|t| f64::from(t[0])).sum::<f64>()).sum();
        let total: f64 = (0..32).map(|y| 64.0 * weight(y)).sum();
        assert!((sum / total - 4.0 / 256.0).abs() < 2e-3, "{}", sum / total);
    }
}
