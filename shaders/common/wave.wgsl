// What lies between the kernels of a wave, as generating paths in general scenes sees it, and a path between two bounces.

@group(1) @binding(0) var<uniform> wave: Wave;
@group(1) @binding(1) var<storage, read> units: array<vec4<u32>>;
@group(1) @binding(2) var<storage, read_write> states: array<vec4<u32>>;
@group(1) @binding(3) var<storage, read_write> heads: array<vec$HEAD_WORDS<u32>>;
@group(1) @binding(5) var<storage, read_write> counters: array<atomic<u32>>;
@group(1) @binding(6) var<uniform> step: Step;
#if SCALED
@group(1) @binding(7) var<storage, read_write> throughputs: array<f32>;
#endif
// Paths still under way: two lists that take turns, and how long each became.
@group(1) @binding(12) var<storage, read_write> queue: array<u32>;
@group(1) @binding(13) var<storage, read_write> queue_lengths: array<atomic<u32>>;

#constants COUNTER_RECORDS

const DIMENSION_LOBE: u32 = 3u;
const DIMENSIONS_PER_VERTEX: u32 = 4u;

struct Path {
    number: u32,
    ray: Ray,
    // Density of the ray's direction, for MIS; negative where it competes with nothing: the camera's own rays, mirrors, ideal
    // refraction.
    density: f32,
    // The one channel that refraction left, or NONE.
    live: u32,
    // The volumes that it is in.
    nested: vec2<u32>,
    // What roulette has made of its weight.
    scale: f32,
}

fn load_path(number: u32, second: vec4<u32>) -> Path {
    let first = bitcast<vec4<f32>>(states[STATE_WORDS * number]);
    var path = Path(number, Ray(first.xyz, bitcast<vec3<f32>>(second.xyz)), first.w, NONE, vec2<u32>(0u), 1.0);
#if DISPERSION
    path.live = states[STATE_WORDS * number + 2u].x;
#endif
#if MEDIA
    path.nested = states[STATE_WORDS * number + 2u].yz;
#endif
#if SCALED
    path.scale = throughputs[number];
#endif
#if RATIOS
    for (var t = 0u; t < TECHNIQUES; t += 1u) {
        ratios[t] = bitcast<f32>(states[STATE_WORDS * number + RATIOS_ROW + t / 4u][t & 3u]);
    }
#endif
    return path;
}

fn save_path(path: Path, records: u32) {
    states[STATE_WORDS * path.number] = bitcast<vec4<u32>>(vec4<f32>(path.ray.origin, path.density));
    states[STATE_WORDS * path.number + 1u] = vec4<u32>(bitcast<vec3<u32>>(path.ray.direction), records);
#if THIRD_STATE
    states[STATE_WORDS * path.number + 2u] = vec4<u32>(path.live, path.nested, 0u);
#endif
#if SCALED
    throughputs[path.number] = path.scale;
#endif
#if RATIOS
    for (var t = 0u; t < TECHNIQUES; t += 1u) {
        states[STATE_WORDS * path.number + RATIOS_ROW + t / 4u][t & 3u] = bitcast<u32>(ratios[t]);
    }
#endif
}

// Where a path's random numbers come from: the key of its pixel and epoch, and its place in the sequence.
struct Draw {
    key: u32,
    index: u32,
}

fn draw_of(path: u32) -> Draw {
    let slot = wave.pixel_begin + path / wave.samples;
    let in_tile = slot % wave.tile_pixels;
    let pixel = units[slot / wave.tile_pixels].xy + vec2<u32>(in_tile % wave.tile_width, in_tile / wave.tile_width);
    let key = pixel_key(frame.seed_low, frame.seed_high, pixel.x, pixel.y, wave.epoch);
    return Draw(key, wave.sample_begin + path % wave.samples);
}

fn draw(from_path: Draw, dimension: u32) -> vec2<f32> {
    return random_pair(from_path.key, dimension, from_path.index, wave.epoch_mask);
}

// What a ray has met: by which stretch of it, and how far from its origin.
struct Meeting {
    hit: Hit,
    ray: Ray,
    distance: f32,
}

// A surface that scatters.
struct Site {
    surface: Surface,
    hit: Hit,
    material: SurfaceMaterial,
    from_front: bool,
    // The geometric normal on the side of the ray.
    face: vec3<f32>,
#if SCATTERS
    // Whether there is none, and matter scatters.
    in_matter: bool,
#endif
}

// A light that is aimed at, and the way to it.
struct Aim {
    // Away from the surface, in the vertex's own frame.
    direction: vec3<f32>,
    // With which it was chosen, by solid angle or, where it can only be aimed at, a probability; 0 where nothing arrives.
    density: f32,
    // What multiplies the spectrum.
    strength: f32,
    // Whether the direction may also be met.
    is_met: bool,
    // Spectrum id.
    source: u32,
    shadow: Ray,
    // Of the shadow ray, in units of its direction.
    limit: f32,
    // While it is aimed: to the light from the surface, and where the way ends, if it does.
    towards: vec3<f32>,
    end: vec3<f32>,
#if MAP
    from_map: bool,
    map_place: MapPlace,
#endif
#if RADIATORS
    // Radiators of the light, and the point on it.
    hot: u32,
    hot_vertex: Vertex,
#endif
}
