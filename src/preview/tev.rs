//! Streams the picture to tev, an image viewer that listens for it (protocol by `tev_client`), tile by tile.

use std::convert::Infallible;
use std::io::ErrorKind;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

use super::{Feed, Snapshot};
use crate::cube::{Grid, Window};
use crate::{Error, Result};

const CONNECTED_WITHIN: Duration = Duration::from_secs(1);
/// For a viewer that does not take what it is sent.
const TAKEN_WITHIN: Duration = Duration::from_secs(5);
/// Between attempts to connect, and between rounds of updates.
const AGAIN_AFTER: Duration = Duration::from_secs(1);
const PACE: Duration = Duration::from_millis(200);
/// What is left at the end is sent within this time, or not at all.
const LAST_WITHIN: Duration = Duration::from_secs(5);

const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// A thread that keeps one image of tev up to date, and connects again whenever tev comes back.
pub struct Tev {
    /// Closed when the thread is to end.
    open: Sender<Infallible>,
    /// Closed when it has.
    done: Receiver<Infallible>,
}

impl Tev {
    /// Shows what `feed` publishes as the image `name` in the tev at `address`, HOST:PORT. Whether that is there already is
    /// the second value; if not, it is looked for once a second.
    pub fn start(address: String, name: String, feed: Arc<Feed>) -> Result<(Tev, bool)> {
        let first = connect(&address);
        let there = first.is_ok();
        let ((open, ended), (working, done)) = (bounded(0), bounded::<Infallible>(0));
        let work = move || {
            let _working = working;
            Stream { address, name, feed, ended }.run(first.ok());
        };
        let spawned = thread::Builder::new().name("tev".into()).spawn(work);
        spawned.map_err(|error| Error::Internal(format!("no thread for tev: {error}")))?;
        Ok((Tev { open, done }, there))
    }

    /// Sends what is left, if tev takes it soon.
    pub fn finish(self) {
        drop(self.open);
        // Either way it is over: the thread has ended, or its time is up.
        let _ = self.done.recv_timeout(LAST_WITHIN);
    }
}

struct Stream {
    address: String,
    name: String,
    feed: Arc<Feed>,
    ended: Receiver<Infallible>,
}

/// A tev that has the image.
struct Connection {
    client: TevClient,
    /// The same connection, to notice that it is closed.
    stream: TcpStream,
    /// The last revision that tev has.
    revision: u64,
}

impl Stream {
    fn run(&self, mut connected: Option<TcpStream>) {
        let mut connection = None;
        let mut revision = 0;
        // How long to wait before the next round, unless the end comes first.
        let mut pause = Duration::ZERO;
        loop {
            let ending = matches!(self.ended.recv_timeout(pause), Err(RecvTimeoutError::Disconnected));
            let snapshot = self.feed.wait(revision, if ending { Duration::ZERO } else { AGAIN_AFTER });
            let sent = match &mut connection {
                Some(connection) => self.update(connection, &snapshot),
                // Before there is a cube there is nothing to show.
                None if grid(&snapshot).is_none() => {
                    if ending {
                        return;
                    }
                    revision = snapshot.revision;
                    pause = Duration::ZERO;
                    continue;
                }
                None => {
                    let stream = connected.take().map_or_else(|| connect(&self.address), Ok);
                    stream.and_then(|stream| {
                        let opened = self.open(stream, &snapshot)?;
                        opened.map_or(Ok(()), |opened| self.update(connection.insert(opened), &snapshot))
                    })
                }
            };
            if sent.is_err() {
                connection = None;
            }
            if ending {
                return;
            }
            pause = if connection.is_some() { PACE } else { AGAIN_AFTER };
            if connection.is_some() {
                revision = snapshot.revision;
            }
        }
    }

    /// Makes the image, once there is a cube.
    fn open(&self, stream: TcpStream, snapshot: &Snapshot) -> std::io::Result<Option<Connection>> {
        let Some(grid) = grid(snapshot) else { return Ok(None) };
        let mut client = TevClient::wrap(stream.try_clone()?);
        let [width, height] = grid.size;
        client.send(PacketCreateImage {
            image_name: &self.name,
            grab_focus: false,
            width,
            height,
            channel_names: &CHANNELS,
        })?;
        Ok(Some(Connection { client, stream, revision: 0 }))
    }

    /// Sends the tiles that have changed.
    fn update(&self, connection: &mut Connection, snapshot: &Snapshot) -> std::io::Result<()> {
        // tev says nothing; what can be read is the end of the connection.
        match connection.stream.peek(&mut [0]) {
            Ok(0) => return Err(ErrorKind::ConnectionReset.into()),
            Err(error) if !matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => return Err(error),
            _ => {}
        }
        let Some(grid) = grid(snapshot) else { return Ok(()) };
        let (revision, ranges) = self.feed.changes(connection.revision);
        for tile in ranges.into_iter().flatten() {
            let rect = grid.rect(tile);
            // A tile that cannot be read now comes with its next unit.
            let Some(Ok(window)) = with_state(snapshot, |state| state.colour(rect, 1)) else { continue };
            let Window { size: [width, height], values, .. } = window;
            connection.client.send(PacketUpdateImage {
                image_name: &self.name,
                grab_focus: false,
                channel_names: &CHANNELS,
                channel_offsets: &[0, 1, 2],
                channel_strides: &[3; 3],
                x: rect.x0,
                y: rect.y0,
                width,
                height,
                data: &values,
            })?;
        }
        connection.revision = revision;
        Ok(())
    }
}

fn connect(address: &str) -> std::io::Result<TcpStream> {
    let mut last = ErrorKind::NotFound.into();
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECTED_WITHIN) {
            Ok(stream) => {
                stream.set_write_timeout(Some(TAKEN_WITHIN))?;
                stream.set_read_timeout(Some(Duration::from_millis(1)))?;
                stream.set_nodelay(true)?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

fn grid(snapshot: &Snapshot) -> Option<Grid> {
    with_state(snapshot, |state| state.cube().grid())
}

fn with_state<T>(snapshot: &Snapshot, read: impl FnOnce(crate::cube::CubeState<'_>) -> T) -> Option<T> {
    let (mut read, mut result) = (Some(read), None);
    snapshot.source.as_ref()?.with_state(&mut |state| result = read.take().map(|read| read(state)));
    result
}
