//! Emitters without a shape: lights and the environment.

use glam::{DAffine3, DMat3, DVec3};

use super::colour::Of;
use super::values::{self, Plugin, place};
use super::xml::{Node, inside};
use super::{Importer, at};
use crate::Result;
use crate::import::environment;
use crate::import::picture::{Colour, Picture, Texels};
use crate::import::report::Deviation;
use crate::import::scene::Section;
use crate::import::text;

/// Rows of a map that is made finer, so that its light comes from where it did.
const SMALL: u32 = 256;

impl<'n> Importer<'n, '_> {
    pub fn emitter(&mut self, node: &'n Node) -> Result<()> {
        let plugin = Plugin::new(node);
        let to_world = plugin.transform("to_world")?;
        let name = self.name_of(node);
        match plugin.kind() {
            "constant" => {
                let radiance = self.light(&plugin, "radiance", &name)?;
                self.environment(Section::new("[environment]").with("radiance", radiance), node);
            }
            "envmap" => self.map(&plugin, &to_world)?,
            "point" => {
                let position = plugin.vector("position")?.unwrap_or(to_world.translation);
                let intensity = self.light(&plugin, "intensity", &name)?;
                let value = format!("{{ position = {}, intensity = {intensity} }}", text::vector(position));
                self.scene.lights.push(Section::new("[[lights]]").with("point", value));
            }
            "directional" => {
                let direction = plugin.vector("direction")?.unwrap_or(to_world.transform_vector3(DVec3::Z));
                let irradiance = self.light(&plugin, "irradiance", &name)?;
                let value = format!("{{ direction = {}, irradiance = {irradiance} }}", text::vector(direction));
                self.scene.lights.push(Section::new("[[lights]]").with("directional", value));
            }
            "spot" => {
                let intensity = self.light(&plugin, "intensity", &name)?;
                let half = plugin.float("cutoff_angle")?.unwrap_or(20.0);
                let half = self.scene.report.within(plugin.place(), "`cutoff_angle`", half, [1e-3, 180.0]);
                let beam = plugin.float("beam_width")?.unwrap_or(0.75 * half);
                let beam = self.scene.report.within(plugin.place(), "`beam_width`", beam, [0.0, half]);
                let value = format!(
                    "{{ position = {}, direction = {}, intensity = {intensity}, half_angle = {}, falloff = {}, profile = \"linear\" }}",
                    text::vector(to_world.translation),
                    text::vector(to_world.transform_vector3(DVec3::Z)),
                    text::rounded(half),
                    text::rounded(beam)
                );
                self.scene.lights.push(Section::new("[[lights]]").with("spot", value));
            }
            other => {
                self.scene.report.left_out(plugin.place(), format!("the emitter `{}`", values::shown(other)));
                return Ok(());
            }
        }
        plugin.finish(&mut self.scene.report);
        self.scene.report.translated(format!("emitter `{}`", plugin.kind()), plugin.place());
        Ok(())
    }

    /// The spectrum of a light as text.
    pub fn light(&mut self, plugin: &Plugin<'n>, key: &str, name: &str) -> Result<String> {
        let colour = self.colour(plugin, key, Of::Emission, true)?;
        let Some(colour) = colour else {
            // As Mitsuba has it: daylight of luminance 1.
            return Ok("{ rgb = [1.0, 1.0, 1.0] }".to_owned());
        };
        if colour.is_texture() {
            let off = colour.off_its_mean();
            self.scene.report.approximated(plugin.place(), format!("`{key}` by a texture as its mean"), off);
            let Colour::Texture(texture) = &colour else { return Ok("0.0".to_owned()) };
            return Ok(format!("{{ rgb = {} }}", text::list(texture.picture.mean())));
        }
        colour.toml(self.scene, &format!("{name}-light"))
    }

    fn environment(&mut self, section: Section, node: &Node) {
        if self.scene.environment.is_some() {
            self.scene.report.left_out(place(node), "a second environment: the first one is there");
            return;
        }
        self.scene.environment = Some(section);
    }

    fn map(&mut self, plugin: &Plugin<'n>, to_world: &DAffine3) -> Result<()> {
        let node = plugin.node;
        let name = plugin.string("filename")?.ok_or_else(|| node.problem("`envmap` has no `filename`"))?;
        let path = inside(name, node)?;
        let scale = plugin.float("scale")?.unwrap_or(1.0);
        // Mitsuba's left edge looks along -z, Spectile's middle does.
        let turn = to_world.matrix3 * DMat3::from_rotation_y(std::f64::consts::PI);
        let mut picture = Picture::read(&path).map_err(|problem| at(node, &problem))?;
        let frame = environment::Frame::of(turn);
        if frame.mirrored {
            picture = picture.flipped(false);
        }
        let is_large = picture.size[1] > SMALL;
        if !is_large {
            picture = picture.between_poles((512 / picture.size[1].max(1) as usize).clamp(1, 8));
        } else {
            let rows = picture.size[1];
            let off = format!("{} degrees, half a row of {rows}, at the poles", text::up(90.0 / f64::from(rows)));
            self.scene.report.approximated(
                plugin.place(),
                "a map whose first and last row are the poles as one of even rows",
                Deviation::at_most(off),
            );
        }
        let is_map = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr") || e.eq_ignore_ascii_case("hdr"));
        let map = if is_map && !frame.mirrored && is_large {
            self.scene.copy("textures", &path)?
        } else {
            let texels = Texels::Floats(picture.linear());
            let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            Picture { texels, ..picture }.write(self.scene, &stem)?
        };
        let mut section = Section::new("[environment]").with("map", text::quoted(&map));
        frame.write(&mut section);
        if scale != 1.0 {
            section.set("scale", text::rounded(scale));
        }
        self.environment(section, node);
        Ok(())
    }
}
