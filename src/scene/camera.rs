//! `[camera]` and `[film]`, and what rays they make.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DMat2, DVec2, DVec3};

use super::decode::{Fields, Item};
use super::environment::to_map;
use super::keys::{CAMERA, DISTORTION, FILM, LATLONG, ORTHOGRAPHIC, PERSPECTIVE, PUSHBROOM, THIN_LENS};
use super::spectrum::report_in_file;
use super::{Camera, Distortion, Film, Filter, Line, Projection};
use crate::format::track::{self, Station};

/// Newton's steps, of which each doubles the digits.
const UNDOING: usize = 20;
/// Places along a side of the film at which a distortion is tried.
const TRIED: u32 = 32;

impl Camera {
    /// Where a pinhole would have what the lens shows at `seen`, y up.
    fn before_lens(&self, seen: DVec2) -> DVec2 {
        let down = DVec2::new(1.0, -1.0);
        self.distortion.and_then(|distortion| distortion.undone(seen * down)).map_or(seen, |at| at * down)
    }

    /// The tangent of the angle that a pixel spans on the axis, of cameras that have one; of a line scanner across the track.
    pub fn pixel_tangent(&self, film: &Film) -> Option<f64> {
        let half = match &self.projection {
            Projection::Perspective { tan_half } | Projection::ThinLens { tan_half, .. } => tan_half.x,
            Projection::Pushbroom { half_width, .. } => *half_width,
            Projection::Orthographic { .. } | Projection::Latlong => return None,
        };
        Some(2.0 * half / f64::from(film.width))
    }

    /// Whether the distortion cannot be undone somewhere on the film, or the two pixels around it that a filter reaches.
    fn folds(&self, film: &Film) -> bool {
        let (Some(distortion), Projection::Perspective { tan_half } | Projection::ThinLens { tan_half, .. }) =
            (self.distortion, &self.projection)
        else {
            return false;
        };
        let beyond = DVec2::ONE + 4.0 / DVec2::new(f64::from(film.width), f64::from(film.height));
        let step = |i: u32| 2.0 * f64::from(i) / f64::from(TRIED) - 1.0;
        let places = (0..=TRIED).flat_map(|i| (0..=TRIED).map(move |j| DVec2::new(step(i), step(j))));
        let mut places = places.map(|place| place * beyond * *tan_half);
        places.any(|place| distortion.undone(place).is_none())
    }

    /// Origin, m, and direction (a unit vector) of the ray through a place on the full film, in pixels from its top left, and a place on
    /// the lens, in its radii: (0, 0) is the middle; of a line scanner lens.x in [-1, 1] is where along the track in the pixel. In f64, as
    /// the reference has it; shaders have their own.
    pub fn ray(&self, film: &Film, place: DVec2, lens: DVec2) -> [DVec3; 2] {
        // -1 … 1 across the film, y upwards.
        let size = DVec2::new(f64::from(film.width), f64::from(film.height));
        let at = DVec2::new(2.0, -2.0) * place / size + DVec2::new(-1.0, 1.0);
        let across = |at: DVec2| at.x * self.right + at.y * self.up;
        match self.projection {
            Projection::Perspective { tan_half } => {
                [self.position, (self.forward + across(self.before_lens(at * tan_half))).normalize()]
            }
            Projection::ThinLens { tan_half, aperture_radius, focus_distance } => {
                let lens = aperture_radius * across(lens);
                let focus = focus_distance * (self.forward + across(self.before_lens(at * tan_half)));
                [self.position + lens, (focus - lens).normalize()]
            }
            Projection::Orthographic { half_size } => [self.position + across(at * half_size), self.forward],
            Projection::Pushbroom { half_width, half_pixel, ref lines } => {
                let Line { position, forward, right, nose } = Line::at(lines, place.y);
                [position, (forward + at.x * half_width * right + lens.x * half_pixel * nose).normalize()]
            }
            Projection::Latlong => {
                let (longitude, latitude) = (PI * at.x, 0.5 * PI * at.y);
                let level = longitude.cos() * self.forward + longitude.sin() * self.right;
                [self.position, (latitude.cos() * level + latitude.sin() * self.up).normalize()]
            }
        }
    }
}

/// Pixels along one side: places on wider films, in f32, would be off by more than 1/32 of a pixel.
const MAX_SIDE: u32 = 131_072;

