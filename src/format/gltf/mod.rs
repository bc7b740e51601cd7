//! glTF 2.0 files, as text (.gltf) and binary (.glb): `gltf-json` reads the JSON; buffers and what lies in them are read here, since
//! it keeps no places. Whatever one part of a file names of another is looked up, never trusted.

mod accessor;
mod geometry;

use std::borrow::Cow;
use std::path::{Component, Path};

use gltf_json::Root;

pub use geometry::{Placed, Standing};
pub use gltf_json as json;

use crate::error::Problem;
use crate::files;

/// A glTF file with all its buffers in memory.
#[derive(Debug)]
pub struct File {
    /// As it was named.
    pub path: std::path::PathBuf,
    pub root: Root,
    buffers: Vec<Vec<u8>>,
}

/// Extensions that say nothing of where surfaces are, or that are read: a file may require them.
const KNOWN: [&str; 7] = [
    "KHR_mesh_quantization",
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_texture_transform",
    "KHR_texture_basisu",
    "EXT_texture_webp",
    "KHR_xmp_json_ld",
];

/// The file of this content, and the buffers beside `path` that it names.
///
/// # Errors
/// What is wrong with it, with the line of JSON, or the path in it.
pub fn parse(bytes: &[u8], path: &Path) -> Result<File, Box<Problem>> {
    let whole = |message: String| Box::new(Problem { file: path.to_owned(), message, ..Problem::default() });
    let (text, chunk) = if bytes.starts_with(b"glTF") { chunks(bytes).map_err(whole)? } else { (bytes, None) };
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let root = Root::from_slice(text).map_err(|error| {
        let is_text = chunk.is_none() && !bytes.starts_with(b"glTF");
        let (line, column) = (error.line(), error.column());
        let said = error.to_string();
        // Where it stands is said by itself.
        let said = said.rsplit_once(" at line ").map_or(said.as_str(), |(said, _)| said).replace(['\n', '\r'], " ");
        let message = format!("is not glTF: {said}");
        let at = |place: usize| (is_text && place > 0).then_some(place);
        Box::new(Problem { file: path.to_owned(), line: at(line), column: at(column), message, ..Problem::default() })
    })?;
    let mut file = File { path: path.to_owned(), root, buffers: Vec::new() };
    file.check().map_err(|message| file.problem(message))?;
    for index in 0..file.root.buffers.len() {
        let buffer = file.buffer(index, chunk).map_err(|message| file.problem(message))?;
        file.buffers.push(buffer);
    }
    Ok(file)
}

/// The JSON of a binary file, and its data if it has some.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word = |at: usize| {
        let four = bytes.get(at..).and_then(|rest| rest.first_chunk::<4>());
        four.map(|four| u32::from_le_bytes(*four)).ok_or_else(|| format!("ends within its header, at byte {at}"))
    };
    let version = word(4)?;
    if version != 2 {
        return Err(format!("is glTF of version {version}: only 2 is supported"));
    }
    // Of what follows the stated length nothing is part of the file.
    let bytes = usize::try_from(word(8)?)
        .ok()
        .and_then(|length| bytes.get(..length))
        .ok_or_else(|| format!("is cut off: it has {} bytes of those that its header states", bytes.len()))?;
    let mut found = (None, None);
    let mut at = 12;
    while at < bytes.len() {
        let (length, kind) = (word(at)?, word(at + 4)?);
        let data = usize::try_from(length).ok().and_then(|length| bytes.get(at + 8..)?.get(..length));
        let data = data.ok_or_else(|| format!("is cut off: the chunk at byte {at} should have {length} bytes"))?;
        match &kind.to_le_bytes() {
            b"JSON" if found.0.is_none() => found.0 = Some(data),
            b"BIN\0" if found.1.is_none() => found.1 = Some(data),
            // Chunks of kinds unknown are to be passed over.
            _ => {}
        }
        at += 8 + data.len();
    }
    Ok((found.0.ok_or("has no chunk of JSON")?, found.1))
}

