//! Who watches a render: the web page and tev, as the arguments say.

use std::path::Path;
use std::sync::Arc;

use super::Output;
use super::progress::Reporter;
use super::render::Args;
use super::view;
use crate::cube::Cube;
use crate::preview::{Feed, Source, Stage, Tev};
use crate::{Error, Result};

/// The feed of a render and those that read it; none where nobody is to watch.
pub struct Sinks {
    pub feed: Option<Arc<Feed>>,
    #[cfg(feature = "web")]
    server: Option<crate::preview::web::Server>,
    tev: Option<Tev>,
}

impl Sinks {
    pub fn start(args: &Args, output: &Output, reporter: &mut Reporter) -> Result<Sinks> {
        if args.listen.is_none() && args.tev.is_none() {
            return Ok(Sinks {
                feed: output.feed(),
                #[cfg(feature = "web")]
                server: None,
                tev: None,
            });
        }
        let feed = output.feed().unwrap_or_else(Feed::of_render);
        let name = view::name_of(&args.output);
        #[cfg(not(feature = "web"))]
        if args.listen.is_some() {
            return Err(view::without_web());
        }
        #[cfg(feature = "web")]
        let server = args
            .listen
            .map(|address| -> Result<_> {
                use serde_json::json;

                use crate::preview::web::{About, Server};
                let about = About { name: name.clone(), exposure: args.exposure, controls: true };
                let server = Server::start_behind(&args.public_host, address, Arc::clone(&feed), about)?;
                let fields = json!({ "url": server.url(), "token": server.token() });
                let through = view::through_proxies(&args.public_host, server.token());
                let through = through.map_or_else(String::new, |through| format!("; {}", through.trim_end()));
                reporter.listening(&format!("watch it at {}{through}", server.url()), fields)?;
                Ok(server)
            })
            .transpose()?;
        let tev = match &args.tev {
            Some(address) => {
                let (tev, there) = Tev::start(address.clone(), name, Arc::clone(&feed))?;
                if !there {
                    reporter.warn(&format!("no tev listens at {address} yet; it is looked for once a second"))?;
                }
                Some(tev)
            }
            None => None,
        };
        Ok(Sinks {
            feed: Some(feed),
            #[cfg(feature = "web")]
            server,
            tev,
        })
    }

    /// Tells whoever watches how the render has ended, and gives them a moment to see it.
    pub fn finish<T>(self, output: &Path, result: &Result<T>) {
        let Some(feed) = self.feed else { return };
        let stage = match result {
            Ok(_) => Stage::Done,
            Err(Error::Interrupted { .. }) => Stage::Stopped,
            Err(_) => Stage::Failed,
        };
        let source = Cube::open(output).ok().map(|cube| Arc::new(cube) as Arc<dyn Source>);
        feed.ended(stage, source);
        #[cfg(feature = "web")]
        if let Some(server) = self.server {
            server.finish();
        }
        if let Some(tev) = self.tev {
            tev.finish();
        }
    }
}
