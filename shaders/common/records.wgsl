// Text, not functions: what walks the records of a path from `first_record` on, `used` of them, for VECTORS quads of channels of
// one thread, and takes throughput_$v and radiance_$v along. Each evaluator puts it into its own loops by `#include`.

#if GENERAL
#repeat VECTORS v
    var product_$v = vec4<f32>(0.0);
    var factor_$v = vec4<f32>(0.0);
#if KEPT
    var kept_$v = vec4<f32>(0.0);
#endif
#if RADIATORS
    var held_$v = vec4<f32>(0.0);
#endif
#if SCATTERS
    var saved_$v = vec4<f32>(0.0);
#endif
#end
#endif
#if THINNED
    // What is seen before scattering lies before this record; the rest roulette has a say in.
    let first_behind = first_record + seen_records;
#endif
#if REMAINDER
    // What there was before the last record, and whether what that added is no business of channels.
    var mixed = Mixed(false, false, false, false, false, true);
    var is_weighed = false;
#if MAP_LEFT
    var is_gathered = false;
#endif
#repeat VECTORS v
    var remainder_$v = vec4<f32>(0.0);
#if MAP_LEFT
    // The share of what F has from the map that weights do not bring.
    var left_$v = vec4<f32>(0.0);
#endif
#end
#endif
    for (var r = first_record; r < first_record + used; r += 1u) {
        let record = records[r];
#if REMAINDER
#repeat VECTORS v
#if MAP_LEFT
        radiance_$v = select(radiance_$v, remainder_$v + left_$v * (radiance_$v - remainder_$v), is_weighed);
        left_$v = select(left_$v, vec4<f32>(0.0), is_gathered);
#else
        radiance_$v = select(radiance_$v, remainder_$v, is_weighed);
#endif
        remainder_$v = radiance_$v;
#end
#if MAP_LEFT
        is_gathered = (record.x & MODE_GATHER) != 0u;
#endif
        is_weighed = !is_of_remainder(record, &mixed);
#endif
#if THINS
        // To be tried alone.
        if (r == first_behind) {
#repeat VECTORS v
            radiance_$v = vec4<f32>(0.0);
#end
        }
#endif
#if GENERAL
#if THINNED
#if THINS
#else
        // It counts for more: all radiance has the factor of the throughput.
        if (r == first_behind) {
#repeat VECTORS v
            throughput_$v *= kept;
#if SCATTERS
            saved_$v *= kept;
#endif
#end
        }
#endif
#endif
#if RAW_RECORDS
        var raw = vec4<f32>(0.0);
        if ((record.x & 0x3fu) >= FIRST_RAW_OP) {
            r += 1u;
            raw = bitcast<vec4<f32>>(records[r]);
        }
#else
        let raw = vec4<f32>(0.0);
#endif
        let weight = bitcast<f32>(record.z);
#if MEDIA
        if ((record.x & 0x3fu) == OP_MEDIUM) {
#repeat VECTORS v
            let depth_$v = bitcast<f32>(record.w) * spectrum_value(record.y, quad_$v, s);
            if (weight > 0.0) {
                radiance_$v += weight * throughput_$v * absorbed(depth_$v) * spectrum_value(record.x >> 16u, quad_$v, s);
            }
            throughput_$v *= exp(-depth_$v);
#end
            continue;
        }
#if GRIDS
        if ((record.x & 0x3fu) == OP_MARCH) {
            let march_from = bitcast<vec4<f32>>(records[r + 1u]).xyz;
            let march_to = bitcast<vec4<f32>>(records[r + 2u]).xyz;
            r += 2u;
#repeat VECTORS v
            march(record, march_from, march_to, quad_$v, s, weight, &throughput_$v, &radiance_$v);
#end
            continue;
        }
        if ((record.x & 0x3fu) == OP_AMOUNTS) {
            let on_factor = (record.x & MODE_ON_F) != 0u;
#repeat VECTORS v
            let first_depth_$v = weight * spectrum_value(record.y & 0xffffu, quad_$v, s);
            let through_$v = exp(-(first_depth_$v + bitcast<f32>(record.w) * spectrum_value(record.y >> 16u, quad_$v, s)));
            throughput_$v *= select(through_$v, vec4<f32>(1.0), on_factor);
            factor_$v *= select(vec4<f32>(1.0), through_$v, on_factor);
            if ((record.x & MODE_GATHER) != 0u) {
                radiance_$v += throughput_$v * factor_$v * spectrum_value(record.x >> 16u, quad_$v, s);
                factor_$v = vec4<f32>(0.0);
            }
#end
            continue;
        }
#endif
#if SCATTERS
        if ((record.x & 0x3fu) == OP_SAVE) {
#repeat VECTORS v
            saved_$v = throughput_$v;
#end
            continue;
        }
        if ((record.x & 0x3fu) == OP_RESTORE) {
#repeat VECTORS v
            throughput_$v = saved_$v;
#end
            continue;
        }
#endif
#endif
#if RADIATORS
        if ((record.x & 0x3fu) == OP_HOLD) {
#repeat VECTORS v
            held_$v = factor_$v;
            factor_$v = vec4<f32>(0.0);
#end
            continue;
        }
#endif
#repeat VECTORS v
        var value_$v = operation_value(record, raw, quad_$v, s);
#end
#if WAVELENGTHS
#if OP_ONLY
        // Behind dispersion a path goes where its own wavelength goes: the others of its channel see what is before it only.
        if ((record.x & 0x3fu) == OP_ONLY) {
#repeat VECTORS v
            value_$v *= select(0.0, f32(WAVELENGTHS), turn == 0u);
#end
        }
#endif
#endif
#if MAP_LEFT
        if ((record.x & 0x3fu) == OP_MAP) {
#repeat VECTORS v
            left_$v = map_left(record.y, record.w, spectrum_value(MAP_AXIS, quad_$v, s)) / max(value_$v, vec4<f32>(1.0e-37));
#end
        }
#endif
#if RADIATORS
        if ((record.x & 0x3fu) == OP_HELD) {
#repeat VECTORS v
            value_$v = held_$v;
#end
        }
#endif
#if KEPT
        if ((record.x & MODE_KEEP) != 0u) {
#repeat VECTORS v
            kept_$v += weight * value_$v;
#end
            continue;
        }
#if RADIATORS
        if ((record.x & 0x3fu) == OP_ABSORBED) {
#repeat VECTORS v
            value_$v = max(1.0 - kept_$v, vec4<f32>(0.0)) / (1.0 - kept_$v * bitcast<f32>(record.w) * value_$v);
            kept_$v = vec4<f32>(0.0);
#end
        }
#endif
        if ((record.x & 0x3fu) == OP_INNER) {
#repeat VECTORS v
            value_$v = kept_$v / (1.0 - kept_$v * value_$v);
            kept_$v = vec4<f32>(0.0);
#end
        }
#endif
        if ((record.x & 0x3fu) == OP_PLAIN) {
#repeat VECTORS v
            throughput_$v *= value_$v;
            radiance_$v += weight * throughput_$v * spectrum_value(record.x >> 16u, quad_$v, s);
#end
            continue;
        }
#repeat VECTORS v
        let weighted_$v = weight * value_$v;
        product_$v = select(product_$v, vec4<f32>(1.0), (record.x & MODE_START) != 0u);
        product_$v = select(product_$v * weighted_$v, product_$v, (record.x & MODE_ON_F) != 0u);
        factor_$v = select(factor_$v, factor_$v * weighted_$v, (record.x & MODE_ON_F) != 0u);
        factor_$v = select(factor_$v, factor_$v + product_$v, (record.x & MODE_ADD) != 0u);
#end
        if ((record.x & MODE_GATHER) != 0u) {
#repeat VECTORS v
            radiance_$v += throughput_$v * factor_$v * spectrum_value(record.x >> 16u, quad_$v, s);
            factor_$v = vec4<f32>(0.0);
#end
        }
        if ((record.x & MODE_ADVANCE) != 0u) {
#if OP_ONLY
            // Most channels of a path that dispersion left to one have nothing to come.
            var left = false;
#endif
#repeat VECTORS v
            throughput_$v *= factor_$v;
            factor_$v = vec4<f32>(0.0);
#if OP_ONLY
            left = left || any(throughput_$v != vec4<f32>(0.0));
#endif
#end
#if OP_ONLY
            if (!left) {
                break;
            }
#endif
        }
#else
        let factor_id = record.x & 0xffffu;
        let source_id = record.x >> 16u;
#if THINNED
#if THINS
        let weight = bitcast<f32>(record.y);
#else
        // One number for all channels: less than to scale what each brings.
        let weight = bitcast<f32>(record.y) * select(1.0, kept, r >= first_behind);
#endif
#else
        let weight = bitcast<f32>(record.y);
#endif
#repeat VECTORS v
#if REGISTERS
        var factor_$v = vec4<f32>(1.0);
        var source_$v = vec4<f32>(0.0);
#repeat FACTORS i
        factor_$v = select(factor_$v, held_$i_$v, factor_id == $(1+i)u);
#end
#repeat SOURCES i
        source_$v = select(source_$v, held_$(FACTORS+i)_$v, source_id == FIRST_SOURCE + $iu);
#end
#else
        let factor_$v = spectrum_value(factor_id, quad_$v, s);
        let source_$v = spectrum_value(source_id, quad_$v, s);
#endif
        throughput_$v *= factor_$v;
        radiance_$v += weight * throughput_$v * source_$v;
#end
#endif
    }
#if REMAINDER
#repeat VECTORS v
#if MAP_LEFT
    radiance_$v = select(radiance_$v, remainder_$v + left_$v * (radiance_$v - remainder_$v), is_weighed);
#else
    radiance_$v = select(radiance_$v, remainder_$v, is_weighed);
#endif
#end
#endif
