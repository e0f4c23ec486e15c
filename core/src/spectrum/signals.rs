//! Spectra of the three signals of a sensor, and why a record has none.

use core::error::Error;
use core::fmt;

use heapless::Vec;

use super::fft;

/// Fewest bins of a fit.
pub(super) const MIN_BINS: usize = 8;

/// Three signals, one per axis of a sensor, over the bins of a band.
#[derive(Clone, Debug, PartialEq)]
pub struct Spectrum<const B: usize> {
    /// Real parts.
    pub re: [Vec<f32, B>; 3],
    /// Imaginary parts.
    pub im: [Vec<f32, B>; 3],
}

impl<const B: usize> Spectrum<B> {
    pub(crate) const EMPTY: Self =
        Self { re: [const { Vec::new() }; 3], im: [const { Vec::new() }; 3] };

    /// Real and imaginary parts along each axis.
    pub(crate) fn parts(&self) -> [[&[f32]; 2]; 3] {
        core::array::from_fn(|axis| [&self.re[axis][..], &self.im[axis][..]])
    }

    /// Adds the next bin: real and imaginary part along each axis. It must have room.
    pub(crate) fn push(&mut self, bin: &[[f64; 2]; 3]) {
        for (axis, [re, im]) in bin.iter().enumerate() {
            let _ = self.re[axis].push(*re as f32);
            let _ = self.im[axis].push(*im as f32);
        }
    }

    /// Real and imaginary part along each axis in a bin.
    pub(crate) fn at(&self, bin: usize) -> [[f64; 2]; 3] {
        core::array::from_fn(|axis| [&self.re, &self.im].map(|part| f64::from(part[axis][bin])))
    }

    /// Sum of the squares.
    pub(super) fn power(&self) -> f64 {
        self.re.iter().chain(&self.im).flatten().map(|part| f64::from(part * part)).sum()
    }
}

/// Why a record has no spectrum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpectrumError {
    /// Its length, or that of its parts, is not a power of two from 256 to 32,768, or one of its signals has another length.
    Length(usize),
    /// The band holds this many bins; a spectrum has at least 8, and at most as many as the capacity.
    Bins(usize),
    /// The record's pose has this many angles, not one per driven joint.
    Pose(usize),
    /// The record holds a value that is not finite: a sample, an angle, or a noise.
    NotFinite,
    /// The force in the band is hardly more than its noise.
    NoForce,
    /// The robot moves evenly in no part of the record.
    Uneven,
}

impl fmt::Display for SpectrumError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length(samples) => write!(
                f,
                "the record has {samples} samples: must be a power of two from {} to {}, the same for every signal",
                fft::MIN_SAMPLES,
                fft::MAX_SAMPLES
            ),
            Self::Bins(bins) if *bins < MIN_BINS => write!(
                f,
                "the record's band holds {bins} bins, of {MIN_BINS} that are needed: widen the band or record for longer"
            ),
            Self::Bins(bins) => write!(
                f,
                "the record's band holds {bins} bins, more than fit: narrow the band or record for less time"
            ),
            Self::Pose(angles) => {
                write!(f, "the record's pose has {angles} angles: give one per driven joint")
            }
            Self::NotFinite => {
                f.write_str("the record holds a value that is not finite: leave it out")
            }
            Self::NoForce => {
                f.write_str("the record's force in the band is hardly above its noise: cut harder")
            }
            Self::Uneven => f.write_str(
                "the robot starts, stops or turns in most of the record: keep the feed even for longer",
            ),
        }
    }
}

impl Error for SpectrumError {}
