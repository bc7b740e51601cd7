//! Texts of kernels, composed per scene from the modules it needs.
//!
//! A kernel is the ordered concatenation of plain WGSL files. Line directives leave out what a scene does not need,
//! so that its text is the same as if the feature did not exist:
//! `#if NAME`, `#else`, `#endif` (NAME defined and not 0) and `#repeat NAME i` … `#end` (as many times as NAME says, with
//! `$i`, `$(4+i)` and `$(NAME+i)` counting; loops nest). `$NAME` stands for a value; constants are declared on top. `#include PATH` stands for
//! the text of a file that several kernels have inside of a function, `#lines NAME` for lines that the scene or its parts add there,
//! `#constants NAME …` for declarations of what the host shares ([`words`], [`instructions`]).

use std::collections::BTreeMap;

use crate::device::{instructions, words};
use crate::gpu::source::Source;

/// A WGSL file compiled into the binary.
#[derive(Debug, Clone, Copy)]
pub struct Module {
    pub name: &'static str,
    pub text: &'static str,
}

impl Module {
    /// The file's name: of a kernel also that of its entry point.
    fn stem(&self) -> &'static str {
        let file = self.name.rsplit('/').next().unwrap_or(self.name);
        file.strip_suffix(".wgsl").unwrap_or(file)
    }

    fn lines(&self) -> Vec<(usize, &'static str)> {
        self.text.lines().enumerate().map(|(i, line)| (i + 1, line)).collect()
    }
}

/// The module that a file in `shaders/` is.
macro_rules! module {
    ($path:literal) => {
        $crate::device::text::Module {
            name: $path,
            text: include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/shaders/", $path)),
        }
    };
}
pub(crate) use module;

/// Files that kernels include.
const INCLUDED: [Module; 6] = [
    module!("common/each_wavelength.wgsl"),
    module!("common/held_spectra.wgsl"),
    module!("common/hold_spectra.wgsl"),
    module!("common/mean_over_wavelengths.wgsl"),
    module!("common/path_chance.wgsl"),
    module!("common/records.wgsl"),
];

/// Names with values: switches for `#if`, counts for `#repeat`, texts for `$NAME`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Defines {
    values: BTreeMap<&'static str, u32>,
    constants: Vec<(&'static str, u32)>,
    lines: BTreeMap<&'static str, Vec<String>>,
}

impl Defines {
    /// Sets a switch or count.
    pub fn set(&mut self, name: &'static str, value: impl Into<u32>) -> &mut Self {
        self.values.insert(name, value.into());
        self
    }

    /// Declares `const NAME: u32` on top of the shader, and sets NAME.
    pub fn constant(&mut self, name: &'static str, value: u32) -> &mut Self {
        self.constants.push((name, value));
        self.set(name, value)
    }

    /// Adds to the text that stands for `#lines NAME`.
    pub fn lines(&mut self, name: &'static str, lines: impl IntoIterator<Item = String>) -> &mut Self {
        self.lines.entry(name).or_default().extend(lines);
        self
    }

    fn get(&self, name: &str) -> u32 {
        self.values.get(name).copied().unwrap_or(0)
    }
}

/// Concatenates `modules` as `defines` say; the last one is the kernel itself and names it.
pub fn compose(modules: &[Module], defines: &Defines) -> Source {
    let mut source = Source::new(modules.last().expect("a kernel has modules").stem());
    for (name, value) in &defines.constants {
        source.push(&format!("const {name}: u32 = {value}u;"), ("constants", 0));
    }
    for module in modules {
        emit(&module.lines(), module, defines, &[], &mut source);
    }
    source
}

/// The end of the block that `lines[start]` opens, and the position of its `#else`.
fn block(lines: &[(usize, &str)], start: usize, module: &Module) -> (usize, Option<usize>) {
    let (mut depth, mut otherwise) = (0, None);
    for (at, (_, line)) in lines.iter().enumerate().skip(start) {
        let line = line.trim();
        if line.starts_with("#if ") || line.starts_with("#repeat ") {
            depth += 1;
        } else if line == "#else" && depth == 1 {
            otherwise = Some(at);
        } else if line == "#endif" || line == "#end" {
            depth -= 1;
            if depth == 0 {
                return (at, otherwise);
            }
        }
    }
    panic!("shaders/{}:{}: this directive is never closed", module.name, lines[start].0);
}

/// Values of the counters of the `#repeat`s around a line.
type Counts = [(char, u32)];

