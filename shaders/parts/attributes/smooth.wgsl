// Shading normals: no light is reflected into a surface, or passes to where it came from.

fn keeps_side(v: Vertex, face: vec3<f32>, direction: vec3<f32>) -> bool {
    return dot(to_world(v, direction), face) * direction.z > 0.0;
}
