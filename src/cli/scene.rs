//! The arguments that choose a scene and change it.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::scene::{self, Draft, Scene};
use crate::{Error, Result, files};

/// Arguments of every command that reads a scene.
#[derive(Debug, clap::Args)]
pub struct SceneArgs {
    /// The scene file (TOML)
    pub scene: PathBuf,

    /// Override a key of the scene, e.g. --set channels.equal.count=1000 (repeatable)
    ///
    /// The key is a dotted path into the scene file, list items by number: `objects.0.material=red`. The value is
    /// written as in TOML; text without quotes is a string. Setting one of several exclusive keys (such as
    /// `channels.wavenumber` where the file has `channels.equal`) replaces its sibling.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = parse_override)]
    pub overrides: Vec<(String, String)>,

    /// Size of the picture in pixels, instead of film.width and film.height
    ///
    /// The same as --set film.width=W --set film.height=H. Half the size is a quarter of the time.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Width and height of a tile in pixels, a multiple of 8
    ///
    /// A tile with all its channels is one file of the cube, and the least that is rendered, merged or recovered: 4
    /// bytes x channels x pixels. Small tiles need little memory on the device, large ones mean fewer files and keep
    /// large devices busy. By default it follows from the number of channels and the size of the picture. It is fixed
    /// when the cube is created.
    #[arg(long, value_name = "PIXELS", value_parser = parse_tile)]
    pub tile: Option<u32>,

    /// What is rendered in the place of `scene`, where a program around the command has made one
    #[arg(skip)]
    pub given: Option<Arc<Draft>>,
}

impl SceneArgs {
    /// Reads the scene, with what the arguments change.
    pub fn load(&self) -> Result<Scene> {
        self.with(Vec::new())
    }

    /// [`SceneArgs::load`] with more keys overridden.
    pub fn with(&self, more: Vec<(String, String)>) -> Result<Scene> {
        let mut overrides = self.overrides.clone();
        overrides.extend(more);
        if let Some([width, height]) = self.size {
            let of_film = |(key, _): &&(String, String)| {
                let key = key.replace([' ', '"', '\''], "");
                ["film.width", "film.height", "film"].contains(&key.as_str())
            };
            if let Some((key, _)) = self.overrides.iter().find(of_film) {
                let message = format!("--size and --set {key} both say the size: keep one of them");
                return Err(crate::Error::Usage(message));
            }
            overrides.push(("film.width".into(), width.to_string()));
            overrides.push(("film.height".into(), height.to_string()));
        }
        match &self.given {
            Some(draft) => draft.resolve(&overrides),
            None => scene::load(&self.scene, &overrides),
        }
    }
}

impl SceneArgs {
    /// Refuses an output that would take the place of the scene, or of a file that it names.
    pub fn refuse_as_output(&self, output: &Path) -> Result<()> {
        let Ok(output_there) = fs::canonicalize(output) else { return Ok(()) };
        let mut named = vec![self.scene.clone()];
        let mut note = |text: &str| named.push(files::parent(&self.scene).join(text));
        let scene = fs::read_to_string(&self.scene).unwrap_or_default();
        if let Ok(scene) = scene.parse::<toml::Table>() {
            scene.values().for_each(|value| each_text(value, &mut note));
        }
        if let Some(draft) = &self.given {
            draft.texts().into_iter().for_each(&mut note);
        }
        self.overrides.iter().for_each(|(_, value)| note(value.trim_matches(['"', '\''])));
        match named.iter().any(|file| fs::canonicalize(file).is_ok_and(|file| file == output_there)) {
            true => Err(Error::Usage(format!(
                "{}: the scene is read from this file; choose another name",
                output.display()
            ))),
            false => Ok(()),
        }
    }
}

/// Calls `each` with every text in a TOML value.
fn each_text(value: &toml::Value, each: &mut impl FnMut(&str)) {
    match value {
        toml::Value::String(text) => each(text),
        toml::Value::Array(items) => items.iter().for_each(|item| each_text(item, each)),
        toml::Value::Table(fields) => fields.values().for_each(|field| each_text(field, each)),
        _ => {}
    }
}

pub(super) fn parse_override(text: &str) -> std::result::Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().to_owned(), value.trim().to_owned())),
        _ => Err("an override is KEY=VALUE, such as film.width=256".into()),
    }
}

pub(super) fn parse_size(text: &str) -> std::result::Result<[u32; 2], String> {
    let side = |text: &str| text.parse::<u32>().ok().filter(|&side| side > 0);
    text.split_once(['x', 'X'])
        .and_then(|(width, height)| Some([side(width)?, side(height)?]))
        .ok_or_else(|| "a size is WIDTHxHEIGHT in whole pixels from 1, such as 640x480".into())
}

fn parse_tile(text: &str) -> std::result::Result<u32, String> {
    match text.parse::<u32>() {
        Ok(tile) if tile > 0 && tile % crate::cube::BLOCK == 0 => Ok(tile),
        _ => Err("a tile is a multiple of 8 pixels wide and high, such as 32 or 64".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_or_explained() {
        assert_eq!(parse_size("640x480"), Ok([640, 480]));
        assert_eq!(parse_override("a.b = c=d"), Ok(("a.b".into(), "c=d".into())));
        assert_eq!(parse_tile("24"), Ok(24));
        for bad in ["640", "0x5", "5x-1", "1x2x3", "x", "99999999999x1"] {
            assert!(parse_size(bad).unwrap_err().contains("640x480"), "{bad}");
        }
        for bad in ["", "=3", "film.width"] {
            assert!(parse_override(bad).is_err(), "{bad}");
        }
        for bad in ["0", "12", "-8", "8.0", ""] {
            assert!(parse_tile(bad).is_err(), "{bad}");
        }
    }
}
