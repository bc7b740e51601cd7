//! Nodes and primitives spread over several bindings, since a device binds only so many bytes at a time.

use crate::device::accel::Accel;
use crate::{Error, Result};

pub const NODE_BYTES: u64 = 80;
pub const PRIMITIVE_BYTES: u64 = 48;
/// Bindings that scene.wgsl keeps for the windows of nodes and of primitives.
const MAX_WINDOWS: u64 = 4;

/// How nodes and primitives are spread over bindings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Windows {
    pub nodes: WindowList,
    pub primitives: WindowList,
}

/// `count` windows of `size` elements each (the last may be shorter).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WindowList {
    pub count: u32,
    pub size: u32,
}

impl WindowList {
    const ONE: WindowList = WindowList { count: 1, size: u32::MAX };

    /// Element ranges of the windows of `elements` elements.
    pub fn ranges(self, elements: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
        let size = self.size as usize;
        (0..self.count as usize).map(move |i| (i * size).min(elements)..(i * size).saturating_add(size).min(elements))
    }
}

impl Windows {
    /// Each in one binding.
    pub const WHOLE: Windows = Windows { nodes: WindowList::ONE, primitives: WindowList::ONE };

    /// For bindings of at most `binding` bytes. Errors: more windows than bindings.
    pub fn of(accel: &Accel, binding: u64) -> Result<Windows> {
        let split = |what: &str, count: usize, bytes: u64| {
            let size = (binding / bytes).min(u64::from(u32::MAX));
            let windows = (count as u64).div_ceil(size).max(1);
            if windows > MAX_WINDOWS {
                return Err(Error::Usage(format!(
                    "the scene has {count} {what}, and this device binds at most {}; use fewer triangles or a larger device",
                    MAX_WINDOWS * size
                )));
            }
            Ok(WindowList { count: windows as u32, size: size as u32 })
        };
        Ok(Windows {
            nodes: split("BVH nodes", accel.nodes.len(), NODE_BYTES)?,
            primitives: split("triangles and shapes", accel.primitives.len(), PRIMITIVE_BYTES)?,
        })
    }

    pub fn are_many(self) -> bool {
        self.nodes.count > 1 || self.primitives.count > 1
    }
}
