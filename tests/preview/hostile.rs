//! Hundreds of requests that must not be answered, and clients that do not behave: nothing changes, nothing leaks, and others
//! are served all the while.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;

use tempfile::tempdir;

use super::client::{Answer, Running, ask, get, raw, serve};
use crate::binary::{PATIENCE, cornell, wait_for};
use crate::cube_files::arrays;
use crate::cubes::{header, patterned};

/// Answers must not speak of this machine's files, and must carry what keeps browsers strict.
#[track_caller]
fn check(answer: &Answer, folder: &Path, what: &str) {
    let all = format!("{}\n{}", answer.head, String::from_utf8_lossy(&answer.body));
    let folder = folder.to_str().expect("UTF-8");
    assert!(!all.contains(folder) && !all.contains("/root") && !all.contains("/tmp"), "{what}: {all}");
    assert_eq!(answer.header("x-content-type-options"), Some("nosniff"), "{what}");
    assert!(answer.header("access-control-allow-origin").is_none(), "{what}");
}

#[test]
fn bad_requests_change_nothing() {
    let folder = tempdir().expect("folder");
    let cube = patterned(folder.path(), "cube.zarr", header([40, 30], [16, 16], 6));
    let (_server, address) = serve(cube.path(), "127.0.0.1:0");
    let before = arrays(cube.path());
    let picture = get(address, "/api/image").body;
    let mut refused = 0;
    let mut expect = |answer: Answer, status: &[u16], what: &str| {
        assert!(status.contains(&answer.status), "{what}: {answer:?}");
        check(&answer, folder.path(), what);
        refused += 1;
    };

    // Names that this server does not go by, origins that are not its own, tokens that are not its.
    let targets = ["/", "/api/status", "/api/image", "/api/spectrum?x=1&y=1", "/api/events", "/api/stop", "/nothing"];
    for target in targets {
        for host in
            ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "192.0.2.1", "[::ffff:1.2.3.4]", "*", ""]
        {
            for method in ["GET", "POST"] {
                expect(ask(address, method, target, &[("Host", host)]), &[400, 403], host);
            }
        }
        for origin in ["http://evil.example", "null", "http://localhost:1", "https://127.0.0.1", "file://"] {
            for method in ["GET", "POST"] {
                expect(ask(address, method, target, &[("Origin", origin)]), &[403], origin);
            }
        }
    }
    let own = format!("http://{address}");
    for control in ["pause", "resume", "stop", "save"] {
        let target = format!("/api/{control}");
        for token in
            ["", "0", "Bearer", "Bearer ", "Bearer 0", "Basic dXNlcjp1c2Vy", &format!("Bearer {}", "0".repeat(32))]
        {
            expect(ask(address, "POST", &target, &[("Authorization", token)]), &[403], token);
        }
        expect(ask(address, "POST", &target, &[("Sec-Fetch-Site", "cross-site"), ("Origin", &own)]), &[403], control);
        expect(ask(address, "GET", &target, &[]), &[405], control);
        // There is nothing to control.
        expect(ask(address, "POST", &target, &[("Origin", &own)]), &[409], control);
    }
    // Bodies, targets and headers of all sizes.
    for length in ["1025", "1000000000", "99999999999999999999", "-1", "x"] {
        let headers = [("Origin", own.as_str()), ("Content-Length", length)];
        expect_any(address, "POST", "/api/pause", &headers, &mut expect);
    }
    for length in [1100, 5000, 70_000] {
        expect_any(address, "GET", &format!("/api/status?{}", "a".repeat(length)), &[], &mut expect);
        expect_any(address, "GET", "/api/status", &[("X-Long", &"a".repeat(length * 100))], &mut expect);
    }
    // Paths out of the folder, and methods that are not there.
    for path in [
        "/../../etc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/api/../cube.zarr",
        "//etc/passwd",
        "/cube.zarr/zarr.json",
        "/.spectile",
        "/api",
        "/api/image/../../x",
        "/%00",
        "/\\..\\x",
    ] {
        expect_any(address, "GET", path, &[], &mut expect);
    }
    for method in ["PUT", "DELETE", "PATCH", "TRACE", "OPTIONS", "BREW"] {
        expect(ask(address, method, "/api/status", &[("Origin", &own)]), &[405], method);
    }
    // Numbers that are none, or not of this picture.
    for (name, others) in [("x", "y=1"), ("y", "x=1"), ("x1", "x=1&y=1"), ("y1", "x=1&y=1")] {
        for value in ["-1", "1e9", "4294967296", "x", "", "0x1", "1.5", "nan", "%00", "41", "1000000"] {
            let target = format!("/api/spectrum?{others}&{name}={value}");
            expect(ask(address, "GET", &target, &[]), &[400], &target);
        }
    }
    for query in [
        "scale=0",
        "scale=3",
        "scale=-8",
        "scale=131072",
        "scale=4294967296",
        "x0=40",
        "x0=9&x1=9",
        "x1=41",
        "y1=31",
        "y0=4294967295",
        "show=nothing",
        "show=channel",
        "show=channel&k=6",
        "show=channel&k=-1",
        "show=false&r=1&g=2",
        "show=false&r=1&g=2&b=6",
        "show=temperature&k=1",
        "format=bmp",
        "ev=x",
        "show=channel&k=18446744073709551616",
    ] {
        expect(ask(address, "GET", &format!("/api/image?{query}"), &[]), &[400], query);
    }
    for garbage in [
        "",
        "\r\n\r\n",
        "GET\r\n\r\n",
        "GET / HTTP/9.9\r\n\r\n",
        "\0\0\0\0\r\n\r\n",
        "GET / HTTP/1.1\r\n\r\n",
        "GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
    ] {
        let mut stream = TcpStream::connect(address).expect("connects");
        stream.write_all(garbage.as_bytes()).expect("sent");
        stream.shutdown(std::net::Shutdown::Write).expect("shut");
        let mut answer = String::new();
        let _ = stream.read_to_string(&mut answer);
        assert!(answer.is_empty() || answer.starts_with("HTTP/1.1 4"), "{garbage:?}: {answer}");
    }
    assert!(refused > 280, "{refused}");
    assert_eq!(get(address, "/api/image").body, picture);
    assert!(before == arrays(cube.path()), "the cube has changed");
}