pub fn decode_film(item: &Item) -> Option<Film> {
    let fields = item.table(&FILM)?;
    let side = |key: &str| fields.require(key, &format!("{key} = 512 (pixels)")).and_then(|i| i.whole(1..=MAX_SIDE));
    let (width, height) = (side("width"), side("height"));
    let filter = match fields.get("filter") {
        Some(item) => item.choice(&[("box", Filter::Box), ("gaussian", Filter::Gaussian)]),
        None => Some(Filter::Box),
    };
    let crop = fields.get("crop");
    let (width, height) = (width?, height?);
    let crop = match crop {
        Some(item) => decode_crop(&item, width, height),
        None => Some([0, 0, width, height]),
    };
    Some(Film { width, height, filter: filter?, crop: crop? })
}

fn decode_crop(item: &Item, width: u32, height: u32) -> Option<[u32; 4]> {
    let items = item.array_of::<4>("four whole numbers [x0, y0, x1, y1]")?;
    let mut limits = [width, height, width, height].into_iter();
    let numbers = items.each_ref().map(|item| item.whole(0..=limits.next().unwrap_or_default()));
    let [x0, y0, x1, y1] = numbers;
    let crop = [x0?, y0?, x1?, y1?];
    if crop[0] >= crop[2] || crop[1] >= crop[3] {
        let help = "write [x0, y0, x1, y1] with x0 < x1 and y0 < y1";
        item.error_help("is empty: it must hold at least one pixel", help);
        return None;
    }
    Some(crop)
}

/// Where the camera names the medium that fills space, if it does.
pub fn medium<'a>(item: &Item<'a>) -> Option<Item<'a>> {
    CAMERA.one_of().find_map(|kind| item.member(kind))?.member("medium")
}

/// `film` gives the shape of the picture; without it (it was wrong) only mistakes are looked for.
pub fn decode_camera(item: &Item, film: Option<&Film>) -> Option<Camera> {
    let fields = item.table(&CAMERA)?;
    let kind = fields.exactly_one("kind of camera")?;
    let size = film.map_or(DVec2::ONE, |film| DVec2::new(f64::from(film.width), f64::from(film.height)));
    let (fields, projection) = match kind.path.as_str() {
        "camera.perspective" => {
            let fields = kind.table(&PERSPECTIVE)?;
            let projection = tan_half(&fields, size).map(|tan_half| Projection::Perspective { tan_half });
            (fields, projection)
        }
        "camera.thin_lens" => {
            let fields = kind.table(&THIN_LENS)?;
            let projection = thin_lens(&fields, size);
            (fields, projection)
        }
        "camera.latlong" => return decode_latlong(&kind, film),
        "camera.pushbroom" => return decode_pushbroom(&kind, film),
        _ => {
            let fields = kind.table(&ORTHOGRAPHIC)?;
            let width = fields.require("width", "width = 1.0 (metres seen from left to right)");
            let half = width.and_then(|item| item.positive()).map(|width| 0.5 * width);
            let half_size = half.map(|half| DVec2::new(half, half * size.y / size.x));
            (fields, half_size.map(|half_size| Projection::Orthographic { half_size }))
        }
    };
    let frame = placement(&fields);
    // An orthographic camera has no such key.
    let at = if kind.path == "camera.orthographic" { None } else { fields.get("distortion") };
    let distortion = at.as_ref().map(decode_distortion);
    let (projection, [position, right, up, forward]) = (projection?, frame?);
    let distortion = match distortion {
        Some(distortion) => Some(distortion?),
        None => None,
    };
    let film = film?;
    let camera = Camera { position, forward, right, up, projection, distortion };
    if let Some(item) = at.filter(|_| camera.folds(film)) {
        item.error_help(
            "folds the picture over: a place of the film would be one of several directions, or of none",
            "check its signs, and that they are for coordinates in units of the focal length",
        );
        return None;
    }
    Some(camera)
}

/// Where the scanner is, from a file of a row a line.
fn decode_pushbroom(item: &Item, film: Option<&Film>) -> Option<Camera> {
    let fields = item.table(&PUSHBROOM)?;
    let size = film.map_or(DVec2::ONE, |film| DVec2::new(f64::from(film.width), f64::from(film.height)));
    let tan_half = tan_half(&fields, size);
    let up = fields.get("up").map_or(Some(DVec3::Y), |item| item.direction());
    let north = fields.get("north").map(|item| item.direction());
    let file =
        fields.require("lines", "lines = \"track.csv\", with the columns x,y,z,yaw_degrees,pitch_degrees,roll_degrees");
    let stations = file.as_ref().and_then(|file| {
        let path = file.cx.path(file.text()?);
        track::read(&path).map_err(|problem| report_in_file(file, *problem)).ok()
    });
    let (tan_half, up, file, stations, film) = (tan_half?, up?, file?, stations?, film?);
    let north = match north {
        Some(north) => north?,
        None if up.z.abs() > 0.999_999 => DVec3::Y,
        None => DVec3::NEG_Z,
    };
    let Some(north) = (north - north.dot(up) * up).try_normalize().filter(|_| north.cross(up).length() > 1e-6) else {
        item.error_help("`north` and `up` must not be parallel", "write e.g. up = [0, 0, 1] and north = [0, 1, 0]");
        return None;
    };
    if stations.len() != film.height as usize || stations.len() < 2 {
        file.error_help(
            format!(
                "has {} lines, and the film {} rows: each row, of two at least, is a line",
                stations.len(),
                film.height
            ),
            format!("set film.height = {}", stations.len().max(2)),
        );
        return None;
    }
    let lines: Arc<[Line]> = stations.iter().map(|station| line(station, north, up)).collect();
    let Line { position, forward, right, nose } = lines[0];
    let projection =
        Projection::Pushbroom { half_width: tan_half.x, half_pixel: tan_half.x / f64::from(film.width), lines };
    Some(Camera { position, forward, right, up: -nose, projection, distortion: None })
}

