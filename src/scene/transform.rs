//! `transform` of an object, and what it does to each kind of shape.

use glam::{DAffine3, DMat3, DVec3};

use super::decode::Item;
use super::keys;
use super::tree::Value;
use super::{Attributes, Mesh, Shape};

/// Coordinates beyond this have squares near the end of f32.
const FARTHEST: f64 = 1e15;
/// How far, relatively, the columns of a similarity may be from equal length and right angles: matrices are often
/// written with the seven digits of f32.
const SIMILAR: f64 = 1e-5;

/// The transform that `item` spells: first scale, then rotate, then translate; or a matrix.
pub fn decode(item: &Item) -> Option<DAffine3> {
    let fields = item.table(&keys::TRANSFORM)?;
    let parts: Vec<Item> = ["translate", "rotate", "scale"].iter().filter_map(|key| fields.get(key)).collect();
    let affine = match fields.get("matrix") {
        Some(_) if !parts.is_empty() => {
            parts[0].error_help("goes without `matrix` only", "keep the matrix, or the others");
            return None;
        }
        Some(item) => matrix(&item)?,
        None => {
            let translate = fields.get("translate").map_or(Some(DVec3::ZERO), |item| item.vector());
            let rotate = fields.get("rotate").map_or(Some(DMat3::IDENTITY), |item| rotation(&item));
            let scale = fields.get("scale").map_or(Some(DVec3::ONE), |item| scale(&item));
            DAffine3 { matrix3: rotate? * DMat3::from_diagonal(scale?), translation: translate? }
        }
    };
    if !is_invertible(&affine) {
        item.error_help(
            "flattens space: its determinant is 0 or cannot be represented",
            "use scales that are not 0, or a matrix that can be inverted",
        );
        return None;
    }
    Some(affine)
}

/// Whether nothing is flattened, as far as can be represented.
pub fn is_invertible(affine: &DAffine3) -> bool {
    let determinant = affine.matrix3.determinant();
    determinant != 0.0 && determinant.is_finite() && affine.translation.is_finite()
}

fn rotation(item: &Item) -> Option<DMat3> {
    let [x, y, z, degrees] = item.numbers::<4>("an axis and an angle [x, y, z, degrees]")?;
    let axis = DVec3::new(x, y, z).try_normalize();
    if axis.is_none() {
        item.error("the axis must have a length greater than 0");
    }
    Some(DMat3::from_axis_angle(axis?, degrees.to_radians()))
}

fn scale(item: &Item) -> Option<DVec3> {
    if matches!(item.node.value, Value::Array(_)) {
        return item.vector();
    }
    item.number().map(DVec3::splat)
}

/// Sixteen numbers, row-major, acting on column vectors.
fn matrix(item: &Item) -> Option<DAffine3> {
    let m = item.numbers::<16>("16 numbers, row by row")?;
    if m[12..] != [0.0, 0.0, 0.0, 1.0] {
        let help = "a matrix is row-major: the translation stands at the end of the first three rows";
        item.error_help(format!("the last row must be 0, 0, 0, 1, but is {:?}", &m[12..]), help);
        return None;
    }
    Some(of_rows(&std::array::from_fn(|i| m[i])))
}

/// Of the first three rows of a matrix that acts on column vectors.
pub fn of_rows(m: &[f64; 12]) -> DAffine3 {
    let column = |i: usize| DVec3::new(m[i], m[4 + i], m[8 + i]);
    DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) }
}

/// The factor of a similarity (rotation, mirroring and one scale for all directions).
fn similarity(m: DMat3) -> Option<f64> {
    let factor = m.determinant().abs().cbrt();
    let product = m.transpose() * m * (factor * factor).recip();
    let difference = (product - DMat3::IDENTITY).to_cols_array().into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    (difference <= SIMILAR).then_some(factor)
}

