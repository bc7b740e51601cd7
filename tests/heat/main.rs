//! Heat and gases: closed forms through the reference path tracer and through devices, and one against the other.

#[path = "../device/mod.rs"]
mod device;
#[path = "../scene_builder/mod.rs"]
mod scene_builder;
#[path = "../statistics/mod.rs"]
mod statistics;

mod by_place;
mod on_devices;
mod reference;