/// Straight down with the nose north, then turned about `up`, the right wing and the nose.
fn line(station: &Station, north: DVec3, up: DVec3) -> Line {
    let [(sin_yaw, yaw), (sin_pitch, pitch), (sin_roll, roll)] =
        [station.yaw, station.pitch, station.roll].map(|degrees| degrees.to_radians().sin_cos());
    let east = north.cross(up);
    let (level, wing) = (yaw * north + sin_yaw * east, yaw * east - sin_yaw * north);
    let (nose, down) = (pitch * level + sin_pitch * up, sin_pitch * level - pitch * up);
    let (right, forward) = (roll * wing + sin_roll * down, roll * down - sin_roll * wing);
    Line { position: DVec3::from(station.position), forward, right, nose }
}

/// Turned as an environment map is.
fn decode_latlong(item: &Item, film: Option<&Film>) -> Option<Camera> {
    let fields = item.table(&LATLONG)?;
    let position = fields.require("position", "position = [x, y, z]").and_then(|item| item.vector());
    let (position, to_map) = (position, to_map(&fields));
    let film = film?;
    if film.width != 2 * film.height {
        fields.warn(format!(
            "`camera.latlong`: the film has {} x {} pixels; a map of all directions is twice as wide as high",
            film.width, film.height
        ));
    }
    // The world's directions of the map's axes.
    let axes = to_map?.transpose();
    let (position, projection) = (position?, Projection::Latlong);
    Some(Camera { position, forward: -axes.z_axis, right: axes.x_axis, up: axes.y_axis, projection, distortion: None })
}

fn decode_distortion(item: &Item) -> Option<Distortion> {
    let fields = item.table(&DISTORTION)?;
    let number = |key: &str| fields.get(key).map_or(Some(0.0), |item| item.number());
    let [k1, k2, k3, p1, p2] = ["k1", "k2", "k3", "p1", "p2"].map(number);
    Some(Distortion { radial: [k1?, k2?, k3?], tangential: [p1?, p2?] })
}

impl Distortion {
    /// Where (x, y), y down, is seen, and by how much that changes with x and with y.
    pub fn of(&self, at: DVec2) -> (DVec2, DMat2) {
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        let (x, y, r2) = (at.x, at.y, at.length_squared());
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
        let seen = DVec2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        );
        let across = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
        let by_x = DVec2::new(radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x, across);
        let by_y = DVec2::new(across, radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x);
        (seen, DMat2::from_cols(by_x, by_y))
    }

    /// What is seen at a place, y down; `None` where Newton's steps from there do not end.
    pub fn undone(&self, seen: DVec2) -> Option<DVec2> {
        let mut at = seen;
        for _ in 0..UNDOING {
            let (found, slopes) = self.of(at);
            at -= slopes.inverse() * (found - seen);
        }
        let (found, slopes) = self.of(at);
        let ends = (found - seen).length() <= 1e-12 * (1.0 + seen.length()) && slopes.determinant() > 0.0;
        ends.then_some(at)
    }
}