/// Some of these the HTTP library itself answers, or closes the connection.
fn expect_any(
    address: std::net::SocketAddr,
    method: &str,
    target: &str,
    headers: &[(&str, &str)],
    expect: &mut impl FnMut(Answer, &[u16], &str),
) {
    let mut request = format!("{method} {target} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n");
    headers.iter().for_each(|(name, value)| request += &format!("{name}: {value}\r\n"));
    let Some(answer) = raw(address, (request + "\r\n").as_bytes()) else { return };
    let by_library = answer.header("x-content-type-options").is_none();
    if by_library {
        assert!((400..500).contains(&answer.status) && answer.body.is_empty(), "{target:.80}: {answer:?}");
    } else {
        expect(answer, &[400, 403, 404, 405, 409, 413, 414, 431], &format!("{target:.80}"));
    }
}

/// Who asks too often is told to slow down; who sends half a request, or takes no answer, holds up nobody.
#[test]
fn slow_and_greedy_clients_hold_up_nobody() {
    let folder = tempdir().expect("folder");
    let cube = patterned(folder.path(), "cube.zarr", header([2048, 1024], [128, 128], 3));
    let (_server, address) = serve(cube.path(), "127.0.0.1:0");
    let mut clients = Vec::new();
    for i in 0..20 {
        let mut slow = TcpStream::connect(address).expect("connects");
        let part = ["GET", "GET /api/status HTTP/1.1\r\nHo", "POST /api/stop HTTP/1.1\r\nContent-Length: 9\r\n"][i % 3];
        slow.write_all(part.as_bytes()).expect("sent");
        let mut deaf = TcpStream::connect(address).expect("connects");
        let target = ["/api/events", "/api/image?show=colour&format=f32"][i % 2];
        write!(deaf, "GET {target} HTTP/1.1\r\nHost: {address}\r\n\r\n").expect("sent");
        clients.push((slow, deaf));
    }
    assert_eq!(get(address, "/api/spectrum?x=1&y=1").status, 200);
    // Served before the server has had enough of the last that came, not after.
    let (last, _) = &mut clients[19];
    last.set_nonblocking(true).expect("set");
    assert!(last.read(&mut [0; 1]).is_err_and(|e| e.kind() == std::io::ErrorKind::WouldBlock), "it is closed");
    last.set_nonblocking(false).expect("set");
    // Those that never finish their headers are closed.
    for (slow, _) in &mut clients {
        slow.set_read_timeout(Some(PATIENCE)).expect("set");
        let mut rest = Vec::new();
        let closed = slow.read_to_end(&mut rest);
        assert!(closed.is_ok() || closed.is_err_and(|e| e.kind() == std::io::ErrorKind::ConnectionReset));
    }
    drop(clients);

    // More connections than there is room for: some are refused, and there is room again when they have gone.
    let mut many: Vec<_> = (0..100).map(|_| TcpStream::connect(address).expect("connects")).collect();
    let mut first = [0; 12];
    many[99].set_read_timeout(Some(PATIENCE)).expect("set");
    let answered = many[99].read_exact(&mut first);
    assert!(answered.is_ok() && first == *b"HTTP/1.1 503", "the hundredth connection was served: {answered:?}");
    drop(many);
    let status = format!("GET /api/status HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
    wait_for("room", || raw(address, status.as_bytes()).filter(|answer| answer.status == 200));

    // One connection that asks and asks, and then is closed.
    let mut stream = TcpStream::connect(address).expect("connects");
    let request = |more: &str| format!("GET /api/nothing HTTP/1.1\r\nHost: {address}\r\n{more}\r\n");
    let requests = request("").repeat(4000) + &request("Connection: close\r\n");
    let mut reader = stream.try_clone().expect("cloned");
    let reads = std::thread::spawn(move || {
        reader.set_read_timeout(Some(PATIENCE)).expect("set");
        let mut all = Vec::new();
        let _ = reader.read_to_end(&mut all);
        String::from_utf8_lossy(&all).matches("HTTP/1.1 429").count()
    });
    let _ = stream.write_all(requests.as_bytes());
    assert!(reads.join().expect("no panic") > 100);
}

/// An address that others can reach: nothing without the token, which is in the address that is printed.
#[test]
fn elsewhere_everything_needs_the_token() {
    let folder = tempdir().expect("folder");
    let cube = patterned(folder.path(), "cube.zarr", header([40, 30], [16, 16], 6));
    let (server, address) = serve(cube.path(), "0.0.0.0:0");
    for target in ["/", "/api/status", "/api/image", "/api/events", "/?token=0"] {
        let answer = ask(address, "GET", target, &[]);
        assert_eq!(answer.status, 401, "{target}");
        check(&answer, folder.path(), target);
    }
    assert!(server.url().ends_with(&format!("/?token={}", server.token())) && server.token().len() == 32);
    let front = ask(address, "GET", &format!("/?token={}", server.token()), &[]);
    assert_eq!((front.status, front.header("location")), (303, Some("/")));
    let cookie = front.header("set-cookie").expect("a cookie");
    assert!(cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"));
    let cookie = cookie.split(';').next().expect("a pair");
    assert_eq!(ask(address, "GET", "/", &[("Cookie", cookie)]).status, 200);
    assert_eq!(ask(address, "GET", "/api/status", &[("Cookie", cookie)]).status, 200);
    assert_eq!(
        ask(address, "GET", "/api/status", &[("Authorization", &format!("Bearer {}", server.token()))]).status,
        200
    );
}

/// A render that is asked for hundreds of things it must not do goes on, and ends with the same bytes.
#[test]
fn a_render_is_not_disturbed() {
    let folder = tempdir().expect("folder");
    let scene = cornell();
    let arguments = |output| {
        let scene = scene.to_str().expect("UTF-8");
        ["render", scene, "-o", output, "--size", "32x32", "--set", "channels.equal.count=20", "--spp", "192", "--json"]
    };
    let render = [&arguments("watched.zarr")[..], &["--listen", "127.0.0.1:0"]].concat();
    let running = Running::start(folder.path(), &render);
    for _ in 0..60 {
        for control in ["pause", "stop", "save"] {
            let target = format!("/api/{control}");
            // It may come to its end meanwhile.
            let host = running.address.to_string();
            for bad in [("Origin", "http://evil.example"), ("Authorization", "Bearer 0")] {
                let request = format!(
                    "POST {target} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{}: {}\r\n\r\n",
                    bad.0, bad.1
                );
                let Ok(mut stream) = TcpStream::connect(running.address) else { continue };
                let mut answer = String::new();
                let _ = stream.write_all(request.as_bytes());
                let _ = stream.read_to_string(&mut answer);
                assert!(
                    answer.is_empty() || answer.starts_with("HTTP/1.1 403") || answer.starts_with("HTTP/1.1 429"),
                    "{answer}"
                );
            }
        }
    }
    let (code, events) = running.ends();
    assert_eq!(code, Some(0), "{events:?}");
    assert!(!events.iter().any(|event| event["event"] == "paused"));
    let alone = crate::binary::command(folder.path(), &arguments("alone.zarr")).output().expect("runs");
    assert!(alone.status.success());
    assert!(arrays(&folder.path().join("watched.zarr")) == arrays(&folder.path().join("alone.zarr")));
}
