//! How a map of light is turned.

use glam::{DMat3, DVec3};

use super::scene::Section;
use super::text;

/// A rotation as scenes write it: from +y to `up` by the shortest way, then `degrees` about that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    pub up: DVec3,
    pub degrees: f64,
    /// Whether the picture has to be mirrored, left for right, first.
    pub mirrored: bool,
}

impl Frame {
    /// Of the turn that takes directions of the map to those of the scene. Scales in it say nothing.
    pub fn of(turn: DMat3) -> Frame {
        let mirrored = turn.determinant() < 0.0;
        // Mirrored left for right is x for -x.
        let turn = if mirrored { turn * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)) } else { turn };
        let up = turn.y_axis.try_normalize().unwrap_or(DVec3::Y);
        // To -y: half a turn about +x.
        let shortest = if up.y < -1.0 + 1e-12 {
            DMat3::from_rotation_x(std::f64::consts::PI)
        } else {
            DMat3::from_quat(glam::DQuat::from_rotation_arc(DVec3::Y, up))
        };
        let front = shortest.transpose() * turn.z_axis.normalize_or(DVec3::Z);
        let degrees = front.x.atan2(front.z).to_degrees();
        Frame { up, degrees: if degrees.abs() < 1e-9 { 0.0 } else { degrees }, mirrored }
    }

    pub fn write(&self, section: &mut Section) {
        if self.up.distance(DVec3::Y) > 1e-12 {
            section.set("up", text::vector(self.up));
        }
        if self.degrees != 0.0 {
            section.set("rotate_degrees", text::rounded(self.degrees));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_come_back() {
        for (axis, angle) in [(DVec3::Y, 0.7), (DVec3::X, 1.9), (DVec3::new(1.0, -2.0, 0.5), 3.0), (DVec3::Z, 0.0)] {
            let turn = DMat3::from_axis_angle(axis.normalize(), angle);
            let frame = Frame::of(turn);
            let shortest = DMat3::from_quat(glam::DQuat::from_rotation_arc(DVec3::Y, frame.up));
            let back = DMat3::from_axis_angle(frame.up, frame.degrees.to_radians()) * shortest;
            let far = (back - turn).to_cols_array().into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
            assert!(far < 1e-9 && !frame.mirrored, "{axis} {angle}: {far}");
        }
        let mirror = Frame::of(DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)));
        assert_eq!((mirror.mirrored, mirror.up, mirror.degrees), (true, DVec3::Y, 0.0));
    }
}
