//! From aligned instants to records: where the stretch is cut, and what a record gets from it.

use heapless::Vec;

use super::align::{Aligned, Instant};
use super::clock::Clock;
use super::invalid::{Invalid, Validity};
use super::setup::Setup;
use super::stretch::Stretch;
use super::{Record, StreamConfig, StreamHealth, bridge, noise};
use crate::noise::NoiseShape;

/// Cuts records out of the stretch.
pub(super) struct Cutter<'a, const N: usize> {
    pub(super) config: &'a StreamConfig,
    pub(super) clock: &'a mut Clock,
    pub(super) stretch: &'a mut Stretch<N>,
    pub(super) record: &'a mut Record<N>,
    pub(super) setup: &'a Setup,
    pub(super) quiet: &'a mut Option<noise::Noise>,
    pub(super) validity: &'a mut Validity,
}

impl<const N: usize> Cutter<'_, N> {
    pub(super) fn take(
        &mut self,
        event: Aligned,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(&Record<N>),
    ) {
        match event {
            Aligned::Instant(instant) => {
                if instant.force.is_some() || instant.acceleration.is_some() {
                    self.clock.arrive(instant.time_s);
                } else {
                    self.clock.miss(1);
                }
                let full = self.config.record_samples;
                let let_go = self.stretch.push(&instant, self.config);
                health.samples_discarded += let_go as u64;
                if self.stretch.newest_missing() > bridge::MAX_GAP {
                    let known = self.stretch.len() - self.stretch.newest_missing();
                    let standing = self.stretch.usable_at_end(self.config).min(known);
                    self.end(standing, health, sink);
                    return self.stretch.clear_samples();
                }
                if self.stretch.feeds
                    && let Some(samples) = self.stretch.fed(self.config)
                {
                    let overflows = self.stretch.overflows();
                    self.emit(samples, health, sink);
                    if overflows {
                        // The samples that came since it was full are lost, so that the next ones do not follow on.
                        health.samples_discarded += self.stretch.len() as u64;
                        self.stretch.clear_samples();
                    }
                    return;
                }
                // The end of a record may lie in a movement that only the next angle shows.
                let standing =
                    if self.stretch.feeds { 0 } else { self.stretch.standing(self.config) };
                if !self.stretch.overflows() {
                    if standing >= full {
                        self.emit(full, health, sink);
                    }
                } else if standing >= full || self.stretch.is_overdue() {
                    // The samples that came since it was full are lost, so that the next ones do not follow on.
                    self.end(standing, health, sink);
                    self.stretch.clear_samples();
                }
            }
            Aligned::Gap(missing) => {
                self.end(self.stretch.usable_at_end(self.config), health, sink);
                self.stretch.clear_samples();
                match missing {
                    Some(instants) => self.clock.miss(instants),
                    None => self.clock.end_run(),
                }
            }
            Aligned::Restart => {
                self.end(self.stretch.usable_at_end(self.config), health, sink);
                self.stretch.clear();
                self.clock.end_run();
            }
        }
    }

    /// Makes records of the first `standing` samples and discards the rest.
    pub(super) fn end(
        &mut self,
        standing: usize,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(&Record<N>),
    ) {
        let full = self.config.record_samples;
        let (mut standing, mut rest) = (standing, self.stretch.len() - standing);
        // The pose is not known, or nothing was cut.
        if self.stretch.pose.unknown(self.config.joints).is_some() || !self.stretch.cutting {
            (standing, rest) = (0, self.stretch.len());
        }
        let least = Stretch::<N>::least(self.config);
        let is_unconfirmed = !self.stretch.pose.is_in_doubt() && rest >= least;
        health.without_pose += u64::from(self.stretch.cutting && is_unconfirmed);
        // One or two samples that were lost at the very end can be bridged too.
        let short = full - standing.min(full);
        let open = self.stretch.newest_missing() + short;
        if rest == 0 && short > 0 && open <= bridge::MAX_GAP {
            for _ in 0..short {
                self.stretch.push(&Instant::default(), self.config);
            }
            standing = full;
        }
        standing = self.divide(standing, health, sink);
        health.samples_discarded += (standing + rest) as u64;
    }

    /// Makes records of the first `samples`, as long as something is cut in what is left. Returns how many are left of these.
    pub(super) fn divide(
        &mut self,
        mut samples: usize,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(&Record<N>),
    ) -> usize {
        while samples >= self.stretch.shortest(self.config) && self.stretch.cutting {
            let of_record = self.config.record_samples.min(1 << samples.ilog2());
            self.emit(of_record, health, sink);
            samples -= of_record;
        }
        samples
    }

    /// Makes a record of the oldest `samples`, bridged, with its noise.
    fn emit(
        &mut self,
        samples: usize,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(&Record<N>),
    ) {
        let Self { config, clock, stretch, record, setup, quiet, validity } = self;
        let rate = clock.rate();
        if rate.is_wrong || rate.is_doubtful || rate.is_refused {
            health.measured_rate_hz = rate.measured_hz as f32;
            health.measured_rate_std_hz = rate.deviation_hz as f32;
        }
        health.wrong_rate += u64::from(rate.is_wrong || rate.is_refused);
        health.doubtful_rate += u64::from(rate.is_doubtful && !rate.is_refused);
        if rate.is_refused {
            health.too_fast += 1;
            health.samples_discarded += samples as u64;
            stretch.discard(samples, config.rate_hz);
            return stretch.look_for_cut(config);
        }
        stretch.has_given_full |= samples == config.record_samples;
        record.rate_hz = rate.rate_hz;
        record.has_doubtful_rate = rate.is_doubtful;
        record.start_s = stretch.start_s;
        let is_known = stretch.write_poses(samples, config, record);
        let signals = stretch.force.iter().chain(&stretch.acceleration);
        let copies = record.force.iter_mut().chain(&mut record.acceleration);
        for (signal, copy) in signals.zip(copies) {
            copy.clear();
            let _ = copy.extend_from_slice(&signal[..samples]);
        }
        stretch.discard(samples, config.rate_hz);
        stretch.look_for_cut(config);
        if !is_known {
            health.samples_discarded += samples as u64;
            return;
        }
        let is_lost = |value: &&f32| value.is_nan();
        let lost = [&record.force[0], &record.acceleration[0]]
            .map(|signal| signal.iter().filter(is_lost).count());
        let invalid = [
            validity.remove_from_force(&mut slices(&mut record.force)),
            validity.remove_from_acceleration(&mut slices(&mut record.acceleration)),
        ];
        health.count_invalid(&invalid);
        if invalid.iter().any(Invalid::are_many) {
            health.samples_discarded += samples as u64;
            return;
        }
        let mut bridged = [bridge::Bridged::default(); 6];
        let copies = record.force.iter_mut().chain(&mut record.acceleration);
        let mut bridgeable = true;
        for (copy, bridged) in copies.zip(&mut bridged) {
            match bridge::bridge(copy) {
                Ok(done) => *bridged = done,
                Err(bridge::Unbridgeable) => bridgeable = false,
            }
        }
        if !bridgeable {
            health.samples_discarded += samples as u64;
            return;
        }
        let force = record.force.each_ref().map(|signal| signal.as_slice());
        let acceleration = record.acceleration.each_ref().map(|signal| signal.as_slice());
        let own = noise::estimate(force, acceleration, config.force_resolution);
        let noise = own.or_else(quiet.as_ref());
        if own.quiet {
            **quiet = Some(noise.clone());
        }
        for axis in 0..3 {
            let added = |bridged: &bridge::Bridged| {
                bridged.samples as f32 / samples as f32 * bridged.mean_square_error
            };
            let rounding = |step: f32| step * step / 12.0;
            let least = rounding(config.force_resolution);
            let force = noise.force[axis].raised(least, added(&bridged[axis]));
            record.force_noise[axis] = libm::sqrtf(force.power);
            record.force_noise_shape[axis] = force.shape;
            let least = rounding(config.acceleration_resolution);
            let acceleration = noise.acceleration[axis].raised(least, added(&bridged[3 + axis]));
            record.acceleration_noise[axis] = libm::sqrtf(acceleration.power);
            record.acceleration_noise_shape[axis] = acceleration.shape;
        }
        record.point = setup.point;
        leave_out_absent(record, setup);
        record.starts_at_rest = noise.starts_at_rest;
        health.bridged += (lost[0] + lost[1]) as u64;
        health.records += 1;
        sink(record);
    }
}

/// Makes the noise of axes that are not measured that of nothing: a force of 0 is exact, and an acceleration of 0 says nothing.
fn leave_out_absent<const N: usize>(record: &mut Record<N>, setup: &Setup) {
    for axis in (0..3).filter(|axis| !setup.force[*axis]) {
        record.force_noise[axis] = 0.0;
        record.force_noise_shape[axis] = NoiseShape::WHITE;
    }
    for axis in (0..3).filter(|axis| !setup.acceleration[*axis]) {
        record.acceleration_noise[axis] = f32::INFINITY;
        record.acceleration_noise_shape[axis] = NoiseShape::WHITE;
    }
}

fn slices<const N: usize>(signals: &mut [Vec<f32, N>; 3]) -> [&mut [f32]; 3] {
    signals.each_mut().map(|signal| signal.as_mut_slice())
}
