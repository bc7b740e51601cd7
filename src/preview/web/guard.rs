//! Who may do what. A page of somebody else's, open in the same browser, can send requests here: what it can not do is
//! forge `Host` or `Origin`, or know the token.

use std::collections::HashMap;
use std::net::{IpAddr, SocketAddr};
use std::sync::Mutex;
use std::time::Instant;

use axum::http::header::{AUTHORIZATION, COOKIE, HOST, ORIGIN};
use axum::http::{HeaderMap, Method, StatusCode, Uri};

use crate::{Error, Result};

/// Requests by the second of one address, and how many it may save up.
const RATE: f64 = 200.0;
const BURST: f64 = 600.0;
/// Addresses that are remembered; when there are more, all begin anew.
const ADDRESSES: usize = 1024;
/// Bytes of a request's target.
const LONGEST_TARGET: usize = 1024;
/// Bytes of all its headers, names included; browsers send one or two thousand.
const LONGEST_HEADERS: usize = 32 << 10;

/// The other end of a connection.
#[derive(Debug, Clone, Copy)]
pub struct Peer(pub IpAddr);

/// Why a request is refused.
pub type Refusal = (StatusCode, &'static str);

pub struct Guard {
    token: String,
    cookie: String,
    /// Whether only this machine can connect.
    loopback: bool,
    host_name: Option<String>,
    /// Names by which a proxy is reached that passes requests on, in lower case. Whoever comes through it is not of this
    /// machine, though his connection is.
    public: Vec<String>,
    buckets: Mutex<HashMap<IpAddr, Bucket>>,
}

/// What an address may still ask for, and when that was counted.
struct Bucket {
    left: f64,
    counted: Instant,
}

impl Guard {
    pub fn new(address: SocketAddr, public: &[String]) -> Result<Guard> {
        let mut secret = [0u8; 16];
        getrandom::fill(&mut secret).map_err(|error| Error::Internal(format!("no random token: {error}")))?;
        Ok(Guard {
            token: secret.iter().map(|byte| format!("{byte:02x}")).collect(),
            // Cookies do not know ports.
            cookie: format!("spectile_{}", address.port()),
            loopback: address.ip().is_loopback(),
            public: public.iter().map(|name| name.to_lowercase()).collect(),
            host_name: std::fs::read_to_string("/proc/sys/kernel/hostname").ok().map(|name| name.trim().to_lowercase()),
            buckets: Mutex::new(HashMap::new()),
        })
    }

    pub fn token(&self) -> &str {
        &self.token
    }

    /// The header that makes a browser remember the token, for this page alone.
    pub fn set_cookie(&self) -> String {
        format!("{}={}; HttpOnly; SameSite=Strict; Path=/", self.cookie, self.token)
    }

    /// Refuses what must not be answered. `peer` is `None` for a request that came in no connection.
    pub fn check(
        &self,
        method: &Method,
        uri: &Uri,
        headers: &HeaderMap,
        peer: Option<IpAddr>,
    ) -> std::result::Result<(), Refusal> {
        if peer.is_some_and(|peer| !self.take_turn(peer, Instant::now())) {
            return Err((StatusCode::TOO_MANY_REQUESTS, "too many requests; slow down"));
        }
        if uri.path_and_query().map_or(0, |target| target.as_str().len()) > LONGEST_TARGET {
            return Err((StatusCode::URI_TOO_LONG, "the address is too long"));
        }
        if headers.iter().map(|(name, value)| name.as_str().len() + value.len()).sum::<usize>() > LONGEST_HEADERS {
            return Err((StatusCode::REQUEST_HEADER_FIELDS_TOO_LARGE, "the headers are too long"));
        }
        let host = single(headers, HOST).ok_or((StatusCode::BAD_REQUEST, "one Host header is needed"))?;
        if !self.is_own_name(host) {
            return Err((StatusCode::FORBIDDEN, "this server goes by no such name; use its address"));
        }
        let origin = headers.contains_key(ORIGIN).then(|| single(headers, ORIGIN).unwrap_or("null"));
        if origin.is_some_and(|origin| !is_origin_of(origin, host) && !self.is_public_origin(origin)) {
            return Err((StatusCode::FORBIDDEN, "requests from other origins are refused"));
        }
        let site = headers.get("sec-fetch-site").map(|site| site.as_bytes());
        let from_elsewhere = site.is_some_and(|site| site != b"same-origin" && site != b"none");
        // A link from elsewhere may lead to the page, and to nothing else.
        let is_page = *method == Method::GET && uri.path() == "/";
        if from_elsewhere && !is_page {
            return Err((StatusCode::FORBIDDEN, "requests from other sites are refused"));
        }
        let presented = self.presents_token(uri, headers);
        if self.needs_token() && !presented && !self.has_cookie(headers) {
            return Err((StatusCode::UNAUTHORIZED, "the token is needed: open the address that was printed"));
        }
        // The page is of this origin, and where others can connect it has the cookie, too.
        if *method != Method::GET && *method != Method::HEAD && !presented && origin.is_none() {
            return Err((StatusCode::FORBIDDEN, "controls need the token (authorization: Bearer …), or the page"));
        }
        Ok(())
    }

    /// Whether others than those who work on this machine can connect.
    pub fn needs_token(&self) -> bool {
        !self.loopback || !self.public.is_empty()
    }

    /// Whether a page of `origin` came through the proxy, which may name another host to this server.
    fn is_public_origin(&self, origin: &str) -> bool {
        let name = origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"));
        name.is_some_and(|name| self.is_public(name))
    }

    /// One of the names that were allowed, with the port that was, if one was.
    fn is_public(&self, host: &str) -> bool {
        let host = host.to_lowercase();
        self.public.iter().any(|allowed| *allowed == host || *allowed == without_port(&host))
    }

    /// Whether the request itself carries the token.
    fn presents_token(&self, uri: &Uri, headers: &HeaderMap) -> bool {
        let bearer = single(headers, AUTHORIZATION).and_then(|value| value.strip_prefix("Bearer "));
        let query = uri.query().unwrap_or_default();
        let asked = query.split('&').find_map(|pair| pair.strip_prefix("token="));
        bearer.is_some_and(|token| self.is_token(token)) || asked.is_some_and(|token| self.is_token(token))
    }

    fn has_cookie(&self, headers: &HeaderMap) -> bool {
        let cookies = headers.get_all(COOKIE).iter().filter_map(|value| value.to_str().ok());
        let mut pairs = cookies.flat_map(|line| line.split(';')).filter_map(|pair| pair.trim().split_once('='));
        pairs.any(|(name, value)| name == self.cookie && self.is_token(value))
    }

    /// Takes the same time wherever they differ.
    fn is_token(&self, other: &str) -> bool {
        let (own, other) = (self.token.as_bytes(), other.as_bytes());
        own.len() == other.len() && own.iter().zip(other).fold(0, |differ, (a, b)| differ | (a ^ b)) == 0
    }

    /// An address, `localhost`, or this machine's name: names that somebody else's DNS cannot have led here. The port may
    /// be that of a tunnel.
    fn is_own_name(&self, host: &str) -> bool {
        if self.is_public(host) {
            return true;
        }
        let name = without_port(host);
        let address = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
        match address.parse::<IpAddr>() {
            // What listens here alone is reached by no other address.
            Ok(ip) => ip.is_loopback() || !self.loopback,
            Err(_) => {
                let name = name.to_lowercase();
                name == "localhost" || (!self.loopback && self.host_name.as_ref() == Some(&name))
            }
        }
    }

    /// Counts a request of `peer`; false when that has asked too much.
    fn take_turn(&self, peer: IpAddr, now: Instant) -> bool {
        let mut buckets = self.buckets.lock().unwrap_or_else(|e| e.into_inner());
        if buckets.len() >= ADDRESSES && !buckets.contains_key(&peer) {
            buckets.clear();
        }
        let bucket = buckets.entry(peer).or_insert(Bucket { left: BURST, counted: now });
        let since = now.saturating_duration_since(bucket.counted).as_secs_f64();
        *bucket = Bucket { left: (bucket.left + since * RATE).min(BURST), counted: now };
        let may = bucket.left >= 1.0;
        bucket.left -= if may { 1.0 } else { 0.0 };
        may
    }
}

fn without_port(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if port.parse::<u16>().is_ok() => name,
        _ => host,
    }
}

