//! Which unit comes next: tiles in order, epochs of a tile in order, a tile on one device at a time.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard};

/// Units that a device takes together: those of some tiles in one epoch, or in all epochs from the first one on that are
/// merged at once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
    /// The first of them, and how many.
    pub epoch: u32,
    pub epochs: u32,
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
    /// Epochs that a new tile gets at once.
    together: u32,
    closed: bool,
}

impl Queue {
    /// A queue without units.
    pub fn new() -> Queue {
        let state = State { ready: VecDeque::new(), undecided: Vec::new(), allowed: 0, together: 1, closed: false };
        Queue { state: Mutex::new(state), changed: Condvar::new() }
    }

    /// Adds tiles, each with the epoch that it goes on from; nothing of them may be taken before [`Queue::allow`]. A new
    /// tile gets its first `together` epochs at once.
    pub fn fill(&self, tiles: impl IntoIterator<Item = (u32, u32)>, together: u32) {
        let mut state = self.state();
        state.together = together;
        state.undecided.extend(tiles.into_iter().map(|(tile, epoch)| (epoch, tile)));
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Takes up to `at_once(epoch)` tiles, `epoch` being the largest they get.
    pub fn next(&self, at_once: impl Fn(u32) -> usize) -> Next {
        let mut state = self.state();
        if state.closed {
            return Next::Never;
        }
        let Some(&(epoch, _)) = state.ready.front() else { return Next::Later };
        let epochs = if epoch == 0 { state.together } else { 1 };
        let at_once = at_once(epoch + epochs - 1).max(1);
        let same = state.ready.iter().take(at_once).take_while(|unit| unit.0 == epoch).count();
        Next::Units(Group { epoch, epochs, tiles: state.ready.drain(..same).map(|unit| unit.1).collect() })
    }

    /// Waits until [`Queue::next`] would have another answer than `Later`.
    pub fn wait(&self) {
        let waiting = |state: &mut State| !state.closed && state.ready.is_empty();
        drop(self.changed.wait_while(self.state(), waiting).unwrap_or_else(|e| e.into_inner()));
    }

    /// Notes that a group is merged: the next epoch of its tiles may be taken, if it is decided.
    pub fn done(&self, group: &Group) {
        let mut state = self.state();
        let next = group.epoch + group.epochs;
        let units = group.tiles.iter().map(|&tile| (next, tile));
        if next < state.allowed {
            state.ready.extend(units);
        } else {
            state.undecided.extend(units);
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

    fn group(epoch: u32, tiles: &[u32]) -> Group {
        Group { epoch, epochs: 1, tiles: tiles.to_vec() }
    }

    #[test]
    fn epochs_of_a_tile_come_in_order_and_only_when_decided() {
        let queue = Queue::new();
        queue.fill((0..3).map(|tile| (tile, 0)), 1);
        assert_eq!(queue.next(|_| 2), Next::Later);
        queue.allow(2);
        assert_eq!(units(queue.next(|_| 2)), (0, vec![0, 1]));
        queue.done(&group(0, &[1]));
        // Tile 2 still owes its first epoch, and a group never mixes epochs.
        assert_eq!(units(queue.next(|_| 9)), (0, vec![2]));
        assert_eq!(units(queue.next(|_| 9)), (1, vec![1]));
        assert_eq!(queue.next(|_| 9), Next::Later);
        // What a lost device gives back comes first.
        queue.done(&group(0, &[2]));
        queue.give_back(group(0, &[0]));
        assert_eq!(units(queue.next(|_| 1)), (0, vec![0]));
        queue.done(&group(0, &[0]));
        queue.done(&group(1, &[1]));
        assert_eq!(units(queue.next(|_| 9)), (1, vec![2, 0]));
        queue.done(&group(1, &[2, 0]));
        assert_eq!(queue.next(|_| 9), Next::Later);
        queue.allow(3);
        assert_eq!(units(queue.next(|_| 9)), (2, vec![0, 1, 2]));
        queue.close();
        assert_eq!(queue.next(|_| 9), Next::Never);
    }

    /// Tiles of which something is there already go on from there; only new ones get epochs together.
    #[test]
    fn new_tiles_may_get_several_epochs_at_once() {
        let queue = Queue::new();
        queue.fill([(0, 3), (1, 0), (2, 0), (3, 8)], 7);
        queue.allow(8);
        let taken = queue.next(|epoch| if epoch == 6 { 9 } else { 0 });
        let new = Group { epoch: 0, epochs: 7, tiles: vec![1, 2] };
        assert_eq!(taken, Next::Units(new.clone()));
        assert_eq!(queue.next(|_| 9), Next::Units(group(3, &[0])));
        assert_eq!(queue.next(|_| 9), Next::Later);
        queue.done(&new);
        assert_eq!(queue.next(|_| 9), Next::Units(group(7, &[1, 2])));
    }
}
