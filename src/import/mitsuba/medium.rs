//! Media of Mitsuba that are the same all over.

use super::Importer;
use super::colour::Of;
use super::values::{self, Plugin};
use super::xml::Node;
use crate::Result;
use crate::import::media::{self, Matter, Phase};
use crate::import::picture::Colour;
use crate::spectral::Curve;

impl<'n> Importer<'n, '_> {
    /// The name of the medium that an element is or means; `None` where it is left out, which is said.
    pub fn medium(&mut self, node: &'n Node) -> Result<Option<String>> {
        let node = self.resolve(node)?;
        if let Some(known) = self.media.get(&std::ptr::from_ref(node)) {
            return Ok(known.clone());
        }
        let made = self.made_of_matter(node)?;
        self.media.insert(std::ptr::from_ref(node), made.clone());
        Ok(made)
    }

    fn made_of_matter(&mut self, node: &'n Node) -> Result<Option<String>> {
        let plugin = Plugin::new(node);
        if plugin.kind() != "homogeneous" {
            let what = format!(
                "a medium `{}`: of those that are the same all over there are some",
                values::shown(plugin.kind())
            );
            self.scene.report.left_out(plugin.place(), what);
            return Ok(None);
        }
        let Some(phase) = self.phase(&plugin)? else { return Ok(None) };
        let (Some(albedo), Some(extinction)) =
            (self.of_volume(&plugin, "albedo", 0.75)?, self.of_volume(&plugin, "sigma_t", 1.0)?)
        else {
            self.scene.report.left_out(plugin.place(), "a medium that differs from place to place");
            return Ok(None);
        };
        let scale = plugin.float("scale")?.unwrap_or(1.0);
        // They choose how it is rendered there.
        for key in ["sample_emitters", "has_spectral_extinction"] {
            plugin.get(key);
        }
        let is_right = media::is_within(&albedo, 0.0..=1.0) && media::is_within(&extinction, 0.0..=f64::MAX);
        if !is_right || !(0.0..=f64::MAX).contains(&scale) {
            return Err(node
                .problem("a medium needs an `albedo` in [0, 1], and a `sigma_t` and `scale` of 0 or more")
                .into());
        }
        let matter = Matter {
            absorption: media::both(&albedo, &extinction, |albedo, extinction| scale * extinction * (1.0 - albedo)),
            scattering: media::both(&albedo, &extinction, |albedo, extinction| scale * extinction * albedo),
            phase,
        };
        let name = self.name_of(node);
        let name = media::put(self.scene, &name, &matter)?;
        plugin.finish(&mut self.scene.report);
        self.scene.report.translated("medium `homogeneous`", plugin.place());
        Ok(Some(name))
    }

    /// `None` for one that is left out.
    fn phase(&mut self, medium: &Plugin<'n>) -> Result<Option<Phase>> {
        let Some(node) = medium.objects(&["phase", "ref"]).first().copied() else {
            return Ok(Some(Phase::HenyeyGreenstein(0.0)));
        };
        let plugin = Plugin::new(self.resolve(node)?);
        let phase = match plugin.kind() {
            "isotropic" => Phase::HenyeyGreenstein(0.0),
            "rayleigh" => Phase::Rayleigh,
            "hg" => {
                let g = plugin.float("g")?.unwrap_or(0.8);
                if g.abs() >= 1.0 {
                    return Err(plugin.node.problem("`g` must lie between -1 and 1").into());
                }
                Phase::HenyeyGreenstein(g)
            }
            other => {
                let what = format!("a medium with the phase function `{}`", values::shown(other));
                self.scene.report.left_out(plugin.place(), what);
                return Ok(None);
            }
        };
        plugin.finish(&mut self.scene.report);
        Ok(Some(phase))
    }

    /// A parameter of a medium, as a number, a spectrum, or a volume that is the same all over; `None` for others.
    fn of_volume(&mut self, medium: &Plugin<'n>, name: &str, default: f64) -> Result<Option<Curve>> {
        let Some(node) = medium.get(name) else { return Ok(Some(Curve::Constant(default))) };
        let node = self.resolve(node)?;
        if node.tag == "volume" {
            let plugin = Plugin::new(node);
            return match plugin.kind() {
                "constvolume" => self.of_volume(&plugin, "value", default),
                _ => Ok(None),
            };
        }
        match self.colour_of(node, Of::Unbounded, true)? {
            Colour::Spectrum(curve, _) => Ok(Some(curve)),
            Colour::Texture(_) => Ok(None),
        }
    }
}
