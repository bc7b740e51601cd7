//! Scenes of pbrt-v4.

mod camera;
mod colour;
mod light;
mod material;
mod medium;
mod shape;
mod token;

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use glam::{DAffine3, DMat3, DVec3};

use self::shape::Form;
use self::token::{At, Parameters, Token, Tokens, shown};
use super::MOST_BOUNCES;
use super::geometry::similarity;
use super::media::{self, Boundary};
use super::picture::{Colour, Texture};
use super::report::Deviation;
use super::scene::{Scene, Section};
use super::text;
use crate::error::Problem;
use crate::format::primaries::Primaries;
use crate::{Error, Result};

/// Shapes that instances may become, and files that a scene may be made of.
const MOST_COPIES: usize = 100_000;
const MOST_PLACES: usize = 10_000_000;
const MOST_FILES: usize = 10_000;
const DEEPEST: usize = 64;

/// What a material became.
#[derive(Debug, Clone)]
pub enum Look {
    Material {
        name: String,
        textured: bool,
    },
    /// Rays pass.
    Nothing,
}

/// An area light that following shapes are.
#[derive(Debug, Clone)]
struct AreaLight {
    parameters: Parameters,
    at: At,
}

/// What attributes save.
#[derive(Debug, Clone)]
struct State {
    ctm: DAffine3,
    /// None: pbrt's own, as the scene has not named one.
    look: Option<Look>,
    area: Option<AreaLight>,
    reversed: bool,
    /// Of RGB, where it is not that of sRGB.
    space: Option<Primaries>,
    /// The medium within shapes now.
    inside: Option<String>,
    /// Of `Attribute`, by what they are for.
    defaults: HashMap<String, Parameters>,
}

/// A shape of an object that is placed later.
#[derive(Debug, Clone)]
struct Kept {
    form: Form,
    to_world: DAffine3,
    look: Look,
    emission: Option<(String, bool)>,
    inside: Option<String>,
    line: usize,
}

/// An object of several shapes, which is an assembly from its first instance on.
#[derive(Debug, Default)]
struct Kind {
    shapes: Vec<Kept>,
    assembly: Option<usize>,
}

pub struct Importer<'s> {
    pub scene: &'s mut Scene,
    pub textures: HashMap<String, Colour>,
    pub named: HashMap<String, Look>,
    /// What pictures of shares became.
    pub shares: Vec<(Rc<Texture>, (String, bool))>,
    /// `None` for those that are left out, which has been said.
    pub media: HashMap<String, Option<String>>,
    state: State,
    saved: Vec<(State, &'static str)>,
    systems: HashMap<String, DAffine3>,
    objects: HashMap<String, Kind>,
    /// The object that shapes go into.
    open: Option<(String, Vec<Kept>)>,
    copies: usize,
    places: usize,
    files: usize,
    film: Parameters,
    camera: Option<(String, Parameters, DAffine3, At)>,
    filter: Option<(String, Parameters, At)>,
    in_world: bool,
    default_look: Option<Look>,
}

/// Translates the scene in the file `source`.
pub fn read(source: &Path, scene: &mut Scene) -> Result<()> {
    let state = State {
        ctm: DAffine3::IDENTITY,
        look: None,
        area: None,
        reversed: false,
        space: None,
        inside: None,
        defaults: HashMap::new(),
    };
    let mut importer = Importer {
        scene,
        textures: HashMap::new(),
        named: HashMap::new(),
        shares: Vec::new(),
        media: HashMap::new(),
        state,
        saved: Vec::new(),
        systems: HashMap::new(),
        objects: HashMap::new(),
        open: None,
        copies: 0,
        places: 0,
        files: 0,
        film: Parameters::default(),
        camera: None,
        filter: None,
        in_world: false,
        default_look: None,
    };
    importer.file(source, &mut Vec::new())?;
    importer.finish(source)
}

