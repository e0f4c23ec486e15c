//! Levels of a fit: errors of the model that its weights allow for at first, and when a level ends.

/// Relative error η of the model's spectra while the band widens, and where a fit to a plant begins. Chosen: 0.1 finds the basin as often, 0.3
/// less often.
pub(crate) const RELATIVE: f64 = 0.05;
/// Relative error η of the model's spectra on the last level of a descent. Chosen: from the end of this level a fit that weighs by the noise
/// alone finds the minimum.
pub(crate) const LAST_RELATIVE: f64 = 0.0125;
/// Relative decrease of the cost in a step below which a level of a descent ends. Chosen: a level need not reach its minimum, since the next
/// level has another one.
pub(crate) const NEGLIGIBLE: f64 = 1e-3;
