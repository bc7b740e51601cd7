// Roulette on evaluation: how many records of a path hold what it sees before it is scattered.

fn note_seen(list: ptr<function, RecordList>) {
    if (step.bounce == 0u) {
        heads[(*list).path].z = (*list).used;
    }
}
