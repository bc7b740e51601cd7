//! How far a render is, for whoever watches.

use std::time::Duration;

use serde_json::{Value, json};

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
    /// Where tiles have ends of their own.
    pub tiles: Option<TileEnds>,
    pub remaining: Option<Duration>,
    pub devices: Vec<DeviceStatus>,
}

/// How many tiles have ended by their own errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TileEnds {
    pub ended: u32,
    /// Those of them that had all samples that they may have, and were not exact enough.
    pub by_samples: u32,
    pub tiles: u32,
    /// The largest error at the last look, of tiles that go on; `None` before their first looks, or where there are none.
    pub worst: Option<f32>,
}

impl TileEnds {
    /// As JSON; docs/json.md lists the fields.
    pub fn facts(&self) -> Value {
        json!({ "ended": self.ended, "by_samples": self.by_samples, "tiles": self.tiles, "worst": self.worst })
    }

    /// For people.
    pub fn describe(&self) -> String {
        let TileEnds { ended, by_samples, tiles, .. } = *self;
        let worst = self.worst.map_or_else(String::new, |worst| format!(", the worst at {:.2} %", 100.0 * worst));
        let full = if by_samples > 0 { format!(" ({by_samples} by --spp)") } else { String::new() };
        format!("{ended} of {tiles} tiles ended{full}{worst}")
    }
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
