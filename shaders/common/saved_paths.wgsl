// The paths of a wave as `generate` saved them, for whoever evaluates them.

@group(1) @binding(0) var<uniform> wave: Wave;
// Wavelength coordinate; records in the low half, and in the high one the wave, once the path has ended. With roulette on evaluation
// also: records of what is seen before scattering, in the low half, and in the high one the wave, once it is decided; what the rest
// counts for, 0 where it does not.
#if THINS
@group(1) @binding(3) var<storage, read_write> heads: array<vec4<u32>>;
#else
@group(1) @binding(3) var<storage, read> heads: array<vec$HEAD_WORDS<u32>>;
#endif
#if GENERAL
@group(1) @binding(4) var<storage, read> records: array<vec4<u32>>;
#else
@group(1) @binding(4) var<storage, read> records: array<vec2<u32>>;
#endif
