// Records of general scenes: what `generate` saves and `evaluate` reads. A record is one instruction of a small program on
// registers of a channel: T, throughput; R, radiance; P, a product; F, a sum of products (a BSDF, or what is left of an emission):
//     x = operation | mode | source spectrum << 16;  y = spectrum a | spectrum b << 16;  z = weight;  w = parameter.
// The operation gives a value X; the mode says what becomes of it, in this order:
//     START:   P = weight X (without: P = P weight X)        ADD:     F += P
//     ON_F:    F *= weight X (instead of P)
//     GATHER:  R += T F S_source, F = 0                      ADVANCE: T *= F, F = 0

const MODE_START: u32 = 0x40u;
const MODE_ADD: u32 = 0x80u;
const MODE_ON_F: u32 = 0x100u;
const MODE_GATHER: u32 = 0x200u;
const MODE_ADVANCE: u32 = 0x400u;
// For operations at a boundary: seen from behind, index 1 / S_a; and multiplied by the square of before over beyond.
const MODE_BEHIND: u32 = 0x800u;
const MODE_SQUARE: u32 = 0x1000u;
const MODE_SINGLE: u32 = MODE_START | MODE_ADD;
#if KEPT
// The fifth register Q += weight X, instead of all of the above.
const MODE_KEEP: u32 = 0x8000u;
#endif

// T *= S_a, R += weight T S_source: a diffuse vertex in one record. No mode.
const OP_PLAIN: u32 = 0u;
// X = 1.
const OP_ONE: u32 = 1u;
// X = S_a.
const OP_SPECTRUM: u32 = 2u;
// X = F, the reflectance at cosine `parameter` of a boundary of index S_a; and 1 - F.
const OP_FRESNEL: u32 = 3u;
const OP_TRANSMIT: u32 = 4u;
// X = F of a metal of index S_a + i S_b; and 1 - F.
const OP_CONDUCTOR: u32 = 5u;
const OP_EMITTANCE: u32 = 6u;
// X: what a rough boundary of index S_a loses, or lets in (MODE_SQUARE): table b at cosine position `parameter`.
const OP_ETA_TABLE: u32 = 7u;
// X = 1 in channel y, 0 elsewhere.
const OP_ONLY: u32 = 8u;
#if COLOURS
// X = S(c0 t^2 + c1 t + c2), a smooth spectrum (Jakob and Hanika 2019): coefficients from texels[y] on, t the place of the
// wavelength in the visible.
const OP_SMOOTH: u32 = 20u;
#endif
#if KEPT
// X = Q / (1 - Q S_a), Q = 0: what comes out of a base of reflectance Q under a coat that reflects S_a back to it.
const OP_INNER: u32 = 21u;
#endif
// X = the environment map over its source spectrum, in cell y (column | row << 16), at the fractions w (16 bits each).
const OP_MAP: u32 = 9u;
// X = D(h) |o h| |i h| / (o h + n i h)^2 (1 - F), each channel with its own half vector h; parameter: roughness; the next
// record holds cos o, and i.
const OP_ROUGH_TRANSMIT: u32 = 48u;
#if RADIATORS
// X = Planck's law at `parameter` kelvins.
const OP_PLANCK: u32 = 25u;
// The sixth register H = F, F = 0; and X = H. No mode of its own, and MODE_ON_F.
const OP_HOLD: u32 = 26u;
const OP_HELD: u32 = 27u;
#if KEPT
// X = (1 - Q) / (1 - Q S_a parameter), Q = 0: what a base of reflectance Q keeps of what it gets, under a coat that reflects S_a
// back to it (parameter 1) or none (0).
const OP_ABSORBED: u32 = 28u;
#endif
#endif
#if MEDIA
// A stretch of `parameter` metres through a medium of absorption S_a: R += weight T (1 - exp(-S_a parameter)) S_source, then
// T *= exp(-S_a parameter). No mode.
const OP_MEDIUM: u32 = 22u;
// X = exp(-S_a parameter).
const OP_EXTINCTION: u32 = 23u;
// The same for volume y, whose voxels differ, on T and R, or with MODE_ON_F on F; from and to, in voxels, are in the next two
// records.
const OP_MARCH: u32 = 24u;
#endif

// Operations from here on have a record of numbers after them.
const FIRST_RAW_OP: u32 = 48u;
