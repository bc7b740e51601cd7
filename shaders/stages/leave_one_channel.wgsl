// Dispersion: where every channel would bend by its own index, one goes on, drawn at random, and stands for all.

fn leave_one_channel(list: ptr<function, RecordList>, path: ptr<function, Path>, choice: DirectionChoice) {
    if (choice.only_channel != NONE) {
        (*path).live = choice.only_channel;
        append(list, OP_ONLY | MODE_SINGLE | MODE_ADVANCE, choice.only_channel, f32(CHANNELS), 0.0);
    }
}
