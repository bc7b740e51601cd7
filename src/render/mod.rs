//! The render: plan → units → waves on a device → host merge.

pub mod lights;
pub mod plan;
pub mod pool;
pub mod prepare;
pub mod queue;
pub mod rng;
pub mod schedule;
pub mod wave;
pub mod worker;
