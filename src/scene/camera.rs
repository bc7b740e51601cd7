//! `[camera]` and `[film]`, and what rays they make.

use glam::{DVec2, DVec3};

use super::decode::{Fields, Item};
use super::keys::{CAMERA, FILM, ORTHOGRAPHIC, PERSPECTIVE, THIN_LENS};
use super::{Camera, Film, Filter, Projection};

impl Camera {
    /// Origin, m, and direction (a unit vector) of the ray through a place on the full film, in pixels from its top left, and a place on
    /// the lens, in its radii: (0, 0) is the middle. In f64, as the reference has it; shaders have their own.
    pub fn ray(&self, film: &Film, place: DVec2, lens: DVec2) -> [DVec3; 2] {
        // -1 … 1 across the film, y upwards.
        let size = DVec2::new(f64::from(film.width), f64::from(film.height));
        let at = DVec2::new(2.0, -2.0) * place / size + DVec2::new(-1.0, 1.0);
        let across = |at: DVec2| at.x * self.right + at.y * self.up;
        match self.projection {
            Projection::Perspective { tan_half } => [self.position, (self.forward + across(at * tan_half)).normalize()],
            Projection::ThinLens { tan_half, aperture_radius, focus_distance } => {
                let lens = aperture_radius * across(lens);
                let focus = focus_distance * (self.forward + across(at * tan_half));
                [self.position + lens, (focus - lens).normalize()]
            }
            Projection::Orthographic { half_size } => [self.position + across(at * half_size), self.forward],
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
        _ => {
            let fields = kind.table(&ORTHOGRAPHIC)?;
            let width = fields.require("width", "width = 1.0 (metres seen from left to right)");
            let half = width.and_then(|item| item.positive()).map(|width| 0.5 * width);
            let half_size = half.map(|half| DVec2::new(half, half * size.y / size.x));
            (fields, half_size.map(|half_size| Projection::Orthographic { half_size }))
        }
    };
    let frame = placement(&fields);
    let (projection, [position, right, up, forward]) = (projection?, frame?);
    film?;
    Some(Camera { position, forward, right, up, projection })
}

/// Half the film in units of the distance, from `fov` and `fov_axis`.
fn tan_half(fields: &Fields, size: DVec2) -> Option<DVec2> {
    #[derive(Clone, Copy)]
    enum Axis {
        X,
        Y,
        Smaller,
        Larger,
    }
    let fov = fields
        .require("fov", "fov = 40.0 (degrees)")
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
