//! The working cube against plain computations of what it must hold.

use std::fs;

use spectile::cube::{Cube, Existing, Header, Rect, Writer, compare};
use spectile::spectral::Channels;
use tempfile::tempdir;

use crate::cubes::{Random, Written, create, header, pattern, patterned, unit};

#[test]
fn first_units_come_back_bit_for_bit_with_edge_tiles() {
    let folder = tempdir().expect("folder");
    for (i, (size, tile, channels)) in [
        ([64, 64], [64, 64], 1),
        ([70, 37], [32, 16], 2),
        ([33, 65], [32, 64], 3),
        ([5, 3], [5, 3], 7),
        ([5, 100], [64, 24], 7),
        ([13, 9], [8, 8], 2000),
        ([1, 1], [8, 8], 5),
    ]
    .into_iter()
    .enumerate()
    {
        let written = patterned(folder.path(), &format!("{i}.zarr"), header(size, tile, channels));
        let cube = Cube::open(written.path()).expect("opens");
        assert_eq!(cube.header(), written.header());
        for tile in 0..cube.grid().count() {
            assert_eq!(cube.samples(tile).expect("samples"), 1);
            let chunk = cube.chunk(tile).expect("chunk").expect("rendered");
            let (rect, grid) = (cube.grid().rect(tile), cube.grid());
            assert_eq!(chunk.values().len(), grid.tile_pixels() * channels);
            // Column by column.
            for (pixel, values) in chunk.values().chunks_exact(channels).enumerate() {
                let (x, y) = (rect.x0 + pixel as u32 / grid.tile[1], rect.y0 + pixel as u32 % grid.tile[1]);
                if x >= rect.x1 || y >= rect.y1 {
                    assert!(values.iter().all(|v| v.is_nan()), "padding of {tile}");
                    continue;
                }
                for (k, v) in values.iter().enumerate() {
                    assert_eq!(v.to_bits(), pattern(x, y, k).to_bits());
                }
                assert_eq!(chunk.spectrum(x, y), values);
                assert_eq!(cube.spectrum(x, y).expect("read").expect("rendered"), values);
            }
        }
    }
}

#[test]
fn the_first_unit_keeps_negative_zero_and_subnormals() {
    let folder = tempdir().expect("folder");
    let cube = create(folder.path(), "bits.zarr", header([2, 1], [8, 8], 2));
    let values = [[-0.0f32, f32::from_bits(1)], [f32::MAX, -f32::MIN_POSITIVE]];
    cube.merge_unit(0, 1, &unit(&cube, 0, |x, _, k| values[x as usize][k])).expect("merged");
    for (x, expected) in values.iter().enumerate() {
        let got = cube.spectrum(x as u32, 0).expect("read").expect("rendered");
        assert_eq!(got.iter().map(|v| v.to_bits()).collect::<Vec<_>>(), expected.map(f32::to_bits));
    }
}

/// Portions of the first epoch, then whole epochs (docs/METHOD.md, Epochs).
const PORTIONS: [u32; 11] = [1, 1, 2, 4, 8, 16, 32, 64, 64, 64, 64];

