//! How far a render is, for whoever watches.

use std::time::Duration;

/// How far a render is.
#[derive(Debug, Clone, PartialEq)]
pub struct Status {
    /// Samples per pixel in the whole image, and when the current epoch will be done.
    pub samples: u32,
    pub samples_next: u32,
    /// Units of the current epoch merged, of all.
    pub units: (u32, u32),
    pub paths: u64,
    pub rays: u64,
    pub elapsed: Duration,
    /// Seconds since the first device was ready.
    pub rendering_s: f64,
    /// The largest error estimate of a channel, from two full epochs on.
    pub error_estimate: Option<f64>,
    pub remaining: Option<Duration>,
    pub devices: Vec<DeviceStatus>,
}

/// What one device did.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceStatus {
    pub name: String,
    pub paths: u64,
    /// Units that it has rendered, of all epochs.
    pub units: u64,
    /// Seconds in which it had work, and had not.
    pub busy_s: f64,
    pub idle_s: f64,
}
