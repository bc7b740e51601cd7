//! What is sent to tev, by a decoder of its packets that shares nothing with the one that makes them.

use std::collections::BTreeMap;
use std::io::{BufReader, Read};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};

use spectile::cube::Cube;
use spectile::preview::{Feed, Tev, follow};
use tempfile::tempdir;

use super::client::Running;
use crate::binary::{PATIENCE, cornell};
use crate::cubes::{Written, create, header, pattern, patterned, unit};

/// A body: little-endian numbers, strings that end with a zero.
struct Body<'a>(&'a [u8]);

impl Body<'_> {
    fn bytes(&mut self, n: usize) -> &[u8] {
        let (head, rest) = self.0.split_at(n);
        self.0 = rest;
        head
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.bytes(4).try_into().expect("four"))
    }

    fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.bytes(8).try_into().expect("eight"))
    }

    fn string(&mut self) -> String {
        let end = self.0.iter().position(|byte| *byte == 0).expect("an end");
        let text = std::str::from_utf8(&self.0[..end]).expect("UTF-8").to_owned();
        self.0 = &self.0[end + 1..];
        text
    }
}

/// Size, and channels by name.
type Image = ([u32; 2], BTreeMap<String, Vec<f32>>);

/// The images of a viewer, by name.
#[derive(Default)]
struct Viewer {
    images: BTreeMap<String, Image>,
    updates: usize,
}

impl Viewer {
    /// Reads and obeys one packet: length with itself, type, body.
    fn obey(&mut self, stream: &mut impl Read) -> std::io::Result<()> {
        let mut length = [0; 4];
        stream.read_exact(&mut length)?;
        let mut packet = vec![0; u32::from_le_bytes(length) as usize - 4];
        stream.read_exact(&mut packet)?;
        let mut body = Body(&packet[1..]);
        match packet[0] {
            4 => {
                assert_eq!(body.bytes(1)[0], 0, "grabs no focus");
                let (name, size) = (body.string(), [body.u32(), body.u32()]);
                let pixels = size[0] as usize * size[1] as usize;
                let channels = (0..body.u32()).map(|_| (body.string(), vec![0.0; pixels])).collect();
                self.images.insert(name, (size, channels));
            }
            6 => {
                assert_eq!(body.bytes(1)[0], 0, "grabs no focus");
                let name = body.string();
                let names: Vec<String> = (0..body.u32()).map(|_| body.string()).collect();
                let [x, y, width, height] = [(); 4].map(|()| body.u32());
                let offsets: Vec<u64> = names.iter().map(|_| body.u64()).collect();
                let strides: Vec<u64> = names.iter().map(|_| body.u64()).collect();
                let data: Vec<f32> = body.0.as_chunks().0.iter().map(|four| f32::from_le_bytes(*four)).collect();
                body.0 = &[];
                let (size, channels) = self.images.get_mut(&name).expect("an image that was made");
                assert!(x + width <= size[0] && y + height <= size[1]);
                for ((name, offset), stride) in names.iter().zip(offsets).zip(strides) {
                    let channel = channels.get_mut(name).expect("a channel that was named");
                    for i in 0..width * height {
                        let at = (y + i / width) * size[0] + x + i % width;
                        channel[at as usize] = data[(offset + u64::from(i) * stride) as usize];
                    }
                }
                self.updates += 1;
            }
            other => panic!("packet {other}"),
        }
        assert!(body.0.is_empty(), "nothing is left");
        Ok(())
    }

    fn until(&mut self, stream: &mut impl Read, such: impl Fn(&Viewer) -> bool) {
        let began = Instant::now();
        while !such(self) {
            assert!(began.elapsed() < PATIENCE);
            self.obey(stream).expect("a packet");
        }
    }

    /// Whether the image shows the cube's preview, bit by bit.
    fn shows(&self, name: &str, cube: &Cube) -> bool {
        let Some((size, channels)) = self.images.get(name) else { return false };
        let preview = cube.preview().expect("preview");
        assert_eq!(*size, preview.size);
        let bits = |v: f32| if v.is_nan() { 0 } else { v.to_bits() };
        ["R", "G", "B"].iter().enumerate().all(|(c, name)| {
            let shown = channels[*name].iter().map(|v| bits(*v));
            shown.eq(preview.rgb.iter().skip(c).step_by(3).map(|v| bits(*v)))
        })
    }
}

fn accept(listener: &TcpListener) -> BufReader<TcpStream> {
    let (stream, _) = listener.accept().expect("a connection");
    stream.set_read_timeout(Some(PATIENCE)).expect("set");
    BufReader::new(stream)
}

