//! Records of general scenes: what `generate` saves and `evaluate` reads. A record is one instruction of a small program on registers
//! of a channel: T, throughput; R, radiance; P, a product; F, a sum of products (a BSDF, or what is left of an emission); in some
//! scenes Q, the reflectance of a base under a coat, and H, where F is put aside.
//!
//!     word 0 = operation | mode | source spectrum << 16;  1 = spectrum a | spectrum b << 16;  2 = weight;  3 = parameter
//!
//! The operation gives a value X; the mode says what becomes of it, in this order:
//!
//!     START:   P = weight X (without: P = P weight X)        ADD:     F += P
//!     ON_F:    F *= weight X (instead of P)                  KEEP:    Q += weight X (instead of all others)
//!     GATHER:  R += T F S_source, F = 0                      ADVANCE: T *= F, F = 0
//!
//! S_a is the value of spectrum a in the channel at the path's wavelength. `shaders/common/records.wgsl` walks the records,
//! `shaders/common/program.wgsl` has the values.

/// An operation: what it reads, what its value is, and what it takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instruction {
    pub name: &'static str,
    /// The low six bits of a record's first word.
    pub code: u32,
    /// Records that it takes, those with its numbers included.
    pub records: u32,
    /// What the words of its record are, where they are something.
    pub operands: &'static str,
    /// The value X; or what it does by itself, where it has no mode.
    pub effect: &'static str,
}

macro_rules! instructions {
    ($($name:ident = $code:literal, $records:literal, $operands:literal, $effect:literal;)*) => {
        $(pub const $name: u32 = $code;)*
        /// All there are.
        pub const INSTRUCTIONS: &[Instruction] = &[$(Instruction {
            name: stringify!($name), code: $code, records: $records, operands: $operands, effect: $effect,
        }),*];
    };
}

instructions! {
    OP_PLAIN = 0, 1, "a, source, weight", "T *= S_a, R += weight T S_source: a diffuse vertex in one record; no mode";
    OP_ONE = 1, 1, "weight", "1";
    OP_SPECTRUM = 2, 1, "a, weight", "S_a";
    OP_FRESNEL = 3, 1, "a, weight, cosine", "F, the reflectance at the cosine of a boundary of index S_a (BEHIND: 1 / S_a)";
    OP_TRANSMIT = 4, 1, "a, weight, cosine", "1 - F (SQUARE: times the square of the index before over beyond)";
    OP_CONDUCTOR = 5, 1, "a, b, weight, cosine", "F of a metal of index S_a + i S_b";
    OP_EMITTANCE = 6, 1, "a, b, weight, cosine", "1 - F of that";
    OP_ETA_TABLE = 7, 1, "a, table, weight, place",
        "what a rough boundary of index S_a loses, or lets in (SQUARE): a table over index and cosine";
    OP_ONLY = 8, 1, "channel, weight", "1 in that channel, 0 elsewhere";
    OP_MAP = 9, 1, "cell, weight, fractions", "the environment map over its source spectrum, at a place in a cell";
    OP_SMOOTH = 20, 1, "texel, weight",
        "S(c0 t² + c1 t + c2), a smooth spectrum (Jakob and Hanika 2019), coefficients from that number of the texels on";
    OP_INNER = 21, 1, "a, weight",
        "Q / (1 - Q S_a), Q = 0: what comes out of a base of reflectance Q under a coat that reflects S_a back to it";
    OP_MEDIUM = 22, 1, "a, source, weight, metres",
        "a stretch through a medium of absorption S_a: R += weight T (1 - exp(-S_a metres)) S_source, T *= exp(-S_a metres); no mode";
    OP_EXTINCTION = 23, 1, "a, weight, metres", "exp(-S_a metres)";
    OP_MARCH = 24, 3, "volume, weight, metres; from; to (voxels)",
        "a stretch through voxels that emit, on T and R; no mode";
    OP_PLANCK = 25, 1, "weight, kelvin", "Planck's law";
    OP_HOLD = 26, 1, "", "H = F, F = 0; no mode";
    OP_HELD = 27, 1, "weight", "H";
    OP_ABSORBED = 28, 1, "a, weight, share",
        "(1 - Q) / (1 - Q S_a share), Q = 0: what a base of reflectance Q keeps of what it gets, under a coat (share 1) or none (0)";
    OP_AMOUNTS = 29, 1, "a, b, amounts of both",
        "T *= exp(-(S_a amount + S_b amount)), or with ON_F F; no other mode but GATHER";
    OP_SAVE = 30, 1, "", "T is put aside; no mode";
    OP_RESTORE = 31, 1, "", "T is what was put aside; no mode";
    OP_HENYEY_GREENSTEIN = 32, 1, "a, b, weight, 1 - cosine",
        "S_a (1 - g²) / ((1 - g)² + 2 g (1 - cosine))^1.5, g = S_b: what matter scatters by that angle, times 4π";
    OP_PHASE_TABLE = 33, 1, "a, table, weight, place",
        "a table's phase function at a place among its rows and, S_a, its columns";
    OP_ROUGH_TRANSMIT = 48, 2, "a, weight, roughness; cos o, i",
        "D(h) |o h| |i h| / (o h + n i h)² (1 - F), each channel with its own half vector h";
}

