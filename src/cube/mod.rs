//! The working cube: a Zarr v3 store with raw, memory-mapped chunks. Nothing else maps memory.
