// Saving instructions of a path (common/record.wgsl).

@group(1) @binding(4) var<storage, read_write> records: array<vec4<u32>>;

// `count` records so far; evaluation may stop after the last one that adds radiance, `used`. `last`: the last instruction.
struct RecordList {
    path: u32,
    count: u32,
    used: u32,
    last: u32,
}

fn append_raw(list: ptr<function, RecordList>, words: vec4<f32>) {
    records[(*list).path * frame.max_records + (*list).count] = bitcast<vec4<u32>>(words);
    (*list).count += 1u;
}

fn append(list: ptr<function, RecordList>, operation: u32, ab: u32, weight: f32, parameter: f32) {
    (*list).last = (*list).path * frame.max_records + (*list).count;
    records[(*list).last] = vec4<u32>(operation, ab, bitcast<u32>(weight), bitcast<u32>(parameter));
    (*list).count += 1u;
}

#if MAP
// The instruction that looks the map up: X = its value there over the source spectrum.
fn append_map(list: ptr<function, RecordList>, mode: u32, place: MapPlace, weight: f32) {
    let fraction = vec2<u32>(place.fraction * 65535.0 + 0.5);
    (*list).last = (*list).path * frame.max_records + (*list).count;
    records[(*list).last] = vec4<u32>(OP_MAP | mode, place.column | (place.row << 16u), bitcast<u32>(weight), fraction.x | (fraction.y << 16u));
    (*list).count += 1u;
}
#endif

// Lets the instructions since record `begin` add to the radiance what they built, times a source.
fn gather(list: ptr<function, RecordList>, begin: u32, source: u32) {
    if ((*list).count > begin) {
        records[(*list).last].x |= MODE_GATHER | (source << 16u);
        (*list).used = (*list).count;
    }
}
