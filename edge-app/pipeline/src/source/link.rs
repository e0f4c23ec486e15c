//! The state of a CAN link, derived from its socket, its error frames and its interface.
//!
//! | seen                                             | the link is then                         |
//! | ------------------------------------------------ | ---------------------------------------- |
//! | a frame that is no error                         | up                                       |
//! | an error frame: bus-off                          | bus-off                                  |
//! | an error frame: restarted                        | up                                       |
//! | any other error frame                            | as before: a controller that is bus-off or a link that is down may still have some to deliver |
//! | ENETDOWN, or the interface is not set up         | down                                     |
//! | the interface is set up, but has no carrier      | bus-off: a CAN driver removes it then    |
//! | the interface is set up and running              | up                                       |
//! | the interface does not exist                     | gone                                     |
//!
//! [`Link::fault`] is what is wrong now, and is `None` when it is over. [`Link::errors`] counts the errors since the
//! start. [`Link::losses`] counts how often the link was lost.

use flexid_wire::trouble::BusFaultKind;

use super::frame::Frame;

// Classes of error frames, bits of their identifier (`linux/can/error.h`).
const TX_TIMEOUT: u32 = 0x001;
const LOST_ARBITRATION: u32 = 0x002;
const CONTROLLER: u32 = 0x004;
const PROTOCOL: u32 = 0x008;
const TRANSCEIVER: u32 = 0x010;
const NO_ACKNOWLEDGEMENT: u32 = 0x020;
const BUS_OFF: u32 = 0x040;
const BUS_ERROR: u32 = 0x080;
const RESTARTED: u32 = 0x100;
// States of a controller, bits of the second byte of data.
const OVERFLOW: u8 = 0x03;
const WARNING: u8 = 0x0C;
const PASSIVE: u8 = 0x30;
const ACTIVE: u8 = 0x40;

/// State of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkState {
    /// Frames can come.
    #[default]
    Up,
    /// The link is down.
    Down,
    /// The controller has left the bus after too many errors.
    BusOff,
    /// The interface does not exist any more.
    Gone,
}

/// Numbers of error frames of each class since the start. One frame may belong to several classes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ErrorCounts {
    /// The controller has left the bus after too many errors of its own.
    pub bus_off: u64,
    /// The controller has come back to the bus.
    pub restarted: u64,
    /// An error counter of the controller is above 127: the controller no longer signals the errors that it sees.
    pub controller_passive: u64,
    /// An error counter of the controller is above 96.
    pub controller_warning: u64,
    /// The controller had no room for a frame.
    pub controller_overflow: u64,
    /// Frames break the rules of the bus, most often because of another bit rate or bad wiring.
    pub protocol: u64,
    /// No node acknowledged a frame that was sent.
    pub no_acknowledgement: u64,
    /// The transceiver reports a fault of the wires.
    pub transceiver: u64,
    /// A frame had to wait for others.
    pub lost_arbitration: u64,
    /// A frame could not be sent in time.
    pub transmit_timeout: u64,
}

/// State of an interface, as the system reports it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interface {
    Missing,
    Down,
    /// The interface is set up, but has no carrier.
    NoCarrier,
    Running,
}

/// Error state of a controller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Controller {
    #[default]
    Active,
    Warning,
    Passive,
}

/// A link and its history.
#[derive(Clone, Debug, Default)]
pub(super) struct Link {
    pub(super) state: LinkState,
    pub(super) errors: ErrorCounts,
    /// Number of times that the link was lost, for however short a time.
    pub(super) losses: u64,
    controller: Controller,
}

impl Link {
    /// Notes a frame that is no error.
    pub(super) fn hear(&mut self) {
        self.go(LinkState::Up);
    }

