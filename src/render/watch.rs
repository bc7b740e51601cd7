//! What the devices report to the thread that decides, and the watch over those that have stopped to.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::Error;
use crate::gpu::deadline::Deadline;
use crate::render::pool::{Pool, Report};

/// How often deadlines are looked at while nobody reports.
const TICK: Duration = Duration::from_millis(200);

/// A thread is stuck when its deadline has passed at so many looks in a row, 10 s: when the whole process was stopped for a
/// while, every deadline has passed, and the threads that are well need a moment to say so.
const LOOKS: u32 = if cfg!(test) { 2 } else { 50 };

/// The reports of all devices in the order of their arrival, until every device has left.
///
/// A thread that is stuck inside its driver cannot leave. When its deadline has passed, its units go back into the queue and
/// it counts as having left; it is never waited for, and whatever it says later about its leaving is not heard.
pub struct Reports {
    pool: Arc<Pool>,
    receiver: Receiver<(usize, Report)>,
    devices: Vec<Device>,
    last_look: Instant,
}

/// A device as seen from outside.
pub struct Device {
    name: String,
    deadline: Arc<Deadline>,
    /// `None` once it has left.
    thread: Option<JoinHandle<()>>,
    /// Looks in a row at which its deadline had passed.
    late: u32,
}

impl Device {
    pub fn new(name: String, deadline: Arc<Deadline>, thread: JoinHandle<()>) -> Device {
        Device { name, deadline, thread: Some(thread), late: 0 }
    }
}

impl Reports {
    pub fn new(pool: Arc<Pool>, receiver: Receiver<(usize, Report)>, devices: Vec<Device>) -> Reports {
        Reports { pool, receiver, devices, last_look: Instant::now() }
    }

    /// A device whose thread is stuck: from now on it has left.
    fn expel_stuck(&mut self) -> Option<(usize, Report)> {
        if self.last_look.elapsed() >= TICK {
            self.last_look = Instant::now();
            for device in &mut self.devices {
                device.late = if device.deadline.has_passed() { device.late + 1 } else { 0 };
            }
        }
        let device = self.devices.iter().position(|d| d.thread.is_some() && d.late >= LOOKS)?;
        self.pool.queue.expel(device);
        self.devices[device].thread = None;
        let what = format!("{}: stuck in its driver, which did not return in time", self.devices[device].name);
        Some((device, Report::Left { result: Err(Error::DevicesLost(what)) }))
    }

    /// The next report, if one comes soon.
    pub fn poll(&mut self) -> Polled {
        // What has been said comes first: a stuck device may have merged units before.
        let mut said = self.receiver.try_recv().ok();
        if said.is_none() {
            if let Some((device, left)) = self.expel_stuck() {
                return Polled::Said(device, left);
            }
            if self.devices.iter().all(|d| d.thread.is_none()) {
                return Polled::End;
            }
            said = match self.receiver.recv_timeout(TICK) {
                Ok(said) => Some(said),
                Err(RecvTimeoutError::Timeout) => return Polled::Silence,
                Err(RecvTimeoutError::Disconnected) => return Polled::End,
            };
        }
        match said {
            Some((device, report @ Report::Left { .. })) => {
                // Of one that has been expelled, this is no news.
                let Some(thread) = self.devices[device].thread.take() else { return Polled::Silence };
                // Its work is done, and panics are part of the report.
                let _ = thread.join();
                Polled::Said(device, report)
            }
            // One that was expelled may have merged units before; nothing else of it counts.
            Some((device, report)) if self.devices[device].thread.is_some() || matches!(report, Report::Merged(_)) => {
                Polled::Said(device, report)
            }
            _ => Polled::Silence,
        }
    }
}

/// What [`Reports::poll`] finds.
pub enum Polled {
    /// The number of a device, and its report.
    Said(usize, Report),
    Silence,
    /// Every device has left.
    End,
}

impl Iterator for Reports {
    type Item = (usize, Report);

    fn next(&mut self) -> Option<(usize, Report)> {
        loop {
            match self.poll() {
                Polled::Said(device, report) => return Some((device, report)),
                Polled::Silence => {}
                Polled::End => return None,
            }
        }
    }
}
