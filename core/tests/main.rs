//! The integration tests of core as one program: what is generic there is compiled once for all of them.

mod bad_data;
mod common;
mod cut_noise;
mod distortion;
mod feed;
mod hold_out;
mod identify;
mod information;
mod motion;
mod mounting;
mod noise;
mod nuisances;
mod plants;
mod receptance;
mod receptances;
mod refine;
mod search;
mod static_quality;
mod statics;
mod stream;
mod thinning;
mod widths;
