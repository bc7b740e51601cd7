//! Inputs and uses that went wrong once, each a folder of `tests/cases` whose `run.sh` drives the real program and ends with PASS.
//!
//! A script gets the program in SPECTILE and writes only to a folder that it makes itself. One that calls Python needs the one
//! of SPECTILE_PYTHON, and finds it first in its PATH.

use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::binary::{output, repository};
use crate::report::skip;

/// A test for each folder.
macro_rules! cases {
    ($($(#[$attribute:meta])* $test:ident = $folder:literal,)*) => {
        const FOLDERS: &[&str] = &[$($folder),*];

        $(#[test]
        $(#[$attribute])*
        fn $test() {
            passes($folder);
        })*
    };
}

cases! {
    abundance_by_name = "abundance-by-name",
    channels_in_micrometres = "channels-in-micrometres",
    columns_without_header = "columns-without-header",
    concave_polygon = "concave-polygon",
    concave_polygon_area = "concave-polygon-area",
    copies_by_others = "copies-by-others",
    csv_from_spreadsheets = "csv-from-spreadsheets",
    cube_as_sky = "cube-as-sky",
    cube_attributes = "cube-attributes",
    #[ignore = "installs packages of Python"]
    cube_in_gdal_312 = "cube-in-gdal-312",
    #[ignore = "installs packages of Python"]
    cube_to_netcdf = "cube-to-netcdf",
    emission_outside_channels = "emission-outside-channels",
    #[ignore = "installs packages of Python"]
    envi_long_lines = "envi-long-lines",
    envi_scale_and_bad_bands = "envi-scale-and-bad-bands",
    export_overwrites_neighbour = "export-overwrites-neighbour",
    exr_layer_names = "exr-layer-names",
    lamp_seen_from_behind = "lamp-seen-from-behind",
    lost_chunk_silent = "lost-chunk-silent",
    measured_noise = "measured-noise",
    noise_of_libraries = "noise-of-libraries",
    non_utf8_path = "non-utf8-path",
    output_replaces_device = "output-replaces-device",
    page_behind_a_proxy = "page-behind-a-proxy",
    parts_of_pictures = "parts-of-pictures",
    refractive_pages = "refractive-pages",
    refractiveindex_downloads = "refractiveindex-downloads",
    scaled_maps = "scaled-maps",
    species_table_columns = "species-table-columns",
    tables_of_others = "tables-of-others",
    unit_of_first_column = "unit-of-first-column",
    unit_spellings = "unit-spellings",
    zarr_cf_scaling = "zarr-cf-scaling",
    zarr_codecs_and_types = "zarr-codecs-and-types",
}

#[test]
fn every_folder_is_a_test() {
    let entries = fs::read_dir(repository("tests/cases")).expect("cases");
    let folders: BTreeSet<String> =
        entries.map(|entry| entry.expect("entry").file_name().to_string_lossy().into_owned()).collect();
    assert_eq!(folders, FOLDERS.iter().map(|&folder| folder.to_owned()).collect());
}

fn passes(folder: &str) {
    let script = repository("tests/cases").join(folder).join("run.sh");
    let text = fs::read_to_string(&script).expect("a script");
    let mut command = Command::new("bash");
    command.arg(&script).env("SPECTILE", env!("CARGO_BIN_EXE_spectile"));
    if text.lines().any(|line| !line.trim_start().starts_with('#') && line.contains("python")) {
        let Some(python) = env::var_os("SPECTILE_PYTHON").filter(|python| !python.is_empty()) else {
            skip("SPECTILE_PYTHON names no Python with tests/python/requirements.txt");
            return;
        };
        let first = Path::new(&python).parent().expect("a folder").to_owned();
        let others = env::var_os("PATH").unwrap_or_default();
        command.env("PATH", env::join_paths([first].into_iter().chain(env::split_paths(&others))).expect("paths"));
    }
    let output = output(&mut command);
    let said = String::from_utf8_lossy(&output.stdout);
    let passed = output.status.success() && said.lines().last() == Some("PASS");
    assert!(passed, "{folder}: {}\n{said}{}", output.status, String::from_utf8_lossy(&output.stderr));
}
