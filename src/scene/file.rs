//! From a scene file to a [`Scene`]: the top level of `scene.toml`.

use std::path::{Path, PathBuf};

use super::assembly;
use super::camera;
use super::channels;
use super::context::Context;
use super::coverage;
use super::decode::{Fields, Item};
use super::digest::digest;
use super::environment;
use super::georeference;
use super::keys;
use super::light;
use super::material::Materials;
use super::medium::Media;
use super::object::Objects;
use super::overrides;
use super::spectrum::Spectra;
use super::tree::{Entry, Origin, Value};
use super::{Evaluation, Evaluator, Integrator, MOST_WAVELENGTHS, Sampler, Scene, Wavelengths};
use crate::error::{Error, Problem, Result};

/// Evaluations walk all records of a path, two a bounce and one more, in one loop of at most 32,768 iterations,
/// the most that every driver runs.
const MAX_BOUNCES: u32 = 16_383;
const MAX_EPOCH: u32 = 1024;
/// Of spectral MIS: the state of a path has a number for each.
const MOST_TECHNIQUES: u32 = 16;

/// Reads the scene in `file`. `overrides` are the `--set` arguments: a dotted key and the text of a TOML value; a bare
/// word is a string.
///
/// # Errors
/// [`Error::Input`] with every independent mistake in the scene, its spectra and its meshes.
pub fn load(file: &Path, overrides: &[(String, String)]) -> Result<Scene> {
    parse(&text_of(file)?, file, overrides)
}

/// The text of the scene in `file`, and its tree, of which only the syntax has been checked.
///
/// # Errors
/// [`Error::Input`] with every mistake of syntax.
pub fn read(file: &Path) -> Result<(String, Vec<Entry>)> {
    let text = text_of(file)?;
    let cx = Context::new(file, without_mark(&text), &[]);
    match cx.document() {
        Some(root) => Ok((text, root)),
        None => Err(Error::Input(cx.finish().0)),
    }
}

fn text_of(file: &Path) -> Result<String> {
    let bytes = std::fs::read(file).map_err(|e| Error::input(file, format!("cannot be read: {e}")))?;
    String::from_utf8(bytes).map_err(|e| {
        let line = e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count() + 1;
        Error::Input(vec![Problem {
            file: file.to_owned(),
            line: Some(line),
            message: "is not UTF-8 text".to_owned(),
            help: Some("save the scene as UTF-8".to_owned()),
            ..Problem::default()
        }])
    })
}

/// Without the mark that some editors put first, which is no part of the scene.
pub(super) fn without_mark(text: &str) -> &str {
    text.strip_prefix('\u{feff}').unwrap_or(text)
}

/// [`load`] on the text of a scene; `file` only locates relative paths and messages.
pub fn parse(text: &str, file: &Path, overrides: &[(String, String)]) -> Result<Scene> {
    let cx = Context::new(file, without_mark(text), overrides);
    let Some(root) = cx.document() else { return Err(Error::Input(cx.finish().0)) };
    resolve(cx, root, overrides)
}

/// The scene that a tree describes.
pub(super) fn resolve(cx: Context<'_>, mut root: Vec<Entry>, overrides: &[(String, String)]) -> Result<Scene> {
    let file = cx.file;
    overrides::apply(&cx, &mut root, overrides);
    let scene = decode(&cx, &root);
    let (problems, warnings) = cx.finish();
    if !problems.is_empty() {
        return Err(Error::Input(problems));
    }
    let mut scene = scene.ok_or_else(|| Error::Internal("a scene was refused without saying why".to_owned()))?;
    scene.file = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
    scene.warnings = warnings;
    let coverage = coverage::warnings(&scene);
    scene.warnings.extend(coverage);
    scene.digest = digest(&scene);
    Ok(scene)
}

