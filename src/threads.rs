//! Threads that outlive their work, and wait for the next of their name.
//!
//! glibc gives every new thread one of up to eight heaps for each core, whichever is free, and a heap keeps what it once had at its
//! end. A software device takes its memory from there, tens of MiB at a time: in a process that renders many times, as Python does,
//! threads that live for one render would leave a piece of that in one heap after the other. Those that do the large work are kept.

use std::any::Any;
use std::collections::BTreeMap;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, PoisonError};
use std::thread::{self, Result};

use crossbeam_channel::{Receiver, Sender, bounded};

/// Does its work, and gives what tells of it, to be called when the thread may be taken again.
type Work = Box<dyn FnOnce() -> Box<dyn FnOnce()> + Send>;

/// Where those without work get it, by their names.
static IDLE: Mutex<BTreeMap<String, Vec<Sender<Work>>>> = Mutex::new(BTreeMap::new());

/// Work on a thread of its own.
pub struct Running<T>(Receiver<Result<T>>);

impl<T> Running<T> {
    /// Waits for its end.
    ///
    /// # Errors
    /// What it panicked with.
    pub fn join(self) -> Result<T> {
        let lost = |_| Err(Box::new("a thread ended without an answer") as Box<dyn Any + Send>);
        self.0.recv().unwrap_or_else(lost)
    }
}

/// Sets a thread named `name` to work: one that has ended such work before, or a new one.
///
/// # Errors
/// Where the system has none to give.
pub fn run<T: Send + 'static>(name: &str, work: impl FnOnce() -> T + Send + 'static) -> io::Result<Running<T>> {
    let (tell, told) = bounded(1);
    let work: Work = Box::new(move || {
        let result = catch_unwind(AssertUnwindSafe(work));
        // Who does not wait for it does not want to know.
        Box::new(move || drop(tell.send(result)))
    });
    let idle = idle().get_mut(name).and_then(Vec::pop);
    let refused = match idle {
        Some(thread) => thread.send(work).err().map(|refused| refused.into_inner()),
        None => Some(work),
    };
    if let Some(work) = refused {
        start(name, work)?;
    }
    Ok(Running(told))
}

fn start(name: &str, work: Work) -> io::Result<()> {
    let (sender, receiver) = bounded::<Work>(1);
    let own = name.to_owned();
    let life = move || {
        let mut next = Some(work);
        while let Some(work) = next {
            let tell = work();
            // First: whoever hears of the end finds it here.
            idle().entry(own.clone()).or_default().push(sender.clone());
            tell();
            next = receiver.recv().ok();
        }
    };
    thread::Builder::new().name(name.to_owned()).spawn(life).map(drop)
}

fn idle() -> std::sync::MutexGuard<'static, BTreeMap<String, Vec<Sender<Work>>>> {
    // Nothing is half done where it is held.
    IDLE.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_after_the_other_share_a_thread_and_those_at_once_do_not() {
        let here = || thread::current().id();
        let first = run("one", here).expect("a thread").join().expect("no panic");
        for _ in 0..5 {
            assert_eq!(run("one", here).expect("a thread").join().expect("no panic"), first);
        }
        assert_ne!(run("another", here).expect("a thread").join().expect("no panic"), first);
        let (go, wait) = bounded::<()>(0);
        let waiting = run("one", move || wait.recv().map(|()| here())).expect("a thread");
        assert_ne!(run("one", here).expect("a thread").join().expect("no panic"), first);
        go.send(()).expect("it waits");
        assert_eq!(waiting.join().expect("no panic"), Ok(first));
    }

    #[test]
    fn panics_are_told_and_harm_no_thread() {
        let here = || thread::current().id();
        let first = run("panics", here).expect("a thread").join().expect("no panic");
        let panicked = run("panics", || -> u32 { panic!("on purpose") }).expect("a thread").join();
        let said = panicked.expect_err("it panics");
        assert_eq!(said.downcast_ref::<&str>(), Some(&"on purpose"));
        assert_eq!(run("panics", here).expect("a thread").join().expect("no panic"), first);
        assert_eq!(
            run("panics", || thread::current().name().map(str::to_owned)).expect("a thread").join().expect("no panic"),
            Some("panics".to_owned())
        );
    }
}
