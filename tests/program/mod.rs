//! Commands of the real binary, and what is in the repository beside it.

mod architecture;
mod bench;
mod cases;
mod cli;
mod converge;
mod documents;
mod drivers;
mod peer;
pub mod scenes;
mod stress;
