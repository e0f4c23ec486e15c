//! The engineer's tools around flexid: import a robot, simulate it, identify it, watch it.
#![forbid(unsafe_code)]

mod check;
pub mod commands;
mod compare;
mod compensate;
mod constant;
pub mod demo;
pub mod dh;
mod feed;
mod findings;
mod fleet;
mod history;
mod json;
mod lobes;
mod map;
pub mod mesh;
mod metrics;
mod new;
mod numbers;
mod picture;
mod place;
pub mod plan;
mod predict;
pub mod recording;
mod show;
mod summary;
pub mod urdf;
mod web;
mod window;
