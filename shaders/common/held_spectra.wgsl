#if REGISTERS
#repeat VECTORS v
#repeat HELD i
#if STRATA
        let held_at_$i_$v = table_index(s.stratum, $(1+i)u, quad_$v);
        let held_$i_$v = spectra[held_at_$i_$v] + s.place * spectra[held_at_$i_$v + 1u];
#else
#if KINKS
        var held_$i_$v = held_value_$i_$v + s.place * held_slope_$i_$v;
#repeat KINKS j
        held_$i_$v += held_bend_$j_$i_$v * max(s.place - held_kink_$j_$i_$v, vec4<f32>(0.0));
#end
        held_$i_$v = max(held_$i_$v, vec4<f32>(0.0));
#else
        let held_$i_$v = held_value_$i_$v + s.place * held_slope_$i_$v;
#endif
#endif
#end
#end
#endif
