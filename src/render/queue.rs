//! Which unit comes next: tiles in order, epochs of a tile in order, a tile on one device at a time.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::{Condvar, Mutex, MutexGuard};

/// Units of one epoch that a device takes together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
    /// Numbers each taking of units, so that the late result of one that was superseded is told by it.
    pub attempt: u64,
    pub epoch: u32,
    pub tiles: Vec<u32>,
}

/// What a device finds when it asks for work.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Next {
    Units(Group),
    /// Nothing now: what is left waits for units that are being rendered, or for a decision.
    Later,
    /// Nothing any more.
    Never,
}

/// The units still to render. Devices pull from it; whoever is fast pulls more often.
pub struct Queue {
    state: Mutex<State>,
    changed: Condvar,
}

struct State {
    /// Units that may be taken, the lowest epochs first.
    ready: VecDeque<(u32, u32)>,
    /// Units of epochs that are not decided yet.
    undecided: Vec<(u32, u32)>,
    /// Epochs below this may be rendered.
    allowed: u32,
    closed: bool,
    /// Attempts so far, and those under way: who took what.
    attempts: u64,
    taken: BTreeMap<u64, (usize, Group)>,
    /// Devices that get nothing any more.
    expelled: BTreeSet<usize>,
}

impl State {
    /// Units that were taken and not merged come first again.
    fn put_back(&mut self, group: Group) {
        for tile in group.tiles.into_iter().rev() {
            self.ready.push_front((group.epoch, tile));
        }
    }
}

