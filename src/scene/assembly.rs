//! `[assemblies]` and `[[instances]]`: objects that are stored once and placed many times.

use std::borrow::Cow;
use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};

use super::arrays::Data;
use super::decode::{Item, did_you_mean, list};
use super::keys;
use super::object::Objects;
use super::spectrum::report_in_file;
use super::transform;
use super::{Assembly, AssemblyId, Interior, Object, Scene, Shape};
use crate::error::Problem;
use crate::format::mesh;
use crate::format::table;

/// All assemblies that are placed, their objects added to `objects`. What is placed nowhere is left out, which is said.
pub fn decode<'a>(
    assemblies: Option<&Item<'a>>,
    instances: Option<&Item<'a>>,
    objects: &mut Objects<'_, 'a>,
) -> Vec<Assembly> {
    let named = assemblies.and_then(|item| item.named_items()).unwrap_or_default();
    let instances = instances.and_then(|item| item.array()).unwrap_or_default();
    let placed: Vec<Option<(&str, Vec<Placed>)>> =
        instances.iter().map(|item| decode_instances(item, &named)).collect();
    let mut decoded = Vec::new();
    for (name, item) in named {
        let of_name =
            || placed.iter().zip(&instances).filter(|(placed, _)| placed.as_ref().is_some_and(|p| p.0 == name));
        if of_name().next().is_none() {
            // Of one that is wrong nobody knows which it meant.
            if placed.iter().all(Option::is_some) {
                item.cx.warn(format!("{} is placed nowhere: it is left out, and not looked at", item.path));
            }
            continue;
        }
        let first = objects.count();
        let Some(fields) = item.table(&keys::ASSEMBLY) else { continue };
        let Some(parts) = fields.require("objects", "objects, or tables [[assemblies.NAME.objects]]") else { continue };
        let parts = parts.array().unwrap_or_default();
        if parts.is_empty() {
            fields.error_help("has no objects", format!("add tables [[{}.objects]]", item.path));
        }
        objects.add_to(decoded.len(), &parts);
        let own = objects.since(first);
        let is_round = own.iter().any(|object| !matches!(object.shape, Shape::Mesh(_)));
        // Without any, what is wrong with its objects has been said.
        let Some(bounds) = box_around_all(own.iter().map(|object| object.shape.bounds())) else { continue };
        for (placed, item) in of_name() {
            for one in placed.iter().flat_map(|(_, all)| all) {
                if let Err(message) = transform::check(&one.to_world, is_round, bounds) {
                    report(one, message, item);
                }
            }
        }
        let instances = of_name().filter_map(|(placed, _)| placed.as_ref());
        let instances = instances.flat_map(|(_, all)| all.iter().map(|one| one.to_world));
        let is_upright = |to_world: &DAffine3| to_world.matrix3.determinant() > 0.0;
        let (upright, mirrored): (Vec<DAffine3>, Vec<DAffine3>) = instances.partition(is_upright);
        if mirrored.is_empty() {
            decoded.push(Assembly { name: name.to_owned(), instances: upright });
            continue;
        }
        // What is mirrored is an assembly of its own, so that no instance turns the order of corners round.
        let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        let own = objects.since(first).to_vec();
        if upright.is_empty() {
            objects.forget_since(first);
        } else {
            decoded.push(Assembly { name: name.to_owned(), instances: upright });
        }
        let assembly = Some(decoded.len());
        own.iter().for_each(|object| objects.push(Object { assembly, ..copy(object, &mirror) }));
        let instances = mirrored.iter().map(|to_world| *to_world * mirror).collect();
        decoded.push(Assembly { name: format!("{name}, mirrored"), instances });
    }
    decoded
}

/// An instance, and where it stands.
struct Placed {
    to_world: DAffine3,
    place: Place,
}

#[derive(Clone, Copy)]
enum Place {
    /// In the entry itself.
    Entry,
    /// In a line of the file that it names.
    Line(usize),
    /// In a row, counted from 0, of numbers in memory.
    Row(usize),
}

