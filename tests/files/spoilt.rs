//! Every reader of other people's files, on files that were valid before something happened to them: each is read or refused in
//! words, whatever it was.

use std::cell::RefCell;
use std::fs;
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use proptest::sample::Index;
use proptest::test_runner::TestRunner;
use spectile::error::Problem;
use spectile::format::mesh::{self, Format};
use spectile::format::text::{self, Column, SpectrumTable};
use spectile::format::{image, maps, phase, refractive, response, volume};
use tempfile::{TempDir, tempdir};

use crate::binary::repository;

/// What reads a file.
#[derive(Debug, Clone, Copy)]
enum Reader {
    Spectrum(Column<'static>),
    Index,
    Responses,
    Columns,
    Phase,
    Map,
    Volume,
    Picture,
    Mesh,
}

/// A valid file, or several that belong together.
struct Valid {
    open: &'static str,
    reader: Reader,
    files: Vec<(&'static str, Vec<u8>)>,
}

fn one(open: &'static str, reader: Reader, bytes: impl Into<Vec<u8>>) -> Valid {
    Valid { open, reader, files: vec![(open, bytes.into())] }
}

const ONLY: Reader = Reader::Spectrum(Column::Only);
const TABLE: &str = "# made up\nwavelength (um),a [W m-2 sr-1 um-1],b\n0.4,1.5,\n0.5,2D0,5\n0.6,3,#N/A\n0.7,4,6\n";
const CAMERA: &str = r#"{"spectral_data": {"units": "relative", "index": {"main": ["R", "G"]},
    "data": {"main": {"400": [0.1, 0.2], "380": [0.0, 0.1], "500": [1, 2]}}}}"#;
const RADIS: &str = r#"{"arrays": {"wavespace": [2000.0, 2500.0], "abscoeff": [3.0, 4.0]}, "units": {"abscoeff": "cm-1"},
    "conditions": {"waveunit": "nm"}}"#;
const SPDX: &str = "<?xml version=\"1.0\"?>\n<IESTM2714><SpectralDistribution><SpectralQuantity>irradiance</SpectralQuantity>\n\
    <SpectralData wavelength=\"400\">0.5</SpectralData>\n<SpectralData wavelength=\"405.5\">0.75</SpectralData>\n\
    </SpectralDistribution></IESTM2714>\n";
const SIG: &str = "/*** Spectra Vista SIG Data ***/\nunits= Radiance, Radiance\ndata=\n350.0  2000.0  1000.0  50.00\n\
    400.0  3000.0  600.0  20.00\n";
const SED: &str = "Comment:\nUnits: W/m^2/sr/nm\nColumns [4]:\nData:\nWvl\tRad. (Ref.)\tRad. (Target)\tReflect. %\n\
    350\t0.5\t0.25\t50.0\n351\t0.5\t0.10\t20.0\n";
const ECOSTRESS: &str = "Name: made up\nType: soil\nX Units: Wavelength (micrometers)\nY Units: Reflectance (percent)\n\
    First Column: X\nSecond Column: Y\nNumber of X Values: 3\nAdditional Information: none\n\n2.5\t20.0\n0.9\t12.5\n0.42\t10.25\n";
const TAPE7: &str = "MM  6    3    2    0\n    FREQ  TOT TRANS  PTH THRML  TOTAL RAD  DEPTH\n\
    \x20   500.     0.5000   1.00E-06   3.00E-06  0.693\n   1000.     0.2500   2.00E-06   4.00E-06  1.386\n -9999.\n";
const LIBRARY: &str = "ENVI\nfile type = ENVI Spectral Library\nsamples = 4\nlines = 2\nbands = 1\ndata type = 4\n\
    interleave = bsq\nbyte order = 0\nheader offset = 0\nwavelength units = Nanometers\nbbl = { 1, 1, 0, 1 }\n\
    wavelength = { 400, 500, 600, 700 }\nspectra names = { first, second }\nreflectance scale factor = 2\n";
const RASTER: &str = "ENVI\nsamples = 4\nlines = 2\nbands = 3\ndata type = 4\ninterleave = bil\nbyte order = 0\nheader offset = 0\n\
    wavelength units = Micrometers\nwavelength = { 0.4, 0.5, 0.6 }\nfwhm = { 0.1, 0.1, 0.1 }\ndata gain values = { 1, 2, 3 }\n\
    data units = W m-2 sr-1 nm-1\ndata ignore value = -9999\n";
const MESH: &str = "mtllib a.mtl\no a\nv 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0.5\nvt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\nusemtl red\n\
    f 1/1/1 2/2/1 3/3/1\nf 1 5 3 4\ng b\nf -1 -2 -3\n";