#[test]
fn merging_follows_the_mean_of_all_samples_in_f64() {
    let folder = tempdir().expect("folder");
    for channels in [1, 2, 3, 7, 2000] {
        let cube = create(folder.path(), &format!("{channels}.zarr"), header([9, 11], [8, 8], channels));
        let mut random = Random(channels as u64);
        let mut expected = vec![0.0f64; 9 * 11 * channels];
        let mut largest = 0.0f64;
        for n in PORTIONS {
            let mut sample = vec![0.0f32; expected.len()];
            for (sample, sum) in sample.iter_mut().zip(&mut expected) {
                *sample = (100.0 * random.uniform().powi(4)) as f32;
                *sum += f64::from(n) * f64::from(*sample);
                largest = largest.max(f64::from(*sample));
            }
            for tile in 0..4 {
                let unit = unit(&cube, tile, |x, y, k| sample[((y * 9 + x) as usize) * channels + k]);
                cube.merge_unit(tile, n, &unit).expect("merged");
            }
        }
        let total: u32 = PORTIONS.iter().sum();
        // Each merge rounds the mean to f32 once; no mean exceeds the largest value.
        let bound = PORTIONS.len() as f64 * 0.5 * f64::from(f32::EPSILON) * largest;
        for y in 0..11 {
            for x in 0..9 {
                let got = cube.spectrum(x, y).expect("read").expect("rendered");
                for (k, got) in got.into_iter().enumerate() {
                    let expected = expected[((y * 9 + x) as usize) * channels + k] / f64::from(total);
                    assert!((f64::from(got) - expected).abs() <= bound, "{x} {y} {k}: {got} {expected}");
                }
            }
        }
        assert_eq!((0..4).map(|t| cube.samples(t).expect("samples")).collect::<Vec<_>>(), [total; 4]);
    }
}

#[test]
fn a_constant_stays_exact_over_many_merges() {
    let folder = tempdir().expect("folder");
    let cube = create(folder.path(), "constant.zarr", Header { epoch: 4, ..header([8, 8], [8, 8], 3) });
    let value = [1.0f32 / 3.0, 1e-30, 6.1e7];
    let unit = unit(&cube, 0, |_, _, k| value[k]);
    cube.merge_unit(0, 3, &unit).expect("merged");
    cube.merge_unit(0, 1, &unit).expect("merged");
    for _ in 0..500 {
        cube.merge_unit(0, 4, &unit).expect("merged");
    }
    assert_eq!(cube.samples(0).expect("samples"), 2004);
    assert_eq!(cube.spectrum(5, 6).expect("read").expect("rendered"), value);
    assert_eq!(cube.error_estimate().expect("estimate"), [0.0; 3]);
}

/// The error estimate against its definition, computed from all epochs at once.
#[test]
fn error_estimate_agrees_with_two_passes() {
    let folder = tempdir().expect("folder");
    let (size, channels) = ([19u32, 10u32], 4usize);
    let cube = create(folder.path(), "estimate.zarr", header(size, [8, 8], channels));
    let pixels = (size[0] * size[1]) as usize;
    let mut random = Random(11);
    // The last channel is dark. `epochs[b]` is the mean of the b-th 64 samples, [pixel][channel].
    let mut draw = |level: f64| -> Vec<f32> {
        (0..pixels * channels)
            .map(|i| if i % channels == 3 { 0.0 } else { (level * random.uniform() * 10f64.powi(i as i32 % 4)) as f32 })
            .collect()
    };
    let portions: Vec<Vec<f32>> = PORTIONS.iter().map(|_| draw(1.0)).collect();
    let merge = |n: u32, values: &[f32]| {
        for tile in 0..cube.grid().count() {
            let unit = unit(&cube, tile, |x, y, k| values[((y * size[0] + x) as usize) * channels + k]);
            cube.merge_unit(tile, n, &unit).expect("merged");
        }
    };
    let mut epochs = vec![vec![0.0f64; pixels * channels]];
    for (i, (&n, values)) in PORTIONS.iter().zip(&portions).enumerate() {
        merge(n, values);
        let estimate = cube.error_estimate().expect("estimate");
        if n < 64 {
            for (sum, v) in epochs[0].iter_mut().zip(values) {
                *sum += f64::from(*v) * f64::from(n) / 64.0;
            }
            assert!(estimate.iter().all(|v| v.is_nan()), "{n} samples are less than two epochs");
            continue;
        }
        epochs.push(values.iter().map(|&v| f64::from(v)).collect());
        let b = epochs.len() as f64;
        for (k, estimate) in estimate.into_iter().enumerate() {
            let (mut variance, mut square) = (0.0, 0.0);
            for p in (k..pixels * channels).step_by(channels) {
                let mean = epochs.iter().map(|e| e[p]).sum::<f64>() / b;
                let spread: f64 = epochs.iter().map(|e| (e[p] - mean).powi(2)).sum::<f64>() / (b - 1.0);
                variance += spread / b;
                square += mean * mean;
            }
            let expected = if k == 3 { 0.0 } else { (variance / square).sqrt() };
            // The stored means are f32: relative 6e-8 each.
            let error = (estimate - expected).abs();
            assert!(error <= 1e-6 * expected, "merge {i}, channel {k}: {estimate} {expected}");
        }
    }
    assert_eq!(
        cube.error_estimate().expect("estimate"),
        Cube::open(cube.path()).expect("open").error_estimate().expect("estimate")
    );
}

