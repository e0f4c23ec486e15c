//! The daemon's live state as a page for browsers.
//!
//! | file          | what                                                                |
//! | ------------- | ------------------------------------------------------------------- |
//! | `follow`      | the connection to the daemon, made anew whenever it ends            |
//! | `parts`       | the parts of the page that change, as HTML                          |
//! | `parameters`  | the part with all parameters, and the pictures of their intervals   |
//! | `document`    | the page around the parts, and its Content-Security-Policy          |
//! | `events`      | the stream of changed parts                                         |
//! | `service`     | the answers to requests                                             |
//! | `connections` | connections of bounded number, size and patience                    |
//! | `slots`       | how many of them each address may have                              |
//!
//! Everything is rendered here. The script in the page only replaces parts by those of the stream. Each client reads the latest
//! parts at its own pace, and none holds up another or the daemon.

mod class;
pub(crate) mod connections;
mod document;
mod events;
pub(crate) mod follow;
mod parameters;
mod parts;
pub(crate) mod service;
mod slots;
mod state;

use std::time::Duration;

/// Shortest time between two changes of the page.
const PACE: Duration = Duration::from_millis(200);