const PAGE: &str = "REFERENCES: \"made up\"\nDATA:\n  - type: formula 2\n    wavelength_range: 0.4 2.0\n    coefficients: 0 1.04 0.006 \
    0.23 0.02 1.01 103.5\n  - type: tabulated k\n    data: |\n        0.4 1e-9\n        0.5 -1e-10\n        0.5 2e-9\n        0.8 1e-9\n";

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float u\n\
    property float v\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n\
    4 0 1 2 3\n3 2 1 0\n";
const STL: &str = "solid a\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1 0\n  endloop\n\
    endfacet\nendsolid a\n";
const GLTF: &str = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0, "children": [1], "scale": [1, 2, -1]}, {"mesh": 0, "rotation": [0, 0, 1, 1], "name": "b"}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 0, "TEXCOORD_0": 1}, "mode": 5, "material": 0}]}],
    "materials": [{"name": "red"}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3, "sparse": {"count": 1,
        "indices": {"bufferView": 1, "componentType": 5121}, "values": {"bufferView": 0, "byteOffset": 12}}},
        {"bufferView": 0, "componentType": 5123, "normalized": true, "byteOffset": 4, "type": "VEC2", "count": 3}],
    "bufferViews": [{"buffer": 0, "byteLength": 48, "byteStride": 12}, {"buffer": 0, "byteLength": 4}],
    "buffers": [{"byteLength": 48, "uri": "m.bin"}]}"#;

/// In big bytes, with elements that do not matter.
fn ply() -> Vec<u8> {
    let mut bytes = b"ply\nformat binary_big_endian 1.0\nelement extra 1\nproperty list uchar short a\nelement vertex 3\n\
        property float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar uint vertex_index\nend_header\n"
        .to_vec();
    bytes.extend([1, 0, 7]);
    bytes.extend([0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_be_bytes()));
    bytes.push(3);
    bytes.extend([0u32, 1, 2].iter().flat_map(|i| i.to_be_bytes()));
    bytes
}

fn stl() -> Vec<u8> {
    let mut bytes = vec![b'x'; 80];
    bytes.extend(1u32.to_le_bytes());
    bytes.extend(floats([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]));
    bytes.extend([0, 0]);
    bytes
}

/// [`GLTF`] with its buffer in itself.
fn glb() -> Vec<u8> {
    let mut json = GLTF.replace(", \"uri\": \"m.bin\"", "").into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF".to_vec();
    for word in [2, 12 + 8 + json.len() as u32 + 8 + 48, json.len() as u32] {
        bytes.extend(u32::to_le_bytes(word));
    }
    bytes.extend(b"JSON");
    bytes.extend(json);
    bytes.extend(48u32.to_le_bytes());
    bytes.extend(b"BIN\0");
    bytes.extend(floats((0..12).map(|i| i as f32)));
    bytes
}

fn floats(values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    values.into_iter().flat_map(f32::to_le_bytes).collect()
}

/// Metadata of a Zarr array in one plain chunk, version 3.
fn array(shape: &str, names: &str, attributes: &str) -> Vec<u8> {
    format!(
        r#"{{"zarr_format":3,"node_type":"array","shape":[{shape}],"data_type":"float32","fill_value":0.0,
        "chunk_grid":{{"name":"regular","configuration":{{"chunk_shape":[{shape}]}}}},
        "chunk_key_encoding":{{"name":"default","configuration":{{"separator":"/"}}}},
        "codecs":[{{"name":"bytes","configuration":{{"endian":"little"}}}}],
        "dimension_names":[{names}],"attributes":{attributes}}}"#
    )
    .into_bytes()
}

