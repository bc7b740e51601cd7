//! What must not change a bit: waves, units per submission, tiles, crops, windows of buffers, the shader translator's
//! checks, the time of day. And what the number of channels may not change.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use spectile::device::prepared::Prepared;
use spectile::device::rng::hash;
use spectile::device::windows::Windows;
use spectile::gpu::adapter::Gpu;
use spectile::gpu::buffer;
use spectile::render::wave::Budget;
use spectile::render::worker::Worker;
use spectile::scene::{Filter, Mesh, Projection, Sampler, Scene, Shape, Sides};
use spectile::spectral::Channels;

use crate::device::{Settings, render};
use crate::scene_builder::*;
use crate::size;

/// A scene that uses a bit of everything: triangles and shapes, several lamps, a sky, roulette, slanted spectra, one with
/// a narrow line. 21 x 13 pixels, so that no tile fits.
fn everything(sampler: Sampler) -> Scene {
    let line = table(&[400.0, 549.0, 549.1, 549.2, 700.0], &[0.1, 0.1, 9.0, 0.1, 0.1]);
    let mut scene = Builder::new()
        .camera(look(
            DVec3::new(0.2, 0.3, 2.2),
            DVec3::ZERO,
            DVec3::Y,
            Projection::Perspective { tan_half: DVec2::new(0.8, 0.5) },
        ))
        .film(21, 13, Filter::Gaussian)
        .channels(Channels::equal(400.0, 700.0, 6))
        .bounces(4)
        .roulette(2)
        .diffuse(
            quad(DVec3::new(-2.0, -1.0, 2.0), 4.0 * DVec3::X, 4.0 * DVec3::NEG_Z),
            table(&[400.0, 700.0], &[0.2, 0.9]),
        )
        .diffuse(icosphere(DVec3::new(-0.4, -0.3, 0.0), 0.6, 3), 0.8)
        .diffuse(sphere(DVec3::new(0.7, -0.6, 0.3), 0.3), table(&[400.0, 530.0, 700.0], &[0.9, 0.1, 0.3]))
        .lamp(icosphere(DVec3::new(0.5, 0.8, 0.0), 0.2, 1), line, Sides::Front)
        .lamp(disk(DVec3::new(-1.0, 1.0, 0.0), DVec3::new(0.5, -1.0, 0.0), 0.3), 2.0, Sides::Both)
        .sky(table(&[400.0, 700.0], &[0.5, 0.2]))
        .build();
    scene.integrator.sampler = sampler;
    scene
}

fn budget(paths: u32) -> Budget {
    Budget { paths: Some(paths), memory: None }
}

fn bits(scene: &Scene, epochs: u32, samples: u32, settings: Settings) -> Vec<u32> {
    let rendered = render(scene, epochs, samples, settings);
    rendered.assert_clean();
    rendered.means.iter().flatten().map(|v| v.to_bits()).collect()
}

/// Two epochs of 64 samples are the same bits whatever the machinery around them.
#[test]
fn machinery_changes_no_bit() {
    for sampler in [Sampler::Sobol, Sampler::Independent] {
        let scene = everything(sampler);
        let base = Settings { seed: 5, ..Settings::default() };
        let expected = bits(&scene, 2, 64, base);
        let same =
            |what: &str, settings: Settings| assert!(bits(&scene, 2, 64, settings) == expected, "{sampler:?}: {what}");
        same("again", base);
        // Waves of a few samples of a few pixels, and of all pixels at once.
        for paths in [300, 1000, 60_000] {
            same("wave size", Settings { budget: budget(paths), ..base });
        }
        same("units one by one", Settings { units: 1, ..base });
        for tile in [[5, 3], [8, 2], [32, 32]] {
            same("tile", Settings { tile, ..base });
        }
        same("tile, wave and units", Settings { tile: [4, 4], budget: budget(3000), units: 3, ..base });
        if sampler == Sampler::Sobol || size::is_full() {
            same("bounds checks", Settings { checked: true, ..base });
        }
        assert!(bits(&scene, 2, 64, Settings { seed: 6, ..base }) != expected, "another seed");
        assert!(bits(&scene, 2, 64, Settings { seed: 5 + (1 << 32), ..base }) != expected, "the seed's high half");
    }
}

