//! One error type: what is wrong, where, and what to do about it.

use std::fmt;
use std::path::{Path, PathBuf};

/// A result whose error is Spectile's own.
pub type Result<T> = std::result::Result<T, Error>;

/// Everything that can stop Spectile; [`Error::exit_code`] is the process's exit code.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A scene, spectrum or mesh is wrong; independent mistakes are reported together.
    #[error("{}", join_problems(.0))]
    Input(Vec<Problem>),
    /// Arguments that make no sense, or a render that cannot fit.
    #[error("{0}")]
    Usage(String),
    /// A device's memory does not hold what it is given.
    #[error("{0}")]
    DeviceMemory(String),
    /// No adapter that can run the shaders.
    #[error("{0}")]
    NoDevice(String),
    /// Every device was lost while rendering; the cube can be resumed.
    #[error("{0}")]
    DevicesLost(String),
    /// The cube or another output cannot be read or written.
    #[error("{}: {what}", .path.display())]
    Storage { path: PathBuf, what: String },
    /// A comparison or check failed: the work was done and its answer is no.
    #[error("{0}")]
    Check(String),
    /// Ctrl-C (2) or SIGTERM (15) ended the work in order.
    #[error("interrupted by signal {signal}")]
    Interrupted { signal: i32 },
    /// Whoever read the standard output has gone (`spectile … | head`): nothing is wrong and nothing is said.
    #[error("the reader of the output has gone")]
    BrokenPipe,
    /// A broken promise inside Spectile: a bug worth reporting.
    #[error("internal error: {0} (this is a bug in Spectile, please report it)")]
    Internal(String),
}

impl Error {
    /// 1 a comparison or check failed, 2 bad input or usage, 3 no usable device, 4 all devices lost, 5 storage.
    pub fn exit_code(&self) -> i32 {
        match self {
            Error::BrokenPipe => 0,
            Error::Check(_) | Error::Internal(_) => 1,
            Error::Input(_) | Error::Usage(_) | Error::DeviceMemory(_) => 2,
            Error::NoDevice(_) => 3,
            Error::DevicesLost(_) => 4,
            Error::Storage { .. } => 5,
            Error::Interrupted { signal } => 128 + signal,
        }
    }

    /// Whether another device may do what one could not: this one is too small, computes wrong or is lost.
    pub fn may_be_of_one_device(&self) -> bool {
        matches!(self, Error::Usage(_) | Error::DeviceMemory(_) | Error::NoDevice(_) | Error::DevicesLost(_))
    }

    /// A storage error about `path`.
    pub fn storage(path: &Path, what: impl fmt::Display) -> Self {
        Error::Storage { path: path.to_owned(), what: what.to_string() }
    }

    /// A single input problem in `file` as a whole.
    pub fn input(file: &Path, message: impl Into<String>) -> Self {
        Error::Input(vec![Problem { file: file.to_owned(), message: message.into(), ..Problem::default() }])
    }
}

/// One mistake in an input file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Problem {
    pub file: PathBuf,
    /// 1-based line and column, where known.
    pub line: Option<usize>,
    pub column: Option<usize>,
    /// Dotted key, e.g. `materials.white.diffuse.reflectance`.
    pub key: Option<String>,
    /// What is wrong, with the allowed range.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
    /// The offending source, rendered with a marker under it; several lines.
    pub snippet: Option<String>,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
            if let Some(column) = self.column {
                write!(f, ":{column}")?;
            }
        }
        if let Some(key) = &self.key {
            write!(f, ": `{key}`")?;
        }
        write!(f, ": {}", self.message)?;
        if let Some(help) = &self.help {
            write!(f, " ({help})")?;
        }
        if let Some(snippet) = &self.snippet {
            write!(f, "\n{snippet}")?;
        }
        Ok(())
    }
}

fn join_problems(problems: &[Problem]) -> String {
    problems.iter().map(Problem::to_string).collect::<Vec<_>>().join("\n")
}