fn zarr_map() -> Valid {
    let scaled = r#"{"units":"W m-2 sr-1 nm-1","scale_factor":0.5,"_FillValue":-1.0}"#;
    let bounds = r#"{"units":"um","bounds":"wavelength_bounds"}"#;
    Valid {
        open: "sky.zarr",
        reader: Reader::Map,
        files: vec![
            ("sky.zarr/zarr.json", br#"{"zarr_format":3,"node_type":"group","attributes":{}}"#.to_vec()),
            ("sky.zarr/radiance/zarr.json", array("2,2,4", r#""wavelength","y","x""#, scaled)),
            ("sky.zarr/radiance/c/0/0/0", floats([1.0; 16])),
            ("sky.zarr/wavelength/zarr.json", array("2", r#""wavelength""#, bounds)),
            ("sky.zarr/wavelength/c/0", floats([0.4, 0.6])),
            ("sky.zarr/wavelength_bounds/zarr.json", array("2,2", r#""wavelength","edge""#, "{}")),
            ("sky.zarr/wavelength_bounds/c/0/0", floats([0.3, 0.5, 0.5, 0.7])),
        ],
    }
}

/// Version 2, whose metadata are in three files.
fn zarr_volume() -> Valid {
    let metadata = r#"{"zarr_format":2,"shape":[2,2,3],"chunks":[2,2,3],"dtype":"<i2","compressor":null,"fill_value":-1,
        "order":"C","filters":null,"dimension_separator":"."}"#;
    let attributes =
        r#"{"_ARRAY_DIMENSIONS":["z","y","x"],"units":"K","scale_factor":0.1,"add_offset":300,"valid_range":[0,500]}"#;
    Valid {
        open: "t.zarr/t",
        reader: Reader::Volume,
        files: vec![
            ("t.zarr/.zgroup", br#"{"zarr_format":2}"#.to_vec()),
            ("t.zarr/t/.zarray", metadata.into()),
            ("t.zarr/t/.zattrs", attributes.into()),
            ("t.zarr/t/0.0.0", (0..12i16).flat_map(i16::to_le_bytes).collect()),
        ],
    }
}

fn png() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 3, 2);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_source_gamma(png::ScaledFloat::new(0.6));
    encoder.write_header().and_then(|mut writer| writer.write_image_data(&[9; 18])).expect("a picture");
    bytes
}

fn valid_files() -> Vec<Valid> {
    let case = |name: &str| fs::read(repository("tests/cases").join(name)).expect("a picture of the cases");
    let utf16: Vec<u8> = "\u{feff}nm;v\r\n400,5;1,25\r\n700;2\r\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let hdr = [b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n-Y 2 +X 4\n".as_slice(), &[128; 32]].concat();
    let rttov = "made up\n  wavenumber  response\n 950.0  0.5\n 1000.0 1.0\n";
    let usgs = " splib07a Record=1: Quartz GDS31 ASDFRa AREF\n 4.0e-01\n-1.23e+34\n 5.5e-01\n";
    let of_usgs = " splib07a Record=2: Wavelengths ASD 0.35-2.5 microns  2151 ch\n 0.350\n 0.351\n 0.352\n";
    vec![
        one("a.csv", Reader::Spectrum(Column::Named("a")), TABLE),
        one("a.csv", Reader::Spectrum(Column::Number(3)), TABLE),
        one("a.csv", Reader::Columns, "nm,300,600 K\n400,1,2\n500,1,2\n"),
        one("mie.csv", Reader::Phase, "degrees,400,0.7 um\n0,90,50\n10,2,3\n90,0.2,0.3\n180,0.5,0.4\n"),
        one("excel.csv", ONLY, utf16),
        one("lamp.spd", ONLY, "400 1 # begins\n500 2\n"),
        one("a.txt", Reader::Index, "wl\tn\n0.4\t1.5\n0.7\t1.4\n\nwl\tk\n0.4\t0\n0.7\t1\n"),
        one("nk.csv", Reader::Index, "nm,n,k\n400,1.5,0\n500,1.4,0.25\n"),
        one("page.yml", Reader::Index, PAGE),
        one("page.yml", Reader::Spectrum(Column::Named("k")), PAGE),
        one("camera.json", Reader::Spectrum(Column::Named("G")), CAMERA),
        one("camera.json", Reader::Responses, CAMERA),
        one("gas.spec", ONLY, RADIS),
        one("lamp.spdx", ONLY, SPDX),
        one("leaf.asd", ONLY, super::imports::asd()),
        one("leaf.sig", ONLY, SIG),
        one("sun.dat", ONLY, "# irradiance in mW/(m2 nm)\n400 1\n500 2\n"),
        one("leaf.sed", ONLY, SED),
        one("rtcoef_goes_srf_1.txt", Reader::Responses, rttov),
        one("soil.spectrum.txt", ONLY, ECOSTRESS),
        one("run.tp7", Reader::Spectrum(Column::Named("TOTAL RAD")), TAPE7),
        one("wide.csv", Reader::Responses, "nm,a,b\n400,1,2\n500,1,\n600,0,3\n"),
        one("long.csv", Reader::Responses, "band,um,response\nred,0.6,0\nred,0.65,1\nblue,0.4,1\nblue,0.45,0.5\n"),
        Valid {
            open: "splib07a_Quartz_ASDFRa_AREF.txt",
            reader: ONLY,
            files: vec![
                ("splib07a_Quartz_ASDFRa_AREF.txt", usgs.into()),
                ("splib07a_Wavelengths_ASD_0.35-2.5_microns_2151_ch.txt", of_usgs.into()),
            ],
        },
        Valid {
            open: "soils.sli",
            reader: Reader::Spectrum(Column::Named("second")),
            files: vec![("soils.hdr", LIBRARY.into()), ("soils.sli", floats((0..8).map(|i| 0.1 * i as f32)))],
        },
        Valid {
            open: "sky.img",
            reader: Reader::Map,
            files: vec![("sky.hdr", RASTER.into()), ("sky.img", floats([0.5; 24]))],
        },
        zarr_map(),
        zarr_volume(),
        one("sky.hdr", Reader::Map, hdr),
        one("sky.exr", Reader::Map, case("exr-layer-names/layer.exr")),
        one("a.exr", Reader::Picture, case("abundance-by-name/abundance.exr")),
        one("a.png", Reader::Picture, png()),
        one("m.obj", Reader::Mesh, MESH),
        one("m.ply", Reader::Mesh, PLY),
        one("m.ply", Reader::Mesh, ply()),
        one("m.stl", Reader::Mesh, STL),
        one("m.stl", Reader::Mesh, stl()),
        Valid {
            open: "m.gltf",
            reader: Reader::Mesh,
            files: vec![("m.gltf", GLTF.into()), ("m.bin", floats((0..12).map(|i| i as f32)))],
        },
        one("m.glb", Reader::Mesh, glb()),
    ]
}

/// One thing that happens to a file.
#[derive(Debug, Clone)]
struct Accident {
    kind: u8,
    at: Index,
    to: Index,
    byte: u8,
}

/// What numbers and marks make trouble.
const WORDS: [&[u8]; 16] = [
    b"nan",
    b"-1",
    b"1e999",
    b"{",
    b"}",
    b"=",
    b"\n",
    b"99999999999999999999",
    b"0",
    b",",
    b"\"",
    b"-0",
    b"1e-320",
    b"[]",
    b"null",
    b"\xff\xfe",
];

impl Accident {
    fn happens_to(&self, bytes: &mut Vec<u8>) {
        let i = self.at.index(bytes.len() + 1);
        let word = WORDS[self.to.index(WORDS.len())];
        match self.kind {
            0 if i < bytes.len() => drop(bytes.remove(i)),
            1 => bytes.insert(i, self.byte),
            2 if i < bytes.len() => bytes[i] ^= 1 << (self.byte % 8),
            3 => bytes.truncate(i),
            4 => drop(bytes.splice(i..i, word.iter().copied())),
            5 => {
                // A number becomes another.
                let digits = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'-');
                let start = (i..bytes.len()).find(|&j| digits(&bytes[j])).unwrap_or(bytes.len());
                let end = (start..bytes.len()).find(|&j| !digits(&bytes[j])).unwrap_or(bytes.len());
                drop(bytes.splice(start..end, word.iter().copied()));
            }
            _ => {
                // A piece is lost, or stands twice.
                let j = self.to.index(bytes.len() + 1);
                let (from, to) = (i.min(j), i.max(j).min(i.min(j) + 64));
                if self.kind == 6 {
                    drop(bytes.drain(from..to));
                } else {
                    let piece = bytes[from..to].to_vec();
                    drop(bytes.splice(from..from, piece));
                }
            }
        }
    }
}

fn accidents() -> impl Strategy<Value = Vec<Accident>> {
    let one = (0..8u8, any::<Index>(), any::<Index>(), any::<u8>());
    proptest::collection::vec(one.prop_map(|(kind, at, to, byte)| Accident { kind, at, to, byte }), 1..5)
}

fn check_table(table: &SpectrumTable) {
    let has = table.nm.len();
    assert!(has >= 2 && has == table.value.len() && table.nm.is_sorted());
    assert!(table.nm.iter().all(|nm| nm.is_finite() && *nm > 0.0) && table.value.iter().all(|v| v.is_finite()));
    assert!(table.line.is_empty() || table.line.len() == has);
}

fn read(reader: Reader, path: &Path) -> Result<(), Box<Problem>> {
    match reader {
        Reader::Spectrum(_) if refractive::is_yaml(path) => read(Reader::Index, path)?,
        Reader::Spectrum(column) => check_table(&text::read_spectrum(path, column, None)?),
        Reader::Index => {
            let index = refractive::read(path, Some([400.0, 700.0]))?;
            [index.n, index.k].into_iter().flatten().flatten().for_each(|table| check_table(&table));
        }
        Reader::Responses => {
            let responses = response::read_responses(path)?;
            assert!(responses.named.iter().all(|(_, response)| response.integral() > 0.0));
        }
        Reader::Phase => {
            let table = phase::read(path)?.table;
            assert!(table.degrees.len() >= 2 && table.degrees.is_sorted() && table.nm.is_sorted());
            assert!(table.values.iter().all(|column| column.len() == table.degrees.len()));
            assert!(table.values.iter().flatten().all(|value| value.is_finite() && *value >= 0.0));
        }
        Reader::Columns => text::read_columns(path)?.iter().for_each(|(_, table)| check_table(table)),
        Reader::Map => {
            let map = maps::read(path)?;
            let [width, height] = map.size.map(|side| side as usize);
            assert_eq!(map.values().len(), width * height * map.per_texel());
        }
        Reader::Volume => {
            let volume = volume::read(path)?;
            assert_eq!(volume.values.len(), volume.size.iter().map(|side| *side as usize).product::<usize>());
        }
        Reader::Picture => {
            let picture = image::read(path)?;
            let [width, height] = picture.size.map(|side| side as usize);
            assert!(picture.planes.iter().all(|plane| plane.samples.len() == width * height));
        }
        Reader::Mesh => {
            let bytes = mesh::content(path)?;
            let mesh = mesh::parse(Format::of(path, &bytes), &bytes, path)?;
            for part in &mesh.parts {
                assert!(part.positions.iter().flatten().all(|x| x.is_finite()));
                assert!(part.triangles.iter().flatten().all(|i| (*i as usize) < part.positions.len()));
                let given = [part.uv.as_ref().map(Vec::len), part.normals.as_ref().map(Vec::len)];
                assert!(given.into_iter().flatten().all(|corners| corners == part.triangles.len()));
            }
        }
    }
    Ok(())
}

/// All valid files on disk, each kind in a folder of its own.
struct Disk {
    folder: TempDir,
    valid: Vec<Valid>,
}

impl Disk {
    fn new() -> Disk {
        let disk = Disk { folder: tempdir().expect("a folder"), valid: valid_files() };
        for (i, valid) in disk.valid.iter().enumerate() {
            for (name, bytes) in &valid.files {
                let path = disk.path(i, name);
                fs::create_dir_all(path.parent().expect("a folder")).expect("made");
                fs::write(path, bytes).expect("written");
            }
        }
        disk
    }

    fn path(&self, kind: usize, name: &str) -> PathBuf {
        self.folder.path().join(kind.to_string()).join(name)
    }

    /// Spoils a file, reads, and puts it back.
    fn spoil(&self, kind: Index, file: Index, accidents: &[Accident]) {
        let kind = kind.index(self.valid.len());
        let Valid { open, reader, files } = &self.valid[kind];
        let (name, whole) = &files[file.index(files.len())];
        let mut bytes = whole.clone();
        accidents.iter().for_each(|accident| accident.happens_to(&mut bytes));
        fs::write(self.path(kind, name), bytes).expect("written");
        // After a panic too: the next accidents are to happen to whole files.
        let _whole = PutBack(self.path(kind, name), whole);
        if let Err(problem) = read(*reader, &self.path(kind, open)) {
            assert!(!problem.message.is_empty() && !problem.message.contains('\n'), "{problem}");
        }
    }
}

/// Writes a file as it was, in the end.
struct PutBack<'b>(PathBuf, &'b [u8]);

impl Drop for PutBack<'_> {
    fn drop(&mut self) {
        fs::write(&self.0, self.1).expect("written");
    }
}

#[test]
fn valid_files_are_read() {
    let disk = Disk::new();
    for (i, valid) in disk.valid.iter().enumerate() {
        read(valid.reader, &disk.path(i, valid.open)).unwrap_or_else(|problem| panic!("{}: {problem}", valid.open));
    }
}

fn spoil(cases: u32) {
    let disk = RefCell::new(Disk::new());
    let config =
        ProptestConfig { failure_persistence: None, max_shrink_iters: 2000, ..ProptestConfig::with_cases(cases) };
    let result =
        TestRunner::new(config).run(&(any::<Index>(), any::<Index>(), accidents()), |(kind, file, accidents)| {
            disk.borrow().spoil(kind, file, &accidents);
            Ok(())
        });
    result.unwrap_or_else(|failure| panic!("{failure}"));
}

#[test]
fn spoilt_files_are_read_or_refused() {
    spoil(5_000);
}

#[test]
#[ignore = "a million files"]
fn a_million_spoilt_files_are_read_or_refused() {
    spoil(1_000_000);
}
