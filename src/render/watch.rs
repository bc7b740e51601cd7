//! What the thread that decides hears: reports of the devices, what users ask for; and the watch over devices that say nothing.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, never, select_biased, tick};

use crate::Error;
use crate::gpu::deadline::Deadline;
use crate::preview::Control;
use crate::render::interrupt::Interrupt;
use crate::render::pool::{Pool, Report};
use crate::threads::Running;

/// How often deadlines are looked at.
const TICK: Duration = Duration::from_millis(if cfg!(test) { 200 } else { 1000 });

/// A thread is stuck when its deadline has passed at so many looks in a row, 10 s: when the whole process was stopped for a
/// while, every deadline has passed, and the threads that are well need a moment to say so.
const LOOKS: u32 = if cfg!(test) { 2 } else { 10 };

/// The reports of all devices in the order of their arrival, until every device has left.
///
/// A thread that is stuck inside its driver cannot leave. When its deadline has passed, its units go back into the queue and
/// it counts as having left; it is never waited for, and whatever it says later about its leaving is not heard.
pub struct Reports {
    pool: Arc<Pool>,
    receiver: Receiver<(usize, Report)>,
    ticks: Receiver<Instant>,
    devices: Vec<Device>,
}

/// Where users ask for something.
pub struct Requests {
    pub end: Receiver<Infallible>,
    pub inquiries: Receiver<()>,
    pub controls: Receiver<Control>,
}

impl Requests {
    /// Those of signals and, where somebody watches, those of viewers.
    pub fn new(interrupt: &Interrupt, controls: Option<&Receiver<Control>>) -> Requests {
        Requests {
            end: interrupt.end().clone(),
            inquiries: interrupt.inquiries().clone(),
            controls: controls.cloned().unwrap_or_else(never),
        }
    }

    /// Nobody asks for anything.
    pub fn none() -> Requests {
        Requests { end: never(), inquiries: never(), controls: never() }
    }
}

/// What [`Reports::hear`] hears.
pub enum Heard {
    /// The number of a device, and its report.
    Report(usize, Report),
    /// A signal asks for the end, or how far the render is.
    End,
    Asked,
    Control(Control),
    /// Every device has left.
    AllLeft,
}

/// A device as seen from outside.
pub struct Device {
    name: String,
    deadline: Arc<Deadline>,
    /// `None` once it has left.
    thread: Option<Running<()>>,
    /// Looks in a row at which its deadline had passed.
    late: u32,
}

impl Device {
    pub fn new(name: String, deadline: Arc<Deadline>, thread: Running<()>) -> Device {
        Device { name, deadline, thread: Some(thread), late: 0 }
    }
}

impl Reports {
    pub fn new(pool: Arc<Pool>, receiver: Receiver<(usize, Report)>, devices: Vec<Device>) -> Reports {
        Reports { pool, receiver, ticks: tick(TICK), devices }
    }

    /// Waits until there is something to hear. What users ask for comes first, then reports, in the order of their arrival.
    pub fn hear(&mut self, requests: &Requests) -> Heard {
        loop {
            // What has been said comes before what is found out: a stuck device may have merged units before.
            if self.receiver.is_empty() {
                if let Some((device, left)) = self.expel_stuck() {
                    return Heard::Report(device, left);
                }
                if self.devices.iter().all(|d| d.thread.is_none()) {
                    return Heard::AllLeft;
                }
            }
            select_biased! {
                recv(requests.end) -> _ => return Heard::End,
                recv(requests.inquiries) -> _ => return Heard::Asked,
                recv(requests.controls) -> control => if let Ok(control) = control {
                    return Heard::Control(control);
                },
                recv(self.receiver) -> said => match said {
                    Ok((device, report)) => if let Some(report) = self.accept(device, report) {
                        return Heard::Report(device, report);
                    },
                    Err(_) => return Heard::AllLeft,
                },
                recv(self.ticks) -> _ => self.look_at_deadlines(),
            }
        }
    }

    fn look_at_deadlines(&mut self) {
        for device in &mut self.devices {
            device.late = if device.deadline.has_passed() { device.late + 1 } else { 0 };
        }
    }

    /// A device whose thread is stuck: from now on it has left.
    fn expel_stuck(&mut self) -> Option<(usize, Report)> {
        let device = self.devices.iter().position(|d| d.thread.is_some() && d.late >= LOOKS)?;
        self.pool.queue.expel(device);
        self.devices[device].thread = None;
        let what = format!("{}: stuck in its driver, which did not return in time", self.devices[device].name);
        Some((device, Report::Left { result: Err(Error::DevicesLost(what)) }))
    }

    /// A report, unless it is one that is not heard.
    fn accept(&mut self, device: usize, report: Report) -> Option<Report> {
        match report {
            Report::Left { .. } => {
                // Of one that has been expelled, this is no news.
                let thread = self.devices[device].thread.take()?;
                // Its work is done, and panics are part of the report.
                let _ = thread.join();
                Some(report)
            }
            // One that was expelled may have merged units before; nothing else of it counts.
            Report::Merged(_) => Some(report),
            _ => self.devices[device].thread.is_some().then_some(report),
        }
    }
}

impl Iterator for Reports {
    type Item = (usize, Report);

    fn next(&mut self) -> Option<(usize, Report)> {
        match self.hear(&Requests::none()) {
            Heard::Report(device, report) => Some((device, report)),
            _ => None,
        }
    }
}
