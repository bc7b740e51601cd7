// Which contributions of a path are of the remainder: what src/device/separable.rs (`Mixed`) says on the host, word by word, which
// takes all others as weights.

#constants SEPARABLE

// Of each spectrum these bits.
@group(1) @binding(17) var<storage, read> separates: array<u32>;

// Which registers hold something that does not separate: T, P, F, Q, H and the T put aside.
struct Mixed {
    throughput: bool,
    product: bool,
    factor: bool,
    kept: bool,
    held: bool,
    saved: bool,
}

// Goes on by an instruction, and says whether what it adds to R, if anything, is of the remainder.
fn is_of_remainder(record: vec4<u32>, mixed: ptr<function, Mixed>) -> bool {
    let operation = record.x & 0x3fu;
    if (operation == OP_MEDIUM || operation == OP_MARCH) {
        (*mixed).throughput = true;
        return true;
    }
    if (operation == OP_AMOUNTS) {
        if ((record.x & MODE_ON_F) != 0u) {
            (*mixed).factor = (record.x & MODE_GATHER) == 0u;
        } else {
            (*mixed).throughput = true;
        }
        return true;
    }
    if (operation == OP_SAVE) {
        (*mixed).saved = (*mixed).throughput;
        return false;
    }
    if (operation == OP_RESTORE) {
        (*mixed).throughput = (*mixed).saved;
        return false;
    }
    if (operation == OP_HOLD) {
        (*mixed).held = (*mixed).factor;
        (*mixed).factor = false;
        return false;
    }
    let is_source_mixed = (separates[record.x >> 16u] & SEPARATES_AS_SOURCE) == 0u;
    var is_value_mixed = operation != OP_ONE;
    if (operation == OP_PLAIN || operation == OP_SPECTRUM) {
        is_value_mixed = (separates[record.y & 0xffffu] & SEPARATES_AS_FACTOR) == 0u;
    } else if (operation == OP_PLANCK) {
        is_value_mixed = record.y == 0u;
#if MAP_SEPARATES
    } else if (operation == OP_MAP) {
        is_value_mixed = false;
#endif
    } else if (operation == OP_HELD) {
        is_value_mixed = (*mixed).held;
    } else if (operation == OP_ABSORBED) {
        is_value_mixed = (*mixed).kept || record.w != 0u;
    }
    if ((record.x & MODE_KEEP) != 0u) {
        (*mixed).kept = (*mixed).kept || is_value_mixed;
        return false;
    }
    if (operation == OP_ABSORBED || operation == OP_INNER) {
        (*mixed).kept = false;
    }
    if (operation == OP_PLAIN) {
        (*mixed).throughput = (*mixed).throughput || is_value_mixed;
        return (*mixed).throughput || is_source_mixed;
    }
    (*mixed).product = (*mixed).product && (record.x & MODE_START) == 0u;
    if ((record.x & MODE_ON_F) != 0u) {
        (*mixed).factor = (*mixed).factor || is_value_mixed;
    } else {
        (*mixed).product = (*mixed).product || is_value_mixed;
    }
    (*mixed).factor = (*mixed).factor || ((record.x & MODE_ADD) != 0u && (*mixed).product);
    let is_remainder = (*mixed).throughput || (*mixed).factor || is_source_mixed;
    if ((record.x & MODE_GATHER) != 0u) {
        (*mixed).factor = false;
    }
    if ((record.x & MODE_ADVANCE) != 0u) {
        (*mixed).throughput = (*mixed).throughput || (*mixed).factor;
        (*mixed).factor = false;
    }
    return is_remainder;
}
