//! Where straight lines cross primitives, in f64 and device units: what lies around a place is found by that.

use glam::DVec3;

use crate::device::accel::Accel;
use crate::device::words::{KIND_INSTANCE, PLACED_VOLUME, Primitive};
use crate::scene::Scene;

/// What bounds the volumes of a scene: primitives of the world, and those of assemblies at each place where they are.
pub struct Boundaries<'a> {
    accel: &'a Accel,
    /// Primitives and what `boundaries` says of them.
    of_world: Vec<(u32, u32)>,
    /// Of each assembly, and the instances of those that have some.
    of_assemblies: Vec<Vec<(u32, u32)>>,
    instances: Vec<Instance>,
}

struct Instance {
    /// Its place among [`Accel::primitives`].
    primitive: u32,
    assembly: usize,
    /// What is added to the numbers of volumes that are there once for each instance.
    added: u32,
}

impl Instance {
    fn number(&self, boundary: u32) -> u32 {
        (boundary & 0xff) + if boundary & PLACED_VOLUME != 0 { self.added } else { 0 }
    }
}

impl<'a> Boundaries<'a> {
    /// `boundaries`: for each primitive the number of the volume behind it in the low byte, or 0, and [`PLACED_VOLUME`] where that counts
    /// from what it says of the instance.
    pub fn new(scene: &Scene, accel: &'a Accel, boundaries: &[u32]) -> Self {
        let mut found = Boundaries {
            accel,
            of_world: Vec::new(),
            of_assemblies: vec![Vec::new(); scene.assemblies.len()],
            instances: Vec::new(),
        };
        let assembly = |primitive: usize| scene.objects[accel.objects[primitive] as usize].assembly;
        for (i, (primitive, &boundary)) in accel.primitives.iter().zip(boundaries).enumerate() {
            let of = assembly(i);
            if let (KIND_INSTANCE, Some(assembly)) = (primitive.tag >> 24, of) {
                found.instances.push(Instance { primitive: i as u32, assembly, added: boundary });
            } else if boundary & 0xff != 0 {
                of.map_or(&mut found.of_world, |of| &mut found.of_assemblies[of]).push((i as u32, boundary));
            }
        }
        found.instances.retain(|instance| !found.of_assemblies[instance.assembly].is_empty());
        found
    }

    /// All of them, in device units of the world.
    pub fn each(&self, mut f: impl FnMut(&Primitive, u32)) {
        for &(primitive, boundary) in &self.of_world {
            f(&self.accel.primitives[primitive as usize], boundary & 0xff);
        }
        for instance in &self.instances {
            for &(primitive, boundary) in &self.of_assemblies[instance.assembly] {
                f(&self.placed(primitive, instance.primitive), instance.number(boundary));
            }
        }
    }

    /// A place on the surface of volume `number`; of one that is there several times, of the first.
    pub fn place_on(&self, number: u32) -> Option<DVec3> {
        let in_instance = |instance: &Instance| {
            let mut parts = self.of_assemblies[instance.assembly].iter();
            let (part, _) = parts.find(|(_, boundary)| instance.number(*boundary) == number)?;
            Some(self.placed(*part, instance.primitive))
        };
        let in_instance = || self.instances.iter().find_map(in_instance);
        let of_world = self.of_world.iter().find(|(_, boundary)| boundary & 0xff == number);
        let of_world = of_world.map(|(primitive, _)| self.accel.primitives[*primitive as usize]);
        of_world.or_else(in_instance).map(|primitive| place_on(&primitive))
    }

    /// The numbers of the bodies around a point in device units, the innermost first.
    pub fn bodies_around(&self, point: DVec3) -> Vec<u32> {
        // No edge of a model is likely to lie in this direction.
        let direction = DVec3::new(0.367_879_441, 0.577_215_664, 0.728_913_7).normalize();
        let mut crossings: Vec<(f64, u32, bool)> = Vec::new();
        self.each(|primitive, number| {
            meet(primitive, point, direction, &mut |t, leaving| crossings.push((t, number, leaving)));
        });
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
        // What is left before it is entered is around the point; what is left first is innermost.
        let (mut around, mut entered) = (Vec::new(), Vec::<u32>::new());
        for (_, number, leaving) in crossings {
            if !leaving {
                entered.push(number);
            } else if let Some(at) = entered.iter().rposition(|n| *n == number) {
                entered.remove(at);
            } else {
                around.push(number);
            }
        }
        around
    }

    fn placed(&self, primitive: u32, instance: u32) -> Primitive {
        let [a, b, c] = self.accel.in_world(primitive, Some(instance)).1.map(|v| v.as_vec3().to_array());
        Primitive { a, b, c, ..self.accel.primitives[primitive as usize] }
    }
}

/// A point on a primitive.
fn place_on(p: &Primitive) -> DVec3 {
    let [a, b, c] = [p.a, p.b, p.c].map(|v| DVec3::from(v.map(f64::from)));
    match p.tag >> 24 {
        1 => a + b.x * DVec3::Z,
        2 => a,
        3 => 0.5 * (a + b) + c.x * (b - a).any_orthogonal_vector().normalize(),
        _ => (a + b + c) / 3.0,
    }
}

/// Tells `crossing` where a ray meets a primitive, and whether it leaves what is behind it.
fn meet(p: &Primitive, origin: DVec3, direction: DVec3, crossing: &mut impl FnMut(f64, bool)) {
    let [a, b, c] = [p.a, p.b, p.c].map(|v| DVec3::from(v.map(f64::from)));
    let mut found = |t: f64, normal: DVec3| {
        if t > 0.0 {
            crossing(t, normal.dot(direction) > 0.0);
        }
    };
    let f = origin - a;
    match p.tag >> 24 {
        1 => {
            let (half, rest) = (f.dot(direction), f.length_squared() - b.x * b.x);
            let square = half * half - rest;
            if square > 0.0 {
                for t in [-half - square.sqrt(), -half + square.sqrt()] {
                    found(t, f + t * direction);
                }
            }
        }
        2 => {
            let t = -f.dot(b) / direction.dot(b);
            if (f + t * direction).length() <= c.x {
                found(t, b);
            }
        }
        3 => {
            let axis = (b - a).normalize();
            let across = |v: DVec3| v - v.dot(axis) * axis;
            let (g, d) = (across(f), across(direction));
            let (half, dd) = (g.dot(d), d.length_squared());
            let square = half * half - dd * (g.length_squared() - c.x * c.x);
            if square > 0.0 && dd > 0.0 {
                for t in [(-half - square.sqrt()) / dd, (-half + square.sqrt()) / dd] {
                    if (0.0..=(b - a).length()).contains(&(f + t * direction).dot(axis)) {
                        found(t, g + t * d);
                    }
                }
            }
        }
        _ => {
            // Möller and Trumbore 1997.
            let (e1, e2) = (b - a, c - a);
            let h = direction.cross(e2);
            let determinant = e1.dot(h);
            let u = f.dot(h) / determinant;
            let q = f.cross(e1);
            let v = direction.dot(q) / determinant;
            if determinant != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
                found(e2.dot(q) / determinant, e1.cross(e2));
            }
        }
    }
}