/// Moves `shape` into the world. The front stays the front: mirroring reverses the order of a mesh's corners, whose
/// first edge stays the first.
/// `Err` says what is wrong.
pub fn apply(affine: &DAffine3, shape: Shape) -> Result<Shape, String> {
    let factor = || similarity(affine.matrix3).ok_or_else(|| NOT_SIMILAR.to_owned());
    let moved = match shape {
        Shape::Mesh(mut mesh) => {
            mesh.positions.iter_mut().for_each(|p| *p = affine.transform_point3(*p));
            if affine.matrix3.determinant() < 0.0 {
                mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
            }
            Shape::Mesh(mesh)
        }
        Shape::Sphere { center, radius } => {
            Shape::Sphere { center: affine.transform_point3(center), radius: radius * factor()? }
        }
        Shape::Disk { center, normal, radius } => Shape::Disk {
            center: affine.transform_point3(center),
            radius: radius * factor()?,
            // The image of the normal is the side its image is seen from, under mirroring too.
            normal: affine.transform_vector3(normal).normalize(),
        },
        Shape::Cylinder { from, to, radius } => Shape::Cylinder {
            from: affine.transform_point3(from),
            to: affine.transform_point3(to),
            radius: radius * factor()?,
        },
    };
    let far = |p: &DVec3| p.abs().max_element() > FARTHEST || !p.is_finite();
    let too_far = match &moved {
        Shape::Mesh(Mesh { positions, .. }) => positions.iter().any(far),
        Shape::Sphere { center, radius } | Shape::Disk { center, radius, .. } => far(center) || *radius > FARTHEST,
        Shape::Cylinder { from, to, radius } => far(from) || far(to) || *radius > FARTHEST,
    };
    if too_far {
        return Err(beyond_farthest());
    }
    let vanished = match &moved {
        Shape::Mesh(_) => false,
        Shape::Sphere { radius, .. } | Shape::Disk { radius, .. } => *radius <= 0.0,
        Shape::Cylinder { from, to, radius } => *radius <= 0.0 || from == to,
    };
    if vanished {
        return Err("shrinks the shape to nothing".to_owned());
    }
    Ok(moved)
}

const NOT_SIMILAR: &str =
    "must keep the shape of a sphere, disk or cylinder: rotations, mirrorings and one scale for all directions only";

fn beyond_farthest() -> String {
    format!("reaches beyond {FARTHEST:e}, farther than can be represented")
}

/// What [`apply`] would say of shapes within `bounds`, some of them round where `is_round`.
pub fn check(affine: &DAffine3, is_round: bool, bounds: [DVec3; 2]) -> Result<(), String> {
    if is_round && similarity(affine.matrix3).is_none() {
        return Err(NOT_SIMILAR.to_owned());
    }
    let far = |p: DVec3| !p.is_finite() || p.abs().max_element() > FARTHEST;
    if box_around(affine, bounds).into_iter().any(far) { Err(beyond_farthest()) } else { Ok(()) }
}

/// A box around what `affine` makes of a box: exactly around its corners.
pub fn box_around(affine: &DAffine3, [low, high]: [DVec3; 2]) -> [DVec3; 2] {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let m = affine.matrix3;
    let reach = m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z;
    let middle = affine.transform_point3(middle);
    [middle - reach, middle + reach]
}

/// Moves what a shape carries along with it.
pub fn apply_attributes(affine: &DAffine3, attributes: &mut Attributes) {
    let matrix = affine.matrix3;
    let mirrored = matrix.determinant() < 0.0;
    if let Some(uv) = attributes.uv.as_mut().filter(|_| mirrored) {
        uv.iter_mut().for_each(|corners| corners.swap(0, 1));
    }
    if let Some(normals) = &mut attributes.normals {
        // Their length is settled later.
        let to_world = matrix.inverse().transpose();
        for corners in normals {
            *corners = corners.map(|normal| to_world * normal);
            if mirrored {
                corners.swap(0, 1);
            }
        }
    }
    if let Some(axes) = &mut attributes.axes {
        let moved = matrix * *axes;
        *axes = DMat3::from_cols(moved.x_axis.normalize(), moved.y_axis.normalize(), moved.z_axis.normalize());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn similarities_are_recognised() {
        let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
        assert!((similarity(turn * 2.5).unwrap() - 2.5).abs() < 1e-12);
        assert!((similarity(DMat3::from_diagonal(DVec3::new(-2.0, 2.0, 2.0))).unwrap() - 2.0).abs() < 1e-12);
        assert!(similarity(DMat3::from_diagonal(DVec3::new(1.0, 1.0, 1.001))).is_none());
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.1, 1.0, 0.0), DVec3::Z);
        assert!(similarity(shear).is_none());
        // A rotation written with seven digits.
        let rounded = DMat3::from_cols_array(&turn.to_cols_array().map(|v| (v * 1e7).round() / 1e7));
        assert!(similarity(rounded).is_some());
        // Far beyond and below one.
        assert!(similarity(turn * 1e-60).is_some() && similarity(turn * 1e60).is_some());
    }

    #[test]
    fn mirroring_keeps_the_front() {
        let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        let mesh = Mesh { positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y], triangles: vec![[0, 1, 2]] };
        let Ok(Shape::Mesh(mesh)) = apply(&mirror, Shape::Mesh(mesh)) else { panic!("a mesh stays one") };
        let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
        assert_eq!((b - a).cross(c - a), DVec3::Z);
        let disk = Shape::Disk { center: DVec3::X, normal: DVec3::Z, radius: 1.0 };
        let Ok(Shape::Disk { center, normal, .. }) = apply(&mirror, disk) else { panic!("a disk stays one") };
        assert_eq!((center, normal), (DVec3::NEG_X, DVec3::Z));
    }
}
