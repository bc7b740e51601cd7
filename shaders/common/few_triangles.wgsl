// Every ray against every triangle, where there are few: constants of the shader, one test after the other without a load, a branch
// between rays or a stack. The hits are those of the BVH, since a test does not know how it was come to.

fn nearer(ray: ShearedRay, hit: Hit, primitive: u32, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> Hit {
    let found = intersect_triangle(ray, a, b, c);
    if (found.x > 0.0 && found.x < hit.distance) {
        return Hit(found.x, primitive, found.y, found.z);
    }
    return hit;
}

// The nearest hit closer than `limit`. Whether any will do makes no difference here.
fn traverse(ray: Ray, limit: f32, any_hit: bool, overflow: ptr<function, bool>) -> Hit {
    var hit = Hit(limit, NONE, 0.0, 0.0);
    if (!(limit > 0.0)) {
        return hit;
    }
    let ray_sheared = sheared(ray);
#lines TRIANGLES
    return hit;
}
