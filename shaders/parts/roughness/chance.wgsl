// What decides between two tables at a vertex.

const SALT_ROUGHNESS: u32 = 0x7f4a7c15u;

fn roughness_chance(path: u32) -> f32 {
    let from_path = draw_of(path);
    return draw(Draw(from_path.key ^ SALT_ROUGHNESS, from_path.index), DIMENSION_BOUNCE + step.bounce * DIMENSIONS_PER_VERTEX).x;
}
