//! Heat and gases: closed forms through the reference path tracer and through devices, and one against the other.

mod by_place;
mod on_devices;
mod reference;
