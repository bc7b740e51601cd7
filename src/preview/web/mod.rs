//! The web page: a small HTTP server on a thread of its own. docs/http.md documents what it serves.
//!
//! One thread accepts and answers; what reads files or encodes pictures runs on two more. Nobody who renders is ever waited
//! for, or waits: see [`Feed`].

mod api;
mod events;
mod guard;
mod image;
mod page;
mod relight;

use std::io::{ErrorKind, Write};
use std::net::SocketAddr;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use axum::Router;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::runtime::Runtime;
use tokio::sync::{Semaphore, watch};
use tokio_io_timeout::TimeoutStream;

use self::guard::{Guard, Peer};
use super::Feed;
use crate::{Error, Result};

/// Connections at a time; of those, so many may listen to events.
const CONNECTIONS: usize = 64;
const LISTENERS: usize = 32;
/// Files are read and pictures made for so many requests at a time.
const READERS: usize = 2;
/// For a request's headers, and for a client that does not take what it has asked for.
const HEADERS_WITHIN: Duration = Duration::from_secs(10);
const TAKEN_WITHIN: Duration = Duration::from_secs(20);
/// The page learns of news at most so often.
const NEWS_EVERY: Duration = Duration::from_millis(50);

/// What the page says about the cube beside what is in the feed and in the cube itself.
#[derive(Debug, Clone)]
pub struct About {
    /// A name for people, without a path.
    pub name: String,
    /// EV that the page begins with, if not automatic.
    pub exposure: Option<f64>,
    /// Whether there is a render to pause, stop and save.
    pub controls: bool,
}

/// What all requests share.
struct App {
    feed: Arc<Feed>,
    about: About,
    guard: Guard,
    /// The revision published last.
    news: watch::Receiver<u64>,
    readers: Semaphore,
    listeners: Arc<Semaphore>,
    thermometers: image::Thermometers,
    relighting: relight::Relighting,
    /// Requests under way, events included, and when the last one ended.
    busy: AtomicUsize,
    last_request: std::sync::Mutex<Option<Instant>>,
    began: Instant,
}

/// The running server. Dropping it ends it at once, [`Server::finish`] in order.
pub struct Server {
    app: Arc<App>,
    url: String,
    ending: Arc<AtomicBool>,
    runtime: Option<Runtime>,
    end: watch::Sender<bool>,
}

impl Server {
    /// Listens on `address`; whoever can reach it may look, with the token where that is not this machine alone.
    pub fn start(address: SocketAddr, feed: Arc<Feed>, about: About) -> Result<Server> {
        Server::start_behind(&[], address, feed, about)
    }

    /// The same behind proxies that go by these names, `NAME` or `NAME:PORT`: then everybody needs the token.
    pub fn start_behind(proxies: &[String], address: SocketAddr, feed: Arc<Feed>, about: About) -> Result<Server> {
        let listener = std::net::TcpListener::bind(address).map_err(|error| cannot_listen(address, &error))?;
        let address = listener.local_addr().map_err(|error| cannot_listen(address, &error))?;
        listener.set_nonblocking(true).map_err(|error| cannot_listen(address, &error))?;
        let guard = Guard::new(address, proxies)?;
        let url = match guard.needs_token() {
            false => format!("http://{address}/"),
            true => format!("http://{address}/?token={}", guard.token()),
        };
        let failed = |error: std::io::Error| Error::Internal(format!("the web server cannot start: {error}"));
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .max_blocking_threads(READERS)
            .thread_name("web")
            .enable_all()
            .build()
            .map_err(failed)?;
        let (news_sender, news) = watch::channel(0);
        let app = Arc::new(App {
            feed: Arc::clone(&feed),
            about,
            guard,
            news,
            readers: Semaphore::new(READERS),
            listeners: Arc::new(Semaphore::new(LISTENERS)),
            thermometers: image::Thermometers::default(),
            relighting: relight::Relighting::default(),
            busy: AtomicUsize::new(0),
            last_request: std::sync::Mutex::new(None),
            began: Instant::now(),
        });
        let (end, ended) = watch::channel(false);
        let router = api::router(&app);
        let entered = runtime.enter();
        let listener = TcpListener::from_std(listener).map_err(failed)?;
        drop(entered);
        runtime.spawn(accept(listener, router, ended));

        let ending = Arc::new(AtomicBool::new(false));
        let stop = Arc::clone(&ending);
        // From the feed, on which threads wait, to a channel, on which tasks do.
        let bridge = move || {
            let mut revision = 0;
            while !stop.load(Ordering::SeqCst) {
                revision = feed.wait(revision, Duration::from_millis(500)).revision;
                news_sender.send_if_modified(|known| revision != std::mem::replace(known, revision));
                thread::sleep(NEWS_EVERY);
            }
        };
        thread::Builder::new().name("web news".into()).spawn(bridge).map_err(failed)?;
        Ok(Server { app, url, ending, runtime: Some(runtime), end })
    }

