//! Noise of the sensors, from the stretches of a record in which nothing is cut: its power, and its spectrum where that is not
//! white.
//!
//! The power is read from all quiet blocks together. That of the force is their variance. That of the acceleration is read from
//! their sixth differences, which pass white noise and stop what rings below a fifth of the rate. No other reading is as good if
//! the noise is white. The periodogram of the stretch before the cut shows whether it is white: [lines] (hum) and [levels] (a
//! sensor's filter) replace the power where they differ from it by more than chance.
//!
//! The robot may ring in that stretch, and a little ringing may be left where it seems to rest. A line that decays is never noise.
//! Below the highest frequency at which the robot rings, the noise counts as loud as just above, or as the plateau below the corner
//! of a sensor's filter.

mod axis;
mod levels;
mod lines;
mod observed;
mod periodogram;
mod quiet;

use core::ops::Range;

pub(super) use axis::AxisNoise;
use observed::Observed;
use periodogram::SHORTEST;
pub(super) use quiet::{BLOCK, is_dead, repeats, variance};
use quiet::{Blocks, QuietRun};

/// Sum of the squares of the sixth differences' coefficients, C(12, 6).
const SIXTH: f32 = 924.0;
/// A record starts at rest if the motion at its start, beside the noise, is at most this part of the root mean square of the motion
/// in the record. A search that takes this for rest is off by as little, and only has to find the basin. The refinement has the
/// seam for any start (the seam, in the README of this crate). Motion that decays is no noise even then.
const RESTING: f32 = 0.02;
/// A stretch has nothing but noise and steady lines in it if its variance is at most this many times the broad noise of its
/// spectrum. The shortest stretch at the lowest corner, 128 samples at a tenth of the rate, gives both from 13 pairs of values.
/// Their ratio is then 1 ± 0.3, and 2 is three deviations off.
const EXPLAINED: f32 = 2.0;
/// A stretch's force is as quiet as another's if its variance is at most this many times as large. Chance gives 0.7 to 1.3 in a
/// tenth of a second at 2 kHz, 200 samples.
const AS_QUIET: f32 = 1.3;

/// Noise of both sensors, per axis, and how the record starts.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Noise {
    /// Noise of the force, powers in N².
    pub(super) force: [AxisNoise; 3],
    /// Noise of the acceleration, powers in (m/s²)².
    pub(super) acceleration: [AxisNoise; 3],
    /// True if the robot rests when the record starts.
    pub(super) starts_at_rest: bool,
    /// True if the record has a quiet stretch; else the noise is the white part of its quietest block.
    pub(super) quiet: bool,
    /// True if the spectrum of the acceleration's noise was read while the robot rested.
    pub(super) at_rest: bool,
}

impl Noise {
    /// Takes over what an `earlier` record shows better: all of the noise if this record has no quiet stretch, and that of the
    /// acceleration if the robot rested then and does not now. Without an earlier record, one that has no quiet stretch keeps its
    /// white part.
    pub(super) fn or_else(&self, earlier: Option<&Self>) -> Self {
        match earlier {
            Some(earlier) if !self.quiet => Self { starts_at_rest: false, ..earlier.clone() },
            Some(earlier) if earlier.at_rest && !self.at_rest => {
                let acceleration = earlier.acceleration.clone();
                Self { acceleration, at_rest: true, ..self.clone() }
            }
            _ => self.clone(),
        }
    }
}

