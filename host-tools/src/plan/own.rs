//! Cuts that the user means to mill, along paths or standing: what their records will say.
//!
//! Each is simulated with the noise of its sensors, and its readings go the way of a recording. Its records are those that `flexid identify` would take,
//! each at its poses.

use std::io;
use std::time::Duration;

use flexid_core::spectrum::fft::MIN_SAMPLES;
use flexid_core::stream::{LEAP, Reading};
use flexid_pipeline::check::{Survey, survey_about};
use flexid_pipeline::config::Config;
use flexid_pipeline::source::{Arrival, Content, Flow, FrameSource, SourceHealth};
use flexid_simulation::experiment::{Cut, Response};
use flexid_simulation::scenario::{Experiment, Sampling};
use flexid_simulation::transmission::add_noise;

use super::candidates::{Candidates, generator};

/// Time between the places of a path at which the rates of the joints are compared, s. Chosen: a ramp of the feed lasts several times as long.
const STEP_S: f64 = 0.01;

/// A cut of the user, and what its records are.
#[derive(Debug)]
pub struct Own {
    /// The cut.
    pub experiment: Experiment,
    /// What a recording of it would hold.
    pub survey: Survey,
    /// Its path in words; `None` where the robot stands.
    pub path: Option<String>,
}

impl Candidates<'_> {
    /// What a recording of a cut would hold; `None` if the robot does not withstand it.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn mill(&self, experiment: &Experiment) -> io::Result<Option<Survey>> {
        let sampling = experiment.sampling(&self.scenario.measurement);
        let cut = self.cut(experiment, &sampling);
        let mut response = cut.response(self.chain, self.bushings);
        if !response.is_finite() {
            return Ok(None);
        }
        let mut noise = generator();
        noise.jump(); // keeps it apart from the roughness, which has the same seed
        add_noise(&mut response.force, sampling.force_noise(), &mut noise);
        add_noise(&mut response.acceleration, sampling.acceleration_noise(), &mut noise);
        let counter_bits = self.config.stream().counter_bits;
        let mut readings = Readings(readings(&cut, &response, &sampling, counter_bits));
        survey_about(self.config, self.bushings.clone(), &mut readings, |_| ()).map(Some)
    }
}

/// Why a robot does not feed along the path of a cut, and what to do: a joint is so fast that it leaps. `None` where none is.
pub fn too_fast(config: &Config, experiment: &Experiment) -> Option<String> {
    let course = experiment.course.as_ref()?;
    let times = (0..).map(|step| f64::from(step) * STEP_S);
    let times = times.take_while(|time| *time <= course.ends_s());
    let rates = times.flat_map(|time| {
        let joints = config.model.driven().zip(course.at(time));
        joints.map(|(joint, [_, rate, _])| (&joint.name, rate.abs()))
    });
    let (joint, rate) = rates.max_by(|one, other| one.1.total_cmp(&other.1))?;
    let most = LEAP * config.rate_hz / MIN_SAMPLES as f64;
    (rate > most).then(|| {
        format!(
            "{joint} moves by up to {rate:.2} rad/s (m/s), which is no feed: by more than {LEAP} rad (m) in {MIN_SAMPLES} samples (feed {:.1} times as slowly)",
            rate / most
        )
    })
}

/// The readings of a cut: those of the sensors at once, and the joint angles at their rate.
fn readings(
    cut: &Cut,
    response: &Response,
    sampling: &Sampling,
    counter_bits: u32,
) -> Vec<Arrival> {
    let mask = u32::MAX >> (32 - counter_bits.clamp(1, 32));
    let angles_every = (sampling.rate_hz / sampling.angle_rate_hz()).round().max(1.0) as usize;
    let mut arrivals = Vec::new();
    let samples = response.force.iter().zip(&response.acceleration);
    for (index, (force, acceleration)) in samples.enumerate() {
        let time_s = index as f64 / sampling.rate_hz;
        let mut push =
            |reading| arrivals.push(Arrival { time_s, content: Content::Reading(reading) });
        if index.is_multiple_of(angles_every) {
            let angles = (0..).zip(cut.angles(time_s));
            angles.for_each(|(index, value)| push(Reading::Joint { index, value }));
        }
        let counter = index as u32 & mask;
        push(Reading::Force { counter, value: [0, 1, 2].map(|axis| force[axis] as f32) });
        push(Reading::Acceleration {
            counter,
            value: [0, 1, 2].map(|axis| acceleration[axis] as f32),
        });
    }
    arrivals
}

/// A recording in memory.
struct Readings(Vec<Arrival>);

impl FrameSource for Readings {
    fn read(&mut self, batch: &mut Vec<Arrival>, _timeout: Duration) -> io::Result<Flow> {
        batch.append(&mut self.0);
        Ok(Flow::Ended)
    }

    fn health(&self) -> SourceHealth {
        SourceHealth::default()
    }
}