fn watch(cube: &Written, address: SocketAddr) -> (Tev, bool) {
    let feed = Feed::of_cube(Cube::open(cube.path()).expect("a cube"));
    follow(Cube::open(cube.path()).expect("a cube"), &feed).expect("followed");
    let kept = Arc::clone(&feed);
    let started = Tev::start(address.to_string(), "cube.zarr".into(), feed).expect("a thread");
    // The feed lives as long as the test.
    std::mem::forget(kept);
    started
}

#[test]
fn tev_gets_every_tile_bit_for_bit_and_again_when_it_comes_back() {
    let folder = tempdir().expect("folder");
    let cube = patterned(folder.path(), "cube.zarr", header([100, 70], [32, 24], 9));
    let listener = TcpListener::bind("127.0.0.1:0").expect("binds");
    let address = listener.local_addr().expect("an address");
    let (tev, there) = watch(&cube, address);
    assert!(there);
    let mut viewer = Viewer::default();
    let mut stream = accept(&listener);
    viewer.until(&mut stream, |viewer| viewer.shows("cube.zarr", &cube));
    let tiles = cube.grid().count() as usize;
    assert_eq!(viewer.updates, tiles);
    // A unit more of one tile: that tile, and no other.
    cube.merge_unit(5, 1, &unit(&cube, 5, |x, y, k| 3.0 * pattern(x, y, k))).expect("merged");
    viewer.until(&mut stream, |viewer| viewer.shows("cube.zarr", &cube));
    assert_eq!(viewer.updates, tiles + 1);
    // The viewer is closed, and another one started.
    drop(stream);
    let mut second = Viewer::default();
    let mut stream = accept(&listener);
    second.until(&mut stream, |viewer| viewer.shows("cube.zarr", &cube));
    assert_eq!(second.updates, tiles);
    tev.finish();
}

#[test]
fn a_tev_that_comes_late_gets_all_and_one_that_is_stuck_holds_up_nobody() {
    let folder = tempdir().expect("folder");
    // Twelve times what the buffers of a connection take.
    let cube = create(folder.path(), "cube.zarr", header([2048, 1024], [256, 256], 3));
    for tile in 0..cube.grid().count() {
        cube.merge_unit(tile, 1, &unit(&cube, tile, pattern)).expect("merged");
    }
    let address = {
        let free = TcpListener::bind("127.0.0.1:0").expect("binds");
        free.local_addr().expect("an address")
    };
    let (tev, there) = watch(&cube, address);
    assert!(!there);
    std::thread::sleep(Duration::from_millis(300));
    let listener = TcpListener::bind(address).expect("binds");
    // It takes the connection, and nothing more.
    let stuck = accept(&listener);
    std::thread::sleep(Duration::from_secs(1));
    drop(stuck);
    let mut viewer = Viewer::default();
    let mut stream = accept(&listener);
    viewer.until(&mut stream, |viewer| viewer.shows("cube.zarr", &cube));
    // Stuck at the end, with more to come than a connection takes: this returns, though nobody reads on.
    for tile in 0..cube.grid().count() {
        cube.merge_unit(tile, 1, &unit(&cube, tile, pattern)).expect("merged");
    }
    tev.finish();
    drop(stream);
}

/// A render with both sinks: what tev has at the end is the picture of the cube.
#[test]
fn a_render_streams_to_tev_to_its_end() {
    let folder = tempdir().expect("folder");
    let listener = TcpListener::bind("127.0.0.1:0").expect("binds");
    let address = listener.local_addr().expect("an address").to_string();
    let viewer = std::thread::spawn(move || {
        let (mut viewer, mut stream) = (Viewer::default(), accept(&listener));
        while viewer.obey(&mut stream).is_ok() {}
        viewer
    });
    let scene = cornell();
    let small = ["--size", "40x24", "--tile", "16", "--set", "channels.equal.count=20", "--spp", "64", "--json"];
    let render =
        ["render", scene.to_str().expect("UTF-8"), "-o", "cube.zarr", "--listen", "127.0.0.1:0", "--tev", &address];
    let running = Running::start(folder.path(), &[&render[..], &small].concat());
    assert_eq!(running.ends().0, Some(0));
    let viewer = viewer.join().expect("no panic");
    let cube = Cube::open(&folder.path().join("cube.zarr")).expect("a cube");
    assert_eq!(cube.progress().expect("progress").samples, [64, 64]);
    assert!(viewer.shows("cube.zarr", &cube), "{} updates", viewer.updates);
}
