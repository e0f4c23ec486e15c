//! Follows the daemon: reads its messages, and connects anew whenever the connection ends.

use std::thread;
use std::time::{Duration, Instant, SystemTime};

use flexid_edge::console::complain;
use flexid_pipeline::config::Listen;
use tokio::sync::watch;

use super::PACE;
use super::parts::{self, Parts};
use super::state::{Link, State};
use crate::show::view::View;
use flexid_edge::client::{Client, ClientError};

/// Interval between two attempts to connect.
const RETRY: Duration = Duration::from_millis(500);
/// Longest silence of a daemon that is reached. Chosen: ten times the interval at which a daemon tells its state.
const SILENCE: Duration = Duration::from_secs(5);

/// A page of a daemon that is not reached yet.
pub(crate) fn begin(address: &Listen) -> watch::Sender<Parts> {
    watch::Sender::new(parts::render(&State::new(address)))
}

/// Follows the daemon at `address`, and publishes the parts of the page as they change. It says once on stderr why there is no connection. It does
/// not return.
pub(crate) fn follow(address: &Listen, page: &watch::Sender<Parts>) -> ! {
    let mut state = State::new(address);
    let mut is_told = false;
    loop {
        let Err(error) = listen(address, &mut state, page);
        if !is_told {
            complain(&format!("note: {error}; the page goes on trying"));
            is_told = true;
        }
        state.link = Link::Lost(error.to_string());
        publish(&state, page);
        thread::sleep(RETRY);
    }
}

/// Publishes messages until the connection ends.
fn listen(
    address: &Listen,
    state: &mut State,
    page: &watch::Sender<Parts>,
) -> Result<std::convert::Infallible, ClientError> {
    let mut client = Client::connect(address, None)?;
    state.link = Link::Live;
    state.view = View::default();
    let (mut heard, mut published) = (Instant::now(), Instant::now());
    let mut changed = true;
    loop {
        let due = PACE.saturating_sub(published.elapsed());
        match client.next(if changed { due } else { SILENCE })? {
            Some(message) => {
                state.view.take(message);
                state.heard = Some(SystemTime::now());
                (heard, changed) = (Instant::now(), true);
            }
            None if heard.elapsed() >= SILENCE => return Err(ClientError::Silent(address.clone())),
            None => {}
        }
        if changed && published.elapsed() >= PACE {
            publish(state, page);
            (published, changed) = (Instant::now(), false);
        }
    }
}

/// Publishes the parts if any differs.
fn publish(state: &State, page: &watch::Sender<Parts>) {
    let parts = parts::render(state);
    page.send_if_modified(|shown| {
        let modified = *shown != parts;
        if modified {
            *shown = parts;
        }
        modified
    });
}
