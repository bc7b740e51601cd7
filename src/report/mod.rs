//! Reports (DESIGN section 8): what is measured, as CSV, JSON and one self-contained page of HTML.

pub mod bench;
pub mod converge;
pub mod convergence;
pub mod everything;
pub mod page;
pub mod throughput;

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::{Value, json};

use crate::gpu::adapter::Gpu;

use crate::{Error, Result, files};

/// On what, when and how something was measured.
#[derive(Debug, Clone)]
pub struct Circumstances {
    pub command: String,
    pub adapter: String,
    pub cores: usize,
    pub date: String,
}

impl Circumstances {
    pub fn now(gpu: &Gpu) -> Circumstances {
        let mut command: Vec<String> = std::env::args().collect();
        if let Some(program) = command.first_mut() {
            *program = "spectile".into();
        }
        Circumstances {
            command: shlex::try_join(command.iter().map(String::as_str)).unwrap_or_else(|_| command.join(" ")),
            adapter: gpu.name.clone(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            date: date(SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs())),
        }
    }

    pub fn facts(&self) -> Value {
        json!({
            "spectile": env!("CARGO_PKG_VERSION"), "command": self.command, "adapter": self.adapter,
            "cores": self.cores, "date": self.date,
        })
    }

    /// One sentence for captions.
    pub fn sentence(&self) -> String {
        format!(
            "Measured on {} by Spectile {} on {}, {} processor cores: `{}`",
            self.date,
            env!("CARGO_PKG_VERSION"),
            self.adapter,
            self.cores,
            self.command
        )
    }
}

/// The day of a UNIX time, UTC, year-month-day (Fliegel and Van Flandern 1968).
fn date(seconds: u64) -> String {
    let days = (seconds / 86_400) as i64 + 2_440_588;
    let l = days + 68_569;
    let n = 4 * l / 146_097;
    let l = l - (146_097 * n + 3) / 4;
    let i = 4000 * (l + 1) / 1_461_001;
    let l = l - 1461 * i / 4 + 31;
    let j = 80 * l / 2447;
    let (day, l) = (l - 2447 * j / 80, j / 11);
    format!("{:04}-{:02}-{day:02}", 100 * (n - 49) + i + l, j + 2 - 12 * l)
}

/// Makes the folder of a report where there is none.
pub fn make_folder(folder: &Path) -> Result<()> {
    files::make_folder_durably(folder).map_err(|error| Error::storage(folder, format!("cannot be made: {error}")))
}

/// Writes `name.csv`, `.json` and `.html`, each in one step.
pub fn write(folder: &Path, name: &str, csv: &str, json: &Value, html: &str) -> Result<()> {
    let json = serde_json::to_string_pretty(json).map_err(|error| Error::Internal(format!("report: {error}")))?;
    for (extension, text) in [("csv", csv), ("json", json.as_str()), ("html", html)] {
        files::write_atomically(&folder.join(format!("{name}.{extension}")), text.as_bytes())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn days_have_dates() {
        for (seconds, day) in [(0, "1970-01-01"), (951_782_400, "2000-02-29"), (1_795_737_600 - 1, "2026-11-26")] {
            assert_eq!(super::date(seconds), day);
        }
    }
}
