// Numbers over cosines and indices that general scenes look up; `render::surfaces` lays them out.

@group(0) @binding(14) var<storage, read> tables: array<f32>;