#[test]
fn epochs_are_merged_whole() {
    let folder = tempdir().expect("folder");
    let cube = create(folder.path(), "portions.zarr", header([8, 8], [8, 8], 1));
    let unit = unit(&cube, 0, |_, _, _| 1.0);
    for n in [0, 65] {
        assert!(cube.merge_unit(0, n, &unit).is_err(), "{n} samples first");
    }
    cube.merge_unit(0, 60, &unit).expect("merged");
    assert!(cube.merge_unit(0, 5, &unit).unwrap_err().to_string().contains("5 samples cannot follow 60"));
    cube.merge_unit(0, 4, &unit).expect("merged");
    assert!(cube.merge_unit(0, 32, &unit).is_err());
    cube.merge_unit(0, 64, &unit).expect("merged");
    assert!(cube.merge_unit(0, 64, &unit[1..]).is_err(), "too short");
    assert_eq!(cube.samples(0).expect("samples"), 128);
}

#[test]
fn a_value_that_is_not_finite_is_refused_and_changes_nothing() {
    let folder = tempdir().expect("folder");
    let cube = patterned(folder.path(), "finite.zarr", header([16, 8], [8, 8], 2));
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let unit = unit(&cube, 1, |x, y, k| if (x, y, k) == (9, 7, 1) { bad } else { 1.0 });
        let message = cube.merge_unit(1, 1, &unit).unwrap_err().to_string();
        assert!(message.contains("tile 1 holds a value in channel 1"), "{message}");
    }
    assert_eq!(cube.samples(1).expect("samples"), 1);
    assert_eq!(cube.spectrum(9, 7).expect("read").expect("rendered")[1], pattern(9, 7, 1));
    let aside = fs::read_dir(cube.path().join(".spectile/aside")).expect("folder");
    assert_eq!(aside.count(), 0, "files aside are removed");
}

#[test]
fn derived_arrays_follow_the_radiance() {
    let folder = tempdir().expect("folder");
    let cube = create(folder.path(), "derived.zarr", Header { epoch: 4, ..header([21, 13], [16, 8], 5) });
    for tile in [0, 1, 3] {
        for scale in [1.0, 3.0] {
            let unit = unit(&cube, tile, |x, y, k| scale * pattern(x, y, k));
            cube.merge_unit(tile, 2, &unit).expect("merged");
        }
    }
    // Preview: the projection of the stored spectrum; tile 2 (rows 8.., columns ..16) is missing.
    let preview = cube.preview().expect("preview");
    for y in 0..13u32 {
        for x in 0..21u32 {
            let rgb = &preview.rgb[((y * 21 + x) * 3) as usize..][..3];
            match cube.spectrum(x, y).expect("read") {
                Some(spectrum) => assert_eq!(rgb, cube.projection().rgb(&spectrum)),
                None => assert!((x < 16 && y >= 8) && rgb.iter().all(|v| v.is_nan())),
            }
        }
    }
    // Overview: [2][1][K] in a file of the tile, means over the pixels of the picture only.
    for tile in [0, 1, 3] {
        let [column, row] = cube.grid().position(tile);
        let bytes = fs::read(cube.path().join(format!("overview/c/0/{row}/{column}"))).expect("overview");
        let values: Vec<f32> = bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        assert_eq!(values.len(), 5 * 2);
        let rect = cube.grid().rect(tile);
        for k in 0..5usize {
            for block in 0..2u32 {
                let x0 = rect.x0 + 8 * block;
                let mut pixels = Vec::new();
                for y in rect.y0..rect.y1 {
                    for x in x0..(x0 + 8).min(rect.x1) {
                        pixels.push(f64::from(cube.spectrum(x, y).expect("read").expect("rendered")[k]));
                    }
                }
                let got = values[block as usize * 5 + k];
                if pixels.is_empty() {
                    assert!(got.is_nan());
                } else {
                    let mean = pixels.iter().sum::<f64>() / pixels.len() as f64;
                    assert!((f64::from(got) / mean - 1.0).abs() < 1e-7, "{got} {mean}");
                }
            }
        }
    }
    let progress = cube.progress().expect("progress");
    assert_eq!((progress.tiles, progress.tiles_started, progress.samples), (4, 3, [4, 4]));
}

