//! The engineer's tools around flexid: import a robot, simulate it, identify it, watch it.
#![forbid(unsafe_code)]

pub mod client;
pub mod commands;
mod compact;
mod confidence;
pub mod demo;
mod exit;
mod news;
mod output;
mod page;
pub mod plan;
mod progress;
mod readout;
pub mod recording;
pub mod reproduce;
pub mod simulation;
pub mod table;
pub mod truth;
pub mod urdf;
pub mod validation;
