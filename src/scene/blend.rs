//! What blends may be made of: other materials, blends too, but never themselves, and not too many.

use super::decode::Item;
use super::material::{Declared, Kind};

/// Materials that are no blends, in one blend and the blends in it: each is asked at every hit.
const MAX_PARTS: usize = 32;

/// The two materials of a blend.
pub struct Parts<'a> {
    /// Where they are named.
    pub items: [Item<'a>; 2],
    /// Their positions among the declared; `None` where one does not exist, which has been said.
    pub indices: Option<[usize; 2]>,
}

/// Reports every cycle of blends, and blends of too many parts, and leaves `None` in their place.
pub fn check_blends(declared: &mut [(&str, Option<Declared>)]) {
    // Counted from the leaves upward; what cannot be counted hangs on a cycle. A part that is wrong counts as one.
    let mut parts: Vec<Option<usize>> = declared.iter().map(|d| blend_of(d).is_none().then_some(1)).collect();
    loop {
        count(declared, &mut parts);
        let Some(start) = parts.iter().position(Option::is_none) else { break };
        let cycle = cycle_from(start, declared, &parts);
        if let Some(item) = blend_of(&declared[cycle[0]]).map(|b| &b.items[usize::from(next(b, &parts).0)]) {
            let names: Vec<&str> = cycle.iter().chain(&cycle[..1]).map(|&i| declared[i].0).collect();
            item.error_help(format!("a blend cannot contain itself: {}", names.join(" -> ")), "name another material");
        }
        for i in cycle {
            declared[i].1 = None;
            parts[i] = Some(1);
        }
    }
    for (i, parts) in parts.into_iter().enumerate().filter(|(_, parts)| *parts > Some(MAX_PARTS)) {
        if let Some(blend) = blend_of(&declared[i]) {
            let parts = parts.unwrap_or_default();
            let message =
                format!("blends {parts} materials, those of its blends counted, but at most {MAX_PARTS} may be");
            blend.items[1].error_help(message, "blend fewer");
        }
        declared[i].1 = None;
    }
}

fn blend_of<'d, 'a>(declared: &'d (&str, Option<Declared<'a>>)) -> Option<&'d Parts<'a>> {
    match &declared.1 {
        Some(Declared { kind: Kind::Blend { parts, .. }, .. }) => Some(parts),
        _ => None,
    }
}

/// Fills in every count that follows from others.
fn count(declared: &[(&str, Option<Declared>)], parts: &mut [Option<usize>]) {
    let mut changed = true;
    while changed {
        changed = false;
        for (i, d) in declared.iter().enumerate() {
            let Some(blend) = blend_of(d).filter(|_| parts[i].is_none()) else { continue };
            let sum = match blend.indices {
                None => Some(1),
                Some([a, b]) => parts[a].zip(parts[b]).map(|(a, b): (usize, usize)| a.saturating_add(b)),
            };
            parts[i] = sum;
            changed |= sum.is_some();
        }
    }
}

/// The first part of `blend` that could not be counted: whether it is b, and its position.
fn next(blend: &Parts, parts: &[Option<usize>]) -> (bool, usize) {
    match blend.indices {
        Some([a, _]) if parts[a].is_none() => (false, a),
        Some([_, b]) => (true, b),
        None => unreachable!("a blend with an unknown part counts as one"),
    }
}

/// A cycle that is met when uncounted parts are followed from `start`.
fn cycle_from(start: usize, declared: &[(&str, Option<Declared>)], parts: &[Option<usize>]) -> Vec<usize> {
    let mut walk = vec![start];
    loop {
        let blend = blend_of(&declared[walk[walk.len() - 1]]).expect("only blends are not counted");
        let (_, following) = next(blend, parts);
        if let Some(first) = walk.iter().position(|&i| i == following) {
            return walk.split_off(first);
        }
        walk.push(following);
    }
}
