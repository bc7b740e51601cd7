// The paths of a wave as `generate` saved them, for whoever evaluates them.

@group(1) @binding(0) var<uniform> wave: Wave;
// Wavelength coordinate; records in the low half, and in the high one the wave, once the path has ended.
@group(1) @binding(3) var<storage, read> heads: array<vec2<u32>>;
#if GENERAL
@group(1) @binding(4) var<storage, read> records: array<vec4<u32>>;
#else
@group(1) @binding(4) var<storage, read> records: array<vec2<u32>>;
#endif
