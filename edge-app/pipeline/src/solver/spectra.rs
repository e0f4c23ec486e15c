//! Spectra of a record in bands, and those of the newest record that the daemon publishes.

use flexid_wire::spectra::{self, MAX_BANDS, Spectra};

use super::{FittedBin, Solver};

/// Neighbouring bins of a record.
#[derive(Clone, Copy, Debug)]
pub struct Band<'a> {
    bins: &'a [FittedBin],
    /// Length of the record, s.
    seconds: f64,
}

/// The bins of a record of this length, s, in at most `most` bands of equal ratios. Bands without bins are left out.
pub fn bands(bins: &[FittedBin], seconds: f64, most: usize) -> impl Iterator<Item = Band<'_>> {
    let first = bins.first().map_or(1.0, |bin| bin.frequency_hz);
    let last = bins.last().map_or(1.0, |bin| bin.frequency_hz);
    let place = move |bin: &FittedBin| {
        let part = (bin.frequency_hz / first).ln() / (last / first).ln().max(f64::MIN_POSITIVE);
        // The conversion saturates.
        ((part * most as f64) as usize).min(most.saturating_sub(1))
    };
    bins.chunk_by(move |one, other| place(one) == place(other))
        .map(move |bins| Band { bins, seconds })
}

impl Band<'_> {
    /// Geometric mean of the frequencies, Hz.
    pub fn frequency_hz(&self) -> f64 {
        self.mean(|bin| bin.frequency_hz.ln()).exp()
    }

    /// Amplitude spectral density of what has this power in each bin, the square of a DFT times the sample period:
    /// `√(2/T · mean)`, of one side.
    pub fn density(&self, power: impl Fn(&FittedBin) -> f64) -> f64 {
        (2.0 * self.mean(power) / self.seconds).sqrt()
    }

    /// Density of the measured acceleration along an axis, (m/s²)/√Hz.
    pub fn measured(&self, axis: usize) -> f64 {
        self.density(|bin| square(bin.measured[axis]))
    }

    /// Density of the modelled acceleration along an axis, (m/s²)/√Hz.
    pub fn modelled(&self, axis: usize) -> f64 {
        self.density(|bin| {
            let (measured, left) = (bin.measured[axis], bin.left[axis]);
            square([measured[0] - left[0], measured[1] - left[1]])
        })
    }

    /// Density of what the noise of both sensors leaves along an axis, (m/s²)/√Hz.
    pub fn noise(&self, axis: usize) -> f64 {
        self.density(|bin| bin.noise[axis])
    }

    fn mean(&self, number: impl Fn(&FittedBin) -> f64) -> f64 {
        self.bins.iter().map(number).sum::<f64>() / self.bins.len() as f64
    }
}

/// Square of the size of a complex number.
fn square([re, im]: [f64; 2]) -> f64 {
    re * re + im * im
}

impl Solver {
    /// Returns measured and modelled spectra of the newest record that the present estimate rests on. Returns `None` without such a
    /// record, and while records are unsettled.
    pub fn spectra(&mut self) -> Option<Spectra> {
        let record = self.newest_fitted()?;
        let seconds = record.samples as f64 / record.rate_hz;
        let band = |band: Band<'_>| spectra::Band {
            frequency_hz: band.frequency_hz() as f32,
            measured: [0, 1, 2].map(|axis| band.measured(axis) as f32),
            modelled: [0, 1, 2].map(|axis| band.modelled(axis) as f32),
            noise: [0, 1, 2].map(|axis| band.noise(axis) as f32),
        };
        Some(Spectra {
            record: record.number,
            pose: record.pose.iter().copied().collect(),
            band_hz: self.measurement.band_hz.map(|edge| edge as f32),
            bands: bands(&record.bins, seconds, MAX_BANDS).map(band).collect(),
        })
    }
}
