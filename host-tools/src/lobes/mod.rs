//! The limit of the depth of cut over a range of spindle speeds.

mod picture;
mod table;

use anyhow::Result;
use flexid_prediction::PositiveEstimate;
use flexid_prediction::lobes::{Limit, Lobes};
use rayon::prelude::*;
use serde::Serialize;

pub(crate) use picture::{svg, title};
pub(crate) use table::{open_damping, text};

/// The stable depths.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Diagram {
    /// Joint angles, base first, rad (m).
    pub(crate) pose: Vec<f64>,
    /// Lower and upper edge of the band that was fitted, Hz.
    pub(crate) band_hz: [f64; 2],
    /// Lowest and highest speed of which the fit speaks, turns a minute: there the teeth pass within the band.
    pub(crate) stated_rpm: [f64; 2],
    /// The limit of the worst of these speeds, m. `None` where no depth chatters.
    pub(crate) least_depth_m: Option<PositiveEstimate>,
    /// Speeds, the lowest first.
    pub(crate) speeds: Vec<Speed>,
}

/// A spindle speed.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Speed {
    /// Turns a minute.
    pub(crate) rpm: f64,
    /// The limit there. `None` where no depth chatters, and where nothing is stated.
    pub(crate) limit: Option<Limit>,
    /// Says that the teeth pass outside of the band that was fitted: no record shows what they meet, and nothing is stated.
    pub(crate) is_beyond: bool,
}

impl Diagram {
    /// Limits at `points` speeds from `lower` to `upper`, turns a minute. It calls `done` once for each.
    pub(crate) fn new(
        pose: Vec<f64>,
        band_hz: [f64; 2],
        lobes: &Lobes,
        [lower, upper]: [f64; 2],
        points: usize,
        done: impl Fn() + Sync,
    ) -> Self {
        let stated_rpm @ [least, most] = lobes.speeds();
        let speed = |index| {
            let rpm = rpm([lower, upper], index as f64 / (points - 1) as f64);
            let is_beyond = !(least..=most).contains(&rpm);
            let limit = if is_beyond { None } else { lobes.limit(rpm) };
            done();
            Speed { rpm, limit, is_beyond }
        };
        let speeds = (0..points).into_par_iter().map(speed).collect();
        Self { pose, band_hz, stated_rpm, least_depth_m: lobes.least(), speeds }
    }

    /// Speeds of which something is stated.
    fn stated(&self) -> impl Iterator<Item = &Speed> + Clone {
        self.speeds.iter().filter(|own| !own.is_beyond)
    }

    /// A line for each speed.
    ///
    /// # Errors
    /// None.
    pub(crate) fn csv(&self) -> Result<String> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record([
            "rpm",
            "depth_mm",
            "low",
            "high",
            "chatter_hz",
            "chatter_low",
            "chatter_high",
            "lobe",
            "beyond",
            "determined",
        ])?;
        for Speed { rpm, limit, is_beyond } in &self.speeds {
            let mut line = vec![rpm.to_string()];
            match limit {
                None => line.extend((0..7).map(|_| String::new())),
                Some(Limit { depth_m, chatter_hz, lobe }) => {
                    let [low, high] = depth_m.interval;
                    line.extend([depth_m.value, low, high].map(|m| format!("{:.9e}", 1e3 * m)));
                    let [low, high] = chatter_hz.interval;
                    line.extend([chatter_hz.value, low, high].map(|hz| format!("{hz:.9e}")));
                    line.push(lobe.to_string());
                }
            }
            line.push(u8::from(*is_beyond).to_string());
            line.push(limit.map_or_else(String::new, |own| {
                u8::from(own.depth_m.determined && own.chatter_hz.determined).to_string()
            }));
            writer.write_record(&line)?;
        }
        Ok(String::from_utf8(writer.into_inner()?)?)
    }
}

/// The speed n at a part p of the range. Lobes are equally far apart in 1/n: half of the speeds are equally far apart in n, half in 1/n.
///
/// ```text
/// 2 p = (n − l)/(u − l) + (1/l − 1/n)/(1/l − 1/u)    ⟹    n² − (2 p − 1)(u − l) n − l u = 0
/// ```
fn rpm([lower, upper]: [f64; 2], part: f64) -> f64 {
    // At the ends the root is exact.
    match part {
        0.0 => return lower,
        1.0 => return upper,
        _ => {}
    }
    let linear = (2.0 * part - 1.0) * (upper - lower);
    (linear + (linear * linear + 4.0 * lower * upper).sqrt()) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_stand_close_together_where_lobes_do() {
        let range = [60.0, 1200.0];
        let speeds: Vec<f64> = (0..400).map(|index| rpm(range, f64::from(index) / 399.0)).collect();
        assert_eq!((speeds[0], speeds[399]), (60.0, 1200.0));
        assert!(speeds.is_sorted_by(|a, b| a < b));
        // Of the lobes of a chatter of 60 Hz with two teeth, each has several speeds.
        let waves = |rpm: f64| 60.0 * 60.0 / (2.0 * rpm);
        assert!(speeds.windows(2).all(|pair| waves(pair[0]) - waves(pair[1]) < 0.2));
        assert!(speeds.windows(2).all(|pair| pair[1] - pair[0] < 6.0));
    }
}
