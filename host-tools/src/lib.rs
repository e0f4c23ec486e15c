//! The engineer's tools around flexid: import a robot, simulate it, identify it, watch it.
#![forbid(unsafe_code)]

mod check;
pub mod client;
pub mod commands;
mod compare;
mod compensate;
mod constant;
pub mod demo;
mod exit;
mod json;
mod lobes;
mod map;
mod numbers;
mod output;
mod picture;
pub mod plan;
mod predict;
mod progress;
pub mod recording;
mod show;
pub mod urdf;
mod web;
