// Every ray against every triangle, where there are few: constants of the shader, one test after the other without a load, a branch
// between rays or a stack. The hits are those of the BVH, since a test does not know how it was come to.

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
