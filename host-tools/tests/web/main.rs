//! `flexid web` before the real daemon, which runs in this process on a socket pair that carries the same frames as a bus.

mod browser;
mod daemon;
mod http;
mod page;
mod program;
