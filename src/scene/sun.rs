//! Where the sun stands.

use std::f64::consts::TAU;

use glam::DVec3;
use solar_positioning::time::JulianDate;
use solar_positioning::{Location, SolarPositions, delta_t};
use toml::value::{Datetime, Offset};

/// Years of the solar position algorithm.
const LAST_YEAR: u16 = 6000;
/// Degrees: the radius of the sun's disk from a distance of one astronomical unit.
pub const ANGULAR_RADIUS: f64 = 0.2665;

/// The centre of the sun's disk as seen from a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Degrees, clockwise from north as seen from above.
    pub azimuth: f64,
    /// Degrees above the horizon.
    pub elevation: f64,
    /// Of the Earth's centre from the sun's, in astronomical units.
    pub distance: f64,
}

/// Where the sun stands at `date`, seen from `latitude` (north) and `longitude` (east), in degrees, at sea level and without
/// refraction: within 0.001 degrees (Reda and Andreas 2004, *Solar position algorithm for solar radiation applications*), its distance
/// within 1e-4 (The Astronomical Almanac, low-precision formulae for the sun).
///
/// # Errors
/// A date that is no moment: without its day, its time or its offset from UTC; or later than the algorithm reaches.
pub fn position(date: &Datetime, latitude: f64, longitude: f64) -> Result<Position, String> {
    let (Some(day), Some(time), Some(offset)) = (date.date, date.time, date.offset) else {
        return Err("must be a day, a time and its offset from UTC".into());
    };
    if day.year > LAST_YEAR {
        return Err(format!("must lie before the year {}", LAST_YEAR + 1));
    }
    let minutes_ahead = match offset {
        Offset::Z => 0.0,
        Offset::Custom { minutes } => f64::from(minutes),
    };
    // A leap second is the last moment of its minute.
    let seconds = f64::from(time.second.unwrap_or(0)) + 1e-9 * f64::from(time.nanosecond.unwrap_or(0));
    let (year, month) = (i32::from(day.year), u32::from(day.month));
    let (hour, minute) = (u32::from(time.hour), u32::from(time.minute));
    let said = |e: solar_positioning::Error| format!("is no date: {e}");
    let delta_t = delta_t::estimate_from_date(year, month).map_err(said)?;
    let written = JulianDate::from_utc(year, month, u32::from(day.day), hour, minute, seconds.min(59.999), delta_t);
    let julian = written.map_err(said)?.julian_date() - minutes_ahead / 1440.0;
    let moment = JulianDate::new(julian, delta_t).map_err(said)?;
    let place = Location { latitude, longitude };
    let seen = SolarPositions::new().at_from_julian(moment, place, 0.0, None).map_err(said)?;
    Ok(Position { azimuth: seen.azimuth(), elevation: seen.elevation_angle(), distance: distance(julian) })
}

/// Astronomical units, at a Julian date.
fn distance(julian: f64) -> f64 {
    let anomaly = (357.528 + 0.985_600_3 * (julian - 2_451_545.0)).to_radians() % TAU;
    1.00014 - 0.01671 * anomaly.cos() - 0.00014 * (2.0 * anomaly).cos()
}

/// The direction in which light travels from a sun at `azimuth` and `elevation` (degrees), in a scene whose `up` and `north` are of
/// length 1: `None` where these are parallel, as there is no north then.
pub fn travels(azimuth: f64, elevation: f64, north: DVec3, up: DVec3) -> Option<DVec3> {
    let level = north - north.dot(up) * up;
    let north = (level.length() > 1e-6).then(|| level.normalize())?;
    let east = north.cross(up);
    let ((sin_azimuth, cos_azimuth), (sin, cos)) = (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
    Some(-(cos * (sin_azimuth * east + cos_azimuth * north) + sin * up).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(date: &str, latitude: f64, longitude: f64) -> Position {
        position(&date.parse().expect("a date"), latitude, longitude).expect("a position")
    }

    /// The example of Reda and Andreas (2004), appendix A.5, but for its refraction, height and Delta T (67 s): zenith 50.11162 with
    /// 0.0164 degrees of refraction, azimuth 194.34024, distance 0.9965423.
    #[test]
    fn the_published_example() {
        let sun = at("2003-10-17T12:30:30-07:00", 39.742476, -105.1786);
        assert!((sun.azimuth - 194.34024).abs() < 1e-3, "{sun:?}");
        assert!((90.0 - sun.elevation - (50.11162 + 0.0164)).abs() < 1e-3, "{sun:?}");
        assert!((sun.distance - 0.9965423).abs() < 1e-4, "{sun:?}");
        assert_eq!(sun, at("2003-10-17T19:30:30Z", 39.742476, -105.1786));
    }

    #[test]
    fn what_is_no_moment_is_refused() {
        for (date, words) in [
            ("2026-06-21", "offset from UTC"),
            ("2026-06-21T10:30:00", "offset from UTC"),
            ("10:30:00", "offset from UTC"),
            ("6001-06-21T10:30:00Z", "before the year 6001"),
        ] {
            let error = position(&date.parse().expect("a date"), 43.6, 5.1).expect_err(date);
            assert!(error.contains(words), "{date}: {error}");
        }
        assert!(at("2016-12-31T23:59:60Z", 43.6, 5.1).elevation < 0.0);
    }

    /// East is to the right of north, seen from above, however the scene is turned.
    #[test]
    fn azimuth_runs_clockwise() {
        for (north, up, east) in [(DVec3::NEG_Z, DVec3::Y, DVec3::X), (DVec3::Y, DVec3::Z, DVec3::X)] {
            let light = |azimuth, elevation| travels(azimuth, elevation, north, up).expect("a direction");
            assert!((light(90.0, 0.0) + east).length() < 1e-15);
            assert!((light(0.0, 0.0) + north).length() < 1e-15);
            assert!((light(123.0, 90.0) + up).length() < 1e-15);
            assert!((light(180.0, 30.0) - (0.75f64.sqrt() * north - 0.5 * up)).length() < 1e-15);
        }
        // A north that is not level is turned level.
        let tilted = travels(0.0, 0.0, DVec3::new(0.0, 0.6, -0.8), DVec3::Y).expect("a direction");
        assert!((tilted - DVec3::Z).length() < 1e-15);
        assert_eq!(travels(0.0, 0.0, DVec3::Y, DVec3::Y), None);
    }
}
