//! From an estimate to its finding: report, confidence and warnings.

mod answer;
mod assembly;
mod basis;
mod confidence;
mod directions;
mod explanations;
mod fault;
mod imperfections;
mod interval;
mod kind;
mod lines;
mod louder_cut;
mod residuals;
mod statics;
mod summary;
mod verdict;
mod warnings;

pub(crate) use answer::{Place, answer};
pub(crate) use assembly::report;
pub(crate) use basis::Basis;
pub(crate) use confidence::{Details, confidence};
pub(crate) use explanations::contradicted;
pub(crate) use fault::{without_equilibrium, without_spectrum};
pub(crate) use lines::lines;
pub(crate) use louder_cut::louder_cut;
pub use residuals::MAX_CONSISTENCY;
pub(crate) use residuals::distortion;
pub use statics::{StaticReport, StaticTestReport};
pub use summary::Summary;
