//! The text of a kernel, and where each of its lines came from.

use crate::{Error, Result};

/// WGSL with one entry point.
#[derive(Debug, Clone)]
pub struct Source {
    /// Names the kernel, as its entry point is called.
    pub label: &'static str,
    pub text: String,
    /// File and line of each line of the text.
    pub origin: Vec<(&'static str, usize)>,
}

impl Source {
    pub fn new(label: &'static str) -> Source {
        Source { label, text: String::new(), origin: Vec::new() }
    }

    pub fn push(&mut self, line: &str, origin: (&'static str, usize)) {
        self.text.push_str(line);
        self.text.push('\n');
        self.origin.push(origin);
    }

    /// Parses the text. Errors name the file and line that it came from.
    pub fn parse(&self) -> Result<naga::Module> {
        naga::front::wgsl::parse_str(&self.text).map_err(|e| {
            let line = e.location(&self.text).map_or(0, |l| l.line_number as usize);
            let (file, line) = self.origin.get(line.saturating_sub(1)).copied().unwrap_or((self.label, 0));
            Error::Internal(format!("shaders/{file}:{line}: {}", e.message()))
        })
    }
}
