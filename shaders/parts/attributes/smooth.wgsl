// Shading normals: no light is reflected into a surface, or passes to where it came from.

// Whether a direction is on one side of the face and of the shading normal, by what it has along both; in matter there is no surface.
fn keeps_side(site: Site, along_face: f32, along_normal: f32) -> bool {
#if SCATTERS
    if (site.in_matter) {
        return true;
    }
#endif
    return along_face * along_normal > 0.0;
}
