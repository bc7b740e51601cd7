#if REGISTERS
#if STRATA
#else
    // One stratum: every spectrum of these channels stays in registers.
#repeat VECTORS v
#repeat HELD i
    let held_value_$i_$v = spectra[table_index(0u, $(1+i)u, quad_$v)];
    let held_slope_$i_$v = spectra[table_index(0u, $(1+i)u, quad_$v) + 1u];
#repeat KINKS j
    let held_kink_$j_$i_$v = spectra[table_index(0u, $(1+i)u, quad_$v) + 2u + $ju];
    let held_bend_$j_$i_$v = spectra[table_index(0u, $(1+i)u, quad_$v) + 2u + KINKS + $ju];
#end
#end
#end
#endif
#endif