/// The assembly that an entry of `[[instances]]` names, and where it is placed.
fn decode_instances<'a>(item: &Item<'a>, named: &[(&'a str, Item<'a>)]) -> Option<(&'a str, Vec<Placed>)> {
    let fields = item.table(&keys::INSTANCE)?;
    let name = fields.require("assembly", "assembly = \"NAME\"").and_then(|item| {
        let name = item.text()?;
        if !named.iter().any(|(known, _)| *known == name) {
            let names = named.iter().map(|(name, _)| *name);
            let help = did_you_mean(name, names.clone()).unwrap_or_else(|| match named.len() {
                0 => format!("define it: [[assemblies.{name}.objects]]"),
                _ => format!("[assemblies] has {}", list(names)),
            });
            item.error_help(format!("no assembly is named \"{name}\""), help);
            return None;
        }
        Some(name)
    });
    let transform = fields.get("transform").map_or(Some(DAffine3::IDENTITY), |item| transform::decode(&item));
    let placements = fields.get("placements");
    let up = match fields.get("up") {
        Some(item) if placements.is_none() => {
            item.error_help("goes with `placements` only", "remove it, or turn the instance by `transform`");
            None
        }
        Some(item) => item.direction(),
        None => Some(DVec3::Y),
    };
    let Some(placements) = placements else {
        return Some((name?, vec![Placed { to_world: transform?, place: Place::Entry }]));
    };
    let ((_, path), up) = (placements.source()?, up?);
    let read = match placements.data() {
        Some(data) => placements_of(data, up),
        None => mesh::content(&path).and_then(|bytes| read_placements(&bytes, &path, up)),
    };
    let mut placed = match read {
        Ok(placed) => placed,
        Err(problem) => {
            report_in_file(&placements, *problem);
            return None;
        }
    };
    let transform = transform?;
    placed.iter_mut().for_each(|one| one.to_world = transform * one.to_world);
    Some((name?, placed))
}

/// What the columns of placements are: places of x, y, z, and of `yaw_degrees` and `scale` where there are any; or of a
/// matrix, row by row.
enum Columns {
    Points { at: [usize; 3], yaw: Option<usize>, scale: Option<usize> },
    Matrix([usize; 12]),
}

const MATRIX: [&str; 12] = ["m00", "m01", "m02", "m03", "m10", "m11", "m12", "m13", "m20", "m21", "m22", "m23"];

impl Columns {
    /// Of these names; `problem` is told what is wrong with them.
    fn of(written: &[String], problem: impl Fn(String) -> Box<Problem>) -> Result<Columns, Box<Problem>> {
        // All lengths of a scene are in metres: that may be said.
        let name = |name: &String| {
            let lower = name.trim().to_lowercase();
            ["[m]", "(m)"]
                .iter()
                .find_map(|unit| lower.strip_suffix(unit))
                .map_or(lower.clone(), |name| name.trim().to_owned())
        };
        let names: Vec<String> = written.iter().map(name).collect();
        let place = |wanted: &str| names.iter().position(|name| name == wanted);
        let all = |wanted: &[&str]| wanted.iter().map(|name| place(name)).collect::<Option<Vec<usize>>>();
        let is_matrix = MATRIX.iter().any(|name| place(name).is_some());
        let known: &[&str] = if is_matrix { &MATRIX } else { &["x", "y", "z", "yaw_degrees", "scale"] };
        if let Some((i, is_twice)) = table::stray(&names, known) {
            let why = if is_twice { "twice" } else { "which no placement has" };
            return Err(problem(format!("has a column `{}`, {why}", written[i].trim())));
        }
        let missing = |wanted: &[&str]| {
            let missing = wanted.iter().filter(|name| place(name).is_none());
            problem(format!("has no column {}", list(missing)))
        };
        if is_matrix {
            let columns = all(&MATRIX).ok_or_else(|| missing(&MATRIX))?;
            return Ok(Columns::Matrix(std::array::from_fn(|i| columns[i])));
        }
        let columns = all(&["x", "y", "z"]).ok_or_else(|| missing(&["x", "y", "z"]))?;
        Ok(Columns::Points {
            at: [columns[0], columns[1], columns[2]],
            yaw: place("yaw_degrees"),
            scale: place("scale"),
        })
    }