/// Short epochs, where a wave holds many units, and a long one, which takes many waves a pixel.
#[test]
fn machinery_changes_no_bit_in_short_and_long_epochs() {
    let scene = everything(Sampler::Sobol);
    for samples in [1, 2, 8, 256] {
        let base = Settings { seed: 5, ..Settings::default() };
        let expected = bits(&scene, 2, samples, Settings { units: 1, ..base });
        for settings in [
            base,
            Settings { budget: budget(500), ..base },
            Settings { tile: [4, 8], ..base },
            Settings { tile: [7, 1], units: 5, ..base },
        ] {
            assert!(bits(&scene, 2, samples, settings) == expected, "{samples} samples, {settings:?}");
        }
    }
}

/// Several windows of primitives, and of nodes: the same bits as with one of each.
#[test]
fn windows_change_no_bit() {
    let base = Settings { tile: [2, 2], ..Settings::default() };
    // Nodes usually take less than a window of the primitives does, but not in a tree of eight nodes with four triangles
    // each: one more than a leaf may hold.
    let mut tiny = everything(Sampler::Sobol);
    tiny.objects.truncate(1);
    tiny.film.crop = [6, 5, 12, 8];
    let mut cloud = Mesh::default();
    let random =
        |i: u32| DVec3::from_array([0, 1, 2].map(|axis| f64::from(hash(3 * i + axis)) / 2_147_483_648.0 - 1.0));
    for i in 0..32 {
        cloud.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        let corner = DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1)) - 0.5;
        cloud.positions.extend((0..3).map(|j| corner + 0.3 * random(3 * i + j)));
    }
    tiny.objects[0].shape = Shape::Mesh(cloud);

    let scenes = [(tiny, 4, 2), (everything(Sampler::Sobol), 4, 1), (everything(Sampler::Sobol), 2, 1)];
    for (scene, parts, nodes) in size::first(2, scenes) {
        let prepared = Prepared::new(&scene, 0).unwrap();
        let binding = prepared.accel.primitives.len().div_ceil(parts) as u64 * 48;
        let windows = Windows::of(&prepared.accel, binding).unwrap();
        assert_eq!((windows.nodes.count, windows.primitives.count), (nodes, parts as u32));
        let expected = bits(&scene, 1, 4, base);
        assert!(expected.iter().collect::<std::collections::HashSet<_>>().len() > 30, "something is seen");
        assert!(bits(&scene, 1, 4, Settings { binding: Some(binding), ..base }) == expected, "{windows:?}");
    }
    let prepared = Prepared::new(&everything(Sampler::Sobol), 0).unwrap();
    let bytes = prepared.accel.primitives.len() as u64 * 48;
    assert!(Windows::of(&prepared.accel, bytes / 5).is_err(), "more windows than bindings is an error");
}

/// A crop shows the same bits as those pixels of the full film.
#[test]
fn crop_is_part_of_the_film() {
    let mut scene = everything(Sampler::Sobol);
    let full = bits(&scene, 1, 16, Settings::default());
    for [x0, y0, x1, y1] in [[3, 2, 20, 12], [20, 12, 21, 13], [0, 5, 21, 6]] {
        scene.film.crop = [x0, y0, x1, y1];
        let crop = bits(&scene, 1, 16, Settings { tile: [8, 8], ..Settings::default() });
        let expected: Vec<u32> =
            (y0..y1).flat_map(|y| full[((y * 21 + x0) * 6) as usize..((y * 21 + x1) * 6) as usize].to_vec()).collect();
        assert!(crop == expected, "crop {x0}, {y0}, {x1}, {y1}");
    }
}

