// Media in their places, as `device::parts::media` lays them out: metres per device unit; the volumes around the camera (two words); where a
// boundary cuts its lens or window, the word of a place there, whose volumes they are, else 0; the first word of tables of phase
// functions; then VOLUME_WORDS words each, then lists, then voxels.
//      0 bits            1 extinction        2 source, or NONE   (spectra, without voxels)
//      3 first voxel of temperature, or NONE      4 its value where constant      5 index of refraction there (spectrum), or NONE
//      6 first word of its kinds of matter        7 … 9 voxels along x, y, z      10 … 21 device units to voxels, rows and offset
//      22 first word of what techniques make of it (parts/scattering)             23 number of amounts that tell its transmittance
// Kinds of matter, with voxels: how many; then of each first voxel of density, or NONE, its value where constant, scattering (spectrum)
// or NONE, number of absorbers; and of these strength, number of columns, and of each column temperature and spectrum. Amounts are in
// that order: of a kind's columns, then of its scattering.

@group(0) @binding(61) var<storage, read> volumes: array<u32>;
#constants VOLUMES

fn volume_at(number: u32) -> u32 {
    return VOLUMES_HEAD + number * VOLUME_WORDS;
}

fn volume_vector(at: u32) -> vec3<f32> {
    return vec3<f32>(bitcast<f32>(volumes[at]), bitcast<f32>(volumes[at + 1u]), bitcast<f32>(volumes[at + 2u]));
}
