//! The files that the examples of `docs/scene.md` name, as small as they can be.

use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage};
use zarrs::array::{ArrayBuilder, data_type};
use zarrs::filesystem::FilesystemStore;

/// Makes them all in `folder`.
pub fn make(folder: &Path) {
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        std::fs::write(path, bytes).expect("written");
    };
    write("spectra/lamp.csv", b"um,warm\n0.35,100\n0.6,900\n0.85,2000\n");
    write("spectra/sun.csv", b"nm,W m-2 nm-1\n350,0.6\n550,1.5\n850,0.9\n");
    write("spectra/soil.csv", b"350,0.1\n850,0.3\n");
    write(
        "track.csv",
        b"x,y,z,yaw_degrees,pitch_degrees,roll_degrees\n0,0,1000,0,0,0\n0.5,0,1000,0.1,0,0\n1,0,1000,0,0,0.1\n",
    );
    write("paints.csv", b"wavelength_nm,red,green\n350,0.05,0.04\n600,0.6,0.3\n850,0.7,0.2\n");
    write("gold.csv", b"nm,n,k\n350,1.6,1.9\n600,0.25,3.0\n850,0.15,5.2\n");
    write(
        "n-bk7.yml",
        b"DATA:\n  - type: tabulated n\n    data: |\n      0.35 1.539\n      0.6 1.516\n      0.85 1.510\n",
    );
    write("sensor.csv", b"nm,blue,red\n430,0,\n460,1,\n500,0,\n580,,0\n620,,1\n680,,0\n");
    write("trees.csv", b"x,y,z,yaw_degrees,scale\n2,1,0,30,1\n-2,1,0,200,0.8\n");
    write("mie.csv", b"degrees,300,900\n0,9,5\n10,2,2\n180,0.9,0.9\n");
    write("co2.csv", b"nm,300,600,1000\n300,0,0.1,0.2\n900,0.3,0.4,0.5\n");
    write("h2o.csv", b"nm,300,600,1000\n300,1,2,3\n900,0,0,0.5\n");
    write(
        "floor.obj",
        b"g tiles\nusemtl floor\nv -1 0 -1\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nf 1 2 3 4\ng rest\nv 1 0 3\nf 2 5 3\n",
    );
    write("cage.gltf", CAGE.as_bytes());
    write("albedo.png", &png(png::ColorType::Rgb, &[200, 120, 40, 60, 70, 80]));
    write("abundance.png", &png(png::ColorType::Rgb, &[100, 100, 55, 0, 200, 0]));
    write("mask.png", &png(png::ColorType::Grayscale, &[0, 128]));
    write("kelvin.exr", &exr(&[("Y", &[290.0, 310.0])]));
    write("sky.exr", &exr(&[("R", &[1.0, 0.1]), ("G", &[1.2, 0.1]), ("B", &[2.0, 0.1])]));
    for (name, value) in [("t.zarr", 800f32), ("d.zarr", 0.5)] {
        let store = Arc::new(FilesystemStore::new(folder.join(name)).expect("a store"));
        let array = ArrayBuilder::new(vec![2, 1, 3], vec![2, 1, 3], data_type::float32(), f32::NAN);
        let array = array.build(store, "/").expect("an array");
        array.store_metadata().expect("written");
        array.store_array_subset(&array.subset_all(), &[value; 6]).expect("written");
    }
}

/// Two nodes with one triangle, above the floor.
const CAGE: &str = r#"{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0, 1]}],
    "nodes": [{"name": "bars", "mesh": 0, "translation": [0, 1, 0]}, {"name": "lock", "mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5121, "type": "VEC3", "count": 3},
        {"bufferView": 0, "componentType": 5121, "type": "VEC2", "count": 3}],
    "bufferViews": [{"buffer": 0, "byteLength": 9}],
    "buffers": [{"byteLength": 9, "uri": "data:application/octet-stream;base64,AAAAAQAAAAEA"}]}"#;

/// Two pixels beside each other.
fn png(colour: png::ColorType, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(colour);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(data).expect("pixels");
    writer.finish().expect("an end");
    bytes
}

fn exr(planes: &[(&str, &[f32; 2])]) -> Vec<u8> {
    let channel = |(name, values): &(&str, &[f32; 2])| AnyChannel::new(*name, FlatSamples::F32(values.to_vec()));
    let channels = AnyChannels::sort(planes.iter().map(channel).collect());
    let layer = Layer::new((2, 1), LayerAttributes::default(), Encoding::UNCOMPRESSED, channels);
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).expect("written");
    bytes.into_inner()
}