impl Queue {
    /// Every tile from its first epoch on; nothing may be taken before [`Queue::allow`].
    pub fn new(tiles: u32) -> Queue {
        let undecided = (0..tiles).map(|tile| (0, tile)).collect();
        let state = State {
            ready: VecDeque::new(),
            undecided,
            allowed: 0,
            closed: false,
            attempts: 0,
            taken: BTreeMap::new(),
            expelled: BTreeSet::new(),
        };
        Queue { state: Mutex::new(state), changed: Condvar::new() }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Takes up to `at_once(epoch)` units of one epoch for `device`.
    pub fn next(&self, device: usize, at_once: impl Fn(u32) -> usize) -> Next {
        let mut state = self.state();
        if state.closed || state.expelled.contains(&device) {
            return Next::Never;
        }
        let Some(&(epoch, _)) = state.ready.front() else { return Next::Later };
        let same = state.ready.iter().take(at_once(epoch).max(1)).take_while(|unit| unit.0 == epoch).count();
        let tiles = state.ready.drain(..same).map(|unit| unit.1).collect();
        state.attempts += 1;
        let group = Group { attempt: state.attempts, epoch, tiles };
        state.taken.insert(group.attempt, (device, group.clone()));
        Next::Units(group)
    }

    /// Whether the result of `group` is wanted, which is asked before it is merged: not if its units were taken back. From a
    /// yes on they cannot be.
    pub fn claim(&self, group: &Group) -> bool {
        self.state().taken.remove(&group.attempt).is_some()
    }

    /// Waits until [`Queue::next`] would have another answer than `Later`.
    pub fn wait(&self) {
        let waiting = |state: &mut State| !state.closed && state.ready.is_empty();
        drop(self.changed.wait_while(self.state(), waiting).unwrap_or_else(|e| e.into_inner()));
    }

    /// Notes that a unit is merged: its tile's next epoch may be taken, if it is decided.
    pub fn done(&self, epoch: u32, tile: u32) {
        let mut state = self.state();
        let next = (epoch + 1, tile);
        if next.0 < state.allowed {
            state.ready.push_back(next);
        } else {
            state.undecided.push(next);
        }
        self.changed.notify_all();
    }

    /// Puts back units that were taken and not merged, unless they were taken back or claimed.
    pub fn give_back(&self, group: Group) {
        let mut state = self.state();
        if state.taken.remove(&group.attempt).is_some() {
            state.put_back(group);
        }
        self.changed.notify_all();
    }

    /// Takes back from `device` all that it has and has not claimed, and gives it nothing any more.
    pub fn expel(&self, device: usize) {
        let mut state = self.state();
        state.expelled.insert(device);
        let of_device = state.taken.extract_if(.., |_, (holder, _)| *holder == device).collect::<Vec<_>>();
        for (_, (_, group)) in of_device.into_iter().rev() {
            state.put_back(group);
        }
        self.changed.notify_all();
    }

    /// Lets epochs below `epochs` be rendered.
    pub fn allow(&self, epochs: u32) {
        let mut state = self.state();
        state.allowed = epochs;
        let (mut now, later): (Vec<_>, Vec<_>) = state.undecided.drain(..).partition(|unit| unit.0 < epochs);
        // Units of an epoch finish in any order, but are taken in the order of their tiles.
        now.sort_unstable();
        state.ready.extend(now);
        state.undecided = later;
        self.changed.notify_all();
    }

    /// Ends the work: nobody gets another unit.
    pub fn close(&self) {
        self.state().closed = true;
        self.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(next: Next) -> Group {
        match next {
            Next::Units(group) => group,
            other => panic!("{other:?} instead of units"),
        }
    }

    fn units(next: Next) -> (u32, Vec<u32>) {
        let Group { epoch, tiles, .. } = group(next);
        (epoch, tiles)
    }

    #[test]
    fn epochs_of_a_tile_come_in_order_and_only_when_decided() {
        let queue = Queue::new(3);
        assert_eq!(queue.next(0, |_| 2), Next::Later);
        queue.allow(2);
        let lost = group(queue.next(0, |_| 1));
        assert_eq!((lost.epoch, &lost.tiles[..]), (0, &[0][..]));
        assert_eq!(units(queue.next(0, |_| 1)), (0, vec![1]));
        queue.done(0, 1);
        // Tile 2 still owes its first epoch, and a group never mixes epochs.
        assert_eq!(units(queue.next(0, |_| 9)), (0, vec![2]));
        assert_eq!(units(queue.next(0, |_| 9)), (1, vec![1]));
        assert_eq!(queue.next(0, |_| 9), Next::Later);
        // What a lost device gives back comes first.
        queue.done(0, 2);
        queue.give_back(lost);
        assert_eq!(units(queue.next(0, |_| 1)), (0, vec![0]));
        for (epoch, tile) in [(0, 0), (1, 1)] {
            queue.done(epoch, tile);
        }
        assert_eq!(units(queue.next(0, |_| 9)), (1, vec![2, 0]));
        queue.done(1, 2);
        queue.done(1, 0);
        assert_eq!(queue.next(0, |_| 9), Next::Later);
        queue.allow(3);
        assert_eq!(units(queue.next(0, |_| 9)), (2, vec![0, 1, 2]));
        queue.close();
        assert_eq!(queue.next(0, |_| 9), Next::Never);
    }

    #[test]
    fn what_a_device_is_relieved_of_is_superseded() {
        let queue = Queue::new(4);
        queue.allow(1);
        let [first, second] = [0, 0].map(|device| group(queue.next(device, |_| 1)));
        let other = group(queue.next(1, |_| 1));
        // The first is being merged already: it stays with its device.
        assert!(queue.claim(&first));
        queue.expel(0);
        assert!(!queue.claim(&second) && queue.claim(&other));
        assert_eq!(queue.next(0, |_| 9), Next::Never);
        // Neither the claimed nor the superseded come back by themselves.
        queue.give_back(first);
        queue.give_back(second.clone());
        let again = group(queue.next(1, |_| 9));
        assert_eq!((&again.tiles[..], again.attempt > second.attempt), (&[1, 3][..], true));
        assert_eq!(queue.next(1, |_| 9), Next::Later);
        assert!(!queue.claim(&second) && queue.claim(&again) && !queue.claim(&again));
    }
}
