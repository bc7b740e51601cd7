// The part of group 0 that passes without geometry see.

@group(0) @binding(0) var<uniform> frame: Frame;
