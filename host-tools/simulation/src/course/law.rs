//! Distance along a line over time: from rest to rest, with a smooth acceleration.
//!
//! The speed grows from 0 to v over a ramp of T seconds. The acceleration is a sine squared, so that it begins and ends without a jolt:
//!
//! ```text
//! s̈ = 2v/T sin²(πt/T)      ṡ = v (t/T − sin(2πt/T)/2π)      s = v (t²/2T − T (1 − cos(2πt/T))/4π²)
//! ```
//!
//! Its largest value a = 2v/T gives T. A ramp covers vT/2. A line that is shorter than two ramps is fed at `√(aL/2)`.

use std::f64::consts::{PI, TAU};

/// The time law of one line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Law {
    /// m.
    length: f64,
    /// Speed v between the ramps, m/s.
    speed: f64,
    /// T, s.
    ramp_s: f64,
}

impl Law {
    /// The law of a line of `length` m at a `feed` in m/s, with accelerations of at most `acceleration` m/s².
    pub(super) fn new(length: f64, feed: f64, acceleration: f64) -> Self {
        let speed = feed.min((0.5 * acceleration * length).sqrt());
        Self { length, speed, ramp_s: 2.0 * speed / acceleration }
    }

    pub(super) fn ramp_s(&self) -> f64 {
        self.ramp_s
    }

    pub(super) fn lasts_s(&self) -> f64 {
        self.length / self.speed + self.ramp_s
    }

    /// Distance s, speed ṡ and acceleration s̈ after `time` seconds: m, m/s and m/s².
    pub(super) fn at(&self, time: f64) -> [f64; 3] {
        let (begin, end) = (self.ramp(time), self.ramp(self.lasts_s() - time));
        // The second ramp is the first one, seen backwards from the end.
        if time <= 0.5 * self.lasts_s() { begin } else { [self.length - end[0], end[1], -end[2]] }
    }

    /// The ramp, and the constant speed after it.
    fn ramp(&self, time: f64) -> [f64; 3] {
        let Self { speed, ramp_s, .. } = *self;
        if time <= 0.0 {
            return [0.0; 3];
        }
        if time >= ramp_s {
            return [speed * (time - 0.5 * ramp_s), speed, 0.0];
        }
        let part = time / ramp_s;
        [
            speed * ramp_s * (0.5 * part * part - (1.0 - (TAU * part).cos()) / (TAU * TAU)),
            speed * (part - (TAU * part).sin() / TAU),
            2.0 * speed / ramp_s * (PI * part).sin().powi(2),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_fed_from_rest_to_rest() {
        // A long line, one of two ramps, and one that is too short for the feed.
        for (length, speed) in [(0.2, 0.01), (0.002, 0.01), (2e-4, 0.01 / 10_f64.sqrt())] {
            let law = Law::new(length, 0.01, 0.1);
            assert!((law.speed - speed).abs() < 1e-15);
            let lasts = law.lasts_s();
            assert_eq!((law.at(-1.0), law.at(lasts + 1.0)), ([0.0; 3], [length, 0.0, -0.0]));
            const STEP: f64 = 1e-5;
            let mut most = [0.0_f64; 2];
            for n in 1..2000 {
                let time = lasts * f64::from(n) / 2000.0;
                let [back, now, ahead] = [time - STEP, time, time + STEP].map(|t| law.at(t));
                for order in 0..2 {
                    let slope = (ahead[order] - back[order]) / (2.0 * STEP);
                    assert!((slope - now[order + 1]).abs() < 1e-6, "{slope} is not {now:?}");
                    most[order] = most[order].max(now[order + 1].abs());
                }
                let mirrored = law.at(lasts - time);
                assert!((now[0] + mirrored[0] - length).abs() < 1e-15);
            }
            assert!((most[0] - speed).abs() < 1e-6 && (most[1] - 0.1).abs() < 1e-4, "{most:?}");
        }
    }
}