/// The value of a header that must not come twice.
fn single(headers: &HeaderMap, name: axum::http::HeaderName) -> Option<&str> {
    let mut values = headers.get_all(name).iter();
    match (values.next(), values.next()) {
        (Some(value), None) => value.to_str().ok(),
        _ => None,
    }
}

/// Whether a page of `origin` came from the server that is addressed as `host`; a proxy may have added TLS.
fn is_origin_of(origin: &str, host: &str) -> bool {
    let name = origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"));
    name.is_some_and(|name| name.eq_ignore_ascii_case(host))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    const OWN: &str = "127.0.0.1:8090";

    fn guard(address: &str) -> Guard {
        Guard::new(address.parse().expect("an address"), &[]).expect("a guard")
    }

    fn check(guard: &Guard, method: Method, target: &str, headers: &[(&str, &str)]) -> u16 {
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            let name = axum::http::HeaderName::try_from(*name).expect("a name");
            map.append(name, value.parse().expect("a value"));
        }
        match guard.check(&method, &target.parse().expect("a target"), &map, None) {
            Ok(()) => 200,
            Err((status, _)) => status.as_u16(),
        }
    }

    #[test]
    fn names_that_dns_could_have_led_here_are_refused() {
        let guard = guard(OWN);
        for host in [OWN, "localhost:8090", "LOCALHOST", "127.0.0.1", "[::1]:8090", "127.8.8.8:1", "localhost:9000"] {
            assert_eq!(check(&guard, Method::GET, "/api/status", &[("host", host)]), 200, "{host}");
        }
        for host in ["evil.example", "evil.example:8090", "127.0.0.1.evil.example", "10.0.0.1:8090", "", "[::1", "a b"]
        {
            assert_eq!(check(&guard, Method::GET, "/api/status", &[("host", host)]), 403, "{host}");
        }
        assert_eq!(check(&guard, Method::GET, "/", &[]), 400);
        assert_eq!(check(&guard, Method::GET, "/", &[("host", OWN), ("host", "evil.example")]), 400);
    }

    #[test]
    fn other_origins_and_sites_are_refused() {
        let guard = guard(OWN);
        let from = |method: Method, more: &[(&str, &str)]| {
            check(&guard, method, "/api/pause", &[&[("host", OWN)], more].concat())
        };
        assert_eq!(from(Method::POST, &[("origin", "http://127.0.0.1:8090")]), 200);
        assert_eq!(from(Method::POST, &[("origin", "http://127.0.0.1:8090"), ("sec-fetch-site", "same-origin")]), 200);
        for origin in ["http://evil.example", "http://127.0.0.1:8091", "http://127.0.0.1", "null", "", "file://"] {
            for method in [Method::GET, Method::POST] {
                assert_eq!(from(method, &[("origin", origin)]), 403, "{origin}");
            }
        }
        assert_eq!(from(Method::POST, &[]), 403);
        assert_eq!(from(Method::POST, &[("sec-fetch-site", "same-origin")]), 403);
        assert_eq!(from(Method::GET, &[("sec-fetch-site", "cross-site")]), 403);
        assert_eq!(check(&guard, Method::GET, "/", &[("host", OWN), ("sec-fetch-site", "cross-site")]), 200);
    }

    #[test]
    fn controls_of_scripts_need_the_token() {
        let guard = guard(OWN);
        let bearer = |token: &str| {
            check(&guard, Method::POST, "/api/stop", &[("host", OWN), ("authorization", &format!("Bearer {token}"))])
        };
        assert_eq!(bearer(guard.token()), 200);
        for wrong in
            ["", "0", &guard.token()[1..], &guard.token().replace(|_: char| true, "0"), &format!("{}0", guard.token())]
        {
            assert_eq!(bearer(wrong), 403, "{wrong}");
        }
        assert_ne!(guard.token(), Guard::new(OWN.parse().expect("one"), &[]).expect("a guard").token());
    }

    #[test]
    fn where_others_can_connect_everything_needs_the_token() {
        let guard = guard("0.0.0.0:8090");
        let host = ("host", "192.0.2.7:8090");
        let origin = ("origin", "http://192.0.2.7:8090");
        assert_eq!(check(&guard, Method::GET, "/", &[host]), 401);
        assert_eq!(check(&guard, Method::GET, "/api/image", &[host, origin]), 401);
        assert_eq!(check(&guard, Method::POST, "/api/stop", &[host, origin]), 401);
        assert_eq!(check(&guard, Method::GET, "/?token=0", &[host]), 401);
        assert_eq!(check(&guard, Method::GET, &format!("/?token={}", guard.token()), &[host]), 200);
        let cookie = guard.set_cookie();
        let cookie = ("cookie", cookie.split(';').next().expect("a pair"));
        assert_eq!(check(&guard, Method::GET, "/api/image", &[host, cookie]), 200);
        assert_eq!(check(&guard, Method::POST, "/api/stop", &[host, cookie, origin]), 200);
        // A cookie alone is sent along by whoever makes the browser send something.
        assert_eq!(check(&guard, Method::POST, "/api/stop", &[host, cookie]), 403);
        assert_eq!(check(&guard, Method::GET, "/", &[("host", "evil.example"), cookie]), 403);
    }

    /// A proxy on this machine connects from it: its name is let in, and what comes by any name needs the token.
    #[test]
    fn a_proxy_is_let_in_by_name_and_needs_the_token() {
        let public = ["Render.example.org".to_owned(), "other.example:8443".to_owned()];
        let guard = Guard::new(OWN.parse().expect("an address"), &public).expect("a guard");
        let token = format!("/?token={}", guard.token());
        for host in ["render.example.org", "render.example.org:443", "RENDER.example.org", "other.example:8443", OWN] {
            assert_eq!(check(&guard, Method::GET, "/", &[("host", host)]), 401, "{host}");
            assert_eq!(check(&guard, Method::GET, &token, &[("host", host)]), 200, "{host}");
        }
        for host in
            ["example.org", "render.example.org.evil.example", "other.example", "other.example:80", "evil.example"]
        {
            assert_eq!(check(&guard, Method::GET, &token, &[("host", host)]), 403, "{host}");
        }
        let cookie = guard.set_cookie();
        let cookie = ("cookie", cookie.split(';').next().expect("a pair"));
        // Passed on as it came, or with this server's own address instead.
        for host in ["render.example.org", OWN] {
            let stop =
                |origin: &str| check(&guard, Method::POST, "/api/stop", &[("host", host), cookie, ("origin", origin)]);
            assert_eq!(stop("https://render.example.org"), 200, "{host}");
            assert_eq!(stop("https://evil.example"), 403, "{host}");
            let bare = ("origin", "https://render.example.org");
            assert_eq!(check(&guard, Method::POST, "/api/stop", &[("host", host), bare]), 401, "{host}");
        }
    }

    #[test]
    fn who_asks_too_much_waits_and_others_do_not() {
        let guard = guard(OWN);
        let [greedy, other] = [[127, 0, 0, 1], [127, 0, 0, 2]].map(IpAddr::from);
        let now = Instant::now();
        assert_eq!((0..2000).filter(|_| guard.take_turn(greedy, now)).count(), BURST as usize);
        assert!(guard.take_turn(other, now));
        let later = now + Duration::from_secs(1);
        assert_eq!((0..2000).filter(|_| guard.take_turn(greedy, later)).count(), RATE as usize);
    }
}
