//! The journal of a tile: what its files must be, one fixed-size record for every commit.
//!
//! A record, little-endian: magic, tile, K, samples per pixel, index of the last epoch merged, suffix of the files aside, the tile's
//! error at its last two looks (not in journals that older versions began, whose magic ends in 1),
//! five 128-bit checksums (one per [`TileArray`], zero for one that the cube has not; in cubes with layers or a remainder six more, with a
//! remainder two more still), per channel Σ M2 and Σ mean² for the error estimate (with a remainder also Σ M2, Σ and Σ of all of it), and
//! the checksum of all that. Checksums are XXH3 (Y. Collet, xxHash), which finds damage and is no protection against intent.

use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::PathBuf;

use super::checksums;
use super::estimate::UNSEEN;
use super::faults::step;
use super::metadata::Header;
use super::store::{Cube, TileArray};
use crate::{Error, Result, files};

const MAGIC: [u8; 8] = *b"SPTJRNL2";
/// Of records that say nothing of looks.
const MAGIC_WITHOUT_LOOKS: [u8; 8] = *b"SPTJRNL1";
/// Up to the looks.
const HEAD_BYTES: usize = 32;
/// A journal that is this long is written anew with its last record only, so that it stays small beside its tile.
const MAX_RECORDS: u64 = 16;

/// The most that a journal takes.
pub(super) fn most_bytes(header: &Header) -> u64 {
    MAX_RECORDS * Shape::of(header).bytes() as u64
}

/// What decides how long a record is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Shape {
    channels: usize,
    has_layers: bool,
    has_remainder: bool,
    has_looks: bool,
}

impl Shape {
    /// Of what is written now.
    fn of(header: &Header) -> Shape {
        let has_layers = !header.layers().is_empty();
        Shape { channels: header.channels.len(), has_layers, has_remainder: header.has_remainder(), has_looks: true }
    }

    fn magic(self) -> [u8; 8] {
        if self.has_looks { MAGIC } else { MAGIC_WITHOUT_LOOKS }
    }

    /// Where the checksums begin.
    fn sums_at(self) -> usize {
        HEAD_BYTES + if self.has_looks { 8 } else { 0 }
    }

    /// Checksums of a record.
    fn files(self) -> usize {
        match (self.has_remainder, self.has_layers) {
            (true, _) => TileArray::MOST,
            (false, true) => TileArray::WITHOUT_REMAINDER,
            (false, false) => TileArray::WITHOUT_LAYERS,
        }
    }

    /// Numbers of each channel.
    fn sums(self) -> usize {
        if self.has_remainder { 5 } else { 2 }
    }

    fn head_bytes(self) -> usize {
        self.sums_at() + 16 * self.files()
    }

    /// Bytes of a record.
    fn bytes(self) -> usize {
        self.head_bytes() + 8 * self.sums() * self.channels + 16
    }
}

/// What a commit says about a tile.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Record {
    pub tile: u32,
    /// Samples per pixel merged.
    pub samples: u32,
    /// Index of the last epoch merged.
    pub epoch: u32,
    /// The name that the files had aside; no two commits have the same.
    pub suffix: u64,
    /// The tile's error at the last look but one and at the last ([`super::estimate::Floor::error`]); infinite before there was one.
    pub looks: [f32; 2],
    /// Of the tile's files, by [`TileArray::place`].
    pub checksums: [u128; TileArray::MOST],
    /// Per channel: Σ over pixels of Welford's M2 = Σ (epoch mean - mean)² over the epochs so far.
    pub spread: Vec<f64>,
    /// Per channel: Σ over pixels of mean².
    pub square: Vec<f64>,
    /// Of cubes with a remainder.
    pub remainder: Option<OfRemainder>,
}

/// What a remainder is of a tile, per channel, sums over its pixels.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct OfRemainder {
    /// As [`Record::spread`], of the remainder alone.
    pub spread: Vec<f64>,
    /// Σ of the remainder, and Σ of the radiance that it is a part of.
    pub sum: Vec<f64>,
    pub of_all: Vec<f64>,
}

impl OfRemainder {
    fn all(&self) -> impl Iterator<Item = &f64> {
        self.spread.iter().chain(&self.sum).chain(&self.of_all)
    }
}

