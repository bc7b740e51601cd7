// Of an instance that is to be aimed at, what of it: by random numbers beside those of the bounce.

const SALT_PLACED: u32 = 0x2545f491u;

fn emitter_chosen(path: u32, index: u32) -> Emitter {
    light_in = NONE;
    let emitter = emitters[index];
    if (index - FIRST_LUMINOUS >= LUMINOUS) {
        return emitter;
    }
    let from_path = draw_of(path);
    let u = draw(Draw(from_path.key ^ SALT_PLACED, from_path.index), DIMENSION_BOUNCE + step.bounce * DIMENSIONS_PER_VERTEX).x;
    var low = emitter.spectrum + 1u;
    var high = emitter.spectrum + emitters[emitter.spectrum].primitive;
    while (low < high) {
        let middle = (low + high) / 2u;
        if (u < emitters[middle].pick_end) {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    return emitter_placed(emitters[low], emitter.primitive, emitter.pick);
}