    /// Notes an error frame. `class` is its identifier without flags.
    pub(super) fn err(&mut self, class: u32, data: &[u8]) {
        let Self { errors, controller, .. } = self;
        let is = |bits| u64::from(class & bits != 0);
        errors.bus_off += is(BUS_OFF);
        errors.restarted += is(RESTARTED);
        errors.protocol += is(PROTOCOL | BUS_ERROR);
        errors.no_acknowledgement += is(NO_ACKNOWLEDGEMENT);
        errors.transceiver += is(TRANSCEIVER);
        errors.lost_arbitration += is(LOST_ARBITRATION);
        errors.transmit_timeout += is(TX_TIMEOUT);
        if class & CONTROLLER != 0 {
            let says = data.get(1).copied().unwrap_or(0);
            errors.controller_overflow += u64::from(says & OVERFLOW != 0);
            errors.controller_warning += u64::from(says & WARNING != 0);
            errors.controller_passive += u64::from(says & PASSIVE != 0);
            if says & PASSIVE != 0 {
                *controller = Controller::Passive;
            } else if says & WARNING != 0 {
                *controller = Controller::Warning;
            } else if says & ACTIVE != 0 {
                *controller = Controller::Active;
            }
        }
        if class & (BUS_OFF | RESTARTED) != 0 {
            // A controller that restarts was off the bus, even if the bus-off frame was lost.
            self.go(LinkState::BusOff);
        }
        if class & (BUS_OFF | RESTARTED) == RESTARTED {
            self.go(LinkState::Up);
            self.controller = Controller::Active;
        }
    }

    /// Notes that the socket reports the link as down.
    pub(super) fn go_down(&mut self) {
        self.go(LinkState::Down);
    }

    /// Notes the state of the interface.
    pub(super) fn look(&mut self, interface: Interface) {
        self.go(match interface {
            Interface::Missing => LinkState::Gone,
            Interface::Down => LinkState::Down,
            Interface::NoCarrier => LinkState::BusOff,
            Interface::Running => LinkState::Up,
        });
        if self.state != LinkState::Up {
            self.controller = Controller::Active;
        }
    }

    fn go(&mut self, state: LinkState) {
        self.losses += u64::from(self.state == LinkState::Up && state != LinkState::Up);
        self.state = state;
    }

    /// Returns what is wrong with the link now.
    pub(super) fn fault(&self) -> Option<BusFaultKind> {
        match (self.state, self.controller) {
            (LinkState::Up, Controller::Active) => None,
            (LinkState::Up, Controller::Warning) => Some(BusFaultKind::ManyErrors),
            (LinkState::Up, Controller::Passive) => Some(BusFaultKind::ErrorPassive),
            (LinkState::Down, _) => Some(BusFaultKind::Down),
            (LinkState::BusOff, _) => Some(BusFaultKind::BusOff),
            (LinkState::Gone, _) => Some(BusFaultKind::Gone),
        }
    }
}

