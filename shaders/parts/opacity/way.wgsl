// Where the random numbers of a way past surfaces that let rays pass come from: beside those of its bounce.

const SALT_FOLLOWED: u32 = 0x165667b1u;
const SALT_TO_LIGHT: u32 = 0x9e3779b1u;

fn begin_way(path: u32, salt: u32) {
    let from_path = draw_of(path);
    way_first = draw(Draw(from_path.key ^ salt, from_path.index), DIMENSION_BOUNCE + step.bounce * DIMENSIONS_PER_VERTEX);
    way_seed = hash(hash(from_path.key ^ salt) ^ hash(from_path.index) ^ step.bounce);
    way_surfaces = 0u;
}
