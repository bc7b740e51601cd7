//! Which unit comes next: tiles in order, or those first that are needed most; epochs of a tile in order, a tile on one device at a time.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::{Condvar, Mutex, MutexGuard};

use crate::preview::Work;

/// Units of other epochs that are passed over where some of one are taken together, at most.
const PASSED_OVER: usize = 64;

/// Units that a device takes together: those of some tiles in one epoch, or in all epochs from the first one on that are
/// merged at once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Group {
    /// Numbers each taking of units, so that the late result of one that was superseded is told by it.
    pub attempt: u64,
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
    /// Units that may be taken, the lowest epochs first, or those of the most needed tiles.
    ready: VecDeque<(u32, u32)>,
    /// Tiles whose next epoch is not decided yet, and which one that is.
    undecided: BTreeMap<u32, u32>,
    /// Epochs below this may be rendered.
    allowed: u32,
    /// Of tiles that are decided by themselves: below which epoch they may be, and how much that is needed.
    tiles: BTreeMap<u32, (u32, f32)>,
    /// Epochs that a new tile gets at once.
    together: u32,
    paused: bool,
    closed: bool,
    /// Attempts so far, and those under way: who took what.
    attempts: u64,
    taken: BTreeMap<u64, (usize, Group)>,
    /// Devices that get nothing any more.
    expelled: BTreeSet<usize>,
}

impl State {
    /// Below which epoch a tile may be rendered.
    fn limit(&self, tile: u32) -> u32 {
        self.tiles.get(&tile).map_or(self.allowed, |decided| decided.0)
    }

    /// Lets units of tiles that are decided by themselves be taken: those needed most first, of others the lowest epochs.
    fn insert(&mut self, unit: (u32, u32)) {
        let order =
            |&(epoch, tile): &(u32, u32)| (-self.tiles.get(&tile).map_or(0.0, |decided| decided.1), epoch, tile);
        let own = order(&unit);
        let place = self.ready.partition_point(|there| order(there) < own);
        self.ready.insert(place, unit);
    }

    /// Units that were taken and not merged come first again.
    fn put_back(&mut self, group: Group) {
        for tile in group.tiles.into_iter().rev() {
            self.ready.push_front((group.epoch, tile));
        }
    }
}

impl Default for Queue {
    /// A queue without units.
    fn default() -> Queue {
        let state = State {
            ready: VecDeque::new(),
            undecided: BTreeMap::new(),
            allowed: 0,
            tiles: BTreeMap::new(),
            together: 1,
            paused: false,
            closed: false,
            attempts: 0,
            taken: BTreeMap::new(),
            expelled: BTreeSet::new(),
        };
        Queue { state: Mutex::new(state), changed: Condvar::new() }
    }
}

