//! What a plant runs beside the daemons of its robots. [`publish`] keeps each finding of a daemon in an outbox and sends it to the MQTT
//! broker of the box; the broker's bridge carries it to that of the plant, and [`collect`] from there into PostgreSQL.
//!
//! ```text
//! flexid-edge --socket--> outbox --MQTT--> mosquitto on the box --bridge, TLS--> mosquitto of the plant --> PostgreSQL
//! ```
#![forbid(unsafe_code)]

mod broker;
pub mod collect;
pub mod envelope;
mod faults;
pub mod link;
pub mod moment;
pub mod outbox;
pub mod place;
pub mod publish;
