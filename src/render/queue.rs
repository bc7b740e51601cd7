//! Which unit comes next: tiles in order, epochs of a tile in order, a tile on one device at a time.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard};

/// Units of one epoch that a device takes together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
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
}

impl Queue {
    /// Every tile from its first epoch on; nothing may be taken before [`Queue::allow`].
    pub fn new(tiles: u32) -> Queue {
        let undecided = (0..tiles).map(|tile| (0, tile)).collect();
        let state = State { ready: VecDeque::new(), undecided, allowed: 0, closed: false };
        Queue { state: Mutex::new(state), changed: Condvar::new() }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Takes up to `at_once(epoch)` units of one epoch.
    pub fn next(&self, at_once: impl Fn(u32) -> usize) -> Next {
        let mut state = self.state();
        if state.closed {
            return Next::Never;
        }
        let Some(&(epoch, _)) = state.ready.front() else { return Next::Later };
        let same = state.ready.iter().take(at_once(epoch).max(1)).take_while(|unit| unit.0 == epoch).count();
        Next::Units(Group { epoch, tiles: state.ready.drain(..same).map(|unit| unit.1).collect() })
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

    /// Puts back units that were taken and not merged; they come first.
    pub fn give_back(&self, group: Group) {
        let mut state = self.state();
        for tile in group.tiles.into_iter().rev() {
            state.ready.push_front((group.epoch, tile));
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

    fn units(next: Next) -> (u32, Vec<u32>) {
        match next {
            Next::Units(group) => (group.epoch, group.tiles),
            other => panic!("{other:?} instead of units"),
        }
    }

    #[test]
    fn epochs_of_a_tile_come_in_order_and_only_when_decided() {
        let queue = Queue::new(3);
        assert_eq!(queue.next(|_| 2), Next::Later);
        queue.allow(2);
        assert_eq!(units(queue.next(|_| 2)), (0, vec![0, 1]));
        queue.done(0, 1);
        // Tile 2 still owes its first epoch, and a group never mixes epochs.
        assert_eq!(units(queue.next(|_| 9)), (0, vec![2]));
        assert_eq!(units(queue.next(|_| 9)), (1, vec![1]));
        assert_eq!(queue.next(|_| 9), Next::Later);
        // What a lost device gives back comes first.
        queue.done(0, 2);
        queue.give_back(Group { epoch: 0, tiles: vec![0] });
        assert_eq!(units(queue.next(|_| 1)), (0, vec![0]));
        for (epoch, tile) in [(0, 0), (1, 1)] {
            queue.done(epoch, tile);
        }
        assert_eq!(units(queue.next(|_| 9)), (1, vec![2, 0]));
        queue.done(1, 2);
        queue.done(1, 0);
        assert_eq!(queue.next(|_| 9), Next::Later);
        queue.allow(3);
        assert_eq!(units(queue.next(|_| 9)), (2, vec![0, 1, 2]));
        queue.close();
        assert_eq!(queue.next(|_| 9), Next::Never);
    }
}
