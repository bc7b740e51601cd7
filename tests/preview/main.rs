//! Whoever watches: the web server and its page, tev, pauses and stops.

mod client;
#[path = "../common/mod.rs"]
mod common;
#[path = "../cube_files/mod.rs"]
mod cube_files;
mod hostile;
mod huge;
mod page;
mod rendering;
mod served;
mod tev;