    /// What to type into a browser; with the token where one is needed to look.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// What controls need from whoever is not the page itself.
    pub fn token(&self) -> &str {
        self.app.guard.token()
    }

    /// Gives whoever watches a moment to see the end that the feed has published, and ends.
    pub fn finish(self) {
        const AT_MOST: Duration = Duration::from_secs(2);
        const QUIET: Duration = Duration::from_millis(400);
        let began = Instant::now();
        let quiet = |since: Option<Instant>| since.is_none_or(|since| since.elapsed() > QUIET);
        while began.elapsed() < AT_MOST {
            let last = *self.app.last_request.lock().unwrap_or_else(|e| e.into_inner());
            if self.app.busy.load(Ordering::SeqCst) == 0 && quiet(last) {
                break;
            }
            thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.ending.store(true, Ordering::SeqCst);
        // Nobody is there to hear it only when the listener has failed.
        let _ = self.end.send(true);
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}

fn cannot_listen(address: SocketAddr, error: &std::io::Error) -> Error {
    let what = match error.kind() {
        ErrorKind::AddrInUse => "another process listens there already; take another port, or 0 for any that is free",
        ErrorKind::AddrNotAvailable => "this machine has no such address; 127.0.0.1 is itself, 0.0.0.0 all it has",
        ErrorKind::PermissionDenied => "not permitted; ports below 1024 usually are root's",
        _ => return Error::Usage(format!("--listen {address}: {error}")),
    };
    Error::Usage(format!("--listen {address}: {what}"))
}

/// Takes connections until the end.
async fn accept(listener: TcpListener, router: Router, mut ended: watch::Receiver<bool>) {
    let free = Arc::new(Semaphore::new(CONNECTIONS));
    loop {
        let accepted = tokio::select! {
            accepted = listener.accept() => accepted,
            _ = ended.changed() => return,
        };
        let Ok((stream, peer)) = accepted else {
            // The process has too many files open, or the client has gone already.
            tokio::time::sleep(Duration::from_millis(50)).await;
            continue;
        };
        let Ok(place) = Arc::clone(&free).try_acquire_owned() else {
            refuse(stream);
            continue;
        };
        let router = router.clone().layer(axum::Extension(Peer(peer.ip())));
        tokio::spawn(async move {
            serve(stream, router).await;
            drop(place);
        });
    }
}

fn refuse(stream: TcpStream) {
    // As the socket of the system: tokio does not know yet that a new one can be written to. Whoever does not get this sees that the
    // connection is closed.
    let Ok(mut stream) = stream.into_std() else { return };
    let _ = stream.write(b"HTTP/1.1 503 Service Unavailable\r\nconnection: close\r\ncontent-length: 0\r\n\r\n");
}

/// Serves a connection until either side has had enough.
async fn serve(stream: TcpStream, router: Router) {
    let _ = stream.set_nodelay(true);
    let mut stream = TimeoutStream::new(stream);
    stream.set_write_timeout(Some(TAKEN_WITHIN));
    let connection = hyper::server::conn::http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEADERS_WITHIN)
        .max_buf_size(64 << 10)
        .serve_connection(TokioIo::new(Box::pin(stream)), TowerToHyperService::new(router));
    // An error is a client that misbehaved or went away: its loss.
    let _ = pin!(connection).await;
}
