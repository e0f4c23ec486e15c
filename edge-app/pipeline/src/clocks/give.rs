//! The readings that leave: at the instants of the slower sensor, with common counters.

use flexid_core::stream::{Reading, SILENCE_S};

use super::delay::{self, Delay, Piece, Settings};
use super::kept::{Expected, Kept};
use super::lines::Lines;

/// Step of the counter at a restart, instants. No time that is shorter than [`SILENCE_S`] has so many.
const RESTART: u32 = 1 << 24;

impl Kept {
    /// Tells the delay of the acceleration after the force.
    pub(super) fn delay(&self, lines: &Lines) -> Result<Delay, String> {
        let Expected { record_samples, highest_hz, axes, .. } = self.expected;
        let settings = Settings {
            rate_hz: 1.0 / lines.lines[lines.base].period_s,
            above_hz: highest_hz,
            axes,
        };
        let pieces = |shift_s: f64| {
            let runs = 0..lines.lines[lines.base].runs.len();
            runs.flat_map(move |run| {
                let own = &lines.lines[lines.base].runs[run];
                let starts =
                    (own.first..=own.last - record_samples as i64 + 1).step_by(record_samples);
                starts.map(move |first| self.piece(lines, run, first, shift_s))
            })
        };
        let coarse = delay::delay(pieces(0.0), &settings)?;
        // Once the pieces hold the same instants, nothing is lost at their ends.
        let fine = delay::delay(pieces(coarse.delay_s), &settings)?;
        Ok(Delay { delay_s: coarse.delay_s + fine.delay_s, ..fine })
    }

    /// A piece of a run from an instant on, the acceleration later by `shift_s`.
    fn piece(&self, lines: &Lines, run: usize, first: i64, shift_s: f64) -> Piece {
        let length = self.expected.record_samples;
        let mut piece = Piece::default();
        let missing = [f32::NAN; 3];
        let mut own = lines.instants(run, first).peekable();
        let other = lines.other_run(run, first + length as i64 / 2, shift_s);
        for number in first..first + length as i64 {
            while own.next_if(|(at, _)| *at < number).is_some() {}
            let base = own.next_if(|(at, _)| *at == number);
            let base = base.map_or(missing, |(_, sample)| self.sensors[lines.base][sample].value);
            let other = other
                .and_then(|other| lines.other_at(run, number, other, shift_s))
                .unwrap_or(missing);
            let (force, acceleration) = if lines.base == 0 { (base, other) } else { (other, base) };
            for axis in 0..3 {
                piece.force[axis].push(force[axis]);
                piece.acceleration[axis].push(acceleration[axis]);
            }
        }
        piece
    }

    /// Passes all readings on, the acceleration later by `delay_s` than the force.
    pub(super) fn give_by(&self, lines: &Lines, delay_s: f64, sink: &mut impl FnMut(f64, Reading)) {
        let base = lines.base;
        let first_s = self.times_s.map_or(0.0, |(first_s, _)| first_s);
        let mut counter = 0_u32;
        let mut newest_s = f64::NEG_INFINITY;
        for (part, begin) in self.parts.iter().enumerate() {
            let end = self.parts.get(part + 1).map_or(self.others.len(), |next| next.others);
            let mut others = self.others[begin.others..end].iter().peekable();
            for run in (0..lines.parts[base].len()).filter(|run| lines.parts[base][*run] == part) {
                let Some((first, last)) = self.known(lines, run, delay_s) else { continue };
                let begins_s = lines.lines[base].time_s(run, first as f64);
                let is_pause = (SILENCE_S..f64::INFINITY).contains(&(begins_s - newest_s));
                counter = counter.wrapping_add(if is_pause { 1 } else { RESTART });
                let mut own = lines.instants(run, first).peekable();
                let mut other_run = None;
                for number in first..=last {
                    let time_s = lines.lines[base].time_s(run, number as f64);
                    while let Some((at_s, reading)) = others.next_if(|(at_s, _)| *at_s <= time_s) {
                        sink(first_s + at_s, *reading);
                    }
                    while own.next_if(|(at, _)| *at < number).is_some() {}
                    let base_value = own.next_if(|(at, _)| *at == number);
                    let base_value = base_value.map(|(_, sample)| self.sensors[base][sample].value);
                    if other_run.is_none_or(|other| !lines.covers(run, number, other, delay_s)) {
                        other_run = lines.other_run(run, number, delay_s);
                    }
                    let other_value =
                        other_run.and_then(|other| lines.other_at(run, number, other, delay_s));
                    let values = if base == 0 {
                        [base_value, other_value]
                    } else {
                        [other_value, base_value]
                    };
                    let counter = counter.wrapping_add((number - first) as u32);
                    if let Some(value) = values[0] {
                        sink(first_s + time_s, Reading::Force { counter, value });
                    }
                    if let Some(value) = values[1] {
                        sink(first_s + time_s, Reading::Acceleration { counter, value });
                    }
                    newest_s = time_s;
                }
                counter = counter.wrapping_add((last - first) as u32);
            }
            others.for_each(|(at_s, reading)| sink(first_s + at_s, *reading));
            newest_s = f64::NEG_INFINITY;
        }
    }

    /// First and last instant of a run at which the other sensor is known: at both ends it is not, within the reach of the kernel.
    fn known(&self, lines: &Lines, run: usize, delay_s: f64) -> Option<(i64, i64)> {
        let own = &lines.lines[lines.base].runs[run];
        let is_known = |number: &i64| {
            let other = lines.other_run(run, *number, delay_s);
            other.is_some_and(|other| lines.other_at(run, *number, other, delay_s).is_some())
        };
        let first = (own.first..=own.last).find(is_known)?;
        (first..=own.last).rev().find(is_known).map(|last| (first, last))
    }
}
