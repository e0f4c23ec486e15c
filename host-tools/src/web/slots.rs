//! How many connections there may be, in all and from one address.

use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Slots that addresses share.
#[derive(Clone, Debug)]
pub(super) struct Slots {
    /// Number of slots.
    all: usize,
    /// Number of slots that one address may take.
    of_one: usize,
    taken: Arc<Mutex<HashMap<IpAddr, usize>>>,
}

/// A slot. It is free again when it is dropped.
#[derive(Debug)]
pub(super) struct Slot {
    slots: Slots,
    address: IpAddr,
}

impl Slots {
    pub(super) fn new(all: usize, of_one: usize) -> Self {
        Self { all, of_one, taken: Arc::default() }
    }

    /// A slot for `address`; `None` where all are taken, or the address has its share.
    pub(super) fn take(&self, address: IpAddr) -> Option<Slot> {
        let address = network(address);
        let mut taken = self.lock();
        if taken.values().sum::<usize>() >= self.all {
            return None;
        }
        let own = taken.entry(address).or_default();
        // An entry of zero is not possible here: the share is at least one.
        if *own >= self.of_one {
            return None;
        }
        *own += 1;
        Some(Slot { slots: self.clone(), address })
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<IpAddr, usize>> {
        // The numbers are right between any two statements.
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The range from which one machine may choose its address: an IPv4 address, or the first half of an IPv6 address.
fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(own) => IpAddr::V6((u128::from(own) >> 64 << 64).into()),
        own => own,
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        let mut taken = self.slots.lock();
        if let Some(own) = taken.get_mut(&self.address) {
            *own -= 1;
            if *own == 0 {
                taken.remove(&self.address);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_has_one_share() {
        let network = |text: &str| network(text.parse().unwrap()).to_string();
        assert_eq!(network("2001:db8:1:2:3:4:5:6"), "2001:db8:1:2::");
        assert_eq!(network("::ffff:10.0.0.1"), "10.0.0.1");
        assert_eq!(network("10.0.0.1"), "10.0.0.1");
    }

    #[test]
    fn an_address_has_its_share_and_gives_it_back() {
        let slots = Slots::new(3, 2);
        let [one, other] = [[127, 0, 0, 1], [10, 0, 0, 1]].map(IpAddr::from);
        let (first, second) = (slots.take(one), slots.take(one));
        assert!(first.is_some() && second.is_some());
        assert!(slots.take(one).is_none(), "more than its share");
        let third = slots.take(other);
        assert!(third.is_some());
        assert!(slots.take(other).is_none(), "more than there are");
        drop(first);
        assert!(slots.take(one).is_some());
        drop((second, third));
        assert!(slots.lock().is_empty());
    }
}
