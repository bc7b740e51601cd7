//! The camera and film of a pbrt scene.

use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};

use super::Importer;
use super::token::{Parameters, shown};
use crate::import::environment::Frame;
use crate::import::film::{self, Filter, Window};
use crate::import::report::Deviation;
use crate::import::scene::Section;
use crate::import::text;
use crate::{Error, Result};

impl Importer<'_> {
    /// What is known only at the end: camera and film.
    pub fn finish(&mut self, source: &Path) -> Result<()> {
        if let Some((_, end)) = self.saved.last() {
            return Err(Error::input(source, format!("ends before an `{end}`")));
        }
        if !self.in_world {
            return Err(Error::input(source, "has no `WorldBegin`"));
        }
        if self.scene.integrator.is_none() {
            self.scene.integrator = Some(Section::new("[integrator]").with("max_bounces", "5"));
            self.scene.report.chosen(None, "5 bounces, as pbrt has it without an integrator");
        }
        let film = std::mem::take(&mut self.film);
        let size = |name: &str, default: f64| -> Result<f64> {
            let size = film.number(name)?.unwrap_or(default);
            if size.fract() != 0.0 || !(1.0..=65_536.0).contains(&size) {
                return Err(Error::input(
                    source,
                    format!("the film's `{name}` must be from 1 to 65536, but is {size}"),
                ));
            }
            Ok(size)
        };
        let (width, height) = (size("xresolution", 1280.0)?, size("yresolution", 720.0)?);
        let (kind, parameters, from_camera, at) = match self.camera.take() {
            Some((kind, parameters, from_camera, at)) => (kind, parameters, from_camera, Some(at)),
            None => {
                self.scene.report.chosen(None, "pbrt's own camera at the origin, as the scene has none");
                ("perspective".to_owned(), Parameters::default(), DAffine3::IDENTITY, None)
            }
        };
        let place = at.as_ref().map(|at| at.place());
        let aspect = parameters.number("frameaspectratio")?.unwrap_or(width / height);
        let window = match parameters.get("screenwindow").map(|window| window.numbers.clone()) {
            Some(window) => match window[..] {
                [x0, x1, y0, y1] if x0 < x1 && y0 < y1 => [x0, x1, y0, y1],
                _ => return Err(Error::input(source, "`screenwindow` must be x0 < x1 and y0 < y1")),
            },
            None if aspect > 1.0 => [-aspect, aspect, -1.0, 1.0],
            None => [-1.0, 1.0, -1.0 / aspect, 1.0 / aspect],
        };
        let [x0, x1, y0, y1] = window;
        let beside = [0.5 * (x0 + x1) / (x1 - x0) * width, -0.5 * (y0 + y1) / (y1 - y0) * height];
        let window = film::window([width, height], beside);
        if window.off > 1e-6 {
            let off = Deviation::at_most(format!("{} pixels to the side", text::up(window.off)));
            self.scene.report.approximated(place.clone(), "a `screenwindow` beside the axis by whole pixels", off);
        }
        let squareness = (x1 - x0) / (y1 - y0) / (width / height);
        if (squareness - 1.0).abs() > 1e-6 {
            let rows = 0.5 * height * (1.0 - 1.0 / squareness).abs();
            let off = Deviation::at_most(format!("{} rows, at the upper and the lower edge", text::up(rows)));
            self.scene.report.approximated(place.clone(), "pixels that are not square as square ones", off);
        }
        let half = 0.5 * (x1 - x0) * window.size[0] / width;
        let matrix = from_camera.matrix3;
        let lens = parameters.number("lensradius")?.unwrap_or(0.0);
        let name = match kind.as_str() {
            "orthographic" => "orthographic",
            "perspective" if lens > 0.0 => "thin_lens",
            "perspective" => "perspective",
            "spherical" => {
                let mapping = parameters.text("mapping")?.unwrap_or("equalarea");
                if mapping != "equirectangular" {
                    let what =
                        format!("a `spherical` camera of the mapping `{}` by longitude and latitude", shown(mapping));
                    let off =
                        Deviation::at_most("the arrangement of pixels: each shows the radiance of its own direction");
                    self.scene.report.approximated(place.clone(), what, off);
                }
                "latlong"
            }
            other => {
                let what = format!("the camera `{}` as `perspective`", shown(other));
                let off = Deviation::unbounded("its lenses bend, blur and darken, or its pixels see other directions");
                self.scene.report.approximated(place.clone(), what, off);
                "perspective"
            }
        };
        let mut camera = Section::new(format!("[camera.{name}]"));
        let (position, forward, up) = (from_camera.translation, matrix.z_axis, matrix.y_axis);
        camera.set("position", text::vector(position));
        if name == "latlong" {
            // pbrt's left edge looks along +x and then +z of the camera, Spectile's along +z and then -x.
            let frame = Frame::of(matrix * DMat3::from_cols(DVec3::NEG_Z, DVec3::Y, DVec3::X));
            if frame.mirrored {
                let off = Deviation::at_most("that left is right");
                self.scene.report.approximated(place.clone(), "a mirrored `spherical` camera as it is unmirrored", off);
            }
            frame.write(&mut camera);
        } else {
            camera.set("look_at", text::vector(position + forward.normalize_or(DVec3::Z)));
            camera.set("up", text::vector(up.normalize_or(DVec3::Y)));
        }
        if name == "orthographic" {
            camera.set("width", text::rounded(2.0 * half * matrix.x_axis.length()));
        } else if name != "latlong" {
            let fov = parameters.number("fov")?.unwrap_or(90.0);
            if !(0.0 < fov && fov < 180.0) {
                return Err(Error::input(
                    source,
                    format!("the camera's `fov` must be between 0 and 180, but is {fov}"),
                ));
            }
            let tan = (0.5 * fov).to_radians().tan();
            let is_plain = parameters.get("screenwindow").is_none() && parameters.get("frameaspectratio").is_none();
            if is_plain {
                camera.set("fov", text::rounded(fov));
                camera.set("fov_axis", "\"smaller\"");
            } else {
                camera.set("fov", text::rounded(2.0 * (tan * half).atan().to_degrees()));
            }
        }
        if name == "thin_lens" {
            camera.set("aperture_radius", text::rounded(lens));
            camera.set("focus_distance", text::rounded(parameters.number("focaldistance")?.unwrap_or(1e6)));
        }
        parameters.get("focaldistance");
        // Cameras of pbrt are left-handed: columns run along +x.
        if name != "latlong" && forward.cross(up).dot(matrix.x_axis) < 0.0 {
            camera.set("flip_x", "true");
        }
        for time in ["shutteropen", "shutterclose"] {
            parameters.get(time);
        }
        parameters.finish("the camera", &mut self.scene.report);
        if let Some(place) = place {
            self.scene.report.translated(format!("Camera `{}`", shown(&kind)), place);
        }
        self.scene.camera = Some(camera);
        self.film(&film, [width, height], &window)
    }

    /// Gives a film the filter nearest to that of the scene.
    fn pixel_filter(&mut self, film: &mut Section) -> Result<()> {
        let (kind, parameters, at) = match self.filter.take() {
            Some((kind, parameters, at)) => (kind, parameters, Some(at.place())),
            None => ("gaussian".to_owned(), Parameters::default(), None),
        };
        let number = |key: &str, default: f64| -> Result<f64> { Ok(parameters.number(key)?.unwrap_or(default)) };
        let radii = |default: f64| -> Result<[f64; 2]> {
            Ok([number("xradius", default)?.max(1e-3), number("yradius", default)?.max(1e-3)])
        };
        let both = match kind.as_str() {
            "box" => radii(0.5)?.map(|radius| Filter::Box { radius }),
            "triangle" => radii(2.0)?.map(|radius| Filter::Tent { radius }),
            "gaussian" => {
                let stddev = number("sigma", 0.5)?.max(1e-3);
                radii(1.5)?.map(|radius| Filter::Gaussian { stddev, radius })
            }
            "mitchell" => {
                let (b, c) = (number("B", 1.0 / 3.0)?, number("C", 1.0 / 3.0)?);
                radii(2.0)?.map(|radius| Filter::Cubic { b, c, radius })
            }
            "sinc" => {
                let lobes = number("tau", 3.0)?.max(1e-3);
                radii(4.0)?.map(|radius| Filter::Sinc { radius, lobes })
            }
            other => {
                film.set("filter", "\"gaussian\"");
                let what = format!("the filter `{}` as a Gaussian of 0.5 pixels", shown(other));
                self.scene.report.approximated(at, what, Deviation::unbounded("it is not known how it blurs"));
                return Ok(());
            }
        };
        let said =
            if at.is_some() { format!("the filter `{kind}`") } else { "pbrt's own filter, `gaussian`,".to_owned() };
        if let Some((own, off)) = film::filter(film, both) {
            self.scene.report.approximated(at, format!("{said} as {own}"), off);
        }
        parameters.finish(&format!("the filter `{kind}`"), &mut self.scene.report);
        Ok(())
    }

    fn film(&mut self, film: &Parameters, [w, h]: [f64; 2], window: &Window) -> Result<()> {
        let [width, height] = window.size.map(|size| (size as u32).to_string());
        let mut section = Section::new("[film]").with("width", width).with("height", height);
        self.pixel_filter(&mut section)?;
        let crop = match (film.get("cropwindow"), film.get("pixelbounds")) {
            (Some(crop), _) => match crop.numbers[..] {
                // As pbrt rounds: up.
                [x0, x1, y0, y1] => Some([(x0 * w).ceil(), (y0 * h).ceil(), (x1 * w).ceil(), (y1 * h).ceil()]),
                _ => return Err(crop.at.problem("`cropwindow` needs four numbers").into()),
            },
            (None, Some(bounds)) => match bounds.numbers[..] {
                [x0, x1, y0, y1] => Some([x0, y0, x1, y1]),
                _ => return Err(bounds.at.problem("`pixelbounds` needs four numbers").into()),
            },
            (None, None) => None,
        };
        let is_beside = window.size != [w, h];
        if let Some([x0, y0, x1, y1]) = crop.or(is_beside.then_some([0.0, 0.0, w, h])) {
            if !(0.0 <= x0 && x0 < x1 && x1 <= w && 0.0 <= y0 && y0 < y1 && y1 <= h) {
                return Err(film.0[0].at.problem("the crop window is not within the film").into());
            }
            let [x, y] = window.first;
            let [x0, x1, y0, y1] = [x + x0, x + x1, y + y0, y + y1];
            section.set("crop", format!("[{x0}, {y0}, {x1}, {y1}]"));
        }
        for unread in
            ["filename", "diagonal", "savefp16", "xresolution", "yresolution", "maxcomponentvalue", "coordinatesystem"]
        {
            film.get(unread);
        }
        film.finish("the film: Spectile shows radiance as it is", &mut self.scene.report);
        self.scene.film = Some(section);
        Ok(())
    }
}