/// Half the film in units of the distance: from `fov` and `fov_axis`, or as a data sheet has it. Of those the tangent of half a pixel's
/// angle, times the pixels along an axis.
fn tan_half(fields: &Fields, size: DVec2) -> Option<DVec2> {
    const PAIRS: [[&str; 2]; 2] = [["focal_length", "pixel_pitch"], ["ground_sampling_distance", "altitude"]];
    let first_of = |keys: &[&'static str]| keys.iter().find_map(|key| fields.get(key));
    let ways = [fields.get("fov"), first_of(&PAIRS[0]), fields.get("ifov"), first_of(&PAIRS[1])];
    if let [_, second, ..] = &ways.iter().flatten().collect::<Vec<_>>()[..] {
        let help =
            "keep one of `fov`, `focal_length` and `pixel_pitch`, `ifov`, or `ground_sampling_distance` and `altitude`";
        second.error_help("says once more how much is seen", help);
        return None;
    }
    if let (None, Some(axis)) = (&ways[0], fields.get("fov_axis"))
        && ways.iter().any(Option::is_some)
    {
        axis.error_help("says nothing without `fov`", "remove it: a pixel is square");
        return None;
    }
    let positive = |key: &str, example: &str| fields.require(key, example).and_then(|item| item.positive());
    // Twice the tangent of half a pixel.
    let pixel = match ways {
        [_, Some(_), ..] => {
            let focal = positive("focal_length", "focal_length = 50.0 (mm)");
            let pitch = positive("pixel_pitch", "pixel_pitch = 5.0 (µm)");
            1e-3 * pitch? / focal?
        }
        [_, _, Some(ifov), _] => {
            // Less than half a turn, whose tangent is none.
            let range = "greater than 0 and at most 3000 milliradians";
            let angle = ifov.number_where(|v| v > 0.0 && v <= 3000.0, range)?;
            2.0 * (0.5e-3 * angle).tan()
        }
        [_, _, _, Some(_)] => {
            let distance = positive("ground_sampling_distance", "ground_sampling_distance = 0.5 (metres a pixel)");
            let altitude = positive("altitude", "altitude = 1000.0 (metres above the ground)");
            distance? / altitude?
        }
        _ => return by_angle(fields, size),
    };
    Some(0.5 * pixel * size)
}

/// From `fov` and `fov_axis`.
fn by_angle(fields: &Fields, size: DVec2) -> Option<DVec2> {
    #[derive(Clone, Copy)]
    enum Axis {
        X,
        Y,
        Smaller,
        Larger,
    }
    let fov = fields
        .require(
            "fov",
            "fov = 40.0 (degrees); or focal_length and pixel_pitch, ifov, ground_sampling_distance and altitude",
        )
        .and_then(|item| item.number_where(|v| v > 0.0 && v < 180.0, "between 0 and 180 degrees, both excluded"));
    let names = [("x", Axis::X), ("y", Axis::Y), ("smaller", Axis::Smaller), ("larger", Axis::Larger)];
    let axis = match fields.get("fov_axis") {
        Some(item) => item.choice(&names),
        None => Some(Axis::X),
    };
    let tangent = (0.5 * fov?.to_radians()).tan();
    let along_x = match axis? {
        Axis::X => true,
        Axis::Y => false,
        Axis::Smaller => size.x <= size.y,
        Axis::Larger => size.x >= size.y,
    };
    Some(if along_x {
        DVec2::new(tangent, tangent * size.y / size.x)
    } else {
        DVec2::new(tangent * size.x / size.y, tangent)
    })
}

fn thin_lens(fields: &Fields, size: DVec2) -> Option<Projection> {
    let tan_half = tan_half(fields, size);
    let radius = fields.require("aperture_radius", "aperture_radius = 0.01 (metres)").and_then(|i| i.not_negative());
    let distance = fields.require("focus_distance", "focus_distance = 1.0 (metres)").and_then(|i| i.positive());
    Some(Projection::ThinLens { tan_half: tan_half?, aperture_radius: radius?, focus_distance: distance? })
}

/// Position, right, up and forward.
fn placement(fields: &Fields) -> Option<[DVec3; 4]> {
    let [position, look_at] =
        ["position", "look_at"].map(|key| fields.require(key, &format!("{key} = [x, y, z]")).and_then(|i| i.vector()));
    let up = match fields.get("up") {
        Some(item) => item.direction(),
        None => Some(DVec3::Y),
    };
    let flip = match fields.get("flip_x") {
        Some(item) => item.boolean(),
        None => Some(false),
    };
    let (position, look_at) = (position?, look_at?);
    let Some(forward) = (look_at - position).try_normalize() else {
        fields.get("look_at")?.error_help(
            "must be another point than `position`, at a distance that can be represented",
            "move one of them",
        );
        return None;
    };
    /// Sine of the smallest angle between `up` and the view that still tells left from right.
    const PARALLEL: f64 = 1e-8;
    let side = forward.cross(up?);
    if side.length() < PARALLEL {
        let item = fields.get("up");
        let at = item.as_ref().map_or(fields.at, |item| item.at);
        let help = "choose an `up` across the view, e.g. up = [0, 0, 1]";
        fields.cx.error(at, &format!("{}.up", fields.path), "`up` is parallel to the view", Some(help.to_owned()));
        return None;
    }
    let right = side.normalize();
    let up = right.cross(forward);
    Some([position, if flip? { -right } else { right }, up, forward])
}