impl Record {
    fn encode(&self, shape: Shape) -> Vec<u8> {
        let mut bytes = shape.magic().to_vec();
        for word in [self.tile, self.square.len() as u32, self.samples, self.epoch] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.extend(self.suffix.to_le_bytes());
        if shape.has_looks {
            bytes.extend(self.looks.iter().flat_map(|look| look.to_le_bytes()));
        }
        self.checksums[..shape.files()].iter().for_each(|sum| bytes.extend(sum.to_le_bytes()));
        let of_remainder = self.remainder.iter().flat_map(OfRemainder::all);
        bytes.extend(self.spread.iter().chain(&self.square).chain(of_remainder).flat_map(|v| v.to_le_bytes()));
        let checksum = checksums::of(&bytes);
        bytes.extend(checksum.to_le_bytes());
        bytes
    }

    /// `None` where the bytes are no record of this tile and shape, or damaged.
    fn decode(bytes: &[u8], tile: u32, shape: Shape) -> Option<Record> {
        let channels = shape.channels;
        let (content, checksum) = bytes.split_last_chunk::<16>()?;
        let (head, sums) = content.split_at_checked(shape.head_bytes())?;
        let word = |at: usize| u32::from_le_bytes(head[at..at + 4].try_into().expect("four bytes"));
        let valid = head[..8] == shape.magic()
            && word(8) == tile
            && word(12) as usize == channels
            && sums.len() == 8 * shape.sums() * channels
            && checksums::of(content).to_le_bytes() == *checksum;
        if !valid {
            return None;
        }
        let sum_at =
            |i: usize| u128::from_le_bytes(head[shape.sums_at() + 16 * i..][..16].try_into().expect("sixteen bytes"));
        let mut spread: Vec<f64> = sums.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
        let mut square = spread.split_off(channels);
        let remainder = shape.has_remainder.then(|| {
            let mut spread = square.split_off(channels);
            let mut sum = spread.split_off(channels);
            let of_all = sum.split_off(channels);
            OfRemainder { spread, sum, of_all }
        });
        Some(Record {
            tile,
            samples: word(16),
            epoch: word(20),
            suffix: u64::from_le_bytes(head[24..32].try_into().expect("eight bytes")),
            looks: if shape.has_looks { [32, 36].map(|at| f32::from_bits(word(at))) } else { UNSEEN },
            checksums: std::array::from_fn(|i| if i < shape.files() { sum_at(i) } else { 0 }),
            spread,
            square,
            remainder,
        })
    }
}

/// The journal of one tile.
pub(super) struct Journal {
    path: PathBuf,
    tile: u32,
    /// Of the records that are written now.
    shape: Shape,
}

impl Journal {
    pub fn of(cube: &Cube, tile: u32) -> Journal {
        let path = cube.journal_folder().join(tile.to_string());
        Journal { path, tile, shape: Shape::of(cube.header()) }
    }

    /// Of the records of a file that begins so: all of it is of one shape.
    fn shape_of(&self, beginning: &[u8]) -> Shape {
        Shape { has_looks: !beginning.starts_with(&MAGIC_WITHOUT_LOOKS), ..self.shape }
    }

    /// The same of an open file, at its beginning.
    fn shape_in(&self, file: &mut File) -> io::Result<Shape> {
        let mut beginning = Vec::new();
        file.take(MAGIC.len() as u64).read_to_end(&mut beginning)?;
        Ok(self.shape_of(&beginning))
    }

    fn failed(&self, error: io::Error) -> Error {
        Error::storage(&self.path, error)
    }

    /// Every whole slot of the file, `None` where it is damaged, and whether the file ends with a whole valid record.
    pub fn records(&self) -> Result<(Vec<Option<Record>>, bool)> {
        let bytes = match fs::read(&self.path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok((Vec::new(), true)),
            Err(error) => return Err(self.failed(error)),
        };
        let shape = self.shape_of(&bytes);
        let slots = bytes.chunks_exact(shape.bytes());
        let whole = slots.remainder().is_empty();
        let records: Vec<_> = slots.map(|slot| Record::decode(slot, self.tile, shape)).collect();
        let sound = whole && records.last().is_none_or(Option::is_some);
        Ok((records, sound))
    }

    /// The last valid record: the one with the most samples, since samples never decrease.
    pub fn last(&self) -> Result<Option<Record>> {
        Ok(self.tail()?.1)
    }

