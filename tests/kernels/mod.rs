//! The texts of the kernels, without a device.

mod cornell_kernels;
mod shaders;
