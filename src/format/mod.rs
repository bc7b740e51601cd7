//! Readers and writers of other people's formats; they know no GPU.

pub mod obj;
pub mod text;
