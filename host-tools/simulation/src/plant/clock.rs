//! The instants at which a sensor samples.

use rand_core::Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::Deserialize;

use super::range::between;

/// Errors of a sensor's clock. The sample of number n is taken at `n/rate · (1 + 1e-6 ppm) − late + jitter` of the robot's time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Clock {
    /// Time by which the readings lag, s, as `[calibration] delay_s` means it for the acceleration. Typical: 20e-6 to 250e-6: a filter's
    /// group delay (second order at 1 kHz: 225 µs), or half a cycle of a field bus of 2 to 4 kHz.
    pub late_s: f64,
    /// Standard deviation of a further lag, drawn for each cut, s. Typical: 10e-6, a start without hardware trigger.
    pub late_spread_s: f64,
    /// Slowness of the sensor's quartz, parts in a million: the lag drifts. Typical: 20 to 50, the tolerance of crystals in data
    /// sheets.
    pub ppm: f64,
    /// Standard deviation of a sample's instant, s. Typical: 1e-6, an interrupt; 20e-6, a task of an operating system.
    pub jitter_s: f64,
}

impl Clock {
    pub(super) fn check(&self, place: &str) -> Result<(), String> {
        let limit = [-0.1, 0.1];
        between(&format!("[{place}] late_s"), self.late_s, limit)?;
        between(&format!("[{place}] late_spread_s"), self.late_spread_s, [0.0, 0.1])?;
        between(&format!("[{place}] ppm"), self.ppm, [-10_000.0, 10_000.0])?;
        between(&format!("[{place}] jitter_s"), self.jitter_s, [0.0, 0.1])
    }

    /// Instants of `samples` samples at `rate_hz`, in samples of a perfect clock.
    pub fn instants(&self, samples: usize, rate_hz: f64, rng: &mut impl Rng) -> Vec<f64> {
        let mut normal = || -> f64 { StandardNormal.sample(rng) };
        let late = rate_hz * (self.late_s + self.late_spread_s * normal());
        let pace = 1.0 + self.ppm * 1e-6;
        (0..samples).map(|n| n as f64 * pace - late + self.jitter_s * rate_hz * normal()).collect()
    }
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng as _;
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    #[test]
    fn the_lateness_grows_as_the_clock_says() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
        let clock = Clock { late_s: 1e-3, ppm: 150.0, ..Clock::default() };
        let instants = clock.instants(2001, 2000.0, &mut rng);
        assert!((instants[0] + 2.0).abs() < 1e-12);
        assert!((instants[2000] - 1998.0 - 2000.0 * 1.5e-4).abs() < 1e-9);
        let clock = Clock { jitter_s: 1e-4, ..Clock::default() };
        let off: Vec<_> = clock
            .instants(4000, 2000.0, &mut rng)
            .iter()
            .enumerate()
            .map(|(n, instant)| instant - n as f64)
            .collect();
        let deviation = (off.iter().map(|x| x * x).sum::<f64>() / 4000.0).sqrt();
        assert!((deviation / 0.2 - 1.0).abs() < 0.03, "{deviation}");
    }
}