/// Estimates the noise of one record without holes. `force_step` is the smallest step of the force signal, N.
pub(super) fn estimate(force: [&[f32]; 3], acceleration: [&[f32]; 3], force_step: f32) -> Noise {
    let blocks = Blocks::judge(force, acceleration, force_step);
    let quiet = blocks.any_quiet();
    let force_power =
        force.map(|signal| blocks.mean(signal, if quiet { variance } else { sixth_difference }));
    let acceleration_power = acceleration.map(|signal| blocks.mean(signal, sixth_difference));
    let mut noise = Noise {
        force: force_power.map(AxisNoise::white),
        acceleration: acceleration_power.map(AxisNoise::white),
        starts_at_rest: false,
        quiet,
        at_rest: false,
    };
    let observe =
        |samples: &Range<usize>| acceleration.map(|signal| Observed::of(&signal[samples.clone()]));
    let whole = acceleration.map(variance);
    // Whether noise, hum and some motion explain the variance of every axis in a stretch.
    let explains = |samples: &Range<usize>, observed: &[Option<Observed>; 3], motion: f32| {
        (0..3).all(|axis| {
            let own = observed[axis].as_ref();
            let noise = own.map_or(acceleration_power[axis], Observed::broad_power);
            let hum = own.map_or(0.0, |own| own.lines_power(false, |_| 1.0));
            let motion = motion * motion * whole[axis];
            variance(&acceleration[axis][samples.clone()]) <= EXPLAINED * noise + hum + motion
        })
    };
    let leading = blocks.leading();
    let at_start = observe(&leading);
    noise.starts_at_rest = !leading.is_empty() && explains(&leading, &at_start, RESTING);
    let Some(QuietRun { samples, precedes_cut }) = blocks.run(SHORTEST) else { return noise };
    let longest = blocks.longest().map_or(samples.clone(), |run| run.samples);
    let mut observed = if samples == leading { at_start } else { observe(&samples) };
    if samples != longest {
        for (own, signal) in observed.iter_mut().zip(acceleration) {
            if let Some(own) = own {
                own.sharpen(&signal[samples.clone()], &signal[longest.clone()]);
            }
        }
    }
    let rests = precedes_cut && explains(&samples, &observed, RESTING);
    let silent = precedes_cut && explains(&samples, &observed, 0.0);
    noise.at_rest = silent && observed.iter().all(Option::is_some);
    for (noise, own) in noise.acceleration.iter_mut().zip(&observed) {
        let own = own.as_ref().and_then(|own| {
            // The sixth differences contain the lines.
            own.noise((noise.power - own.lines_power(silent, sixth_gain)).max(0.0), silent)
        });
        if let Some(own) = own {
            *noise = own;
        }
    }
    // A tool beyond the force sensor pushes it while the robot rings.
    let is_as_quiet = |signal: &&[f32]| {
        variance(&signal[longest.clone()]) <= AS_QUIET * variance(&signal[samples.clone()])
    };
    let samples = if !rests || force.iter().all(is_as_quiet) { longest } else { samples };
    for (noise, signal) in noise.force.iter_mut().zip(force) {
        let own = Observed::of(&signal[samples.clone()]).and_then(|own| {
            // The variance contains the lines.
            own.noise((noise.power - own.lines_power(silent, |_| 1.0)).max(0.0), silent)
        });
        if let Some(own) = own {
            *noise = own;
        }
    }
    noise
}

/// Number of quiet samples at the start of a record without holes, signals of equal length. `force_step` is as for [`estimate`].
pub(super) fn leading_quiet(
    force: [&[f32]; 3],
    acceleration: [&[f32]; 3],
    force_step: f32,
) -> usize {
    Blocks::judge(force, acceleration, force_step).leading().len()
}

/// Power of the sixth differences of a line, over that of white noise of the same power.
fn sixth_gain(frequency: f32) -> f32 {
    libm::powf(2.0 * libm::sinf(core::f32::consts::PI * frequency), 12.0) / SIXTH
}

/// Variance of the white part, which the neighbouring samples do not predict.
pub(super) fn sixth_difference(signal: &[f32]) -> f32 {
    let differences = signal
        .windows(7)
        .map(|w| w[0] + w[6] - 6.0 * (w[1] + w[5]) + 15.0 * (w[2] + w[4]) - 20.0 * w[3]);
    let (mut sum, mut count) = (0.0, 0);
    for difference in differences {
        sum += difference * difference;
        count += 1;
    }
    sum / (SIXTH * count.max(1) as f32)
}

#[cfg(test)]
mod tests;
