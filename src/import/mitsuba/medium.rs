//! Media of Mitsuba that are the same all over.

use super::Importer;
use super::colour::Of;
use super::values::{self, Plugin};
use super::xml::Node;
use crate::Result;
use crate::import::media::{self, Matter, Phase};
use crate::import::picture::Colour;
use crate::spectral::Curve;

/// Phase functions within phase functions.
const DEEPEST: usize = 16;

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
        let Some(phases) = self.phases(&plugin)? else { return Ok(None) };
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
            phases,
        };
        let name = self.name_of(node);
        let name = media::put(self.scene, &name, &matter)?;
        plugin.finish(&mut self.scene.report);
        self.scene.report.translated("medium `homogeneous`", plugin.place());
        Ok(Some(name))
    }

    /// Where the light goes that a medium scatters, each way with its share; `None` for one that is left out.
    fn phases(&mut self, medium: &Plugin<'n>) -> Result<Option<Vec<(f64, Phase)>>> {
        match medium.objects(&["phase", "ref"]).first() {
            Some(node) => self.phase(node, 0),
            None => Ok(Some(vec![(1.0, Phase::HenyeyGreenstein(0.0))])),
        }
    }

    fn phase(&mut self, node: &'n Node, depth: usize) -> Result<Option<Vec<(f64, Phase)>>> {
        let plugin = Plugin::new(self.resolve(node)?);
        let phases = match plugin.kind() {
            "isotropic" => vec![(1.0, Phase::HenyeyGreenstein(0.0))],
            "rayleigh" => vec![(1.0, Phase::Rayleigh)],
            "hg" => {
                let g = plugin.float("g")?.unwrap_or(0.8);
                if g.abs() >= 1.0 {
                    return Err(plugin.node.problem("`g` must lie between -1 and 1").into());
                }
                vec![(1.0, Phase::HenyeyGreenstein(g))]
            }
            "blendphase" => {
                let Some(blended) = self.blended(&plugin, depth)? else { return Ok(None) };
                blended
            }
            other => {
                let what = format!("a medium with the phase function `{}`", values::shown(other));
                self.scene.report.left_out(plugin.place(), what);
                return Ok(None);
            }
        };
        plugin.finish(&mut self.scene.report);
        Ok(Some(phases))
    }

    /// Two phase functions by their shares, the same at all wavelengths, as they are in Mitsuba.
    fn blended(&mut self, plugin: &Plugin<'n>, depth: usize) -> Result<Option<Vec<(f64, Phase)>>> {
        if depth >= DEEPEST {
            return Err(plugin.node.problem("has phase functions within more than 16 others").into());
        }
        let weight = match plugin.get("weight").map(|node| self.resolve(node)).transpose()? {
            Some(node) if node.tag == "float" => plugin.float("weight")?,
            Some(_) => self.of_volume(plugin, "weight", 0.5)?.map(|curve| curve.eval(550.0)),
            None => return Err(plugin.node.problem("`blendphase` needs a `weight`").into()),
        };
        let Some(weight) = weight else {
            self.scene.report.left_out(plugin.place(), "a medium whose phase function differs from place to place");
            return Ok(None);
        };
        if !(0.0..=1.0).contains(&weight) {
            return Err(plugin.node.problem("the `weight` of `blendphase` must lie between 0 and 1").into());
        }
        let [first, second] = plugin.objects(&["phase", "ref"])[..] else {
            return Err(plugin.node.problem("`blendphase` needs two phase functions").into());
        };
        let (Some(first), Some(second)) = (self.phase(first, depth + 1)?, self.phase(second, depth + 1)?) else {
            return Ok(None);
        };
        let of = |share: f64, all: Vec<(f64, Phase)>| all.into_iter().map(move |(part, phase)| (share * part, phase));
        let both = of(1.0 - weight, first).chain(of(weight, second));
        Ok(Some(both.filter(|(share, _)| *share > 0.0).collect()))
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
