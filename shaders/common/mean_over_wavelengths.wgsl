#if WAVELENGTHS
#repeat VECTORS v
    sum_$v += radiance_$v;
#end
    }
#repeat VECTORS v
    let radiance_$v = sum_$v / f32(WAVELENGTHS);
#end
#endif
