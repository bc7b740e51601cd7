//! Media of pbrt that are the same all over.

use super::Importer;
use super::colour::Of;
use super::token::{At, Parameters, shown};
use crate::Result;
use crate::import::media::{self, Matter, Phase};
use crate::import::picture::unbounded;
use crate::spectral::Curve;

/// What pbrt-v4 takes where a homogeneous medium says nothing, per unit of length: linear sRGB.
const ABSORPTION: [f64; 3] = [0.0011, 0.0024, 0.014];
const SCATTERING: [f64; 3] = [2.55, 3.21, 3.77];

impl Importer<'_> {
    /// The medium of a `MakeNamedMedium` in the scene; `None` where it is left out, which is said.
    pub fn medium(&mut self, name: &str, parameters: &Parameters, at: &At) -> Result<Option<String>> {
        let kind = parameters.text("type")?.ok_or_else(|| at.problem("the medium has no `type`"))?;
        if kind != "homogeneous" {
            let what = format!("the medium \"{}\" (`{}`): it differs from place to place", shown(name), shown(kind));
            self.scene.report.left_out(at.place(), what);
            parameters.ask_for_all();
            return Ok(None);
        }
        if parameters.get("preset").is_some() {
            let what = format!("the medium \"{}\" by a `preset`: its numbers are pbrt's own", shown(name));
            self.scene.report.left_out(at.place(), what);
            parameters.ask_for_all();
            return Ok(None);
        }
        if parameters.get("Le").is_some() {
            parameters.get("Lescale");
            self.scene.report.left_out(at.place(), format!("what the medium \"{}\" emits (`Le`)", shown(name)));
        }
        let scale = parameters.number("scale")?.unwrap_or(1.0);
        let g = parameters.number("g")?.unwrap_or(0.0);
        if !(0.0..=f64::MAX).contains(&scale) || g.abs() >= 1.0 {
            return Err(at.problem("a medium needs a `scale` of 0 or more, and `g` between -1 and 1").into());
        }
        let mut coefficient = |key: &str, default: [f64; 3]| -> Result<Curve> {
            let found = self.colour(parameters, key, Of::Index)?.map(|colour| colour.mean());
            let curve = found.unwrap_or_else(|| unbounded(default));
            Ok(media::both(&curve, &Curve::Constant(scale), |a, scale| scale * a))
        };
        let matter = Matter {
            absorption: coefficient("sigma_a", ABSORPTION)?,
            scattering: coefficient("sigma_s", SCATTERING)?,
            phases: vec![(1.0, Phase::HenyeyGreenstein(g))],
        };
        let medium = media::put(self.scene, name, &matter)?;
        parameters.finish(&format!("the medium \"{}\"", shown(name)), &mut self.scene.report);
        self.scene.report.translated("MakeNamedMedium `homogeneous`", at.place());
        Ok(Some(medium))
    }

    /// `MediumInterface`.
    pub fn interface(&mut self, inside: &str, outside: &str, at: &At) -> Result<()> {
        let found = |name: &str| -> Result<Option<String>> {
            if name.is_empty() {
                return Ok(None);
            }
            let medium = self.media.get(name).cloned();
            Ok(medium.ok_or_else(|| at.problem(format!("no medium is named \"{}\"", shown(name))))?)
        };
        let (within, around) = (found(inside)?, found(outside)?);
        // One on both sides bounds nothing.
        self.state.inside = within.filter(|_| inside != outside);
        if let Some(around) = around {
            let what = format!("the medium \"{}\" outside of shapes, or around the camera", shown(&around));
            self.scene.report.left_out(at.place(), what);
        }
        Ok(())
    }
}
