//! The render: plan → units → waves on a device → host merge.

pub mod lights;
pub mod prepare;
pub mod rng;
pub mod wave;
pub mod worker;