    /// The shape of what is there, and [`Journal::last`].
    fn tail(&self) -> Result<(Shape, Option<Record>)> {
        let mut file = match File::open(&self.path) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok((self.shape, None)),
            Err(error) => return Err(self.failed(error)),
        };
        // Usually the last slot is it; a writer that is at work, or was killed, may have left a part of another.
        let mut read = || -> io::Result<(Shape, Option<Record>)> {
            let shape = self.shape_in(&mut file)?;
            let size = shape.bytes() as u64;
            let slots = file.metadata()?.len() / size;
            let mut bytes = vec![0; size as usize];
            for slot in (0..slots).rev() {
                file.seek(SeekFrom::Start(slot * size))?;
                file.read_exact(&mut bytes)?;
                if let Some(record) = Record::decode(&bytes, self.tile, shape) {
                    return Ok((shape, Some(record)));
                }
            }
            Ok((shape, None))
        };
        read().map_err(|error| self.failed(error))
    }

    /// Appends a record after the one with the suffix `previous`, durably. Refuses where that is not the last one: then
    /// somebody else writes this tile.
    pub fn append(&self, record: &Record, previous: Option<u64>) -> Result<()> {
        let (shape, last) = self.tail()?;
        self.expect(last.as_ref(), previous)?;
        let size = self.shape.bytes() as u64;
        let existed = self.path.exists();
        let length = if existed { fs::metadata(&self.path).map_err(|e| self.failed(e))?.len() } else { 0 };
        if shape != self.shape || length >= MAX_RECORDS * size {
            let last = last.map(|last| last.encode(self.shape)).unwrap_or_default();
            return self.replace(&[last, record.encode(self.shape)].concat());
        }
        let write = || -> io::Result<()> {
            let mut file = OpenOptions::new().create(true).truncate(false).write(true).open(&self.path)?;
            step("journal opened")?;
            // A part of a record that a full disk left behind is written over.
            file.seek(SeekFrom::Start(length / size * size))?;
            let bytes = record.encode(self.shape);
            let (first, second) = bytes.split_at(bytes.len() / 2);
            let written = file.write_all(first).and_then(|()| step("journal half appended"));
            let written = written.and_then(|()| file.write_all(second)).and_then(|()| step("journal appended"));
            if let Err(error) = written.and_then(|()| file.sync_all()) {
                // What cannot be cut now is cut when the tile is resumed.
                let _ = file.set_len(length);
                return Err(error);
            }
            step("journal synced")?;
            if existed { Ok(()) } else { files::sync_folder(files::parent(&self.path)) }
        };
        write().map_err(|error| self.failed(error))
    }

    /// Refuses where the last valid record is not the one with this suffix.
    pub fn expect_tail(&self, suffix: Option<u64>) -> Result<()> {
        self.expect(self.last()?.as_ref(), suffix)
    }

    fn expect(&self, last: Option<&Record>, suffix: Option<u64>) -> Result<()> {
        if last.map(|record| record.suffix) == suffix {
            return Ok(());
        }
        let what =
            format!("tile {} was changed by another process; this one has lost its lock on it and stops", self.tile);
        Err(Error::storage(&self.path, what))
    }

    /// Makes `record` the only one, or the journal empty.
    pub fn reset(&self, record: Option<&Record>) -> Result<()> {
        self.replace(&record.map(|record| record.encode(self.shape)).unwrap_or_default())
    }

    /// Cuts what follows the last valid record.
    pub fn cut(&self, records: &[Option<Record>]) -> Result<()> {
        let kept = records.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
        let cut = || -> io::Result<()> {
            let mut file = OpenOptions::new().read(true).write(true).open(&self.path)?;
            let size = self.shape_in(&mut file)?.bytes();
            file.set_len((kept * size) as u64)?;
            step("journal cut")?;
            file.sync_all()
        };
        cut().map_err(|error| self.failed(error))
    }

    /// Waits until what the journal says is on disk.
    pub fn sync(&self) -> Result<()> {
        let sync = || {
            File::open(&self.path)?.sync_all()?;
            files::sync_folder(files::parent(&self.path))
        };
        sync().map_err(|error| self.failed(error))
    }

    fn replace(&self, bytes: &[u8]) -> Result<()> {
        let aside = files::sibling(&self.path, "part");
        let replace = || -> io::Result<()> {
            let mut file = File::create_new(&aside)?;
            file.write_all(bytes)?;
            step("journal written anew")?;
            file.sync_all()?;
            step("new journal synced")?;
            fs::rename(&aside, &self.path)?;
            step("new journal renamed")?;
            files::sync_folder(files::parent(&self.path))
        };
        replace().map_err(|error| {
            // The journal is what it was; a leftover that cannot be removed is removed when the tile is resumed.
            let _ = fs::remove_file(&aside);
            self.failed(error)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: Shape = Shape { channels: 3, has_layers: false, has_remainder: false, has_looks: true };

    fn record(samples: u32) -> Record {
        Record {
            tile: 7,
            samples,
            epoch: 8,
            suffix: u64::from(samples) << 32 | 5,
            looks: [0.25, f32::INFINITY],
            checksums: [1, 2 << 100, 3, u128::MAX, 0, 0, 0, 0, 0, 0, 0, 0, 0],
            spread: vec![0.5, -0.0, 1e300],
            square: vec![9.0, 5.0, 0.0],
            remainder: None,
        }
    }

    #[test]
    fn bytes_round_trip_and_damage_is_seen() {
        let bytes = record(192).encode(SHAPE);
        assert_eq!(bytes.len(), SHAPE.bytes());
        assert_eq!(Record::decode(&bytes, 7, SHAPE), Some(record(192)));
        assert_eq!(Record::decode(&bytes, 7, Shape { channels: 2, ..SHAPE }), None);
        assert_eq!(Record::decode(&bytes, 6, SHAPE), None);
        for i in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[i] ^= 4;
            assert_eq!(Record::decode(&damaged, 7, SHAPE), None, "byte {i}");
            assert_eq!(Record::decode(&bytes[..i], 7, SHAPE), None, "cut at {i}");
        }
    }

    /// Cubes with a remainder have more files and sums, and no others' records.
    #[test]
    fn remainders_have_records_of_their_own() {
        let shape = Shape { has_remainder: true, ..SHAPE };
        let remainder = OfRemainder { spread: vec![1.0; 3], sum: vec![2.0, 3.0, 4.0], of_all: vec![5.0, 6.0, 7.0] };
        let with =
            Record { checksums: [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13], remainder: Some(remainder), ..record(64) };
        let bytes = with.encode(shape);
        assert_eq!(bytes.len(), shape.bytes());
        assert_eq!(Record::decode(&bytes, 7, shape), Some(with));
        assert_eq!(Record::decode(&bytes, 7, SHAPE), None);
        assert_eq!(Record::decode(&record(64).encode(SHAPE), 7, shape), None);
    }

    #[test]
    fn journals_of_older_versions_are_read_and_written_anew() {
        let folder = tempfile::tempdir().expect("folder");
        let journal = Journal { path: folder.path().join("7"), tile: 7, shape: SHAPE };
        let older = Shape { has_looks: false, ..SHAPE };
        let unseen = |samples| Record { looks: [f32::INFINITY; 2], ..record(samples) };
        let bytes = [record(64).encode(older), record(128).encode(older)].concat();
        assert!(bytes.starts_with(b"SPTJRNL1") && bytes.len() == 2 * (SHAPE.bytes() - 8));
        fs::write(&journal.path, [&bytes[..], &[1; 30]].concat()).expect("written");
        let (records, sound) = journal.records().expect("read");
        assert!(!sound && records == [Some(unseen(64)), Some(unseen(128))]);
        journal.cut(&records).expect("cut");
        assert_eq!(fs::read(&journal.path).expect("read"), bytes);
        journal.append(&record(192), Some(unseen(128).suffix)).expect("appended");
        assert_eq!(journal.records().expect("read"), (vec![Some(unseen(128)), Some(record(192))], true));
    }

    #[test]
    fn journals_grow_stay_small_and_know_their_tail() {
        let folder = tempfile::tempdir().expect("folder");
        let journal = Journal { path: folder.path().join("7"), tile: 7, shape: SHAPE };
        assert_eq!(journal.last().expect("read"), None);
        let mut previous = None;
        for samples in 1..100 {
            let record = record(samples);
            let error = journal.append(&record, Some(99)).expect_err("the tail is another");
            assert!(error.to_string().contains("tile 7 was changed by another process"), "{error}");
            journal.append(&record, previous).expect("appended");
            assert_eq!(journal.last().expect("read").as_ref(), Some(&record));
            let length = fs::metadata(&journal.path).expect("there").len();
            assert!(length <= MAX_RECORDS * SHAPE.bytes() as u64, "{length}");
            previous = Some(record.suffix);
        }
        // A torn record is not seen, cut, and written over.
        let sound = fs::read(&journal.path).expect("read");
        fs::write(&journal.path, [&sound[..], &record(100).encode(SHAPE)[..50]].concat()).expect("written");
        assert_eq!(journal.last().expect("read"), Some(record(99)));
        let (records, sound_tail) = journal.records().expect("read");
        assert!(!sound_tail);
        journal.cut(&records).expect("cut");
        assert_eq!(fs::read(&journal.path).expect("read"), sound);
        assert_eq!(fs::read_dir(folder.path()).expect("list").count(), 1);
    }
}
