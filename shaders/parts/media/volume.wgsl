// Media in their places, as `device::parts::media` lays them out: metres per device unit; the volumes around the camera (two words); where a
// boundary cuts its lens or window, the word of a place there, whose volumes they are, else 0; then VOLUME_WORDS words each, then lists
// of absorbers.
//      0 bits            1 absorption        2 source, or NONE   (spectra, without grids)
//      3, 4 first voxel of temperature, density, or NONE         5, 6 their values where constant
//      7 … 9 voxels along x, y, z       10 … 21 device units to voxels, rows and offset       22 first word of its absorbers
//      23 index of refraction there (spectrum), or NONE
// Absorbers: how many; then of each strength, number of columns, and of each column temperature and spectrum.

@group(0) @binding(61) var<storage, read> volumes: array<u32>;
#constants VOLUMES

fn volume_at(number: u32) -> u32 {
    return VOLUMES_HEAD + number * VOLUME_WORDS;
}

fn volume_vector(at: u32) -> vec3<f32> {
    return vec3<f32>(bitcast<f32>(volumes[at]), bitcast<f32>(volumes[at + 1u]), bitcast<f32>(volumes[at + 2u]));
}
