//! A device that is lost in the middle of a render gives its units back, and the others finish with the same bytes.

mod scene_builder;

use std::sync::{Arc, OnceLock, mpsc};
use std::time::Duration;

use glam::{DVec2, DVec3};
use scene_builder::*;
use spectile::Error;
use spectile::cube::{Existing, Writer};
use spectile::gpu::adapter::{Gpu, Selection};
use spectile::render::plan;
use spectile::render::pool::{Pool, Report};
use spectile::render::prepare::Prepared;
use spectile::render::queue::Queue;
use spectile::scene::{Filter, Projection, Scene, Sides};
use spectile::spectral::Channels;

const TILE: [u32; 2] = [16, 16];
const EPOCHS: u32 = 10;

fn scene() -> Scene {
    let projection = Projection::Perspective { tan_half: DVec2::splat(0.7) };
    Builder::new()
        .camera(look(DVec3::new(0.0, 0.0, 0.9), DVec3::ZERO, DVec3::Y, projection))
        .film(64, 64, Filter::Box)
        .channels(Channels::equal(400.0, 700.0, 40))
        .bounces(4)
        .diffuse(room(DVec3::splat(-1.0), DVec3::splat(1.0)), 0.5)
        .lamp(quad(DVec3::new(-0.3, 0.9, -0.3), DVec3::X * 0.6, DVec3::Z * 0.6), 1.0, Sides::Front)
        .build()
}

/// Renders on two devices; the first is destroyed after `doom`, if it gets that far. Returns the chunks and whether it
/// was lost.
fn render(doom: Option<Duration>) -> (Vec<Vec<f32>>, bool) {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = scene();
    let prepared = Arc::new(Prepared::new(&scene, 3).expect("a scene"));
    let header = plan::header(&scene, TILE, 3);
    let (queue, cube, interrupt) = (Queue::new(), OnceLock::new(), Arc::default());
    let tiles = 0..header.grid().count();
    queue.fill(tiles.clone().map(|tile| (tile, 0)), 1);
    let path = folder.path().join("cube.zarr");
    let opened = Writer::open(&path, &header, Existing::Refuse, tiles, &mut |what| panic!("{what}"));
    cube.set(opened.expect("a cube")).ok();
    let pool = Pool {
        prepared: &prepared,
        queue: &queue,
        cube: &cube,
        tile: TILE,
        full_epoch: 64,
        memory: None,
        profile: false,
        interrupt: &interrupt,
    };
    let gpus = Gpu::open_all(&Selection::Count(2)).expect("devices");
    let victim = gpus[0].device.clone();
    let mut lost = false;
    std::thread::scope(|threads| {
        let (sender, reports) = mpsc::channel();
        for (device, gpu) in gpus.into_iter().enumerate() {
            let (pool, sender) = (&pool, sender.clone());
            threads.spawn(move || pool.work(device, gpu, &sender));
        }
        drop(sender);
        let (mut ready, mut merged) = (0, 0);
        for (device, report) in reports {
            match report {
                Report::Ready { .. } => {
                    ready += 1;
                    if ready == 2 {
                        queue.allow(EPOCHS);
                        if let Some(doom) = doom {
                            let victim = &victim;
                            threads.spawn(move || {
                                std::thread::sleep(doom);
                                victim.destroy();
                            });
                        }
                    }
                }
                Report::Merged(units) => {
                    merged += units.group.tiles.len() as u32;
                    if merged == EPOCHS * cube.get().expect("a cube").cube().grid().count() {
                        queue.close();
                    }
                }
                Report::Left { result: Err(Error::DevicesLost(_)) } => {
                    assert_eq!(device, 0, "only the destroyed device is lost");
                    lost = true;
                }
                Report::Left { result } => assert!(result.is_ok(), "{:?}", result.err()),
            }
        }
    });
    let writer = cube.get().expect("a cube");
    writer.flush().expect("committed");
    let cube = writer.cube();
    let chunks = (0..cube.grid().count()).map(|t| cube.chunk(t).expect("a chunk").expect("rendered").values().to_vec());
    (chunks.collect(), lost)
}

/// Ten moments of a render that takes a few seconds: whatever the device was doing, no unit is lost, doubled or spoilt.
#[test]
fn a_destroyed_device_changes_no_bit() {
    let bits = |chunks: &[Vec<f32>]| chunks.iter().flatten().map(|v| v.to_bits()).collect::<Vec<_>>();
    let (undisturbed, lost) = render(None);
    assert!(!lost);
    let expected = bits(&undisturbed);
    let mut losses = 0;
    for moment in 0..10 {
        let (chunks, lost) = render(Some(Duration::from_millis(5 + 37 * moment)));
        losses += u32::from(lost);
        assert!(bits(&chunks) == expected, "destroyed after {} ms", 5 + 37 * moment);
    }
    assert!(losses >= 5, "the device was lost in {losses} of 10 renders: the others were too short to tell");
}