/// A directly visible constant radiance stays exact to the last bit in every channel, whatever K, the number of samples,
/// and the form in which spectra are held.
#[test]
fn visible_constant_is_exact() {
    let radiance = f64::from(0.123_456_79_f32);
    for count in size::first(3, [7, 400, 2000, 1, 2, 3, 8, 33]) {
        for extra in [0, 12] {
            // A sky with an emitting disk before it, both of the same constant.
            let mut b = Builder::new()
                .camera(look(DVec3::Z, DVec3::ZERO, DVec3::Y, Projection::Perspective { tan_half: DVec2::splat(1.0) }))
                .film(3, 3, Filter::Box)
                .channels(Channels::equal(380.0, 780.0, count))
                .bounces(0)
                .lamp(disk(DVec3::ZERO, DVec3::Z, 0.5), radiance, Sides::Front)
                .sky(table(&[380.0, 512.3, 780.0], &[radiance; 3]));
            // Unseen surfaces that make the tables large, and strata and knots necessary.
            for i in 0..extra {
                let slope = table(&[380.0, 411.7 + f64::from(i), 411.8 + f64::from(i), 780.0], &[0.1, 0.2, 0.9, 0.3]);
                b = b.diffuse(sphere(DVec3::new(0.0, 0.0, 9.0 + f64::from(i)), 0.2), slope);
            }
            let scene = b.build();
            for samples in [1, 64, 1024] {
                let rendered = render(&scene, 1, samples, Settings { tile: [4, 4], ..Settings::default() });
                rendered.assert_clean();
                let wrong = rendered.means[0].iter().position(|v| f64::from(*v) != radiance);
                assert_eq!(wrong, None, "K = {count}, {extra} more spectra, {samples} samples");
            }
        }
    }
}

/// Paths do not depend on K: a channel covering the same interval has the same bits among 1, 2, 3, 7 and 2,000.
#[test]
fn a_channel_is_the_same_among_any_number() {
    let with = |bounds: Vec<[f64; 2]>| {
        let scene = Builder::new()
            .camera(look(
                DVec3::new(0.2, 0.3, 2.2),
                DVec3::ZERO,
                DVec3::Y,
                Projection::Perspective { tan_half: DVec2::new(0.8, 0.5) },
            ))
            .film(5, 4, Filter::Box)
            .channels(Channels::from_bounds(bounds, None))
            .bounces(3)
            .diffuse(
                quad(DVec3::new(-2.0, -1.0, 2.0), 4.0 * DVec3::X, 4.0 * DVec3::NEG_Z),
                table(&[400.0, 700.0], &[0.2, 0.9]),
            )
            .diffuse(sphere(DVec3::new(0.0, -0.6, 0.3), 0.3), 0.7)
            // One light only: with more, what K decides is which of them is asked.
            .lamp(
                Shape::Cylinder { from: DVec3::X, to: DVec3::Y, radius: 0.1 },
                table(&[400.0, 700.0], &[1.0, 2.0]),
                Sides::Front,
            )
            .build();
        let rendered = render(&scene, 1, 16, Settings { tile: [8, 8], ..Settings::default() });
        rendered.assert_clean();
        let first: Vec<u32> = rendered.means[0].iter().step_by(rendered.channels).map(|v| v.to_bits()).collect();
        let last: Vec<u32> = rendered.means[0]
            .iter()
            .skip(rendered.channels - 1)
            .step_by(rendered.channels)
            .map(|v| v.to_bits())
            .collect();
        (first, last)
    };
    let (expected, _) = with(vec![[500.0, 512.0]]);
    assert!(expected.iter().any(|v| *v != 0));
    for count in [2, 3, 7, 2000] {
        // First and last among others of all widths.
        let mut bounds: Vec<[f64; 2]> = (0..count).map(|i| [400.0 + 0.1 * i as f64, 401.0 + 0.14 * i as f64]).collect();
        bounds[0] = [500.0, 512.0];
        bounds[count - 1] = [500.0, 512.0];
        let (first, last) = with(bounds);
        assert!(first == expected && last == expected, "K = {count}");
    }
}