    /// Where an instance is whose row has `number` of a column.
    fn to_world<E>(&self, up: DVec3, number: impl Fn(usize) -> Result<f64, E>) -> Result<DAffine3, E> {
        let given = |column: &Option<usize>, usual: f64| column.map_or(Ok(usual), &number);
        match self {
            Columns::Points { at: [x, y, z], yaw, scale } => {
                let translation = DVec3::new(number(*x)?, number(*y)?, number(*z)?);
                let (turn, scale) = (given(yaw, 0.0)?.to_radians(), given(scale, 1.0)?);
                Ok(DAffine3 { matrix3: DMat3::from_axis_angle(up, turn) * scale, translation })
            }
            Columns::Matrix(columns) => {
                let mut m = [0.0; 12];
                for (value, column) in m.iter_mut().zip(columns) {
                    *value = number(*column)?;
                }
                Ok(transform::of_rows(&m))
            }
        }
    }
}

/// An instance a line.
fn read_placements(bytes: &[u8], path: &Path, up: DVec3) -> Result<Vec<Placed>, Box<Problem>> {
    const HELP: &str =
        "begin the file with x,y,z or x,y,z,yaw_degrees or x,y,z,yaw_degrees,scale, or with m00,m01,m02,m03,m10 … m23";
    let table = table::read_for(bytes, path, "`x,y,z` and the like")?;
    table.check_metres()?;
    let of_names = |message: String| table.problem(Some(table.line), message, HELP);
    if table.names.is_empty() {
        return Err(of_names("names no columns".to_owned()));
    }
    let columns = Columns::of(&table.names, of_names)?;
    let placed = |row: &table::Row| {
        table.check_row(row)?;
        let to_world = columns.to_world(up, |column| {
            let missing =
                || table.problem(Some(row.line), format!("has no `{}`", table.names[column]), "give a number");
            table.number(row, column)?.ok_or_else(missing)
        })?;
        if !transform::is_invertible(&to_world) {
            return Err(table.problem(Some(row.line), FLAT.to_owned(), INVERTIBLE));
        }
        Ok(Placed { to_world, place: Place::Line(row.line) })
    };
    table.rows.iter().map(placed).collect()
}

/// An instance a row.
fn placements_of(data: &Data, up: DVec3) -> Result<Vec<Placed>, Box<Problem>> {
    const HELP: &str = "give columns x, y, z, and yaw_degrees and scale or not; or m00, m01, m02, m03, m10 … m23";
    let table = data.table()?;
    let columns = Columns::of(&table.columns, |message| data.problem(message, HELP))?;
    if table.values.is_empty() {
        return Err(data.problem("places nothing", "give a row for each instance, or leave it out"));
    }
    let placed = |(i, row): (usize, &[f64])| {
        let to_world = columns.to_world(up, |column| Ok::<f64, Box<Problem>>(row[column]))?;
        if !transform::is_invertible(&to_world) {
            return Err(data.problem(format!("row {i}, counted from 0, {FLAT}"), INVERTIBLE));
        }
        Ok(Placed { to_world, place: Place::Row(i) })
    };
    table.rows().enumerate().map(placed).collect()
}

const FLAT: &str = "flattens space: its determinant is 0 or cannot be represented";
const INVERTIBLE: &str = "use a scale that is not 0, or a matrix that can be inverted";

/// Says what is wrong about an instance that the entry `item` places.
fn report(placed: &Placed, message: String, item: &Item) {
    let key = item.member(if matches!(placed.place, Place::Entry) { "transform" } else { "placements" });
    let at = key.as_ref().unwrap_or(item);
    let file = || at.source().map(|(_, file)| file).unwrap_or_default();
    match placed.place {
        Place::Entry => at.error(message),
        Place::Line(line) => {
            report_in_file(at, Problem { file: file(), line: Some(line), message, ..Problem::default() });
        }
        Place::Row(i) => {
            let message = format!("row {i}, counted from 0, {message}");
            report_in_file(at, Problem { file: file(), message, ..Problem::default() });
        }
    }
}

