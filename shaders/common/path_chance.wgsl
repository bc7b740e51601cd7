#if THINNED
        // Of a path that roulette drops, what is seen before it is scattered counts alone.
        let kept = bitcast<f32>(head.w);
        let seen_records = head.z & 0xffffu;
        let used = select(min(head.y & 0xffffu, seen_records), head.y & 0xffffu, kept > 0.0);
#else
        let used = head.y & 0xffffu;
#endif
