//! `spectile view`: the page of `render --listen` on a cube that is there.

use std::net::SocketAddr;
use std::path::PathBuf;

use super::Output;
use super::sensor::Noise;
use crate::Result;

/// Look at a cube in a browser: its picture, channels and spectra
///
/// Serves one page until Ctrl-C: the picture in true colour, in a single channel, in false colour or, in the thermal infrared,
/// as brightness temperature; a click shows the spectrum of a pixel. The cube may be one that is being rendered, or larger than
/// memory: zoomed out only its overview is read. docs/http.md describes what else can be asked of the server.
///
/// Cubes of `render --factored` can be looked at under other lamps and paints, as `relight` makes them; docs/RELIGHT.md says more.
///
/// Counts of a sensor (`sensor --model`) are shown as they are, or with --noise off as the detector would count without noise and patterns.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile view cube.zarr
  spectile view counts.zarr --noise off
  spectile view cube.zarr --listen 127.0.0.1:9000
  spectile view cube.zarr --listen 0.0.0.0:8090        for other machines, with the token that is printed")]
pub struct Args {
    /// The cube, a folder
    pub cube: PathBuf,

    /// Where to serve the page: IP:PORT, port 0 for any that is free
    ///
    /// On an address of this machine alone (127.0.0.1) whoever works on it may look. Where others can connect, the address
    /// that is printed holds a token, without which nothing is answered.
    #[arg(long, value_name = "IP:PORT", default_value = "127.0.0.1:8090", value_parser = parse_address)]
    pub listen: SocketAddr,

    /// A name by which a proxy is reached that passes requests on to this page: NAME or NAME:PORT (repeatable)
    ///
    /// Without it the page answers to its own addresses only. With it every request needs the token that is printed, also from
    /// this machine, since whoever comes through the proxy seems to. docs/http.md has more.
    #[arg(long, value_name = "NAME", value_parser = parse_host)]
    pub public_host: Vec<String>,

    /// Of counts: as they are, or without noise and patterns, which needs `sensor --electrons`
    #[arg(long, value_enum, default_value_t = Noise::On)]
    pub noise: Noise,

    /// Exposure that the page begins with, in EV; otherwise automatic
    #[arg(long, value_name = "EV", value_parser = super::parse_exposure, allow_hyphen_values = true)]
    pub exposure: Option<f64>,

    /// One JSON object a line on stdout, instead of text
    #[arg(long)]
    pub json: bool,
}

/// The end of a cube's path, which is all that viewers are told.
pub fn name_of(cube: &std::path::Path) -> String {
    let whole = std::fs::canonicalize(cube).unwrap_or_else(|_| cube.to_owned());
    whole.file_name().map_or_else(|| "cube".into(), |name| name.to_string_lossy().into_owned())
}

#[cfg(feature = "web")]
pub fn run(args: &Args, output: &Output) -> Result<()> {
    use std::time::Duration;

    use serde_json::json;

    use crate::cube::Cube;
    use crate::preview::{Feed, follow, web};

    let interrupt = output.interrupt()?;
    let open = || {
        let cube = Cube::open_picture(&args.cube)?;
        if args.noise == Noise::Off { cube.without_noise() } else { Ok(cube) }
    };
    let feed = Feed::of_cube(open()?);
    follow(open()?, &feed)?;
    let about = web::About { name: name_of(&args.cube), exposure: args.exposure, controls: false };
    let server = web::Server::start_behind(&args.public_host, args.listen, feed, about)?;
    output.event("listening", json!({ "url": server.url(), "token": server.token() }))?;
    output.text(&format!("{}: look at {} (Ctrl-C ends it)\n", args.cube.display(), server.url()))?;
    if let Some(through) = through_proxies(&args.public_host, server.token()) {
        output.text(&through)?;
    }
    interrupt.sleep(Duration::MAX)
}

/// Where the page is to be had through proxies, if there are any.
#[cfg(feature = "web")]
pub fn through_proxies(hosts: &[String], token: &str) -> Option<String> {
    let each: Vec<String> = hosts.iter().map(|host| format!("{host}/?token={token}")).collect();
    (!each.is_empty()).then(|| format!("through a proxy: {}\n", each.join(", ")))
}

#[cfg(not(feature = "web"))]
pub fn run(_: &Args, _: &Output) -> Result<()> {
    Err(without_web())
}

/// What a build without the feature `web` says.
#[cfg(not(feature = "web"))]
pub fn without_web() -> crate::Error {
    crate::Error::Usage(
        "this program was built without its web page; build it with the cargo feature `web`, which is on by default"
            .into(),
    )
}

/// The name of a proxy, as `Host` has it.
pub fn parse_host(text: &str) -> std::result::Result<String, String> {
    let (name, port) = text.rsplit_once(':').map_or((text, None), |(name, port)| (name, Some(port)));
    let is_name = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || "-._".contains(c));
    match is_name && port.is_none_or(|port| port.parse::<u16>().is_ok_and(|port| port > 0)) {
        true => Ok(text.to_owned()),
        false => Err("a host is NAME or NAME:PORT, without http:// and path, such as render.example.org".into()),
    }
}

/// An address to listen on.
pub fn parse_address(text: &str) -> std::result::Result<SocketAddr, String> {
    let text = text.strip_prefix("localhost:").map_or_else(|| text.to_owned(), |port| format!("127.0.0.1:{port}"));
    text.parse().map_err(|_| "an address to listen on is IP:PORT, such as 127.0.0.1:8090".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_proxies() {
        for good in ["render.example.org", "localhost:8443", "a-b_c.d"] {
            assert_eq!(parse_host(good), Ok(good.to_owned()));
        }
        for bad in ["", "http://render.example.org", "a/b", "a:", "a:0", "a:b", "a b", "*"] {
            assert!(parse_host(bad).unwrap_err().contains("render.example.org"), "{bad}");
        }
    }

    #[test]
    fn addresses() {
        assert_eq!(parse_address("localhost:80"), Ok(SocketAddr::from(([127, 0, 0, 1], 80))));
        assert_eq!(parse_address("0.0.0.0:8090"), Ok(SocketAddr::from(([0; 4], 8090))));
        assert!(parse_address("[::1]:8090").expect("an address").is_ipv6());
        for bad in ["", "8090", ":8090", "127.0.0.1", "example.com:80", "127.0.0.1:70000"] {
            assert!(parse_address(bad).unwrap_err().contains("127.0.0.1:8090"), "{bad}");
        }
    }
}
