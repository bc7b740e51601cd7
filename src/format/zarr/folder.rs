//! The folder of an array as zarrs reads it: in a path of any bytes, and with codecs of numcodecs' as they come.

use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::path::PathBuf;

use serde_json::{Value, json};
use zarrs::storage::byte_range::{ByteRange, ByteRangeIterator};
use zarrs::storage::{Bytes, MaybeBytesIterator, ReadableStorageTraits, StorageError, StoreKey};

/// A folder, of which only files are read.
#[derive(Debug)]
pub(super) struct Folder {
    pub(super) path: PathBuf,
}

/// Gives codecs that say no level one, which decoding has no use for and zarrs asks of them.
fn with_levels(value: &mut Value) {
    if let Value::Object(codec) = value {
        let name = codec.get("name").and_then(Value::as_str).unwrap_or("");
        let has_level = ["zlib", "bz2", "gzip"].contains(&name.trim_start_matches("numcodecs."));
        if has_level && codec.contains_key("name") {
            let configuration = codec.entry("configuration").or_insert_with(|| json!({}));
            if let Value::Object(configuration) = configuration {
                configuration.entry("level").or_insert(json!(1));
            }
        }
    }
    match value {
        Value::Object(entries) => entries.values_mut().for_each(with_levels),
        Value::Array(entries) => entries.iter_mut().for_each(with_levels),
        _ => {}
    }
}

impl Folder {
    /// The metadata of an array of version 3, with what zarrs asks for.
    fn metadata(&self, key: &StoreKey) -> Option<Vec<u8>> {
        if key.as_str() != "zarr.json" {
            return None;
        }
        let mut metadata: Value = serde_json::from_slice(&std::fs::read(self.path.join(key.as_str())).ok()?).ok()?;
        with_levels(metadata.get_mut("codecs")?);
        serde_json::to_vec(&metadata).ok()
    }
}

impl ReadableStorageTraits for Folder {
    fn get_partial_many<'a>(
        &'a self,
        key: &StoreKey,
        byte_ranges: ByteRangeIterator<'a>,
    ) -> Result<MaybeBytesIterator<'a>, StorageError> {
        if let Some(metadata) = self.metadata(key) {
            let cut = |range: ByteRange| {
                let size = metadata.len() as u64;
                let range = range.start(size).min(size) as usize..range.end(size).min(size) as usize;
                Ok(Bytes::copy_from_slice(&metadata[range]))
            };
            let cut: Vec<_> = byte_ranges.map(cut).collect();
            return Ok(Some(Box::new(cut.into_iter())));
        }
        let mut file = match std::fs::File::open(self.path.join(key.as_str())) {
            Ok(file) => file,
            Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => return Ok(None),
            Err(e) => return Err(e.into()),
        };
        let size = file.metadata()?.len();
        let mut cut = |range: ByteRange| -> Result<Bytes, StorageError> {
            let (start, end) = (range.start(size), range.end(size));
            if start > end || end > size {
                return Err(std::io::Error::from(ErrorKind::UnexpectedEof).into());
            }
            let mut bytes = vec![0; (end - start) as usize];
            file.seek(SeekFrom::Start(start))?;
            file.read_exact(&mut bytes)?;
            Ok(Bytes::from(bytes))
        };
        let cut: Vec<_> = byte_ranges.map(&mut cut).collect();
        Ok(Some(Box::new(cut.into_iter())))
    }

    fn size_key(&self, key: &StoreKey) -> Result<Option<u64>, StorageError> {
        match std::fs::metadata(self.path.join(key.as_str())) {
            Ok(metadata) => Ok(Some(self.metadata(key).map_or(metadata.len(), |metadata| metadata.len() as u64))),
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
            Err(e) => Err(e.into()),
        }
    }

    fn supports_get_partial(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_that_nothing_needs_are_given() {
        let mut codecs = json!([
            { "name": "bytes", "configuration": { "endian": "little" } },
            { "name": "sharding_indexed", "configuration": { "codecs": [{ "name": "numcodecs.zlib" }] } },
            { "name": "numcodecs.bz2", "configuration": {} },
            { "name": "gzip", "configuration": { "level": 9 } },
        ]);
        with_levels(&mut codecs);
        assert_eq!(codecs[1]["configuration"]["codecs"][0]["configuration"]["level"], 1);
        assert_eq!([&codecs[2], &codecs[3]].map(|codec| codec["configuration"]["level"].clone()), [json!(1), json!(9)]);
        assert_eq!(codecs[0]["configuration"], json!({ "endian": "little" }));
    }
}
