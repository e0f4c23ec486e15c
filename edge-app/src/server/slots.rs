//! Slots of the clients. When all are taken, a client of the user and the process that hold most of them is evicted for another.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Most clients at a time. A further client is refused, unless another peer holds more than its share.
pub const MAX_CLIENTS: usize = 16;
/// Most threads of clients: those that are served, and as many that are evicted and have not left yet.
const MAX_THREADS: usize = 2 * MAX_CLIENTS;

/// Origin of a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Peer {
    /// The client is a process that came through a Unix socket. The kernel names it.
    Process { user: u32, process: i32 },
    /// The client came by TCP. A process may take any address of the loopback interface, so that all clients by TCP count as
    /// one peer.
    Network,
}

impl Peer {
    fn user(self) -> Option<u32> {
        match self {
            Self::Process { user, .. } => Some(user),
            Self::Network => None,
        }
    }
}

/// The slots of all clients.
#[derive(Debug, Default)]
pub(super) struct Slots(Mutex<Vec<Taken>>);

#[derive(Clone, Debug)]
struct Taken {
    peer: Peer,
    evicted: Arc<AtomicBool>,
}

/// Slot of a client. It is free again when it is dropped.
#[derive(Debug)]
pub(super) struct Slot<'a> {
    slots: &'a Slots,
    evicted: Arc<AtomicBool>,
}

impl Slots {
    /// Returns a slot for a client. When all are taken, it is the slot of a peer that holds more than `peer` would. Returns
    /// `None` if there is no other peer of that kind, or if too many clients have not left yet.
    pub(super) fn take(&self, peer: Peer) -> Option<Slot<'_>> {
        let mut all = self.lock();
        if all.len() >= MAX_THREADS {
            return None;
        }
        let served = || all.iter().filter(|taken| !taken.evicted.load(Ordering::Relaxed));
        if served().count() >= MAX_CLIENTS {
            let peers: Vec<Peer> = served().map(|taken| taken.peer).collect();
            let taken = served().nth(to_evict(&peers, peer)?)?;
            taken.evicted.store(true, Ordering::Relaxed);
        }
        let evicted = Arc::new(AtomicBool::new(false));
        all.push(Taken { peer, evicted: Arc::clone(&evicted) });
        Some(Slot { slots: self, evicted })
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Taken>> {
        // The list is whole between any two statements, so that a panic leaves it valid.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Slot<'_> {
    /// Returns whether the client must leave, since another peer gets its slot.
    pub(super) fn is_evicted(&self) -> bool {
        self.evicted.load(Ordering::Relaxed)
    }
}

impl Drop for Slot<'_> {
    fn drop(&mut self) {
        self.slots.lock().retain(|taken| !Arc::ptr_eq(&taken.evicted, &self.evicted));
    }
}

/// Returns the index of the slot that is evicted for `newcomer`: the oldest slot of the process that holds most, of the user who
/// holds most. The same rule holds between the processes of one user. No slot is evicted for a newcomer that would then hold as
/// many.
fn to_evict(held: &[Peer], newcomer: Peer) -> Option<usize> {
    let users = |peer: Peer| held.iter().filter(|other| other.user() == peer.user()).count();
    let processes = |peer: Peer| held.iter().filter(|other| **other == peer).count();
    // `max_by_key` takes the last of equal ones, which is the oldest in reverse order.
    let backwards = || (0..held.len()).rev();
    let largest = backwards().max_by_key(|&index| (users(held[index]), processes(held[index])))?;
    if users(newcomer) + 1 < users(held[largest]) && newcomer.user() != held[largest].user() {
        return Some(largest);
    }
    let own = backwards().filter(|&index| held[index].user() == newcomer.user());
    let largest = own.max_by_key(|&index| processes(held[index]))?;
    (processes(newcomer) + 1 < processes(held[largest])).then_some(largest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peer(user: u32, process: i32) -> Peer {
        Peer::Process { user, process }
    }

    #[test]
    fn who_holds_most_is_evicted_but_not_for_one_who_would_hold_as_many() {
        let crowd = [peer(1, 10); 16];
        assert_eq!(to_evict(&crowd, peer(1, 10)), None);
        assert_eq!(to_evict(&crowd, peer(1, 11)), Some(0));
        assert_eq!(to_evict(&crowd, peer(2, 20)), Some(0));
        assert_eq!(to_evict(&crowd, Peer::Network), Some(0));
        assert_eq!(to_evict(&[Peer::Network; 16], Peer::Network), None);

        // One user has many processes, and one has a single process.
        let mut forks: Vec<Peer> = (0..15).map(|process| peer(1, process)).collect();
        forks.insert(0, peer(2, 20));
        assert_eq!(to_evict(&forks, peer(3, 30)), Some(1));
        assert_eq!(to_evict(&forks, peer(2, 21)), Some(1));
        assert_eq!(to_evict(&forks, peer(1, 99)), None);

        let halves: Vec<Peer> = (0..16).map(|index| peer(1 + index % 2, 1)).collect();
        assert_eq!(to_evict(&halves, peer(1, 2)), Some(0));
        assert_eq!(to_evict(&halves, peer(1, 1)), None);
        assert_eq!(to_evict(&halves, peer(3, 1)), Some(0));
    }

    #[test]
    fn those_that_are_evicted_count_until_they_have_left() {
        let slots = Slots::default();
        let mut crowd: Vec<Slot> =
            (0..MAX_CLIENTS).map(|_| slots.take(peer(1, 1)).unwrap()).collect();
        assert!(slots.take(peer(1, 1)).is_none());
        let other = slots.take(peer(2, 2)).unwrap();
        assert_eq!(crowd.iter().position(Slot::is_evicted), Some(0));
        drop(crowd.remove(0));
        assert!(slots.take(peer(1, 1)).is_none());
        assert!(!other.is_evicted());
        drop(other);
        assert!(slots.take(peer(1, 1)).is_some());

        // Peers that push each other out do not accumulate threads.
        let all: Vec<Slot> = (3..99).filter_map(|user| slots.take(peer(user, 1))).collect();
        assert!(crowd.len() + all.len() <= MAX_THREADS);
    }
}
