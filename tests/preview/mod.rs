//! Whoever watches: the web server and its page, tev, pauses and stops.

mod client;
mod hostile;
mod huge;
mod page;
mod relight;
mod rendering;
mod served;
mod tev;