impl Scene {
    /// Every object as often as it is placed, in the world, without assemblies. Of a scene without any, that scene.
    ///
    /// The geometry is that of the instances but for the rounding of f64.
    pub fn copied(&self) -> Cow<'_, Scene> {
        if self.assemblies.is_empty() {
            return Cow::Borrowed(self);
        }
        // What is copied has surfaces of its own.
        let bodies = self.objects.iter().filter_map(|object| object.interior).map(|interior| interior.body + 1);
        let bodies = bodies.max().unwrap_or(0);
        // Numbers of all instances, from 1: of each assembly that of the first.
        let mut first_of_each = Vec::with_capacity(self.assemblies.len());
        let mut next = 1;
        for assembly in &self.assemblies {
            first_of_each.push(next);
            next += assembly.instances.len();
        }
        let copies = self.objects.iter().flat_map(|object| {
            let first = object.assembly.map_or(0, |assembly| first_of_each[assembly]);
            self.placed(object).enumerate().map(move |(i, to_world)| match to_world {
                None => object.clone(),
                Some(to_world) => {
                    let mut copy = copy(object, to_world);
                    copy.interior.iter_mut().for_each(|interior| interior.body += bodies * (first + i));
                    copy
                }
            })
        });
        let objects = copies.collect();
        Cow::Owned(Scene { objects, assemblies: Vec::new(), ..self.clone() })
    }

    /// From the space of `object` to the world, for each time that it is there; `None`: it is in the world itself.
    fn placed(&self, object: &Object) -> impl Iterator<Item = Option<&DAffine3>> {
        let instances = object.assembly.map_or(&[][..], |assembly| &self.assemblies[assembly].instances);
        object.assembly.is_none().then_some(None).into_iter().chain(instances.iter().map(Some))
    }

    /// Boxes around `object`, one for each time that it is there.
    pub fn boxes(&self, object: &Object) -> impl Iterator<Item = [DVec3; 2]> {
        let bounds = object.shape.bounds();
        self.placed(object)
            .map(move |to_world| to_world.map_or(bounds, |to_world| transform::box_around(to_world, bounds)))
    }

    /// A box around everything; `None` where there is nothing.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let mut boxes: Vec<[DVec3; 2]> =
            self.objects.iter().filter(|o| o.assembly.is_none()).map(|object| object.shape.bounds()).collect();
        for (id, assembly) in self.assemblies.iter().enumerate() {
            let Some(own) = self.bounds_of(id) else { continue };
            boxes.extend(assembly.instances.iter().map(|to_world| transform::box_around(to_world, own)));
        }
        box_around_all(boxes)
    }

    /// A box around an assembly, in its own space.
    pub fn bounds_of(&self, assembly: AssemblyId) -> Option<[DVec3; 2]> {
        box_around_all(self.objects.iter().filter(|o| o.assembly == Some(assembly)).map(|object| object.shape.bounds()))
    }
}

/// The corners of a box around others; `None` without any.
pub fn box_around_all(boxes: impl IntoIterator<Item = [DVec3; 2]>) -> Option<[DVec3; 2]> {
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let [min, max] = boxes.into_iter().fold(none, |[min, max], [low, high]| [min.min(low), max.max(high)]);
    (min.x <= max.x).then_some([min, max])
}

fn copy(object: &Object, to_world: &DAffine3) -> Object {
    let mut attributes = object.attributes.clone();
    transform::apply_attributes(to_world, &mut attributes);
    if let Some(normals) = &mut attributes.normals {
        normals.iter_mut().flatten().for_each(|normal| *normal = normal.normalize());
    }
    // Who placed it has looked whether it can be.
    let shape = transform::apply(to_world, object.shape.clone()).unwrap_or_else(|_| object.shape.clone());
    let interior = object.interior.map(|own| Interior { to_grid: own.to_grid * to_world.inverse(), ..own });
    Object { shape, attributes, interior, assembly: None, ..object.clone() }
}