/// Decodes every section, whatever is wrong with the others; `None` if anything was.
fn decode<'a>(cx: &'a Context<'a>, root: &'a [Entry]) -> Option<Scene> {
    let top = Fields::root(cx, root, &keys::SCENE);
    let section = |key: &str, example: &str| {
        let item = top.get(key);
        if item.is_none() {
            cx.error(&Origin::Whole, key, format!("`[{key}]` is missing"), Some(format!("add {example}")));
        }
        item
    };
    let film = section("film", "[film] with width and height in pixels").and_then(|i| camera::decode_film(&i));
    let camera = section("camera", "[camera.perspective] with position, look_at and fov")
        .and_then(|i| camera::decode_camera(&i, film.as_ref()));
    let georeference = top.get("georeference").map(|item| georeference::decode(&item, camera.as_ref(), film.as_ref()));
    let channels = section("channels", "[channels] with equal = { from = 380, to = 780, count = 400 }")
        .and_then(|i| channels::decode(&i));
    let integrator = match top.get("integrator") {
        Some(item) => decode_integrator(&item),
        None => Some(Integrator::default()),
    };

    let mut spectra = Spectra::new(cx, top.get("spectra"), channels.clone());
    let mut materials = Materials::new(top.get("materials"), &mut spectra);
    let mut media = Media::new(top.get("media"), &mut spectra);
    let mut objects = Objects::new(&mut spectra, &mut materials, &mut media);
    if let Some(items) = top.get("objects").and_then(|item| item.array()) {
        objects.add_all(&items);
    }
    let assemblies = assembly::decode(top.get("assemblies").as_ref(), top.get("instances").as_ref(), &mut objects);
    let objects = objects.finish();
    let (materials, textures) = materials.finish();
    let outer = top.get("camera").and_then(|item| camera::medium(&item));
    let camera_medium = outer.map(|item| media.take_outer(&item, &mut spectra));
    let lights = light::decode_lights(top.get("lights"), &mut spectra);
    let environment = top.get("environment").map(|item| environment::decode(&item, &mut spectra));

    Some(Scene {
        file: PathBuf::new(),
        camera: camera?,
        film: film?,
        channels: channels?,
        integrator: integrator?,
        materials,
        textures,
        spectra: spectra.finish(),
        objects,
        assemblies,
        media: media.finish(),
        camera_medium: match camera_medium {
            Some(medium) => Some(medium?),
            None => None,
        },
        lights,
        environment: match environment {
            Some(environment) => Some(environment?),
            None => None,
        },
        georeference: match georeference {
            Some(georeference) => Some(georeference?),
            None => None,
        },
        first_hits: false,
        warnings: Vec::new(),
        digest: String::new(),
    })
}

impl Default for Integrator {
    /// What a scene without `[integrator]` gets.
    fn default() -> Self {
        Integrator {
            max_bounces: 5,
            russian_roulette_start: 0,
            sampler: Sampler::Sobol,
            wavelengths: Wavelengths::Emission,
            wavelengths_per_channel: None,
            techniques: None,
            forced_collision: false,
            evaluation: Evaluation::Auto,
            evaluator: Evaluator::Auto,
            epoch: 64,
        }
    }
}

fn decode_integrator(item: &Item) -> Option<Integrator> {
    let fields = item.table(&keys::INTEGRATOR)?;
    let default = Integrator::default();
    let bounces = |key: &str, default: u32| match fields.get(key) {
        Some(item) => item.whole(0..=MAX_BOUNCES),
        None => Some(default),
    };
    let max_bounces = bounces("max_bounces", default.max_bounces);
    let russian_roulette_start = bounces("russian_roulette_start", default.russian_roulette_start);
    let sampler = match fields.get("sampler") {
        Some(item) => item.choice(&[("sobol", Sampler::Sobol), ("independent", Sampler::Independent)]),
        None => Some(default.sampler),
    };
    let wavelengths = match fields.get("wavelengths") {
        Some(item) => item.choice(&[("emission", Wavelengths::Emission), ("uniform", Wavelengths::Uniform)]),
        None => Some(default.wavelengths),
    };
    let power_of_two = |key: &str, most: u32, default: u32| match fields.get(key) {
        Some(item) => item.whole(1..=most).filter(|value| {
            if !value.is_power_of_two() {
                item.error_help(
                    format!("must be a power of two up to {most}, but is {value}"),
                    format!("use {} or {}", value.next_power_of_two() / 2, value.next_power_of_two()),
                );
            }
            value.is_power_of_two()
        }),
        None => Some(default),
    };
    let is_auto = |item: &Item| matches!(&item.node.value, Value::String(word) if word == "auto");
    let wavelengths_per_channel = match fields.get("wavelengths_per_channel").filter(|item| !is_auto(item)) {
        Some(_) => power_of_two("wavelengths_per_channel", MOST_WAVELENGTHS, 1).map(Some),
        None => Some(default.wavelengths_per_channel),
    };
    let techniques = match fields.get("techniques") {
        Some(item) if is_auto(&item) => Some(None),
        Some(item) => item.whole(1..=MOST_TECHNIQUES).map(Some),
        None => Some(default.techniques),
    };
    let forced_collision = match fields.get("forced_collision") {
        Some(item) => item.boolean(),
        None => Some(default.forced_collision),
    };
    let evaluation = match fields.get("evaluation") {
        Some(item) => item.choice(&Evaluation::ALL.map(|evaluation| (evaluation.name(), evaluation))),
        None => Some(default.evaluation),
    };
    let evaluator = match fields.get("evaluator") {
        Some(item) => item.choice(&Evaluator::ALL.map(|evaluator| (evaluator.name(), evaluator))),
        None => Some(default.evaluator),
    };
    let epoch = power_of_two("epoch", MAX_EPOCH, default.epoch);
    Some(Integrator {
        max_bounces: max_bounces?,
        russian_roulette_start: russian_roulette_start?,
        sampler: sampler?,
        wavelengths: wavelengths?,
        wavelengths_per_channel: wavelengths_per_channel?,
        techniques: techniques?,
        forced_collision: forced_collision?,
        evaluation: evaluation?,
        evaluator: evaluator?,
        epoch: epoch?,
    })
}
