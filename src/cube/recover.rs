//! Putting a tile in order, under its lock: what a killed process, a full disk, a power cut or bit rot left of it.
//! Every step may be the last one and is done again by the next recovery.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::checksums;
use super::faults::step;
use super::journal::{Journal, Record};
use super::merge::UnitPass;
use super::store::{Cube, TileArray};
use super::writer::{sync_folders, take_place};
use crate::{Error, Result, files};

/// Puts `tiles` in order and returns what each holds. `warn` is told what had to be given up.
pub(super) fn recover(
    cube: &Cube,
    tiles: Range<u32>,
    warn: &mut dyn FnMut(String),
) -> Result<impl Iterator<Item = Result<Option<Record>>>> {
    let mut leftovers = leftovers(cube, &tiles)?;
    Ok(tiles.map(move |tile| {
        let record = recover_tile(cube, tile, warn)?;
        for path in leftovers.remove(&tile).unwrap_or_default() {
            match fs::remove_file(&path) {
                Err(error) if error.kind() != ErrorKind::NotFound => {
                    return Err(Error::storage(&path, format!("cannot be removed: {error}")));
                }
                _ => {}
            }
        }
        Ok(record)
    }))
}

/// Files that lie aside, by tile: of commits that ended half-way, and of units that were never committed.
fn leftovers(cube: &Cube, tiles: &Range<u32>) -> Result<BTreeMap<u32, Vec<PathBuf>>> {
    let mut found: BTreeMap<u32, Vec<PathBuf>> = BTreeMap::new();
    for folder in [cube.aside_folder(), cube.journal_folder()] {
        let failed = |error| Error::storage(&folder, error);
        for entry in fs::read_dir(&folder).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            // `TILE.SUFFIX.ARRAY`, or a journal that was being written anew: `.TILE.RANDOM.part`.
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            let mut words = name.trim_start_matches('.').split('.');
            let tile = words.next().and_then(|tile| tile.parse::<u32>().ok());
            if let Some(tile) = tile.filter(|tile| tiles.contains(tile))
                && words.next().is_some()
            {
                found.entry(tile).or_default().push(path);
            }
        }
    }
    Ok(found)
}

/// The record that rules a tile: the one with the most samples whose radiance (and standard error) is there, in place or
/// aside.
fn recover_tile(cube: &Cube, tile: u32, warn: &mut dyn FnMut(String)) -> Result<Option<Record>> {
    let journal = Journal::of(cube, tile);
    let (records, sound) = journal.records()?;
    if !sound {
        journal.cut(&records)?;
    }
    let damaged = records.iter().rev().skip_while(|record| record.is_none()).any(Option::is_none);
    let valid: Vec<Record> = records.into_iter().flatten().collect();
    for (i, record) in valid.iter().enumerate().rev() {
        if !put_in_place(cube, record)? {
            continue;
        }
        if i + 1 < valid.len() {
            let newest = &valid[valid.len() - 1];
            warn(format!(
                "tile {tile} of {} is damaged: of its {} samples per pixel it goes on from {}",
                cube.path().display(),
                newest.samples,
                record.samples
            ));
        }
        if damaged || i + 1 < valid.len() {
            journal.reset(Some(record))?;
        }
        return Ok(Some(record.clone()));
    }
    let mut anything = !valid.is_empty();
    let mut folders = BTreeSet::new();
    for &part in cube.parts() {
        let path = cube.part_path(part, tile);
        match fs::remove_file(&path) {
            Ok(()) => {
                anything = true;
                folders.insert(files::parent(&path).to_owned());
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => return Err(Error::storage(&path, format!("is damaged and cannot be removed: {error}"))),
        }
    }
    if anything {
        warn(format!(
            "tile {tile} of {} is damaged: its files are not what its journal says, so it is rendered again from its \
             first sample",
            cube.path().display()
        ));
        sync_folders(&folders)?;
        journal.reset(None)?;
    }
    Ok(None)
}

/// Brings every file of `record` to its place; derived ones are made anew where they are not as they should be. False
/// where the radiance or the standard error is not there.
fn put_in_place(cube: &Cube, record: &Record) -> Result<bool> {
    let mut folders = BTreeSet::new();
    let mut missing = Vec::new();
    for &part in cube.parts() {
        let checksum = record.checksums[part.place()];
        let target = cube.part_path(part, record.tile);
        let aside = cube.aside_path(part, record.tile, record.suffix);
        if checksum_of(&target) == Some(checksum) {
            continue;
        }
        if checksum_of(&aside) == Some(checksum) {
            if folders.is_empty() {
                // Its writer may have been killed before it had synced the record.
                Journal::of(cube, record.tile).sync()?;
            }
            take_place(&aside, &target, &mut folders)?;
        } else if !part.is_derived() {
            return Ok(false);
        } else {
            missing.push(part);
        }
    }
    if !missing.is_empty() {
        rebuild(cube, record, &missing, &mut folders)?;
    }
    sync_folders(&folders)?;
    Ok(true)
}

/// The checksum of a file; `None` where there is none, or none that can be read: what a bad sector holds is lost.
pub(super) fn checksum_of(path: &Path) -> Option<u128> {
    let file = File::open(path).ok()?;
    let mut sum = checksums::Summing::new(std::io::sink());
    std::io::copy(&mut &file, &mut sum).ok()?;
    Some(sum.checksum())
}

/// Makes derived files of a tile from its radiance.
fn rebuild(cube: &Cube, record: &Record, parts: &[TileArray], folders: &mut BTreeSet<PathBuf>) -> Result<()> {
    let (grid, tile) = (cube.grid(), record.tile);
    let chunk =
        cube.chunk(tile)?.ok_or_else(|| Error::storage(&cube.part_path(cube.main_part(), tile), "has vanished"))?;
    let mut pass = UnitPass::new(grid, grid.rect(tile), cube.channels().len(), cube.projection());
    pass.run(None, chunk.values(), chunk.layout(), 1.0, &mut std::io::sink())
        .map_err(|error| Error::storage(cube.path(), error))?;
    for &part in parts {
        let samples = record.samples.to_le_bytes();
        let bytes: &[u8] = match part {
            TileArray::Samples => &samples,
            TileArray::Preview => bytemuck::cast_slice(&pass.preview),
            TileArray::Overview => bytemuck::cast_slice(&pass.overview),
            _ => continue,
        };
        if checksums::of(bytes) != record.checksums[part.place()] {
            let what = format!("`{}` of tile {tile}, made anew, is not what it was", part.name());
            return Err(Error::Internal(what));
        }
        let aside = cube.aside_path(part, tile, files::random_number());
        let write = || {
            let mut file = File::create_new(&aside)?;
            file.write_all(bytes)?;
            step("derived file written")?;
            file.sync_all()
        };
        let target = cube.part_path(part, tile);
        write().map_err(|error: std::io::Error| Error::storage(&target, format!("cannot be made anew: {error}")))?;
        take_place(&aside, &target, folders)?;
    }
    Ok(())
}
