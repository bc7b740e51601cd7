//! Devices that have done their work, for the next who asks for the same in this process.
//!
//! A software device compiles kernels on a thread of its own. Where a process renders many times, as Python does, each new thread may get
//! another of glibc's heaps and leave some MiB at its end, so that devices are kept there instead of closed.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::adapter::{AdapterFacts, Trouble};

/// Whether this process keeps devices; see [`keep_devices`].
static KEEPS: AtomicBool = AtomicBool::new(false);
static KEPT: Mutex<Vec<Kept>> = Mutex::new(Vec::new());

/// Which of all adapters it is: those that look alike are counted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Identity {
    name: String,
    backend: String,
    pci: Option<String>,
    position: usize,
}

impl Identity {
    pub fn of(listed: &[AdapterFacts], index: usize) -> Identity {
        let AdapterFacts { name, backend, pci, .. } = &listed[index];
        let alike = |other: &&AdapterFacts| other.name == *name && other.backend == *backend && other.pci == *pci;
        let position = listed[..index].iter().filter(alike).count();
        Identity { name: name.clone(), backend: backend.clone(), pci: pci.clone(), position }
    }
}

/// An open device.
pub(super) struct Kept {
    pub identity: Identity,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub trouble: Arc<Mutex<Option<Trouble>>>,
    pub instance: wgpu::Instance,
}

impl Kept {
    fn works(&self) -> bool {
        self.trouble.lock().is_ok_and(|trouble| trouble.is_none())
    }
}

/// From now on devices of this process are kept, until it ends.
pub fn keep_devices() {
    KEEPS.store(true, Ordering::Relaxed);
}

/// One that is kept, if there is one, which nobody else has from then on.
pub(super) fn take(identity: &Identity) -> Option<Kept> {
    let mut kept = all();
    // It may have been lost in the meantime.
    kept.retain(Kept::works);
    let at = kept.iter().position(|kept| kept.identity == *identity)?;
    Some(kept.swap_remove(at))
}

/// Keeps a device that works, in a process that keeps them.
pub(super) fn give(device: Kept) {
    if KEEPS.load(Ordering::Relaxed) && device.works() {
        // What was made for the last render is freed when the device is looked at.
        let _ = device.device.poll(wgpu::PollType::Poll);
        all().push(device);
    }
}

fn all() -> MutexGuard<'static, Vec<Kept>> {
    // Nothing is half done where it is held.
    KEPT.lock().unwrap_or_else(PoisonError::into_inner)
}
