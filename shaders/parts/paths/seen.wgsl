// Roulette on evaluation: how many records of a path hold what it sees before it is scattered.

@group(1) @binding(15) var<storage, read_write> chances: array<vec2<u32>>;

fn note_seen(list: ptr<function, RecordList>) {
    if (step.bounce == 0u) {
        chances[(*list).path].x = (*list).used;
    }
}
