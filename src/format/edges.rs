//! Edges of meshes.

use std::collections::HashMap;

use glam::DVec3;

/// Edges, by their corners among `positions`, that do not run once in each direction for every time they run in the other: a surface without
/// them bounds a body, as far as every ray crosses it outward as often as inward. Corners at one point are one corner.
pub fn open(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut corners: HashMap<[u64; 3], u32> = HashMap::new();
    let mut welded = Vec::with_capacity(positions.len());
    for position in positions {
        // 0 and -0 are one place.
        let bits = position.to_array().map(|x| (x + 0.0).to_bits());
        let next = corners.len() as u32;
        welded.push(*corners.entry(bits).or_insert(next));
    }
    // Times forward less times backward, of edges from the lower corner to the higher.
    let mut balance: HashMap<[u32; 2], (i32, [u32; 2])> = HashMap::new();
    for triangle in triangles {
        for i in 0..3 {
            let edge = [triangle[i], triangle[(i + 1) % 3]];
            let [a, b] = edge.map(|corner| welded[corner as usize]);
            let (key, step) = if a < b { ([a, b], 1) } else { ([b, a], -1) };
            balance.entry(key).or_insert((0, edge)).0 += step;
        }
    }
    let mut open: Vec<[u32; 2]> = balance.into_values().filter(|(n, _)| *n != 0).map(|(_, edge)| edge).collect();
    open.sort_unstable();
    open
}
