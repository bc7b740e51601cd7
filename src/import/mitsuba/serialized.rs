//! Mitsuba's .serialized meshes, versions 3 and 4.

use std::io::Read;

use glam::{DVec2, DVec3};

use crate::import::geometry::Mesh;

/// What a mesh may be larger than its compressed bytes.
const MOST_INFLATED: u64 = 1032;

/// Mesh `index` of a file of this content.
///
/// # Errors
/// A sentence.
pub fn parse(bytes: &[u8], index: usize) -> Result<Mesh, String> {
    let half = |at: usize| bytes.get(at..at + 2).map(|b| u16::from_le_bytes([b[0], b[1]]));
    if half(0) != Some(0x041c) {
        return Err("is no .serialized mesh".to_owned());
    }
    let version = half(2).unwrap_or(0);
    if version != 3 && version != 4 {
        return Err(format!("is a .serialized mesh of version {version}: 3 and 4 are read"));
    }
    let tail = bytes.len().checked_sub(4).ok_or("is cut off")?;
    let count = bytes[tail..].first_chunk::<4>().map_or(0, |b| u32::from_le_bytes(*b)) as usize;
    let width = if version == 4 { 8 } else { 4 };
    let table =
        count.checked_mul(width).and_then(|size| tail.checked_sub(size)).ok_or("is cut off: its table is not there")?;
    if index >= count {
        return Err(format!("has {count} meshes, and none of index {index}"));
    }
    let entry = |i: usize| -> usize {
        let mut eight = [0; 8];
        eight[..width].copy_from_slice(&bytes[table + i * width..table + (i + 1) * width]);
        usize::try_from(u64::from_le_bytes(eight)).unwrap_or(usize::MAX)
    };
    let end = if index + 1 < count { entry(index + 1) } else { table };
    let packed = bytes.get(entry(index)..end).and_then(|data| data.get(4..)).ok_or("has a mesh outside of the file")?;
    let limit = MOST_INFLATED * packed.len() as u64 + 1024;
    let mut data = Vec::new();
    let read = flate2::read::ZlibDecoder::new(packed).take(limit).read_to_end(&mut data);
    read.map_err(|e| format!("cannot be unpacked: {e}"))?;
    unpacked(&data, version).ok_or_else(|| "has a mesh that is cut off or has impossible indices".to_owned())
}

fn unpacked(data: &[u8], version: u16) -> Option<Mesh> {
    let mut at = 0usize;
    let mut take = |count: usize| -> Option<&[u8]> {
        let piece = data.get(at..at.checked_add(count)?)?;
        at += count;
        Some(piece)
    };
    let flags = u32::from_le_bytes(*take(4)?.first_chunk()?);
    if version == 4 {
        while take(1)? != [0] {}
    }
    let mut size = || usize::try_from(u64::from_le_bytes(*take(8)?.first_chunk()?)).ok();
    let (vertices, triangles) = (size()?, size()?);
    let is_double = flags & 0x2000 != 0;
    let width = if is_double { 8 } else { 4 };
    let mut numbers = |count: usize| -> Option<Vec<f64>> {
        let piece = take(count.checked_mul(vertices)?.checked_mul(width)?)?;
        Some(match is_double {
            true => piece.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect(),
            false => piece.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b).into()).collect(),
        })
    };
    let vectors =
        |numbers: Vec<f64>| numbers.as_chunks::<3>().0.iter().map(|v| DVec3::from_array(*v)).collect::<Vec<_>>();
    let mut mesh = Mesh { positions: vectors(numbers(3)?), ..Mesh::default() };
    if flags & 0x1 != 0 {
        mesh.normals = Some(vectors(numbers(3)?));
    }
    if flags & 0x2 != 0 {
        mesh.uv = Some(numbers(2)?.as_chunks::<2>().0.iter().map(|v| DVec2::from_array(*v)).collect());
    }
    if flags & 0x8 != 0 {
        numbers(3)?;
    }
    let wide = if vertices > u32::MAX as usize { 8 } else { 4 };
    let indices = take(triangles.checked_mul(3 * wide)?)?;
    let indices: Vec<u32> = indices.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b)).collect();
    if wide == 8 || indices.iter().any(|i| *i as usize >= vertices) {
        return None;
    }
    mesh.triangles = indices.as_chunks::<3>().0.to_vec();
    mesh.positions.iter().all(|p| p.is_finite()).then_some(mesh)
}
