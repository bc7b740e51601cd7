//! Sensors: the camera and its film.

use glam::DVec2;

use super::Importer;
use super::values::{self, Plugin};
use super::xml::Node;
use crate::Result;
use crate::import::film::{self, CATMULL_ROM, Filter};
use crate::import::report::Deviation;
use crate::import::scene::Section;
use crate::import::text;

impl<'n> Importer<'n, '_> {
    pub fn default_sensor(&mut self) {
        self.scene.report.chosen(None, "a camera at the origin that looks along +z, as the scene has none");
        let camera = Section::new("[camera.perspective]").comment("chosen: the scene has no sensor");
        let camera =
            camera.with("position", "[0.0, 0.0, 0.0]").with("look_at", "[0.0, 0.0, 1.0]").with("up", "[0.0, 1.0, 0.0]");
        self.scene.camera = Some(camera.with("fov", "45.0"));
        self.scene.film = Some(Section::new("[film]").with("width", "768").with("height", "576"));
    }

    pub fn sensor(&mut self, node: &'n Node) -> Result<()> {
        let plugin = Plugin::new(node);
        let film = plugin.objects(&["film"]);
        let [width, height] = self.film(film.first().copied())?;
        let to_world = plugin.transform("to_world")?;
        let (x, z) = (to_world.matrix3.x_axis, to_world.matrix3.z_axis);
        let up = to_world.matrix3.y_axis;
        if z.cross(up).length() < 1e-12 {
            return Err(node.problem("the `to_world` of the sensor has no direction").into());
        }
        let kind = match plugin.kind() {
            "thinlens" => "thin_lens",
            "orthographic" => "orthographic",
            "perspective" => "perspective",
            other => {
                let what = format!("the sensor `{}` as `perspective`", values::shown(other));
                let off = Deviation::unbounded("it sees other directions, or counts them otherwise");
                self.scene.report.approximated(plugin.place(), what, off);
                "perspective"
            }
        };
        let mut camera = Section::new(format!("[camera.{kind}]"));
        camera.set("position", text::vector(to_world.translation));
        camera.set("look_at", text::vector(to_world.translation + z.normalize()));
        camera.set("up", text::vector(up.normalize()));
        match kind {
            // The film is two units wide before the transform.
            "orthographic" => camera.set("width", text::rounded(2.0 * x.length())),
            _ => self.field_of_view(&plugin, &mut camera, width / height)?,
        }
        if kind == "thin_lens" {
            let radius = plugin.float("aperture_radius")?.filter(|radius| *radius > 0.0);
            let radius = radius.ok_or_else(|| node.problem("`thinlens` needs an `aperture_radius` above 0"))?;
            camera.set("aperture_radius", text::rounded(radius));
            camera.set("focus_distance", text::rounded(plugin.float("focus_distance")?.unwrap_or(1.0)));
        }
        // Columns run along -x of the sensor; Spectile's along forward x up.
        if z.cross(up).dot(-x) < 0.0 {
            camera.set("flip_x", "true");
        }
        for key in ["principal_point_offset_x", "principal_point_offset_y", "shutter_open", "shutter_close"] {
            if plugin.float(key)?.unwrap_or(0.0) != 0.0 {
                self.scene.report.left_out(plugin.place(), format!("`{key}` of the sensor"));
            }
        }
        // Clipping planes hide nothing of a scene that a camera in it would see.
        for key in ["near_clip", "far_clip"] {
            if plugin.get(key).is_some() {
                self.scene.report.left_out(plugin.place(), format!("`{key}`: nothing is clipped"));
            }
        }
        plugin.finish(&mut self.scene.report);
        self.scene.report.translated(format!("sensor `{}`", values::shown(plugin.kind())), plugin.place());
        self.scene.camera = Some(camera);
        Ok(())
    }

    fn field_of_view(&mut self, plugin: &Plugin<'n>, camera: &mut Section, aspect: f64) -> Result<()> {
        let mut axis = plugin.string("fov_axis")?.unwrap_or("x").trim();
        let fov = match (plugin.float("fov")?, plugin.string("focal_length")?) {
            (Some(_), Some(_)) => {
                let message = "has both `fov` and `focal_length`, of which a camera has one: remove the other";
                return Err(plugin.node.problem(message).into());
            }
            (Some(fov), None) => fov,
            (None, Some(length)) => {
                let millimetres = length.trim().trim_end_matches("mm").trim().parse::<f64>().ok().filter(|f| *f > 0.0);
                let millimetres =
                    millimetres.ok_or_else(|| plugin.node.problem("`focal_length` must be like `50mm`"))?;
                axis = "diagonal";
                // A frame of 36 x 24 mm.
                2.0 * (0.5 * f64::hypot(36.0, 24.0) / millimetres).atan().to_degrees()
            }
            (None, None) => {
                axis = "diagonal";
                2.0 * (0.5 * f64::hypot(36.0, 24.0) / 50.0).atan().to_degrees()
            }
        };
        if !(0.0 < fov && fov < 180.0) {
            return Err(plugin.node.problem(format!("`fov` must be between 0 and 180, but is {fov}")).into());
        }
        match axis {
            "x" => camera.set("fov", text::rounded(fov)),
            "y" | "smaller" | "larger" => {
                camera.set("fov", text::rounded(fov));
                camera.set("fov_axis", text::quoted(axis));
            }
            "diagonal" => {
                let half = (0.5 * fov).to_radians().tan() / f64::hypot(1.0, 1.0 / aspect);
                camera.set("fov", text::rounded(2.0 * half.atan().to_degrees()));
            }
            other => return Err(plugin.node.problem(format!("`fov_axis` is `{}`", values::shown(other))).into()),
        }
        Ok(())
    }

    /// Gives a film the filter nearest to `filter`, Mitsuba's Gaussian where there is none.
    fn pixel_filter(&mut self, filter: Option<&Plugin<'n>>, of: &Plugin<'n>, film: &mut Section) -> Result<()> {
        let kind = filter.map_or("gaussian", |filter| filter.kind());
        let number = |key: &str, default: f64| -> Result<f64> {
            let found = filter.map_or(Ok(None), |filter| filter.float(key))?.unwrap_or(default);
            if found >= 0.0 {
                Ok(found)
            } else {
                Err(of.node.problem(format!("the filter's `{key}` must not be negative")).into())
            }
        };
        let positive = |key: &str, default: f64| number(key, default).map(|found| found.max(1e-3));
        let known = match kind {
            "box" => Some(Filter::Box { radius: positive("radius", 0.5)? }),
            "tent" => Some(Filter::Tent { radius: positive("radius", 1.0)? }),
            "gaussian" => {
                let stddev = positive("stddev", 0.5)?;
                Some(Filter::Gaussian { stddev, radius: 4.0 * stddev })
            }
            "mitchell" => Some(Filter::Cubic { b: number("A", 1.0 / 3.0)?, c: number("B", 1.0 / 3.0)?, radius: 2.0 }),
            "catmullrom" => Some(CATMULL_ROM),
            "lanczos" => {
                let lobes = positive("lobes", 3.0)?;
                Some(Filter::Sinc { radius: lobes, lobes })
            }
            _ => None,
        };
        let shown = values::shown(kind);
        let Some(known) = known else {
            film.set("filter", "\"gaussian\"");
            let off = Deviation::unbounded("it is not known how it blurs");
            self.scene.report.approximated(
                of.place(),
                format!("the filter `{shown}` as a Gaussian of 0.5 pixels"),
                off,
            );
            return Ok(());
        };
        if let Some((own, off)) = film::filter(film, [known; 2]) {
            self.scene.report.approximated(of.place(), format!("the filter `{shown}` as {own}"), off);
        }
        if let Some(filter) = filter {
            filter.finish(&mut self.scene.report);
        }
        Ok(())
    }

    /// Translates a film; gives its width and height.
    fn film(&mut self, node: Option<&'n Node>) -> Result<[f64; 2]> {
        let Some(node) = node else {
            self.scene.film = Some(Section::new("[film]").with("width", "768").with("height", "576"));
            self.scene.report.chosen(None, "768 x 576 pixels, as the sensor has no film");
            return Ok([768.0, 576.0]);
        };
        let plugin = Plugin::new(node);
        let size = |key: &str, default: i64| -> Result<i64> {
            match plugin.whole(key)?.unwrap_or(default) {
                size @ 1..=65_536 => Ok(size),
                other => Err(node.problem(format!("`{key}` must be from 1 to 65536, but is {other}")).into()),
            }
        };
        let (width, height) = (size("width", 768)?, size("height", 576)?);
        let mut film = Section::new("[film]").with("width", width.to_string()).with("height", height.to_string());
        let filter = plugin.objects(&["rfilter"]).first().copied().map(Plugin::new);
        self.pixel_filter(filter.as_ref(), &plugin, &mut film)?;
        let crop = ["crop_offset_x", "crop_offset_y", "crop_width", "crop_height"].map(|key| plugin.whole(key));
        let [x, y, w, h] = crop;
        let (x, y) = (x?.unwrap_or(0), y?.unwrap_or(0));
        let (w, h) = (w?.unwrap_or(width - x), h?.unwrap_or(height - y));
        if [x, y, w, h] != [0, 0, width, height] {
            if x < 0 || y < 0 || w < 1 || h < 1 || x + w > width || y + h > height {
                return Err(node.problem("the crop window is not within the film").into());
            }
            film.set("crop", format!("[{x}, {y}, {}, {}]", x + w, y + h));
        }
        // What files look like is no part of the scene.
        for key in [
            "file_format",
            "pixel_format",
            "component_format",
            "banner",
            "high_quality_edges",
            "sample_border",
            "compensate",
        ] {
            plugin.get(key);
        }
        if plugin.kind() == "specfilm" {
            self.scene
                .report
                .left_out(plugin.place(), "the bands of a `specfilm`: `[channels]` of scene.toml takes their place");
            plugin.objects(&["spectrum"]);
        }
        plugin.finish(&mut self.scene.report);
        self.scene.report.translated(format!("film `{}`", values::shown(plugin.kind())), plugin.place());
        self.scene.film = Some(film);
        Ok(DVec2::new(width as f64, height as f64).to_array())
    }
}
