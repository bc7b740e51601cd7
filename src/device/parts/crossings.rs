//! Where straight lines cross primitives, in f64 and device units: what lies around a place is found by that.

use glam::DVec3;

use crate::device::accel::Accel;
use crate::device::words::{KIND_INSTANCE, Primitive};
use crate::scene::Scene;

/// What bounds the volumes of a scene: primitives of the world, and those of assemblies at each place where they are.
pub struct Boundaries<'a> {
    accel: &'a Accel,
    /// Primitives and the numbers of what is behind them.
    of_world: Vec<(u32, u32)>,
    /// Of each assembly, and the instances of those that have some.
    of_assemblies: Vec<Vec<(u32, u32)>>,
    instances: Vec<(u32, usize)>,
}

impl<'a> Boundaries<'a> {
    /// `boundaries`: for each primitive the number of the volume behind it in the low byte, or 0.
    pub fn new(scene: &Scene, accel: &'a Accel, boundaries: &[u32]) -> Self {
        let mut found = Boundaries {
            accel,
            of_world: Vec::new(),
            of_assemblies: vec![Vec::new(); scene.assemblies.len()],
            instances: Vec::new(),
        };
        let assembly = |primitive: usize| scene.objects[accel.objects[primitive] as usize].assembly;
        for (primitive, number) in boundaries.iter().map(|boundary| boundary & 0xff).enumerate() {
            if number != 0 {
                let list = assembly(primitive).map_or(&mut found.of_world, |of| &mut found.of_assemblies[of]);
                list.push((primitive as u32, number));
            }
        }
        let is_instance = |(_, primitive): &(usize, &Primitive)| primitive.tag >> 24 == KIND_INSTANCE;
        let instances = accel.primitives.iter().enumerate().filter(is_instance);
        let of = instances.filter_map(|(instance, _)| Some((instance as u32, assembly(instance)?)));
        found.instances = of.filter(|(_, of)| !found.of_assemblies[*of].is_empty()).collect();
        found
    }

    /// All of them, in device units of the world.
    pub fn each(&self, mut f: impl FnMut(&Primitive, u32)) {
        for &(primitive, number) in &self.of_world {
            f(&self.accel.primitives[primitive as usize], number);
        }
        for &(instance, assembly) in &self.instances {
            for &(primitive, number) in &self.of_assemblies[assembly] {
                f(&self.placed(primitive, instance), number);
            }
        }
    }

    /// A place on the surface of volume `number`; of one that is there several times, of the first.
    pub fn place_on(&self, number: u32) -> Option<DVec3> {
        let of_number = |list: &[(u32, u32)]| list.iter().find(|(_, other)| *other == number).map(|(first, _)| *first);
        let in_instance = || {
            let mut placed = self.instances.iter();
            placed.find_map(|(instance, of)| Some(self.placed(of_number(&self.of_assemblies[*of])?, *instance)))
        };
        let of_world = of_number(&self.of_world).map(|primitive| self.accel.primitives[primitive as usize]);
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