/// Returns the class of an error frame: its identifier without flags.
pub(super) fn class(frame: &Frame) -> u32 {
    match frame.id {
        embedded_can::Id::Extended(id) => id.as_raw(),
        embedded_can::Id::Standard(id) => id.as_raw().into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An observation of a link.
    #[derive(Clone, Copy, Debug)]
    enum Seen {
        Frame,
        Error(u32, u8),
        NetDown,
        Look(Interface),
    }

    fn see(link: &mut Link, seen: Seen) {
        match seen {
            Seen::Frame => link.hear(),
            Seen::Error(class, says) => link.err(class, &[0, says, 0, 0, 0, 0, 0, 0]),
            Seen::NetDown => link.go_down(),
            Seen::Look(interface) => link.look(interface),
        }
    }

    #[test]
    fn every_state_goes_where_the_table_says() {
        use LinkState::{BusOff, Down, Gone, Up};
        let stays = None;
        for (seen, then) in [
            (Seen::Frame, Some(Up)),
            (Seen::Error(BUS_OFF, 0), Some(BusOff)),
            (Seen::Error(BUS_OFF | CONTROLLER | BUS_ERROR, PASSIVE), Some(BusOff)),
            (Seen::Error(RESTARTED, 0), Some(Up)),
            (Seen::Error(PROTOCOL | BUS_ERROR, 0), stays),
            (Seen::Error(CONTROLLER, PASSIVE), stays),
            (Seen::Error(CONTROLLER, ACTIVE), stays),
            (Seen::Error(NO_ACKNOWLEDGEMENT, 0), stays),
            (Seen::Error(0, 0), stays),
            (Seen::NetDown, Some(Down)),
            (Seen::Look(Interface::Down), Some(Down)),
            (Seen::Look(Interface::NoCarrier), Some(BusOff)),
            (Seen::Look(Interface::Running), Some(Up)),
            (Seen::Look(Interface::Missing), Some(Gone)),
        ] {
            for before in [Up, Down, BusOff, Gone] {
                let mut link = Link { state: before, ..Link::default() };
                see(&mut link, seen);
                assert_eq!(link.state, then.unwrap_or(before), "{before:?}, {seen:?}");
                assert_eq!(
                    link.fault().is_none(),
                    link.state == Up && !matches!(seen, Seen::Error(CONTROLLER, PASSIVE)),
                    "{before:?}, {seen:?}"
                );
            }
        }
    }

    #[test]
    fn each_time_the_link_is_lost_counts_once() {
        let mut link = Link::default();
        for (seen, losses) in [
            (Seen::Frame, 0),
            (Seen::Error(CONTROLLER, PASSIVE), 0),
            (Seen::Error(BUS_OFF, 0), 1),
            (Seen::Look(Interface::NoCarrier), 1),
            (Seen::Look(Interface::Down), 1),
            (Seen::Error(RESTARTED, 0), 1),
            (Seen::NetDown, 2),
            (Seen::Look(Interface::Running), 2),
            (Seen::Look(Interface::Missing), 3),
            (Seen::Frame, 3),
            // The bus-off frame was lost.
            (Seen::Error(RESTARTED, 0), 4),
        ] {
            see(&mut link, seen);
            assert_eq!(link.losses, losses, "{seen:?}");
        }
        assert_eq!(link.state, LinkState::Up, "two looks at the state alone show none of them");
    }

    #[test]
    fn a_fault_ends_and_its_count_stays() {
        let mut link = Link::default();
        let course = [
            (Seen::Error(CONTROLLER, 0x08), Some(BusFaultKind::ManyErrors)),
            (Seen::Error(CONTROLLER | PROTOCOL, 0x20), Some(BusFaultKind::ErrorPassive)),
            (Seen::Error(BUS_OFF, 0), Some(BusFaultKind::BusOff)),
            (Seen::Error(RESTARTED, 0), None),
            (Seen::NetDown, Some(BusFaultKind::Down)),
            (Seen::Look(Interface::Running), None),
            (Seen::Error(CONTROLLER, 0x10), Some(BusFaultKind::ErrorPassive)),
            (Seen::Error(CONTROLLER, ACTIVE), None),
            (Seen::Look(Interface::Missing), Some(BusFaultKind::Gone)),
            (Seen::Frame, None),
        ];
        for (seen, fault) in course {
            see(&mut link, seen);
            assert_eq!(link.fault(), fault, "{seen:?}");
        }
        let expected = ErrorCounts {
            bus_off: 1,
            restarted: 1,
            controller_passive: 2,
            controller_warning: 1,
            protocol: 1,
            ..ErrorCounts::default()
        };
        assert_eq!(link.errors, expected);
    }

    #[test]
    fn each_class_has_its_count() {
        let count = |class, says| {
            let mut link = Link::default();
            link.err(class, &[0, says]);
            link.errors
        };
        let none = ErrorCounts::default();
        for (errors, expected) in [
            (count(TX_TIMEOUT, 0), ErrorCounts { transmit_timeout: 1, ..none }),
            (count(LOST_ARBITRATION, 0), ErrorCounts { lost_arbitration: 1, ..none }),
            (count(CONTROLLER, 0x01), ErrorCounts { controller_overflow: 1, ..none }),
            (count(PROTOCOL, 0), ErrorCounts { protocol: 1, ..none }),
            (count(BUS_ERROR, 0), ErrorCounts { protocol: 1, ..none }),
            (count(PROTOCOL | BUS_ERROR, 0), ErrorCounts { protocol: 1, ..none }),
            (count(TRANSCEIVER, 0), ErrorCounts { transceiver: 1, ..none }),
            (count(NO_ACKNOWLEDGEMENT, 0), ErrorCounts { no_acknowledgement: 1, ..none }),
        ] {
            assert_eq!(errors, expected);
        }
        let mut link = Link::default();
        link.err(CONTROLLER, &[]);
        assert_eq!(link.errors, none);
    }
}
