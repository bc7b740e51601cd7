//! The camera and film of a pbrt scene.

use std::path::Path;

use glam::{DAffine3, DVec3};

use super::Importer;
use super::token::{Parameters, shown};
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
            self.scene.report.chosen("5 bounces, as pbrt has it without an integrator");
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
                self.scene.report.chosen("pbrt's own camera at the origin, as the scene has none");
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
        if (x0 + x1).abs() > 1e-9 * (x1 - x0) || (y0 + y1).abs() > 1e-9 * (y1 - y0) {
            self.scene.report.say(
                crate::import::Fate::Approximated,
                place.clone(),
                "a `screenwindow` beside the axis as one around it",
            );
        }
        if ((x1 - x0) / (y1 - y0) / (width / height) - 1.0).abs() > 1e-6 {
            self.scene.report.say(
                crate::import::Fate::Approximated,
                place.clone(),
                "pixels that are not square as square ones",
            );
        }
        let half = 0.5 * (x1 - x0);
        let matrix = from_camera.matrix3;
        let lens = parameters.number("lensradius")?.unwrap_or(0.0);
        let name = match kind.as_str() {
            "orthographic" => "orthographic",
            "perspective" if lens > 0.0 => "thin_lens",
            "perspective" => "perspective",
            other => {
                let what = format!("the camera `{}` as `perspective`", shown(other));
                self.scene.report.say(crate::import::Fate::Approximated, place.clone(), what);
                "perspective"
            }
        };
        let mut camera = Section::new(format!("[camera.{name}]"));
        let (position, forward, up) = (from_camera.translation, matrix.z_axis, matrix.y_axis);
        camera.set("position", text::vector(position));
        camera.set("look_at", text::vector(position + forward.normalize_or(DVec3::Z)));
        camera.set("up", text::vector(up.normalize_or(DVec3::Y)));
        if name == "orthographic" {
            camera.set("width", text::rounded(2.0 * half * matrix.x_axis.length()));
        } else {
            let fov = parameters.number("fov")?.unwrap_or(90.0);
            if !(0.0 < fov && fov < 180.0) {
                return Err(Error::input(
                    source,
                    format!("the camera's `fov` must be between 0 and 180, but is {fov}"),
                ));
            }
            let tan = (0.5 * fov).to_radians().tan();
            if parameters.get("screenwindow").is_none() && parameters.get("frameaspectratio").is_none() {
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
        if forward.cross(up).dot(matrix.x_axis) < 0.0 {
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
        self.film(&film, width, height)
    }

    fn film(&mut self, film: &Parameters, width: f64, height: f64) -> Result<()> {
        let mut section = Section::new("[film]")
            .with("width", (width as u32).to_string())
            .with("height", (height as u32).to_string());
        match self.filter.as_deref() {
            Some("box") => {}
            None | Some("gaussian") => section.set("filter", "\"gaussian\""),
            Some(other) => {
                section.set("filter", "\"gaussian\"");
                self.scene.report.say(
                    crate::import::Fate::Approximated,
                    None,
                    format!("the filter `{}` as a Gaussian of 0.5 pixels", shown(other)),
                );
            }
        }
        let [w, h] = [width, height];
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
        if let Some([x0, y0, x1, y1]) = crop {
            if !(0.0 <= x0 && x0 < x1 && x1 <= w && 0.0 <= y0 && y0 < y1 && y1 <= h) {
                return Err(film.0[0].at.problem("the crop window is not within the film").into());
            }
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
