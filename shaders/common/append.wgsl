// Saving instructions of a path (common/record.wgsl).

@group(1) @binding(4) var<storage, read_write> records: array<vec4<u32>>;

// `count` records so far; evaluation may stop after the last one that adds radiance, `used`. `last`: the last instruction.
struct RecordList {
    path: u32,
    count: u32,
    used: u32,
    last: u32,
}

// The next record's place. A path that takes more than are planned writes over its own last one; the host is told how many it took.
fn next_record(list: ptr<function, RecordList>) -> u32 {
    let at = min((*list).count, frame.max_records - 1u);
    (*list).count += 1u;
    return (*list).path * frame.max_records + at;
}

fn append_raw(list: ptr<function, RecordList>, words: vec4<f32>) {
    records[next_record(list)] = bitcast<vec4<u32>>(words);
}

fn append_words(list: ptr<function, RecordList>, words: vec4<u32>) {
    (*list).last = next_record(list);
    records[(*list).last] = words;
}

fn append(list: ptr<function, RecordList>, operation: u32, ab: u32, weight: f32, parameter: f32) {
    append_words(list, vec4<u32>(operation, ab, bitcast<u32>(weight), bitcast<u32>(parameter)));
}

// Lets the instructions since record `begin` add to the radiance what they built, times a source.
fn gather(list: ptr<function, RecordList>, begin: u32, source: u32) {
    if ((*list).count > begin) {
        records[(*list).last].x |= MODE_GATHER | (source << 16u);
        (*list).used = (*list).count;
    }
}

// Lets the throughput take what was built.
fn advance(list: ptr<function, RecordList>) {
    records[(*list).last].x |= MODE_ADVANCE;
}
