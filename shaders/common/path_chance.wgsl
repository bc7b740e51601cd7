#if THINNED
        // Of a path that roulette drops, what is seen before it is scattered counts alone.
        let chance = chances[path];
        let kept = bitcast<f32>(chance.y);
        let seen_records = chance.x & 0xffffu;
        let used = select(min(head.y & 0xffffu, seen_records), head.y & 0xffffu, kept > 0.0);
#else
        let used = head.y & 0xffffu;
#endif
