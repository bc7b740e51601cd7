// Spots: points that shine into a cone, whose axis and edge stand after them among the lamps (`device::parts::lights`).

#constants SPOTS

// The share of its intensity that spot `lamp` sends along `towards`, which leads to it.
fn spot_share(lamp: u32, towards: vec3<f32>) -> f32 {
    let place = lamps[lamp + 2u];
    let edge = bitcast<vec2<f32>>(lamps[lamp + 3u].xy);
    let axis = bitcast<vec3<f32>>(place.xyz);
    let d = normalize(-towards);
    let cosine = dot(d, axis);
    let off = cross(d, axis);
    let sine2 = dot(off, off);
    if (place.w == CONE_LINEAR) {
        return falling(turn_of(cosine, sqrt(sine2)), edge);
    }
    // 1 - cos, without cancellation.
    let t = falling(select(1.0 - cosine, sine2 / (1.0 + cosine), cosine > 0.0), edge);
    return t * t * (3.0 - 2.0 * t);
}

// From 1 up to edge.x to 0 from edge.y on.
fn falling(at: f32, edge: vec2<f32>) -> f32 {
    let width = edge.y - edge.x;
    let sharp = select(0.0, 1.0, at < edge.y);
    return select(sharp, clamp((edge.y - at) / max(width, 1.0e-30), 0.0, 1.0), width > 0.0);
}
