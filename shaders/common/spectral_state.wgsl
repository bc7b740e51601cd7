// The state of a path and a quad of channels between two bounces of the conventional path tracer: 16 bytes a channel, as in
// Hoarau et al. 2018, section 4.2. The light of the last vertex is added to the radiance at the next one.

const STATE_QUADS: u32 = 4u;
const STATE_THROUGHPUT: u32 = 0u;
const STATE_RADIANCE: u32 = 1u;
const STATE_DIRECT: u32 = 2u;
