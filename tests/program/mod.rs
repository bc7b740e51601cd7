//! Commands of the real binary, and what is in the repository beside it.

mod bench;
mod cli;
mod converge;
mod peer;
mod scenes;
mod stress;
