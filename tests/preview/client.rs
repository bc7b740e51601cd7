//! A plain HTTP client, and servers to talk to.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Child, Stdio};
use std::sync::Arc;
use std::time::Duration;

use serde_json::Value;
use spectile::cube::Cube;
use spectile::preview::web::{About, Server};
use spectile::preview::{Feed, follow};

use crate::binary::{PATIENCE, command, wait_for};

/// An answer: status, headers in lower case, body.
#[derive(Debug)]
pub struct Answer {
    pub status: u16,
    pub head: String,
    pub body: Vec<u8>,
}

impl Answer {
    pub fn text(&self) -> &str {
        std::str::from_utf8(&self.body).expect("UTF-8")
    }

    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|e| panic!("{e}: {self:?}"))
    }

    pub fn floats(&self) -> Vec<f32> {
        self.body.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
    }

    pub fn header(&self, name: &str) -> Option<&str> {
        self.head.lines().find_map(|line| line.strip_prefix(&format!("{name}: ")))
    }
}

/// Sends bytes as they are and reads until the server closes; `None` where it closed without an answer.
pub fn raw(address: SocketAddr, request: &[u8]) -> Option<Answer> {
    let mut stream = TcpStream::connect(address).expect("connects");
    stream.set_read_timeout(Some(PATIENCE)).expect("set");
    // It may be closed before all is sent.
    let _ = stream.write_all(request);
    let mut all = Vec::new();
    let _ = stream.read_to_end(&mut all);
    let end = all.windows(4).position(|four| four == b"\r\n\r\n")?;
    let head = String::from_utf8_lossy(&all[..end]).into_owned();
    let status = head.split(' ').nth(1)?.parse().ok()?;
    let lower = |line: &str| match line.split_once(": ") {
        Some((name, value)) => format!("{}: {value}\n", name.to_lowercase()),
        None => format!("{line}\n"),
    };
    Some(Answer { status, head: head.lines().map(lower).collect(), body: all[end + 4..].to_vec() })
}

/// A request with these headers, and `Host` unless it is among them.
pub fn ask(address: SocketAddr, method: &str, target: &str, headers: &[(&str, &str)]) -> Answer {
    let mut request = format!("{method} {target} HTTP/1.1\r\nConnection: close\r\n");
    if !headers.iter().any(|(name, _)| name.eq_ignore_ascii_case("host")) {
        request += &format!("Host: {address}\r\n");
    }
    for (name, value) in headers {
        request += &format!("{name}: {value}\r\n");
    }
    raw(address, (request + "\r\n").as_bytes()).unwrap_or_else(|| panic!("no answer to {method} {target} {headers:?}"))
}

/// A request with a body, and with the token where there is one.
pub fn put(address: SocketAddr, target: &str, token: Option<&str>, body: &str) -> Answer {
    let length = body.len().to_string();
    let bearer = token.map(|token| format!("Bearer {token}")).unwrap_or_default();
    let mut request =
        format!("PUT {target} HTTP/1.1\r\nConnection: close\r\nHost: {address}\r\nContent-Length: {length}\r\n");
    if token.is_some() {
        request += &format!("Authorization: {bearer}\r\n");
    }
    raw(address, (request + "\r\n" + body).as_bytes()).unwrap_or_else(|| panic!("no answer to PUT {target}"))
}

pub fn get(address: SocketAddr, target: &str) -> Answer {
    let answer = ask(address, "GET", target, &[]);
    assert_eq!(answer.status, 200, "{target}: {}", String::from_utf8_lossy(&answer.body));
    answer
}

/// The address in a URL that was printed.
pub fn address_in(url: &str) -> SocketAddr {
    let rest = url.strip_prefix("http://").expect("a URL");
    rest.split('/').next().expect("a host").parse().expect("an address")
}

/// A cube on disk, served in this process.
pub fn serve(path: &Path, listen: &str) -> (Server, SocketAddr) {
    let feed = Feed::of_cube(Cube::open(path).expect("a cube"));
    follow(Cube::open(path).expect("a cube"), &feed).expect("followed");
    serve_feed(feed, listen)
}

pub fn serve_feed(feed: Arc<Feed>, listen: &str) -> (Server, SocketAddr) {
    let about = About { name: "cube.zarr".into(), exposure: None, controls: false };
    let server = Server::start(listen.parse().expect("an address"), feed, about).expect("listens");
    let address = address_in(server.url());
    (server, SocketAddr::new([127, 0, 0, 1].into(), address.port()))
}

/// The events of a server, as they come.
pub struct Events(BufReader<TcpStream>);

impl Events {
    pub fn listen(address: SocketAddr) -> Events {
        let mut stream = TcpStream::connect(address).expect("connects");
        stream.set_read_timeout(Some(PATIENCE)).expect("set");
        write!(stream, "GET /api/events HTTP/1.1\r\nHost: {address}\r\n\r\n").expect("sent");
        Events(BufReader::new(stream))
    }
}

impl Iterator for Events {
    type Item = (String, Value);

    /// The next event's name and data; comments and the sizes of chunks are passed over.
    fn next(&mut self) -> Option<(String, Value)> {
        let mut name = String::new();
        loop {
            let mut line = String::new();
            if self.0.read_line(&mut line).ok()? == 0 {
                return None;
            }
            let line = line.trim_end();
            if let Some(event) = line.strip_prefix("event: ") {
                name = event.to_owned();
            } else if let Some(data) = line.strip_prefix("data: ") {
                return Some((name, serde_json::from_str(data).expect("JSON")));
            }
        }
    }
}

/// The real binary at work, which says where it listens.
pub struct Running {
    pub child: Child,
    pub address: SocketAddr,
    pub token: String,
    pub url: String,
    lines: Option<std::thread::JoinHandle<Vec<Value>>>,
}

impl Running {
    pub fn start(folder: &Path, arguments: &[&str]) -> Running {
        let mut child = command(folder, arguments).stdout(Stdio::piped()).spawn().expect("runs");
        let mut lines = BufReader::new(child.stdout.take().expect("piped")).lines();
        let event = lines
            .by_ref()
            .map(|line| serde_json::from_str::<Value>(&line.expect("UTF-8")).expect("JSON"))
            .find(|event| event["event"] == "listening")
            .expect("it listens");
        let url = event["url"].as_str().expect("a URL").to_owned();
        let rest = move || lines.map(|line| serde_json::from_str(&line.expect("UTF-8")).expect("JSON")).collect();
        Running {
            child,
            address: address_in(&url),
            token: event["token"].as_str().expect("a token").to_owned(),
            url,
            lines: Some(std::thread::spawn(rest)),
        }
    }

    pub fn status(&self) -> Value {
        get(self.address, "/api/status").json()
    }

    /// Waits until the status is `such`; the server answers 200 requests a second, so asks less often.
    pub fn until(&self, such: impl Fn(&Value) -> bool) -> Value {
        wait_for("another status", || {
            let status = Some(self.status()).filter(&such);
            if status.is_none() {
                std::thread::sleep(Duration::from_millis(20));
            }
            status
        })
    }

    pub fn control(&self, what: &str) -> u16 {
        let bearer = format!("Bearer {}", self.token);
        ask(self.address, "POST", &format!("/api/{what}"), &[("Authorization", &bearer)]).status
    }

    /// The exit code, and the events after `listening`.
    pub fn ends(mut self) -> (Option<i32>, Vec<Value>) {
        let code = self.child.wait().expect("ends").code();
        (code, self.lines.take().map(|lines| lines.join().expect("no panic")).unwrap_or_default())
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