/// A budget decides how large waves are, and no bit; and the device's own allocator says that it is kept.
#[test]
fn memory_changes_no_bit_and_is_kept() {
    let scene = everything(Sampler::Sobol);
    let prepared = Arc::new(Prepared::new(&scene, 5).expect("a scene"));
    let tile = Settings::default().tile;
    let worker = |memory| {
        let budget = Budget { memory, paths: None };
        Worker::new(Gpu::open().expect("a device"), Arc::clone(&prepared), tile, budget)
    };
    let unbounded = worker(None).expect("no budget").plan;
    let refusal = worker(Some(1)).err().expect("a byte is not enough").to_string();
    let least: u64 = refusal.split(' ').filter_map(|word| word.parse().ok()).nth(1).expect("the least");
    let all = unbounded.device_bytes();
    assert!(least < all / 3, "{least} of {all}: budgets in between say nothing");
    let mut sizes = Vec::new();
    for memory in [least, least + (all - least) / 50, all / 2, 2 * all] {
        let mut worker = worker(Some(memory)).expect("enough");
        worker.submit(&[[0, 0, 16, 13]], 3, 64).expect("submitted");
        worker.collect().expect("rendered");
        let allocated = worker.gpu.device.generate_allocator_report().expect("a report").total_allocated_bytes;
        // wgpu's own: a buffer of zeros (512 KiB) and small change.
        assert!(allocated <= memory, "{allocated} bytes allocated of {memory}");
        // Beside what uploading took, which is free again, and what alignment did not.
        let said = worker.plan.device_bytes() - worker.plan.scene_bytes.min(buffer::PIECE_BYTES) - (64 << 10);
        assert!(allocated >= said, "{allocated} bytes allocated, {said} said");
        sizes.push(worker.plan.paths);
        drop(worker);
        let settings =
            Settings { seed: 5, budget: Budget { memory: Some(memory), paths: None }, ..Settings::default() };
        for samples in [1, 64] {
            let expected = bits(&scene, 2, samples, Settings { seed: 5, ..Settings::default() });
            assert!(bits(&scene, 2, samples, settings) == expected, "{memory} bytes, {samples} samples");
        }
    }
    assert!(sizes.is_sorted() && 3 * sizes[0] < sizes[3] && sizes[3] == unbounded.paths, "{sizes:?}");
}

/// The largest film: a lamp ends in the middle of a pixel near each corner, and the pixel sees half of it.
#[test]
fn the_largest_film_is_sharp_at_its_corners() {
    let side = 131_072u32;
    let pixel = 2.0 / f64::from(side);
    for [right, top] in [[false, false], [true, true]] {
        // In pixels: the last but two of the row.
        let [x, y] = [right, !top].map(|far| if far { side - 3 } else { 2 });
        let place = |column: u32| (f64::from(column) + 0.5) * pixel - 1.0;
        let edge = DVec3::new(place(x), -place(y), 0.0);
        let mut scene = Builder::new()
            .camera(look(DVec3::Z, DVec3::ZERO, DVec3::Y, Projection::Orthographic { half_size: DVec2::ONE }))
            .film(side, side, Filter::Box)
            .channels(Channels::equal(400.0, 700.0, 1))
            .bounces(0)
            .lamp(quad(edge - 0.125 * DVec3::Y, 0.25 * DVec3::X, 0.25 * DVec3::Y), 1.0, Sides::Front)
            .build();
        scene.film.crop = [x - 1, y - 1, x + 2, y + 2];
        let rendered = render(&scene, 1, 4096, Settings { seed: 3, ..Settings::default() });
        rendered.assert_clean();
        // Eight roundings of 1/256 of a pixel at most, from the place on the film to the edge of the lamp.
        for row in rendered.means[0].chunks(3) {
            assert!(row[0] == 0.0 && (row[1] - 0.5).abs() < 1.0 / 32.0 && row[2] == 1.0, "{row:?}");
        }
    }
}
