//! `[georeference]`: where on a map the picture lies.

use glam::{DVec2, DVec3};

use super::decode::Item;
use super::keys::GEOREFERENCE;
use super::{Camera, Film, Georeference, Projection};

/// Cosine of the angle between a camera's view and straight down, from 1, up to which it looks straight down: 2 microradians.
const PLUMB: f64 = 2e-12;

/// `None` where something is wrong, which has been said.
pub fn decode(item: &Item, camera: Option<&Camera>, film: Option<&Film>) -> Option<Georeference> {
    let fields = item.table(&GEOREFERENCE)?;
    let crs = fields.require("crs", "crs = \"EPSG:32631\", or WKT").and_then(|item| crs(&item));
    let origin = fields.get("origin").map_or(Some(DVec3::ZERO), |item| item.vector());
    let ground = fields.get("ground").map_or(Some(0.0), |item| item.number());
    let up = fields.get("up").map_or(Some(DVec3::Y), |item| item.direction());
    let north = fields.get("north").map(|item| item.direction());
    let (crs, origin, ground, up) = (crs?, origin?, ground?, up?);
    // Where up is z, maps have their north at the top: +y.
    let north = match north {
        Some(north) => north?,
        None if up.z.abs() > 0.999_999 => DVec3::Y,
        None => DVec3::NEG_Z,
    };
    let Some(north) = (north - north.dot(up) * up).try_normalize().filter(|_| north.cross(up).length() > 1e-6) else {
        item.error_help("`north` and `up` must not be parallel", "write e.g. up = [0, 0, 1] and north = [0, 1, 0]");
        return None;
    };
    let (camera, film) = (camera?, film?);
    match camera.projection {
        Projection::Orthographic { .. } if camera.forward.dot(up) < -1e-6 => {}
        Projection::Perspective { .. } | Projection::ThinLens { .. } if camera.forward.dot(up) < PLUMB - 1.0 => {}
        Projection::Orthographic { .. } => {
            item.error_help("goes with a camera that looks down, along -`up`", "turn the camera, or set `up`");
            return None;
        }
        Projection::Perspective { .. } | Projection::ThinLens { .. } => {
            let off = (-camera.forward.dot(up)).clamp(-1.0, 1.0).acos().to_degrees();
            item.error_help(
                format!(
                    "goes with a perspective camera that looks straight down, along -`up`, but this one looks {off:.4} degrees \
                     off: its pixels lie in no regular grid on a map"
                ),
                "let it look straight down, or take camera.orthographic; `--layers coordinates` says where each pixel is",
            );
            return None;
        }
        Projection::Pushbroom { .. } => {
            item.error_help(
                "does not go with camera.pushbroom, whose pixels lie in no regular grid on a map",
                "`--layers coordinates` says where each pixel is",
            );
            return None;
        }
        Projection::Latlong => {
            item.error("does not go with camera.latlong, which sees no piece of a map");
            return None;
        }
    }
    if camera.distortion.is_some() {
        item.error("does not go with a lens that distorts: its pixels lie in no regular grid on a map");
        return None;
    }
    // On the map, from where on the film.
    let east = north.cross(up);
    let place = |x: f64, y: f64| {
        let [from, direction] = camera.ray(film, DVec2::new(x, y), DVec2::ZERO);
        let height = from.dot(up) + origin.z - ground;
        let t = height / -direction.dot(up);
        let at = from + t * direction;
        (t, DVec2::new(origin.x + at.dot(east), origin.y + at.dot(north)))
    };
    let (width, height) = (f64::from(film.width), f64::from(film.height));
    let ((t, corner), (_, right), (_, below)) = (place(0.0, 0.0), place(width, 0.0), place(0.0, height));
    if t <= 0.0 && !matches!(camera.projection, Projection::Orthographic { .. }) {
        let item = fields.get("ground");
        let what = "the camera is not above the ground";
        let at = item.as_ref().map_or(fields.at, |item| item.at);
        fields.cx.error(
            at,
            &format!("{}.ground", fields.path),
            what,
            Some("`ground` is a height, as `origin` has it".into()),
        );
        return None;
    }
    let (column, row) = ((right - corner) / width, (below - corner) / height);
    Some(Georeference { crs, affine: [column.x, row.x, corner.x, column.y, row.y, corner.y] })
}

/// `EPSG:` and a number, or WKT.
fn crs(item: &Item) -> Option<String> {
    let text = item.text()?.trim();
    let code = text.get(..5).filter(|name| name.eq_ignore_ascii_case("epsg:")).map(|_| text[5..].trim());
    if let Some(code) = code.and_then(|code| code.parse::<u16>().ok()).filter(|code| *code >= 1024) {
        return Some(format!("EPSG:{code}"));
    }
    // WKT 1 and 2 begin with the kind of system, and a bracket.
    const KINDS: [&str; 9] =
        ["PROJCS", "GEOGCS", "LOCAL_CS", "COMPD_CS", "PROJCRS", "GEOGCRS", "ENGCRS", "COMPOUNDCRS", "BOUNDCRS"];
    let upper = text.to_ascii_uppercase();
    let is_wkt =
        KINDS.iter().any(|kind| upper.strip_prefix(kind).is_some_and(|rest| rest.trim_start().starts_with(['[', '('])));
    if code.is_none() && is_wkt && text.ends_with([']', ')']) {
        return Some(text.to_owned());
    }
    item.error_help("must be \"EPSG:\" and its number, or WKT", "write e.g. crs = \"EPSG:32631\" (UTM zone 31 north)");
    None
}
