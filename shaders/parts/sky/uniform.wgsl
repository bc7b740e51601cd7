// A uniform environment is met by sampling the BSDF, which is as good as aiming at it.

fn arrive_from_uniform_sky(list: ptr<function, RecordList>, scale: f32) {
    let begin = (*list).count;
    append(list, OP_ONE | MODE_SINGLE, 0u, scale, 0.0);
    gather(list, begin, frame.environment_spectrum);
}
