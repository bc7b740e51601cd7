//! The texts of the kernels, without a device, and what records mean to them.

mod cornell_kernels;
mod instructions;
mod shaders;
