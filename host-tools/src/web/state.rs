//! The latest of a daemon.

use std::time::SystemTime;

use flexid_pipeline::config::Listen;

use crate::show::view::View;

/// Connection to the daemon.
#[derive(Clone, Debug)]
pub(super) enum Link {
    /// The daemon is reached.
    Live,
    /// The daemon is not reached, for this reason.
    Lost(String),
}

/// The latest of a daemon.
pub(super) struct State {
    /// Address of the daemon.
    pub(super) address: String,
    /// Connection to the daemon.
    pub(super) link: Link,
    /// Time of the newest message.
    pub(super) heard: Option<SystemTime>,
    /// The newest messages. They stay when the connection ends.
    pub(super) view: View,
}

impl State {
    pub(super) fn new(address: &Listen) -> Self {
        let link = Link::Lost("not connected yet".to_owned());
        Self { address: address.to_string(), link, heard: None, view: View::default() }
    }
}
