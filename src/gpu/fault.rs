//! Faults on demand, for tests: software devices are never lost, full or hung by themselves.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

use crate::gpu::adapter::{Gpu, Trouble};

/// Moments in the life of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// The buffers are made.
    Start,
    FirstWave,
    /// Any wave of the same units that follows.
    LaterWave,
    /// The means are on their way to the host.
    Transfer,
    /// They have arrived, and are not yet looked at.
    Mapping,
    Merge,
    /// Before the next units are asked for.
    Between,
}

/// What goes wrong.
#[derive(Clone)]
pub enum Kind {
    /// As a driver reports it.
    Lost,
    /// By wgpu's own `destroy`.
    Destroyed,
    OutOfMemory,
    /// Nothing that is waited for is ever done.
    Hang,
    /// The thread does not come back from the driver until it is released.
    Stuck,
    /// The kernels of one wave write nothing.
    SilentGenerate,
    SilentEvaluate,
    /// A call that wgpu rejects, with nobody waiting for the error.
    Invalid,
    /// A bug of ours.
    Panic,
    /// Nothing: waits until another device has had its fault.
    After(Arc<Faults>),
}

/// One fault, when `phase` is reached for the time after `skip` times.
pub struct Fault {
    pub phase: Phase,
    pub skip: u32,
    pub kind: Kind,
}

/// The faults of one device.
#[derive(Default)]
pub struct Faults {
    planned: Mutex<VecDeque<Fault>>,
    fired: AtomicU32,
    hanging: AtomicBool,
    silent: Mutex<Option<Kind>>,
    released: (Mutex<bool>, Condvar),
    /// Late results that nobody took.
    pub discarded: AtomicU32,
}

thread_local! {
    static NEXT: RefCell<VecDeque<Arc<Faults>>> = const { RefCell::new(VecDeque::new()) };
}

/// Plans the faults of the next device that this thread opens (after those planned before).
pub fn plan(faults: impl IntoIterator<Item = Fault>) -> Arc<Faults> {
    let faults = Arc::new(Faults { planned: Mutex::new(faults.into_iter().collect()), ..Faults::default() });
    NEXT.with_borrow_mut(|next| next.push_back(Arc::clone(&faults)));
    faults
}

/// The faults of a device that is being opened.
pub fn planned() -> Arc<Faults> {
    NEXT.with_borrow_mut(VecDeque::pop_front).unwrap_or_default()
}

impl Faults {
    /// How many faults have happened.
    pub fn fired(&self) -> u32 {
        self.fired.load(Ordering::SeqCst)
    }

    /// Lets a stuck thread go on.
    pub fn release(&self) {
        *self.released.0.lock().expect("no panic") = true;
        self.released.1.notify_all();
    }

    /// A phase is reached: what is planned for it happens.
    pub fn reach(&self, phase: Phase, gpu: &Gpu) {
        let fault = {
            let mut planned = self.planned.lock().expect("no panic");
            match planned.front_mut() {
                Some(fault) if fault.phase == phase && fault.skip == 0 => planned.pop_front(),
                Some(fault) if fault.phase == phase => {
                    fault.skip -= 1;
                    None
                }
                _ => None,
            }
        };
        let Some(fault) = fault else { return };
        self.fired.fetch_add(1, Ordering::SeqCst);
        match fault.kind {
            Kind::Lost => gpu.note(Trouble::Lost("lost by a test".into())),
            Kind::Destroyed => gpu.device.destroy(),
            Kind::OutOfMemory => gpu.note(Trouble::Memory),
            Kind::Hang => self.hanging.store(true, Ordering::SeqCst),
            Kind::SilentGenerate | Kind::SilentEvaluate => *self.silent.lock().expect("no panic") = Some(fault.kind),
            Kind::Invalid => {
                let (size, usage) = (gpu.limits.max_buffer_size + 16, wgpu::BufferUsages::STORAGE);
                let descriptor = wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
                drop(gpu.device.create_buffer(&descriptor));
            }
            Kind::Panic => panic!("by a test"),
            Kind::Stuck => {
                let _passed = gpu.deadline.let_pass();
                let released = self.released.0.lock().expect("no panic");
                drop(self.released.1.wait_while(released, |released| !*released).expect("no panic"));
            }
            Kind::After(other) => {
                while other.fired() == 0 {
                    std::thread::sleep(Duration::from_millis(1));
                }
            }
        }
    }

    /// Whether the device does not answer.
    pub fn hangs(&self) -> bool {
        self.hanging.load(Ordering::SeqCst)
    }

    /// Which kernels of the next wave write nothing, if that is what goes wrong.
    pub fn silence(&self) -> Option<Kind> {
        self.silent.lock().expect("no panic").take()
    }
}