#[test]
fn overlapping_disjoint_and_unordered_channels_keep_their_bounds() {
    let folder = tempdir().expect("folder");
    let bounds = vec![[8e3, 12e3], [380.0, 390.1], [385.0, 470.0 / 0.7], [2e4 - 1e-3, 2e4]];
    let channels = Channels::from_bounds(bounds, Some([3, 1, 1]));
    let cube =
        patterned(folder.path(), "odd.zarr", Header { channels, origin: [100, 7], ..header([9, 9], [8, 16], 4) });
    let opened = Cube::open(cube.path()).expect("opens");
    assert_eq!(opened.header(), cube.header());
    assert_eq!(opened.projection().rgb(&[1.0, 2.0, 3.0, 4.0]), [4.0, 2.0, 2.0]);
}

#[test]
fn what_is_no_cube_is_refused_in_words() {
    let folder = tempdir().expect("folder");
    let refusal = |name: &str| match Cube::open(&folder.path().join(name)) {
        Ok(_) => panic!("{name} opened"),
        Err(error) => {
            assert_eq!(error.exit_code(), 5);
            error.to_string()
        }
    };
    assert!(refusal("missing.zarr").contains("missing.zarr: there is no such cube"));
    fs::write(folder.path().join("file"), "x").expect("written");
    assert!(refusal("file").contains("is a file"));
    fs::create_dir(folder.path().join("empty")).expect("made");
    assert!(refusal("empty").contains("no zarr.json"));
    fs::write(folder.path().join("empty/zarr.json"), "{").expect("written");
    assert!(refusal("empty").contains("not JSON"));
    fs::write(folder.path().join("empty/zarr.json"), r#"{"zarr_format": 3, "attributes": {}}"#).expect("written");
    assert!(refusal("empty").contains("not a Spectile cube"));
    fs::write(folder.path().join("empty/zarr.json"), r#"{"attributes": {"spectile_format": 3}}"#).expect("written");
    assert!(refusal("empty").contains("format 3; this version reads the formats 1 and 2"));

    let cube = patterned(folder.path(), "good.zarr", header([8, 8], [8, 8], 2));
    let metadata = fs::read_to_string(cube.path().join("zarr.json")).expect("read");
    // A copy without what Spectile keeps for itself is known by its metadata alone.
    fs::rename(cube.path().join(".spectile"), folder.path().join("kept")).expect("moved");
    for (from, to) in [
        ("\"order\"", "\"odrer\""),
        ("\"epoch\": 64", "\"epoch\": 63"),
        ("\"channel_names\"", "\"names\""),
        ("\"shape\"", "\"from\""),
        ("little", "big"),
    ] {
        assert!(metadata.contains(from), "{from}");
        fs::write(cube.path().join("zarr.json"), metadata.replace(from, to)).expect("written");
        let said = refusal("good.zarr");
        let expected = if ["\"order\"", "little"].contains(&from) { "has stored `" } else { "damaged" };
        assert!(said.contains(expected), "{from}: {said}");
    }
    fs::write(cube.path().join("zarr.json"), metadata).expect("written");
    let bounds = cube.path().join("wavelength_bounds/c/0/0");
    let whole = fs::read(&bounds).expect("read");
    fs::write(&bounds, [0; 31]).expect("written");
    assert!(refusal("good.zarr").contains("31 bytes long, not 32"));
    fs::write(&bounds, whole).expect("written");
    fs::rename(folder.path().join("kept"), cube.path().join(".spectile")).expect("moved");
    fs::write(cube.path().join("radiance/c/0/0/0"), [0; 100]).expect("written");
    let opened = Cube::open(cube.path()).expect("opens");
    assert!(opened.chunk(0).err().expect("refused").to_string().contains("is damaged: 100 bytes long, not 512"));
    assert!(opened.spectrum(7, 7).unwrap_err().to_string().contains("is damaged"));
}

#[test]
fn a_tile_whose_files_contradict_each_other_is_not_merged() {
    let folder = tempdir().expect("folder");
    let cube = patterned(folder.path(), "torn.zarr", header([8, 8], [8, 8], 2));
    let unit = unit(&cube, 0, pattern);
    let refusal = || {
        let error = cube.merge_unit(0, 1, &unit).unwrap_err();
        assert_eq!(error.exit_code(), 5);
        error.to_string()
    };
    let radiance = cube.path().join("radiance/c/0/0/0");
    let sound = fs::read(&radiance).expect("read");
    let mut damaged = sound.clone();
    damaged[77] ^= 1;
    fs::write(&radiance, &damaged).expect("written");
    assert!(refusal().contains("is damaged: it is not what the journal says"), "{}", refusal());
    fs::remove_file(&radiance).expect("removed");
    assert!(refusal().contains("is missing, although the journal has it"), "{}", refusal());
    fs::write(&radiance, &sound).expect("written");
    cube.merge_unit(0, 1, &unit).expect("sound again");
    // Somebody else has merged meanwhile: this process has lost its lock.
    fs::write(cube.path().join("samples/c/0/0"), 1u32.to_le_bytes()).expect("written");
    assert!(refusal().contains("tile 0 has 2 samples per pixel where 1 were expected"), "{}", refusal());
}

#[test]
fn overwrite_replaces_cubes_and_nothing_else() {
    let folder = tempdir().expect("folder");
    let path = folder.path().join("cube.zarr");
    let refusal = |overwrite| {
        let existing = if overwrite { Existing::Replace } else { Existing::Refuse };
        let error = Written::open(&path, header([8, 8], [8, 8], 2), existing).err().expect("refused");
        assert_eq!(error.exit_code(), 2);
        error.to_string()
    };
    // Somebody's folder, file, or other Zarr store.
    fs::create_dir(&path).expect("made");
    fs::write(path.join("thesis.tex"), "years of work").expect("written");
    assert!(refusal(false).contains("--overwrite"));
    assert!(refusal(true).contains("no zarr.json"));
    fs::write(path.join("zarr.json"), r#"{"zarr_format": 3, "node_type": "group", "attributes": {}}"#)
        .expect("written");
    assert!(refusal(true).contains("not a Spectile cube"));
    assert_eq!(fs::read_to_string(path.join("thesis.tex")).expect("read"), "years of work");
    fs::remove_dir_all(&path).expect("removed");
    fs::write(&path, "x").expect("written");
    assert!(refusal(false).contains("exists already"));
    assert!(refusal(true).contains("is a file"));
    fs::remove_file(&path).expect("removed");
    #[cfg(unix)]
    {
        // Through a link the cube behind it is meant, also one that is new.
        std::os::unix::fs::symlink("elsewhere", &path).expect("linked");
        let behind = folder.path().join("elsewhere");
        drop(Written::open(&path, header([8, 8], [8, 8], 2), Existing::Refuse).expect("made behind the link"));
        assert!(path.is_symlink() && behind.join("zarr.json").is_file());
        assert!(refusal(false).contains("exists already"));
        drop(Written::open(&path, header([16, 8], [8, 8], 2), Existing::Replace).expect("replaced behind the link"));
        assert!(path.is_symlink() && Cube::open(&behind).expect("opens").header().size == [16, 8]);
        fs::remove_file(&path).expect("removed");
        fs::remove_dir_all(&behind).expect("removed");
    }

    // A cube, alone and with somebody's notes in it.
    let old = patterned(folder.path(), "cube.zarr", header([16, 16], [8, 8], 3));
    let mapped = old.chunk(3).expect("chunk").expect("rendered");
    assert!(refusal(false).contains("exists already"));
    fs::write(path.join("notes.txt"), "x").expect("written");
    assert!(refusal(true).contains("notes.txt"));
    fs::remove_file(path.join("notes.txt")).expect("removed");
    let replace = || Written::open(&path, header([8, 8], [8, 8], 2), Existing::Replace);
    let error = replace().err().expect("in use");
    assert!(error.exit_code() == 5 && error.to_string().contains("tiles 0..4 are in use"), "{error}");
    drop(old);
    let new = replace().expect("replaced");
    assert_eq!(new.samples(0).expect("samples"), 0);
    assert!(new.chunk(0).expect("chunk").is_none() && new.spectrum(0, 0).expect("read").is_none());
    assert_eq!(mapped.spectrum(9, 9)[2], pattern(9, 9, 2), "what is mapped stays readable");
    let names: Vec<_> = fs::read_dir(folder.path()).expect("list").map(|e| e.expect("entry").file_name()).collect();
    assert_eq!(names, ["cube.zarr"], "no temporary folder stays");
}

#[test]
fn impossible_cubes_are_refused_before_anything_is_made() {
    let folder = tempdir().expect("folder");
    let good = || header([100, 100], [64, 64], 4);
    let interval = |from, to| Channels::from_bounds(vec![[from, to]], None);
    let bad = [
        (Header { size: [0, 5], ..good() }, "no pixels"),
        (Header { tile: [60, 64], ..good() }, "tile width 60"),
        (Header { tile: [64, 0], ..good() }, "tile height 0"),
        (Header { epoch: 48, ..good() }, "power of two"),
        (Header { epoch: 2048, ..good() }, "power of two"),
        (Header { channels: Channels::equal(400.0, 500.0, 0), ..good() }, "0 channels"),
        (Header { channels: interval(500.0, 500.0), ..good() }, "500 to 500 nm"),
        (Header { channels: interval(f64::NAN, 500.0), ..good() }, "NaN to 500"),
        (Header { channels: Channels { false_colour: Some([0, 1, 4]), ..good().channels }, ..good() }, "false colour"),
        (Header { size: [u32::MAX; 2], tile: [8, 8], ..good() }, "larger tiles"),
        (Header { size: [u32::MAX; 2], tile: [u32::MAX; 2], ..good() }, "too large"),
        (Header { size: [1 << 24; 2], tile: [1024; 2], ..good() }, "free there"),
    ];
    for (header, expected) in bad {
        let error = Written::open(&folder.path().join("bad.zarr"), header, Existing::Refuse).err().expect("refused");
        assert!(error.to_string().contains(expected) && error.exit_code() == 2, "{error}");
    }
    let nowhere = Written::open(&folder.path().join("no/where.zarr"), good(), Existing::Refuse).err().expect("refused");
    assert!(nowhere.to_string().contains("there is no folder"), "{nowhere}");
    assert_eq!(fs::read_dir(folder.path()).expect("list").count(), 0);
}

#[test]
fn readers_see_a_whole_tile_while_it_is_merged() {
    let folder = tempdir().expect("folder");
    let cube = create(folder.path(), "busy.zarr", Header { epoch: 1, ..header([32, 32], [32, 32], 50) });
    let merges = 40;
    std::thread::scope(|scope| {
        scope.spawn(|| {
            for i in 0..merges {
                // The mean of 0, 1, … i is i/2: the same in every pixel and channel at any moment.
                cube.merge_unit(0, 1, &unit(&cube, 0, |_, _, _| i as f32)).expect("merged");
            }
        });
        scope.spawn(|| {
            let reader = Cube::open(cube.path()).expect("opens while rendering");
            while reader.samples(0).expect("samples") < merges {
                if let Some(chunk) = reader.chunk(0).expect("chunk") {
                    let first = chunk.values()[0];
                    assert!(chunk.values().iter().all(|&v| v == first));
                }
            }
        });
    });
    assert_eq!(cube.spectrum(3, 3).expect("read").expect("rendered"), vec![(merges - 1) as f32 / 2.0; 50]);
}

#[test]
fn threads_may_merge_into_one_cube() {
    let folder = tempdir().expect("folder");
    let cube = create(folder.path(), "threads.zarr", Header { epoch: 1, ..header([64, 32], [16, 16], 3) });
    std::thread::scope(|scope| {
        for worker in 0..4 {
            let cube = &cube;
            // A tile is on one device at a time; none of the units may get lost.
            scope.spawn(move || {
                for round in 0..20u32 {
                    let tile = 2 * worker + round % 2;
                    cube.merge_unit(tile, 1, &unit(cube, tile, |_, _, _| 2.0)).expect("merged");
                }
            });
        }
    });
    assert!((0..8).all(|tile| cube.samples(tile).expect("samples") == 10));
}

#[test]
fn compare_follows_the_definitions() {
    let folder = tempdir().expect("folder");
    let size = [19u32, 10u32];
    // Other tiles, same picture. Channel 2 of the reference is dark, and of both in the first half of the rows.
    let value = |x: u32, y: u32, k: usize| if k == 2 { 0.0 } else { 1.0 + (x * (k as u32 + 1) + y) as f32 };
    let shifted = |x: u32, y: u32, k: usize| value(x, y, k) * 1.5 - if k == 1 { 2.0 } else { 0.0 };
    let [a, b] = [("a.zarr", [8, 8]), ("b.zarr", [16, 16])].map(|(n, t)| create(folder.path(), n, header(size, t, 3)));
    for tile in 0..a.grid().count() {
        a.merge_unit(tile, 1, &unit(&a, tile, shifted)).expect("merged");
    }
    for tile in 0..b.grid().count() {
        b.merge_unit(tile, 1, &unit(&b, tile, value)).expect("merged");
    }
    let comparison = compare(&a, &b).expect("compared");
    assert_eq!((comparison.pixels, comparison.pixels_in_all), (190, 190));
    for k in 0..3 {
        let all = (0..10).flat_map(|y| (0..19).map(move |x| (x, y)));
        let pairs: Vec<_> = all.map(|(x, y)| (f64::from(shifted(x, y, k)), f64::from(value(x, y, k)))).collect();
        let mean = |f: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|&(x, r)| f(x, r)).sum::<f64>() / 190.0;
        let reference = mean(&|_, r| r);
        let epsilon = (0.01 * reference).powi(2);
        let got = comparison.channels[k];
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs();
        assert!(close(got.bias, mean(&|x, r| x - r)) && close(got.reference_mean, reference));
        assert!(close(got.rmse, mean(&|x, r| (x - r).powi(2)).sqrt()));
        let relative = mean(&|x, r| (x - r).powi(2) / (r * r + epsilon));
        assert!(close(got.rel_mse, if k == 2 { 0.0 } else { relative }), "{k}: {}", got.rel_mse);
    }
    assert_eq!(comparison.worst().0, 0);

    // Against itself nothing differs; missing tiles are left out and counted.
    let itself = compare(&a, &a).expect("compared");
    assert!(itself.channels.iter().all(|c| (c.bias, c.rmse, c.rel_mse) == (0.0, 0.0, 0.0)));
    let part = create(folder.path(), "part.zarr", header(size, [16, 16], 3));
    assert!(compare(&part, &b).unwrap_err().to_string().contains("no rendered pixel in common"));
    part.merge_unit(1, 1, &unit(&part, 1, |x, y, k| if k == 2 { 1.0 } else { value(x, y, k) })).expect("merged");
    let partly = compare(&part, &b).expect("compared");
    assert_eq!(part.grid().rect(1), Rect { x0: 16, y0: 0, x1: 19, y1: 10 });
    assert_eq!((partly.pixels, partly.channels[0].rel_mse), (30, 0.0));
    assert_eq!(partly.worst(), (2, f64::INFINITY), "light where the reference is dark in all pixels");

    let other_size = create(folder.path(), "size.zarr", header([19, 11], [8, 8], 3));
    assert!(compare(&a, &other_size).unwrap_err().to_string().contains("19x10 pixels, the second 19x11"));
    let other_count = create(folder.path(), "count.zarr", header(size, [8, 8], 4));
    assert!(compare(&a, &other_count).unwrap_err().to_string().contains("3 channels, the second 4"));
    let channels = Channels::equal(380.0, 781.0, 3);
    let other_channels = create(folder.path(), "channels.zarr", Header { channels, ..header(size, [8, 8], 3) });
    assert!(compare(&a, &other_channels).unwrap_err().to_string().contains("channel 0 is 380-"));
}

/// The picture shows every unit as soon as it is merged, also before it is committed; readers see it a commit later.
#[test]
fn the_preview_follows_every_unit() {
    let folder = tempdir().expect("folder");
    let header = Header { epoch: 1, ..header([40, 24], [16, 16], 3) };
    let path = folder.path().join("cube.zarr");
    let writer = Writer::open(&path, &header, Existing::Refuse, 0..6, &mut |what| panic!("{what}")).expect("a cube");
    let cube = writer.cube();
    let mut shown = writer.preview(1).expect("preview");
    assert!(shown.rgb.iter().all(|v| v.is_nan()));
    for epoch in 0..3 {
        for tile in 0..6 {
            writer
                .merge_unit(tile, epoch, 1, &unit(cube, tile, |x, y, k| pattern(x, y, k) * epoch as f32))
                .expect("merged");
            let now = writer.preview(1).expect("preview");
            let rect = cube.grid().rect(tile);
            let mut changed = 0;
            for (i, (now, before)) in now.rgb.chunks(3).zip(shown.rgb.chunks(3)).enumerate() {
                let (x, y) = (i as u32 % 40, i as u32 / 40);
                let inside = (rect.x0..rect.x1).contains(&x) && (rect.y0..rect.y1).contains(&y);
                let same =
                    now.iter().zip(before).all(|(a, b)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()));
                assert!(inside || same, "tile {tile} changed pixel {x} {y}");
                changed += u64::from(!same);
            }
            assert_eq!(changed, rect.pixels(), "tile {tile}, epoch {epoch}");
            shown = now;
        }
        if epoch == 0 {
            assert!(cube.preview().expect("preview").rgb.iter().all(|v| v.is_nan()), "nothing is committed yet");
        }
        writer.flush().expect("committed");
        assert_eq!(cube.preview().expect("preview"), shown);
    }
    // Reduced: means of 8 x 8 pixels, as in the overview.
    let reduced = writer.preview(8).expect("preview");
    assert_eq!(reduced.size, [5, 3]);
    let mean = (0..64).map(|i| f64::from(shown.rgb[((8 + i / 8) * 40 + 16 + i % 8) * 3 + 1])).sum::<f64>() / 64.0;
    assert!((f64::from(reduced.rgb[(5 + 2) * 3 + 1]) / mean - 1.0).abs() < 1e-6);
}