impl File {
    /// A mistake in this file.
    pub fn problem(&self, message: String) -> Box<Problem> {
        Box::new(Problem { file: self.path.clone(), message, ..Problem::default() })
    }

    fn check(&self) -> Result<(), String> {
        let asset = &self.root.asset;
        if asset.version.split('.').next() != Some("2") {
            return Err(format!("is glTF of version {}: only 2 is supported", asset.version.escape_debug()));
        }
        // Files of a later minor version may be read as 2.0, unless they say otherwise.
        if let Some(least) = asset.min_version.as_ref().filter(|least| *least != "2.0") {
            return Err(format!("asks for readers of glTF {}: only 2.0 is supported", least.escape_debug()));
        }
        let is_known = |name: &&String| name.starts_with("KHR_materials_") || KNOWN.contains(&name.as_str());
        match self.root.extensions_required.iter().find(|name| !is_known(name)) {
            Some(name) => Err(format!(
                "requires the extension {}, which is not supported: export without it",
                name.escape_debug()
            )),
            None => Ok(()),
        }
    }

    fn buffer(&self, index: usize, chunk: Option<&[u8]>) -> Result<Vec<u8>, String> {
        let buffer = &self.root.buffers[index];
        let at = format!("buffers[{index}]");
        let mut bytes = match &buffer.uri {
            Some(uri) => self.bytes_of(uri, &at)?.0,
            None if index == 0 => match chunk {
                Some(chunk) => chunk.to_vec(),
                None => return Err(format!("`{at}` has no `uri`, and the file no binary chunk")),
            },
            None => return Err(format!("`{at}` has no `uri`")),
        };
        let stated = buffer.byte_length.0;
        if (bytes.len() as u64) < stated {
            return Err(format!("`{at}` has {} bytes, but should have {stated}", bytes.len()));
        }
        bytes.truncate(stated as usize);
        Ok(bytes)
    }

    /// What a URI at `at` names: data within it, or a file in the folder of this one. And, of data, its media type.
    ///
    /// # Errors
    /// A sentence.
    pub fn bytes_of(&self, uri: &str, at: &str) -> Result<(Vec<u8>, String), String> {
        use base64::Engine;
        if let Some(data) = uri.strip_prefix("data:") {
            let (kind, content) = data.split_once(',').ok_or_else(|| format!("`{at}.uri` is no data URI"))?;
            let Some(media) = kind.strip_suffix(";base64") else {
                let bytes = percent_encoding::percent_decode_str(content).collect();
                return Ok((bytes, kind.to_owned()));
            };
            // Writers differ in whether they pad.
            let engine = base64::engine::general_purpose::GeneralPurpose::new(
                &base64::alphabet::STANDARD,
                base64::engine::general_purpose::GeneralPurposeConfig::new()
                    .with_decode_padding_mode(base64::engine::DecodePaddingMode::Indifferent),
            );
            let bytes = engine.decode(content).map_err(|e| format!("`{at}.uri` is no base64: {e}"))?;
            return Ok((bytes, media.to_owned()));
        }
        let path = self.file_of(uri, at)?;
        let bytes = std::fs::read(&path)
            .map_err(|e| format!("`{at}.uri` names {}, which cannot be read: {e}", files::shown(&path)))?;
        Ok((bytes, String::new()))
    }

    /// The file that a URI names, which is in the folder of this one or below.
    ///
    /// # Errors
    /// A sentence.
    pub fn file_of(&self, uri: &str, at: &str) -> Result<std::path::PathBuf, String> {
        let decoded: Cow<str> =
            percent_encoding::percent_decode_str(uri).decode_utf8().map_err(|_| format!("`{at}.uri` is not UTF-8"))?;
        let relative = Path::new(&*decoded);
        let stays = relative.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        if uri.contains("://") || !stays || decoded.contains('\0') {
            let shown: String = uri.chars().take(100).collect();
            return Err(format!(
                "`{at}.uri` is \"{}\": only files in the folder of this one are read",
                shown.escape_debug()
            ));
        }
        Ok(files::parent(&self.path).join(relative))
    }
}

#[cfg(test)]
mod tests;
