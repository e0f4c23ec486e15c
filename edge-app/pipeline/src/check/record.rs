//! Examines records one by one, as the solver does before it takes them.

use std::io;

use fearless_simd::Level;
use flexid_core::chain::Chain;
use flexid_core::loss::target::Target;
use flexid_core::parameters::Bushings;
use flexid_wire::unused::RecordFault;
use flexid_wire::warning::Warning;

use super::blows::Blows;
use super::excitation::Excitation;
use super::travel::Travel;
use crate::config::Config;
use crate::intake::plausibility::{Axes, Scale};
use crate::record::{Record, SAMPLES, same_pose};
use crate::solver::{Candidate, Fingerprint, Taken, experiment};
use crate::unchecked;

/// Content of a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Examined {
    /// Number among all receptances and records, from 1.
    pub number: u64,
    /// Time of the first sample on the clock of the recording, s.
    pub start_s: f64,
    /// Length, s.
    pub seconds: f64,
    /// Sampling rate, Hz.
    pub rate_hz: f64,
    /// True if the measured rate contradicts the config's, but is too uncertain to replace it.
    pub has_doubtful_rate: bool,
    /// Joint angles, rad (m), base first.
    pub pose: Vec<f64>,
    /// Number of the pose, from 1, in the order in which the poses came. Records whose angles differ by at most 1e-3 rad (m) have the
    /// same. `None` along a path.
    pub pose_number: Option<u64>,
    /// Motion along a path. `None` where the robot stands.
    pub travel: Option<Travel>,
    /// Number of the record that this one repeats: they share more than half of their samples.
    pub repeats: Option<u64>,
    /// Number of samples before the cut, in which nothing is cut.
    pub quiet_samples: usize,
    /// Time before the cut, in which nothing is cut, s.
    pub quiet_s: f64,
    /// True if the robot rests when the record starts.
    pub starts_at_rest: bool,
    /// The parts of the band in which the force stands clear of its noise, or the fault for which a fit refuses the record.
    pub excitation: Result<Excitation, RecordFault>,
    /// Blows of a hammer. `None` if the force has three axes, or is that of a shaker.
    pub blows: Option<Blows>,
}

impl Examined {
    /// Returns whether a fit takes the record: it has no fault, and repeats no other.
    pub fn is_usable(&self) -> bool {
        self.excitation.is_ok() && self.repeats.is_none()
    }
}

/// Examines records.
pub(super) struct Examiner<'a> {
    config: &'a Config,
    chain: Chain,
    stiffest: Bushings,
    buffer: Box<[f32; SAMPLES]>,
    taken: Taken,
    scale: Scale,
    axes: Axes,
    /// The records examined so far.
    pub(super) records: Vec<Examined>,
}

impl<'a> Examiner<'a> {
    /// # Errors
    /// A checked config gives no error.
    pub(super) fn new(config: &'a Config) -> io::Result<Self> {
        let joints = config.model.joints.len();
        Ok(Self {
            config,
            chain: config.model.chain().map_err(unchecked)?,
            stiffest: config.bounds.stiffest(joints),
            buffer: Box::new([0.0; SAMPLES]),
            taken: Taken::default(),
            scale: Scale::new(&config.bounds, joints, Level::new()),
            axes: Axes::new(&config.mounting),
            records: Vec::new(),
        })
    }

    /// Examines the next record.
    pub(super) fn examine<'r>(&mut self, record: &'r Record) -> Candidate<'r> {
        let number = (1 + self.config.receptances.len() + self.records.len()) as u64;
        let fingerprint = Fingerprint::of(record);
        let repeats = self.taken.original(&fingerprint);
        let Self { config, chain, stiffest, buffer, .. } = self;
        let experiment = experiment(config, chain, stiffest, record, buffer);
        let measurement = self.config.measurement();
        let ratio = experiment.as_ref().ok().filter(|_| repeats.is_none()).and_then(|experiment| {
            // An experiment of this chain has a target.
            let target = Target::new(&self.chain, &measurement, experiment.site()).ok()?;
            Some(self.scale.ratio(&target, experiment))
        });
        if let (Ok(experiment), None) = (&experiment, repeats) {
            self.taken.add(number, fingerprint.clone());
            if let Some(ratio) = ratio {
                self.scale.note(ratio);
                self.axes.note(experiment);
            }
        }
        let travelled = self.records.iter().rev().find_map(|record| record.travel.as_ref());
        let travel = Travel::of(record, &self.chain, travelled);
        let samples = record.force[0].len();
        let quiet_samples = record.quiet_samples(self.config.signals.force_resolution);
        self.records.push(Examined {
            number,
            start_s: record.start_s,
            seconds: samples as f64 / record.rate_hz,
            rate_hz: record.rate_hz,
            has_doubtful_rate: record.has_doubtful_rate,
            pose: record.pose.to_vec(),
            pose_number: travel.is_none().then(|| self.pose_number(&record.pose)),
            travel,
            repeats,
            quiet_samples,
            quiet_s: quiet_samples as f64 / record.rate_hz,
            starts_at_rest: record.starts_at_rest,
            excitation: match &experiment {
                Ok(experiment) => Ok(Excitation::of(experiment, self.config.band_hz)),
                Err(fault) => Err(fault.clone()),
            },
            blows: self.config.signals.has_part_of_force().then(|| Blows::of(record)).flatten(),
        });
        Candidate { record, fingerprint, experiment, ratio }
    }

    /// Warning that force and acceleration do not agree with the model's masses.
    pub(super) fn scale(&self) -> Option<Warning> {
        self.scale.warning()
    }

    /// Warning that axes are swapped or reversed.
    pub(super) fn axes(&self) -> Option<Warning> {
        self.axes.warning()
    }

    fn pose_number(&self, pose: &[f64]) -> u64 {
        let known = || self.records.iter().filter_map(|own| Some((&own.pose, own.pose_number?)));
        let newest = known().map(|(_, number)| number).max().unwrap_or_default();
        let same = known().find(|(own, _)| same_pose(own, pose));
        same.map_or(newest + 1, |(_, number)| number)
    }
}