fn emit(lines: &[(usize, &str)], module: &Module, defines: &Defines, counts: &Counts, out: &mut Source) {
    let mut at = 0;
    while at < lines.len() {
        let (number, line) = lines[at];
        let directive = line.trim();
        if let Some(name) = directive.strip_prefix("#if ") {
            let (end, otherwise) = block(lines, at, module);
            let chosen = match (defines.get(name.trim()) != 0, otherwise) {
                (true, _) => at + 1..otherwise.unwrap_or(end),
                (false, Some(otherwise)) => otherwise + 1..end,
                (false, None) => end..end,
            };
            emit(&lines[chosen], module, defines, counts, out);
            at = end + 1;
        } else if let Some(header) = directive.strip_prefix("#repeat ") {
            let (end, _) = block(lines, at, module);
            let (name, counter) = header.split_once(' ').expect("#repeat NAME counter");
            let counter = counter.chars().next().expect("a counter of one letter");
            for i in 0..defines.get(name) {
                emit(&lines[at + 1..end], module, defines, &[counts, &[(counter, i)]].concat(), out);
            }
            at = end + 1;
        } else if let Some(name) = directive.strip_prefix("#lines ") {
            for line in defines.lines.get(name).into_iter().flatten() {
                out.push(line, (module.name, number));
            }
            at += 1;
        } else if let Some(names) = directive.strip_prefix("#constants ") {
            for name in names.split_whitespace() {
                let declared = words::declarations(name).or_else(|| instructions::declarations(name));
                let declared =
                    declared.unwrap_or_else(|| panic!("shaders/{}:{number}: no constants {name}", module.name));
                declared.iter().for_each(|line| out.push(line, (module.name, number)));
            }
            at += 1;
        } else if let Some(path) = directive.strip_prefix("#include ") {
            let included = INCLUDED.iter().find(|module| module.name == path);
            let included = included.unwrap_or_else(|| panic!("shaders/{}:{number}: no file {path}", module.name));
            emit(&included.lines(), included, defines, counts, out);
            at += 1;
        } else {
            out.push(&substitute(line, defines, counts), (module.name, number));
            at += 1;
        }
    }
}

/// Replaces `$i`, `$(4+i)`, `$(NAME+i)` and `$NAME`.
fn substitute(line: &str, defines: &Defines, counts: &Counts) -> String {
    let count = |counter: char| counts.iter().find(|c| c.0 == counter).map(|c| c.1);
    let mut result = String::with_capacity(line.len());
    let mut rest = line;
    while let Some(at) = rest.find('$') {
        result.push_str(&rest[..at]);
        rest = &rest[at + 1..];
        let sum = rest.strip_prefix('(').and_then(|r| r.split_once(')')).and_then(|(sum, after)| {
            let (offset, counter) = sum.split_once('+')?;
            let offset = offset.parse().ok().or_else(|| defines.values.get(offset).copied())?;
            Some((offset + count(counter.chars().next()?)?, after))
        });
        let first = rest.chars().next().unwrap_or(' ');
        if let Some((value, after)) = sum {
            result.push_str(&value.to_string());
            rest = after;
        } else if let Some(value) = count(first) {
            result.push_str(&value.to_string());
            rest = &rest[first.len_utf8()..];
        } else {
            let end = rest.find(|c: char| !c.is_ascii_uppercase() && c != '_').unwrap_or(rest.len());
            result.push_str(&defines.get(&rest[..end]).to_string());
            rest = &rest[end..];
        }
    }
    result + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directives_choose_repeat_and_count() {
        let text =
            "a\n#if X\nb\n#repeat N i\nc$i $(4+i)\n#if Y\nd\n#else\ne\n#endif\n#end\n#else\nf\n#endif\n$WORKGROUP";
        let module = Module { name: "m", text };
        let compose_with = |x: u32, n: u32| {
            let mut defines = Defines::default();
            defines.set("X", x).set("N", n).set("WORKGROUP", 64u32);
            compose(&[module], &defines)
        };
        assert_eq!(compose_with(1, 2).text, "a\nb\nc0 4\ne\nc1 5\ne\n64\n");
        assert_eq!(compose_with(0, 2).text, "a\nf\n64\n");
        assert_eq!(compose_with(1, 1).origin[2], ("m", 5));
        let nested = Module { name: "n", text: "#repeat N i\n#repeat N j\n$i$j $(2+j)\n#end\n#end" };
        let mut defines = Defines::default();
        assert_eq!(compose(&[nested], defines.set("N", 2u32)).text, "00 2\n01 3\n10 2\n11 3\n");
    }

    #[test]
    fn errors_name_the_file_and_line() {
        let module = Module { name: "m", text: "#if X\n#endif\nfn f() -> u32 {\n  return 1.5;\n}" };
        let error = compose(&[module], &Defines::default()).parse().unwrap_err().to_string();
        assert!(error.contains("shaders/m:"), "{error}");
    }
}
