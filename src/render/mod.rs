//! The render: plan → units → waves on a device → host merge.

pub mod expand;
#[cfg(test)]
mod fault_tests;
mod gather;
pub mod interrupt;
pub mod job;
mod last_bounce;
pub mod layers;
pub mod pilot;
pub mod plan;
pub mod pool;
pub mod queue;
mod ready;
pub mod schedule;
pub mod self_test;
pub mod time_limit;
pub mod watch;
pub mod wave;
pub mod worker;