/// A problem of another file, at the place where it is named.
fn beside(at: &At, problem: &Problem) -> Box<Problem> {
    let file = text::file_name(&problem.file.file_name().unwrap_or_default().to_string_lossy());
    let line = problem.line.map_or_else(String::new, |line| format!(":{line}"));
    at.problem(format!("{file}{line}: {}", problem.message))
}

impl Importer<'_> {
    fn file(&mut self, path: &Path, open: &mut Vec<PathBuf>) -> Result<()> {
        let whole = |message: String| Error::input(path, message);
        let identity = std::fs::canonicalize(path).map_err(|e| whole(format!("cannot be read: {e}")))?;
        if open.contains(&identity) {
            return Err(whole("includes itself".to_owned()));
        }
        self.files += 1;
        if self.files > MOST_FILES {
            return Err(whole(format!("is included after {MOST_FILES} others: that many are read at most")));
        }
        let bytes = std::fs::read(path).map_err(|e| whole(format!("cannot be read: {e}")))?;
        if bytes.contains(&0) {
            return Err(whole("is no text".to_owned()));
        }
        open.push(identity);
        if open.len() > DEEPEST {
            return Err(whole(format!("is included by more than {DEEPEST} files, one in the other")));
        }
        let mut tokens = Tokens::new(bytes, path);
        while let Some((token, at)) = tokens.next()? {
            let Token::Word(word) = token else {
                return Err(at.problem("a directive is expected here").into());
            };
            self.directive(&word, &mut tokens, &at, open)?;
        }
        open.pop();
        Ok(())
    }

    fn directive(&mut self, word: &str, tokens: &mut Tokens, at: &At, open: &mut Vec<PathBuf>) -> Result<()> {
        if self.transform(word, tokens, at)? || self.block(word, tokens, at)? {
            return Ok(());
        }
        match word {
            "Include" | "Import" => {
                let name = tokens.text("a file", at)?;
                self.file(&at.file(&name)?, open)?;
            }
            "WorldBegin" => {
                self.in_world = true;
                self.state.ctm = DAffine3::IDENTITY;
                self.systems.insert("world".to_owned(), DAffine3::IDENTITY);
            }
            "Camera" => {
                let (kind, parameters) = self.plugin(tokens, at)?;
                let from_camera = self.state.ctm.inverse();
                self.systems.insert("camera".to_owned(), from_camera);
                self.camera = Some((kind, parameters, from_camera, at.clone()));
            }
            "Film" => {
                let (kind, parameters) = self.plugin(tokens, at)?;
                self.scene.report.translated(format!("Film `{}`", shown(&kind)), at.place());
                self.film = parameters;
            }
            "PixelFilter" => {
                let (kind, parameters) = self.plugin(tokens, at)?;
                self.filter = Some((kind, parameters, at.clone()));
            }
            "Integrator" => {
                let (kind, parameters) = self.plugin(tokens, at)?;
                self.integrator(&kind, &parameters, at)?;
            }
            "Sampler" | "Accelerator" => drop(self.plugin(tokens, at)?),
            "Option" => drop(tokens.parameters()?),
            "ColorSpace" => {
                let name = tokens.text("a colour space", at)?;
                let d65 = [0.3127, 0.3290];
                self.state.space = match name.as_str() {
                    "srgb" => None,
                    "rec2020" => Some(Primaries([[0.708, 0.292], [0.170, 0.797], [0.131, 0.046], d65])),
                    "dci-p3" => Some(Primaries([[0.68, 0.32], [0.265, 0.69], [0.15, 0.06], d65])),
                    "aces2065-1" => {
                        Some(Primaries([[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077], [0.32168, 0.33767]]))
                    }
                    other => return Err(at.problem(format!("the colour space `{}` is unknown", shown(other))).into()),
                };
            }
            "Material" => {
                let (kind, parameters) = self.plugin(tokens, at)?;
                let parameters = self.with_defaults("material", parameters);
                let name = format!("{kind}-{}", at.line);
                self.state.look = Some(self.material(&name, &kind, &parameters, at)?);
            }
            "MakeNamedMaterial" => {
                let (name, parameters) = self.plugin(tokens, at)?;
                let parameters = self.with_defaults("material", parameters);
                let kind = parameters.text("type")?.ok_or_else(|| at.problem("the material has no `type`"))?.to_owned();
                let look = self.material(&name, &kind, &parameters, at)?;
                self.named.insert(name, look);
            }
            "NamedMaterial" => {
                let name = tokens.text("a name", at)?;
                let found = self.named.get(&name).cloned();
                let found = found.ok_or_else(|| at.problem(format!("no material is named \"{}\"", shown(&name))))?;
                self.state.look = Some(found);
            }
            "Texture" => {
                let name = tokens.text("a name", at)?;
                let kind = tokens.text("`spectrum` or `float`", at)?;
                let (class, parameters) = self.plugin(tokens, at)?;
                let parameters = self.with_defaults("texture", parameters);
                self.texture(&name, &kind, &class, &parameters, at)?;
            }
            "LightSource" => {
                let (kind, parameters) = self.plugin(tokens, at)?;
                let parameters = self.with_defaults("light", parameters);
                let ctm = self.state.ctm;
                self.source(&kind, &parameters, &ctm, at)?;
            }
            "AreaLightSource" => {
                let (kind, parameters) = self.plugin(tokens, at)?;
                if kind == "diffuse" {
                    let parameters = self.with_defaults("light", parameters);
                    self.state.area = Some(AreaLight { parameters, at: at.clone() });
                } else {
                    self.scene.report.left_out(at.place(), format!("the area light `{}`", shown(&kind)));
                }
            }
            "Shape" => {
                let (kind, parameters) = self.plugin(tokens, at)?;
                let parameters = self.with_defaults("shape", parameters);
                self.shape(&kind, &parameters, at)?;
            }
            "MakeNamedMedium" => {
                let (name, parameters) = self.plugin(tokens, at)?;
                let medium = self.medium(&name, &parameters, at)?;
                self.media.insert(name, medium);
            }
            "MediumInterface" => {
                let inside = tokens.text("a name", at)?;
                let outside = match tokens.peek()? {
                    Some((Token::Text(text), _)) if !text.contains(' ') => tokens.text("a name", at)?,
                    _ => inside.clone(),
                };
                self.interface(&inside, &outside, at)?;
            }
            _ => return Err(at.problem(format!("`{}` is no directive of pbrt-v4", shown(word))).into()),
        }
        Ok(())
    }

    /// `"name"` and the parameters of a directive.
    fn plugin(&mut self, tokens: &mut Tokens, at: &At) -> Result<(String, Parameters)> {
        Ok((tokens.text("a name", at)?, tokens.parameters()?))
    }

    fn with_defaults(&self, of: &str, parameters: Parameters) -> Parameters {
        match self.state.defaults.get(of) {
            Some(defaults) => parameters.over(defaults),
            None => parameters,
        }
    }

    /// Directives that change the current transform.
    fn transform(&mut self, word: &str, tokens: &mut Tokens, at: &At) -> Result<bool> {
        let step = match word {
            "Identity" => {
                self.state.ctm = DAffine3::IDENTITY;
                return Ok(true);
            }
            "Translate" => DAffine3::from_translation(DVec3::from_array(tokens.numbers(at)?)),
            "Scale" => {
                let factors = DVec3::from_array(tokens.numbers(at)?);
                if factors.to_array().contains(&0.0) {
                    return Err(at.problem("a `Scale` of 0 flattens space").into());
                }
                DAffine3::from_scale(factors)
            }
            "Rotate" => {
                let [degrees, x, y, z] = tokens.numbers(at)?;
                let axis = DVec3::new(x, y, z).try_normalize().ok_or_else(|| at.problem("`Rotate` has no axis"))?;
                DAffine3::from_axis_angle(axis, degrees.to_radians())
            }
            "LookAt" => {
                let [ex, ey, ez, lx, ly, lz, ux, uy, uz] = tokens.numbers(at)?;
                let (eye, look, up) = (DVec3::new(ex, ey, ez), DVec3::new(lx, ly, lz), DVec3::new(ux, uy, uz));
                let frame = || {
                    let forward = (look - eye).try_normalize()?;
                    let right = up.try_normalize()?.cross(forward).try_normalize()?;
                    Some(DMat3::from_cols(right, forward.cross(right), forward))
                };
                let matrix3 =
                    frame().ok_or_else(|| at.problem("`LookAt` has no direction, or its up lies along it"))?;
                DAffine3 { matrix3, translation: eye }.inverse()
            }
            "Transform" | "ConcatTransform" => {
                let m: [f64; 16] = tokens.numbers(at)?;
                if [m[3], m[7], m[11], m[15]] != [0.0, 0.0, 0.0, 1.0] {
                    return Err(at.problem("the matrix has a last row that is not 0, 0, 0, 1").into());
                }
                let column = |i: usize| DVec3::new(m[i], m[i + 1], m[i + 2]);
                let matrix3 = DMat3::from_cols(column(0), column(4), column(8));
                if matrix3.determinant() == 0.0 {
                    return Err(at.problem("the matrix flattens space").into());
                }
                let affine = DAffine3 { matrix3, translation: column(12) };
                if word == "Transform" {
                    self.state.ctm = affine;
                    return Ok(true);
                }
                affine
            }
            "CoordinateSystem" => {
                self.systems.insert(tokens.text("a name", at)?, self.state.ctm);
                return Ok(true);
            }
            "CoordSysTransform" => {
                let name = tokens.text("a name", at)?;
                let found = self.systems.get(&name).copied();
                self.state.ctm =
                    found.ok_or_else(|| at.problem(format!("no coordinate system is named \"{}\"", shown(&name))))?;
                return Ok(true);
            }
            "ReverseOrientation" => {
                self.state.reversed = !self.state.reversed;
                return Ok(true);
            }
            "TransformTimes" | "ActiveTransform" => {
                if word == "TransformTimes" {
                    tokens.numbers::<2>(at)?;
                } else {
                    tokens.next()?;
                }
                self.scene.report.left_out(at.place(), "motion: everything is where the last transform puts it");
                return Ok(true);
            }
            _ => return Ok(false),
        };
        self.state.ctm *= step;
        if !self.state.ctm.is_finite() {
            return Err(at.problem("the transform is not finite").into());
        }
        Ok(true)
    }

    /// Directives that begin and end something.
    fn block(&mut self, word: &str, tokens: &mut Tokens, at: &At) -> Result<bool> {
        match word {
            "AttributeBegin" | "TransformBegin" => {
                if self.saved.len() >= 10_000 {
                    return Err(at.problem("more than 10,000 attributes are open").into());
                }
                self.saved
                    .push((self.state.clone(), if word == "AttributeBegin" { "AttributeEnd" } else { "TransformEnd" }));
            }
            "AttributeEnd" | "TransformEnd" => match self.saved.pop() {
                Some((state, end)) if end == word && word == "AttributeEnd" => self.state = state,
                Some((state, end)) if end == word => self.state.ctm = state.ctm,
                _ => return Err(at.problem(format!("`{word}` ends what has not begun")).into()),
            },
            "Attribute" => {
                let of = tokens.text("what it is for", at)?;
                let parameters = tokens.parameters()?;
                let before = self.state.defaults.remove(&of).unwrap_or_default();
                self.state.defaults.insert(of, parameters.over(&before));
            }
            "ObjectBegin" => {
                let name = tokens.text("a name", at)?;
                if self.open.is_some() {
                    return Err(at.problem("`ObjectBegin` within another").into());
                }
                self.saved.push((self.state.clone(), "ObjectEnd"));
                self.open = Some((name, Vec::new()));
            }
            "ObjectEnd" => match (self.saved.pop(), self.open.take()) {
                (Some((state, "ObjectEnd")), Some((name, kept))) => {
                    self.state = state;
                    self.objects.insert(name, Kind { shapes: kept, assembly: None });
                }
                _ => return Err(at.problem("`ObjectEnd` ends what has not begun").into()),
            },
            "ObjectInstance" => {
                let name = tokens.text("a name", at)?;
                self.instance(&name, at)?;
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Places an object; as copies of its shapes where these are stretched and round.
    fn instance(&mut self, name: &str, at: &At) -> Result<()> {
        let unknown = || at.problem(format!("no object is named \"{}\"", shown(name)));
        let Kind { shapes, assembly } = self.objects.remove(name).ok_or_else(unknown)?;
        self.places += 1;
        if self.places > MOST_PLACES {
            return Err(at.problem(format!("the scene has more than {MOST_PLACES} instances")).into());
        }
        let to_world = self.state.ctm;
        if shapes.is_empty() {
            self.objects.insert(name.to_owned(), Kind { shapes, assembly });
            return Ok(());
        }
        let id = match assembly {
            Some(id) => id,
            None => {
                let before = std::mem::take(&mut self.scene.objects);
                let placed = shapes.iter().try_for_each(|shape| self.place(shape.clone(), at));
                let parts = std::mem::replace(&mut self.scene.objects, before);
                placed?;
                self.scene.assemble(name, parts)
            }
        };
        if self.scene.assemblies[id].takes(&to_world) {
            self.scene.assemblies[id].place(to_world);
            self.scene.report.translated("ObjectInstance", at.place());
        } else {
            self.copies += shapes.len();
            if self.copies > MOST_COPIES {
                let message = format!(
                    "more than {MOST_COPIES} shapes are in instances that stretch a round one, each of which becomes a copy"
                );
                return Err(at.problem(message).into());
            }
            for shape in &shapes {
                self.place(Kept { to_world: to_world * shape.to_world, ..shape.clone() }, at)?;
            }
        }
        self.objects.insert(name.to_owned(), Kind { shapes, assembly: Some(id) });
        Ok(())
    }

    fn shape(&mut self, kind: &str, parameters: &Parameters, at: &At) -> Result<()> {
        let to_world = self.state.ctm;
        let round = similarity(to_world.matrix3).is_some();
        let reversed = self.state.reversed;
        let textured = matches!(self.state.look, Some(Look::Material { textured: true, .. }))
            || parameters.get("alpha").is_some_and(|alpha| alpha.kind == "texture");
        let Some(form) = self.form(kind, parameters, at, (round, textured), reversed)? else { return Ok(()) };
        let emission = match self.state.area.clone() {
            Some(area) => Some(self.emission(&area, &form, &to_world, at)?),
            None => None,
        };
        let alpha = match parameters.get("alpha") {
            Some(alpha) => Some(self.share(alpha)?).filter(|(share, _)| share != "1.0"),
            None => None,
        };
        parameters.finish(&format!("the shape `{kind}`"), &mut self.scene.report);
        self.scene.report.translated(format!("Shape `{kind}`"), at.place());
        let mut look = self.look();
        if let Some(alpha) = alpha {
            look = self.masked(look, alpha, at);
        }
        let kept = Kept { form, to_world, look, emission, inside: self.state.inside.clone(), line: at.line };
        match &mut self.open {
            Some((_, shapes)) => shapes.push(kept),
            None => self.place(kept, at)?,
        }
        Ok(())
    }

    /// The material of shapes now.
    fn look(&mut self) -> Look {
        if let Some(look) = &self.state.look {
            return look.clone();
        }
        let scene = &mut self.scene;
        let made = || {
            let section = Section::default().comment("of shapes that have none in pbrt").with("reflectance", "0.5");
            Look::Material { name: scene.put("default", "diffuse", section), textured: false }
        };
        self.default_look.get_or_insert_with(made).clone()
    }

    /// What a shape emits, and whether from both sides.
    fn emission(&mut self, area: &AreaLight, form: &Form, to_world: &DAffine3, at: &At) -> Result<(String, bool)> {
        let parameters = &area.parameters;
        let both = parameters.boolean("twosided", false)?;
        if parameters.get("filename").is_some() {
            self.scene.report.left_out(area.at.place(), "`filename` of an area light: it shines evenly");
        }
        if let Some(spread) = parameters.number("spread")?.filter(|spread| *spread < 90.0) {
            // Of what shines evenly into half of space, π, a cone of half of an angle has π sin².
            let cone = spread.max(0.0).to_radians().sin().powi(2);
            let off = match cone > 0.0 {
                true => format!(
                    "nothing within {spread} degrees of its normal; beyond, all its radiance: its power is {} times as much",
                    text::up(1.0 / cone)
                ),
                false => "all its radiance: it shines along its normal alone".to_owned(),
            };
            let what = "the `spread` of an area light as 90 degrees: its radiance is the same in all directions";
            self.scene.report.approximated(area.at.place(), what, Deviation::at_most(off));
        }
        let unit = std::f64::consts::PI * form.area(to_world) * if both { 2.0 } else { 1.0 };
        let scale = self.photometric(parameters, "power", "L", unit)?;
        let light = self.light(parameters, "L", scale, &format!("area-{}", at.line))?;
        parameters.finish("the area light", &mut self.scene.report);
        Ok((light, both))
    }

    fn place(&mut self, kept: Kept, at: &At) -> Result<()> {
        let (material, textured) = match (&kept.look, &kept.emission) {
            (Look::Material { name, textured }, _) => (Some(name.clone()), *textured),
            (Look::Nothing, Some(_)) => {
                let known = self.named.get("lamp that is nothing else").cloned();
                let name = match known {
                    Some(Look::Material { name, .. }) => name,
                    _ => self.scene.put("lamp", "black", Section::default()),
                };
                let look = Look::Material { name: name.clone(), textured: false };
                self.named.insert("lamp that is nothing else".to_owned(), look);
                (Some(name), false)
            }
            (Look::Nothing, None) if kept.inside.is_some() => (None, false),
            (Look::Nothing, None) => {
                self.scene.report.left_out(at.place(), "a shape of which nothing is seen (material `interface`)");
                return Ok(());
            }
        };
        let Some(mut object) = kept.form.section(&kept.to_world, textured) else {
            self.scene.report.left_out(at.place(), "an instance that stretches a round shape");
            return Ok(());
        };
        object.comments.push(format!("line {}", kept.line));
        let boundary = Boundary::of(self.scene, material.as_deref());
        let is_filled = match &kept.inside {
            Some(medium) => media::fill(self.scene, &mut object, medium, boundary, at.place()),
            None => false,
        };
        match material {
            Some(material) => object.set("material", text::quoted(&material)),
            None if is_filled => {}
            None => return Ok(()),
        }
        if let Some((emission, both)) = kept.emission {
            object.set("emission", emission);
            if both {
                object.set("emission_sides", "\"both\"");
            }
        }
        if let Some(at) = object.entries.iter().position(|(key, _)| key == "transform") {
            let transform = object.entries.remove(at);
            object.entries.push(transform);
        }
        self.scene.objects.push(object);
        Ok(())
    }

    fn integrator(&mut self, kind: &str, parameters: &Parameters, at: &At) -> Result<()> {
        if !["path", "volpath", "bdpt", "mlt", "sppm", "simplepath", "simplevolpath"].contains(&kind) {
            let off = Deviation::unbounded("light that only one of the two counts, and its noise");
            let what = format!("the integrator `{}` as a path tracer", shown(kind));
            self.scene.report.approximated(at.place(), what, off);
        }
        let depth = parameters.number("maxdepth")?.unwrap_or(5.0);
        let depth = self.scene.report.within(at.place(), "`maxdepth`", depth, [0.0, MOST_BOUNCES]);
        parameters.ask_for_all();
        self.scene.report.translated(format!("Integrator `{}`", shown(kind)), at.place());
        self.scene.integrator = Some(Section::new("[integrator]").with("max_bounces", (depth as u32).to_string()));
        Ok(())
    }
}
