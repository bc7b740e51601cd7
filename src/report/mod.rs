//! Reports: what is measured, as CSV, JSON and one self-contained page of HTML.

pub mod bench;
pub mod converge;
pub mod convergence;
pub mod page;
pub mod throughput;

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::{Value, json};

use crate::gpu::adapter::Gpu;

use crate::files::output::Product;
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
        let mut command: Vec<String> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
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

/// The three files of a report.
const JSON: Product = file("a report of Spectile's as JSON", &["json"], is_json);
const CSV: Product = file("a report of Spectile's as CSV", &["csv"], is_csv);
const HTML: Product = file("a report of Spectile's as HTML", &["html"], is_html);

/// First lines of the tables that reports have.
const TABLES: [&str; 3] = [bench::CSV_HEADER, converge::CSV_HEADER, STRESS_CSV_HEADER];

/// That of `stress`.
pub const STRESS_CSV_HEADER: &str = "group,case,check,expected,got,error,bound,standard_error,verdict";

const fn file(
    name: &'static str,
    extensions: &'static [&'static str],
    check: fn(&Path) -> std::result::Result<(), String>,
) -> Product {
    Product { name, extensions, is_stream: false, is_folder: false, check }
}

fn read(path: &Path) -> std::result::Result<String, String> {
    std::fs::read_to_string(path).map_err(|error| format!("cannot be read as text ({error})"))
}

fn is_json(path: &Path) -> std::result::Result<(), String> {
    let found: Value = serde_json::from_str(&read(path)?).map_err(|_| "is not JSON")?;
    let by_spectile = found["measured"]["spectile"].is_string();
    if by_spectile { Ok(()) } else { Err("does not say by which version it was measured".into()) }
}

fn is_csv(path: &Path) -> std::result::Result<(), String> {
    let text = read(path)?;
    let first = text.lines().next().unwrap_or_default();
    if TABLES.contains(&first) { Ok(()) } else { Err("does not begin with the columns of one".into()) }
}

fn is_html(path: &Path) -> std::result::Result<(), String> {
    let text = read(path)?;
    let is_page = text.starts_with(page::BEGINS) && text.contains("by Spectile ");
    if is_page { Ok(()) } else { Err("was not written by a report".into()) }
}

/// Makes the folder of the report `name` where there is none, and refuses early what could not be replaced there.
pub fn make_folder(folder: &Path, name: &str) -> Result<()> {
    if folder.as_os_str() == "-" || (folder.exists() && !folder.is_dir()) {
        return Err(Error::Usage(format!("{}: is no folder, and a report needs one", folder.display())));
    }
    files::make_folder_durably(folder).map_err(|error| Error::storage(folder, format!("cannot be made: {error}")))?;
    products(folder, name).into_iter().try_for_each(|(product, path)| product.check_target(&path))
}

fn products(folder: &Path, name: &str) -> [(Product, PathBuf); 3] {
    [CSV, JSON, HTML].map(|product| (product, folder.join(format!("{name}.{}", product.extensions[0]))))
}

/// Writes `name.csv`, `.json` and `.html`, each in one step.
pub fn write(folder: &Path, name: &str, csv: &str, json: &Value, html: &str) -> Result<()> {
    let json = serde_json::to_string_pretty(json).map_err(|error| Error::Internal(format!("report: {error}")))?;
    for ((product, path), text) in products(folder, name).into_iter().zip([csv, &json, html]) {
        product.write(&path, text.as_bytes())?;
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