/// Operations from here on have a record of numbers after them.
pub const FIRST_RAW_OP: u32 = 48;

pub const MODE_START: u32 = 0x40;
pub const MODE_ADD: u32 = 0x80;
pub const MODE_ON_F: u32 = 0x100;
pub const MODE_GATHER: u32 = 0x200;
pub const MODE_ADVANCE: u32 = 0x400;
/// For operations at a boundary: seen from behind, index 1 / S_a; and multiplied by the square of before over beyond.
pub const MODE_BEHIND: u32 = 0x800;
pub const MODE_SQUARE: u32 = 0x1000;
pub const MODE_KEEP: u32 = 0x8000;
pub const MODE_SINGLE: u32 = MODE_START | MODE_ADD;

const MODES: [(&str, u32); 10] = [
    ("FIRST_RAW_OP", FIRST_RAW_OP),
    ("MODE_START", MODE_START),
    ("MODE_ADD", MODE_ADD),
    ("MODE_ON_F", MODE_ON_F),
    ("MODE_GATHER", MODE_GATHER),
    ("MODE_ADVANCE", MODE_ADVANCE),
    ("MODE_BEHIND", MODE_BEHIND),
    ("MODE_SQUARE", MODE_SQUARE),
    ("MODE_KEEP", MODE_KEEP),
    ("MODE_SINGLE", MODE_SINGLE),
];

/// Declarations in WGSL of all of them, by the name `INSTRUCTIONS`.
pub fn declarations(name: &str) -> Option<Vec<String>> {
    let all = MODES.into_iter().chain(INSTRUCTIONS.iter().map(|instruction| (instruction.name, instruction.code)));
    (name == "INSTRUCTIONS").then(|| all.map(|(name, value)| format!("const {name}: u32 = {value}u;")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No two operations, and no operation and mode, share what tells them apart; who has numbers after it says so.
    #[test]
    fn words_tell_instructions_apart() {
        for (i, a) in INSTRUCTIONS.iter().enumerate() {
            assert!(a.code < 0x40 && INSTRUCTIONS[..i].iter().all(|b| a.code != b.code), "{}", a.name);
            let raw = a.records > 1 && a.name != "OP_MARCH";
            assert_eq!(a.code >= FIRST_RAW_OP, raw, "{}", a.name);
        }
        let single = MODES.iter().filter(|(name, _)| name.starts_with("MODE_") && *name != "MODE_SINGLE");
        let all = single.fold(0x3f, |seen, (name, bit)| {
            assert!(bit.is_power_of_two() && seen & bit == 0, "{name}");
            seen | bit
        });
        assert!(all < 1 << 16, "the upper half is a spectrum");
    }
}
