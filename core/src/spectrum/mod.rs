//! From a record to its spectra, the data of the search and the refinement.
//!
//! The end of a record is the central problem. Low modes ring on for seconds, so that on the plain DFT of a record
//! `X(ω) = H(ω) F(ω)` is wrong by more than everything that is sought. There are two remedies:
//!
//! - [`thinned`]: signals weighted by `e^(−αt)` make it true on the line `s = α + iω`, up to `e^(−αT)`, for a record that starts at
//!   rest. A Hann window does well enough for other records. The search fits these spectra.
//! - [`Experiment`]'s own spectra are the plain DFT over exactly the record. One record is one period of a periodic motion. Unknown
//!   loads on the bushings mend its seam, and the refinement estimates them beside the parameters ([`crate::refine`]).

mod adjusted;
mod cut_noise;
mod drift;
mod experiment;
pub mod fft;
mod measurement;
mod movement;
mod part;
mod receptance;
mod signals;
mod site;
pub mod thinned;
mod tone;

pub use cut_noise::{CutNoise, MAX_BANDS};
pub use experiment::{Experiment, Kind, LEAST_FORCE};
pub use measurement::Measurement;
pub(crate) use movement::Movement;
pub use part::Part;
pub use receptance::{MeasuredBin, MeasuredReceptance};
pub use signals::{Spectrum, SpectrumError};
pub use site::Site;
pub use tone::{MAX_TONES, Tone};