impl Queue {
    /// Adds tiles, each with the epoch that it goes on from; nothing of them may be taken before [`Queue::allow`]. A new
    /// tile gets its first `together` epochs at once.
    pub fn fill(&self, tiles: impl IntoIterator<Item = (u32, u32)>, together: u32) {
        let mut state = self.state();
        state.together = together;
        state.undecided.extend(tiles);
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Takes up to `at_once(epoch)` tiles for `device`, `epoch` being the largest they get.
    pub fn next(&self, device: usize, at_once: impl Fn(u32) -> usize) -> Next {
        let mut state = self.state();
        if state.closed || state.expelled.contains(&device) {
            return Next::Never;
        }
        if state.paused {
            return Next::Later;
        }
        let Some(&(epoch, _)) = state.ready.front() else { return Next::Later };
        let epochs = if epoch == 0 { state.together } else { 1 };
        let at_once = at_once(epoch + epochs - 1).max(1);
        // Those of the same epoch, also behind a few others.
        let (mut tiles, mut place) = (Vec::new(), 0);
        while tiles.len() < at_once && place < state.ready.len().min(PASSED_OVER) {
            match state.ready[place] {
                (of, tile) if of == epoch => {
                    state.ready.remove(place);
                    tiles.push(tile);
                }
                _ => place += 1,
            }
        }
        state.attempts += 1;
        let group = Group { attempt: state.attempts, epoch, epochs, tiles };
        state.taken.insert(group.attempt, (device, group.clone()));
        Next::Units(group)
    }

    /// Whether the result of `group` is still wanted: not if its units were taken back.
    pub fn is_wanted(&self, group: &Group) -> bool {
        self.state().taken.contains_key(&group.attempt)
    }

    /// [`Queue::is_wanted`], which is asked before the result is merged: from a yes on the units cannot be taken back.
    pub fn claim(&self, group: &Group) -> bool {
        self.state().taken.remove(&group.attempt).is_some()
    }

    /// Waits until [`Queue::next`] would have another answer than `Later`.
    pub fn wait(&self) {
        let waiting = |state: &mut State| !state.closed && (state.paused || state.ready.is_empty());
        drop(self.changed.wait_while(self.state(), waiting).unwrap_or_else(|e| e.into_inner()));
    }

    /// Notes that a group is merged: the next epoch of its tiles may be taken, if it is decided.
    pub fn done(&self, group: &Group) {
        let mut state = self.state();
        let next = group.epoch + group.epochs;
        for &tile in &group.tiles {
            match (next < state.limit(tile), state.tiles.contains_key(&tile)) {
                (false, _) => drop(state.undecided.insert(tile, next)),
                (true, false) => state.ready.push_back((next, tile)),
                (true, true) => state.insert((next, tile)),
            }
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
        let now = state.undecided.extract_if(.., |_, epoch| *epoch < epochs);
        let mut now: Vec<(u32, u32)> = now.map(|(tile, epoch)| (epoch, tile)).collect();
        // Units of an epoch finish in any order, but are taken in the order of their tiles.
        now.sort_unstable();
        state.ready.extend(now);
        self.changed.notify_all();
    }

    /// Lets a tile be rendered up to `epoch`, without that one, whatever becomes of others; what is needed more comes first.
    pub fn allow_tile(&self, tile: u32, epoch: u32, need: f32) {
        let mut state = self.state();
        state.tiles.insert(tile, (epoch, need));
        if let Some(next) = state.undecided.get(&tile).copied().filter(|next| *next < epoch) {
            state.undecided.remove(&tile);
            state.insert((next, tile));
        }
        self.changed.notify_all();
    }

    /// What devices have taken and not merged.
    pub fn under_way(&self) -> Vec<Work> {
        let state = self.state();
        let taken = state.taken.values();
        taken.map(|(device, group)| Work { device: *device, epoch: group.epoch, tiles: group.tiles.clone() }).collect()
    }

    /// While paused nobody gets another unit; what is under way goes on.
    pub fn pause(&self, paused: bool) {
        self.state().paused = paused;
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
        let queue = Queue::default();
        queue.fill((0..3).map(|tile| (tile, 0)), 1);
        assert_eq!(queue.next(0, |_| 2), Next::Later);
        queue.allow(2);
        let lost = group(queue.next(0, |_| 1));
        assert_eq!((lost.epoch, &lost.tiles[..]), (0, &[0][..]));
        let second = group(queue.next(0, |_| 1));
        assert_eq!((second.epoch, &second.tiles[..]), (0, &[1][..]));
        queue.done(&second);
        // Tile 2 still owes its first epoch, and a group never mixes epochs.
        assert_eq!(units(queue.next(0, |_| 9)), (0, vec![2]));
        assert_eq!(units(queue.next(0, |_| 9)), (1, vec![1]));
        assert_eq!(queue.next(0, |_| 9), Next::Later);
        // What a lost device gives back comes first.
        queue.done(&Group { tiles: vec![2], ..second.clone() });
        queue.give_back(lost);
        let again = group(queue.next(0, |_| 1));
        assert_eq!((again.epoch, &again.tiles[..]), (0, &[0][..]));
        queue.done(&again);
        queue.done(&Group { epoch: 1, ..second.clone() });
        assert_eq!(units(queue.next(0, |_| 9)), (1, vec![2, 0]));
        queue.done(&Group { epoch: 1, tiles: vec![2, 0], ..second });
        assert_eq!(queue.next(0, |_| 9), Next::Later);
        queue.allow(3);
        assert_eq!(units(queue.next(0, |_| 9)), (2, vec![0, 1, 2]));
        queue.close();
        assert_eq!(queue.next(0, |_| 9), Next::Never);
    }

    #[test]
    fn what_a_device_is_relieved_of_is_superseded() {
        let queue = Queue::default();
        queue.fill((0..4).map(|tile| (tile, 0)), 1);
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

    #[test]
    fn nobody_gets_anything_during_a_pause() {
        let queue = Queue::default();
        queue.fill([(0, 0)], 1);
        queue.allow(1);
        queue.pause(true);
        assert_eq!(queue.next(0, |_| 1), Next::Later);
        std::thread::scope(|threads| {
            let waiting = threads.spawn(|| queue.wait());
            std::thread::sleep(std::time::Duration::from_millis(20));
            assert!(!waiting.is_finished());
            queue.pause(false);
        });
        assert_eq!(units(queue.next(0, |_| 1)), (0, vec![0]));
        queue.pause(true);
        queue.close();
        queue.wait();
        assert_eq!(queue.next(0, |_| 1), Next::Never);
    }

    #[test]
    fn tiles_may_be_decided_one_by_one() {
        let queue = Queue::default();
        queue.fill((0..4).map(|tile| (tile, 0)), 1);
        for tile in 0..4 {
            queue.allow_tile(tile, 2, f32::INFINITY);
        }
        let first = group(queue.next(0, |_| 3));
        assert_eq!((first.epoch, &first.tiles[..]), (0, &[0, 1, 2][..]));
        queue.done(&first);
        // The lowest epochs first, where all are needed as much.
        let [last, second] = [0, 0].map(|device| group(queue.next(device, |_| 9)));
        assert_eq!((last.epoch, &last.tiles[..], second.epoch, &second.tiles[..]), (0, &[3][..], 1, &[0, 1, 2][..]));
        queue.done(&last);
        queue.done(&second);
        assert_eq!(units(queue.next(0, |_| 9)), (1, vec![3]));
        assert_eq!(queue.next(0, |_| 9), Next::Later);
        // Tile 1 has ended. What is taken together is of one epoch.
        queue.allow_tile(0, 9, 0.1);
        queue.allow_tile(2, 9, 0.3);
        let most = group(queue.next(0, |_| 1));
        assert_eq!((most.epoch, &most.tiles[..]), (2, &[2][..]));
        queue.done(&most);
        assert_eq!(units(queue.next(0, |_| 2)), (3, vec![2]));
        assert_eq!(units(queue.next(0, |_| 2)), (2, vec![0]));
        assert_eq!(queue.next(0, |_| 9), Next::Later);
    }

    /// Tiles of which something is there already go on from there; only new ones get epochs together.
    #[test]
    fn new_tiles_may_get_several_epochs_at_once() {
        let queue = Queue::default();
        queue.fill([(0, 3), (1, 0), (2, 0), (3, 8)], 7);
        queue.allow(8);
        let new = group(queue.next(0, |epoch| if epoch == 6 { 9 } else { 0 }));
        assert_eq!((new.epoch, new.epochs, &new.tiles[..]), (0, 7, &[1, 2][..]));
        assert!(queue.is_wanted(&new) && queue.claim(&new) && !queue.is_wanted(&new));
        assert_eq!(units(queue.next(0, |_| 9)), (3, vec![0]));
        assert_eq!(queue.next(0, |_| 9), Next::Later);
        queue.done(&new);
        assert_eq!(units(queue.next(0, |_| 9)), (7, vec![1, 2]));
    }
}
