//! From an estimate to its report, its confidence and its warnings.

mod assembly;
mod basis;
mod confidence;
mod directions;
mod finding;
mod refusal;
mod residuals;
mod summary;
mod verdict;
mod warnings;

pub(crate) use assembly::report;
pub(crate) use basis::Basis;
pub(crate) use confidence::confidence;
pub use finding::Finding;
pub(crate) use refusal::no_equilibrium;
pub use summary::Summary;
