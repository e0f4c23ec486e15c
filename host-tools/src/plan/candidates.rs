//! The experiments to choose from, and the information of each.

use flexid_core::chain::Chain;
use flexid_core::parameters::Bushings;
use flexid_core::refine::{Basis, Information, Refinement};
use flexid_core::sought::Sought;
use flexid_core::spectrum::{self, SpectrumError};
use flexid_core::stream::Record;
use flexid_pipeline::config::Config;
use flexid_pipeline::knowledge::{Assumed, Knowledge};
use flexid_pipeline::{BINS, SAMPLES};
use rand_core::SeedableRng as _;
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::iter::{IntoParallelIterator as _, IntoParallelRefIterator as _, ParallelIterator as _};

use flexid_simulation::experiment::Cut;
use flexid_simulation::force::{self, OVERSAMPLING};
use flexid_simulation::scenario::{Cutting, Experiment, Feed, Sampling, Scenario};

/// Seed of the cuts' roughness.
const SEED: u32 = 1;

/// A possible experiment.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Pose and cut.
    pub experiment: Experiment,
    /// Information of the experiment about the unknowns of a robot without imperfections.
    pub information: Information,
}

/// The assumed robot and its work.
#[derive(Clone, Debug)]
pub struct Candidates<'a> {
    /// Limits of the joints, bounds, gravity, and length of a record.
    pub config: &'a Config,
    /// The robot without its joints' bushings.
    pub chain: &'a Chain,
    /// Spindle speeds and the noise of the sensors.
    pub scenario: &'a Scenario,
    /// The cutter, its force within the budget.
    pub cutting: Cutting,
    /// Parameters at which the information is computed.
    pub bushings: &'a Bushings,
    /// Unknowns that a fit seeks.
    pub sought: &'a Sought,
}

impl Candidates<'_> {
    /// Evaluates every cut at each of `poses`. It leaves out experiments whose force is lost in the noise, and poses
    /// at which the robot has no equilibrium under gravity. It calls `done` once for each experiment.
    ///
    /// # Errors
    /// A record has no spectrum for any other reason.
    pub fn evaluate(
        &self,
        poses: &[Vec<f64>],
        done: impl Fn() + Sync,
    ) -> Result<Vec<Candidate>, SpectrumError> {
        let cuts: Vec<_> =
            self.cuts().into_par_iter().map(|cut| (self.record(&cut), cut)).collect();
        let pairs: Vec<_> =
            cuts.iter().flat_map(|cut| poses.iter().map(move |pose| (cut, pose))).collect();
        let measurement = self.config.measurement();
        let workplace =
            || (Box::new([0.0; SAMPLES]), Box::new(Refinement::new(self.sought, self.bushings)));
        let evaluate =
            |(buffer, refinement): &mut (Box<[f32; SAMPLES]>, Box<Refinement>),
             ((record, cut), pose): &(&(Box<Record<SAMPLES>>, Experiment), &Vec<f64>)| {
                let mut record = record.clone();
                record.pose = pose.iter().copied().collect();
                let spectra =
                    spectrum::Experiment::<BINS>::new(self.chain, &measurement, &record, buffer);
                let spectra = match spectra {
                    Ok(spectra) => Box::new(spectra),
                    Err(error) => {
                        done();
                        return (error != SpectrumError::NoForce).then_some(Err(error));
                    }
                };
                let assumed = self.assumed();
                let problem = assumed.problem(&measurement, &[]);
                let information = refinement.information(&problem, &spectra, Basis::Planned);
                done();
                let experiment = Experiment { pose: pose.to_vec(), ..cut.clone() };
                Some(Ok(Candidate { experiment, information: information.ok()? }))
            };
        pairs.par_iter().map_init(workplace, evaluate).flatten_iter().collect()
    }

    /// What an experiment says of a robot with imperfections, as far as its force tells; `None` as [`Candidates::evaluate`] leaves it out.
    pub fn plan(&self, experiment: &Experiment) -> Option<Knowledge> {
        let mut record = self.record(experiment);
        record.pose = experiment.pose.iter().copied().collect();
        self.knowledge(&record, Basis::Planned)
    }

    /// The same from its simulation; `None` if the robot does not withstand it.
    ///
    /// [`Candidates::plan`] takes a record for one period of a periodic motion. A mode that outlasts the record
    /// then rings into its beginning, and its parameters seem up to twice as well determined as they are.
    pub fn simulate(&self, experiment: &Experiment) -> Option<Knowledge> {
        let mut record = self.record(experiment);
        let cut = self.cut(experiment, &self.sampling());
        let response = cut.response(self.chain, self.bushings);
        record.pose = cut.pose.iter().copied().collect();
        let simulated = [&response.force, &response.acceleration];
        for (signals, simulated) in
            [&mut record.force, &mut record.acceleration].into_iter().zip(simulated)
        {
            for (axis, signal) in signals.iter_mut().enumerate() {
                for (value, simulated) in signal.iter_mut().zip(simulated) {
                    *value = simulated[axis] as f32;
                }
            }
        }
        self.knowledge(&record, Basis::Measured)
    }

    /// The cut of an experiment, with its force.
    pub(super) fn cut(&self, experiment: &Experiment, sampling: &Sampling) -> Cut {
        Cut {
            gravity: self.config.gravity.into(),
            accelerometer: self.config.accelerometer,
            mounting: self.config.mounting,
            ..Cut::new(experiment, &self.cutting, sampling, &mut generator())
        }
    }

    fn knowledge(&self, record: &Record<SAMPLES>, basis: Basis) -> Option<Knowledge> {
        let measurement = self.config.measurement();
        let mut buffer = Box::new([0.0; SAMPLES]);
        let spectra =
            spectrum::Experiment::<BINS>::new(self.chain, &measurement, record, &mut buffer);
        self.assumed().of_experiment(&Box::new(spectra.ok()?), basis)
    }

    /// The robot about which experiments say something.
    pub fn assumed(&self) -> Assumed<'_> {
        let Self { config, sought, chain, bushings, .. } = *self;
        Assumed { config, sought, chain, bushings }
    }

    /// Number of cuts at each pose.
    pub fn cuts_per_pose(&self) -> usize {
        self.cuts().len()
    }

    /// Cuts with the spindle speeds of the scenario's experiments, fed along each axis.
    fn cuts(&self) -> Vec<Experiment> {
        let mut ramps: Vec<[f64; 2]> = Vec::new();
        for Experiment { spindle_rpm, .. } in &self.scenario.experiments {
            if !ramps.contains(spindle_rpm) {
                ramps.push(*spindle_rpm);
            }
        }
        let cut = |spindle_rpm, feed| Experiment::standing("planned", spindle_rpm, feed);
        let feeds = [Feed::X, Feed::Y, Feed::Z];
        ramps.into_iter().flat_map(|ramp| feeds.map(|feed| cut(ramp, feed))).collect()
    }

    /// Sampling of the scenario, with an experiment as long as a record.
    fn sampling(&self) -> Sampling {
        let duration_s = self.config.record_samples as f64 / self.config.rate_hz;
        Sampling { duration_s, ..self.scenario.measurement }
    }

    /// The record of a cut, without its acceleration. The force ignores the inertia of a tool beyond the force
    /// sensor.
    fn record(&self, cut: &Experiment) -> Box<Record<SAMPLES>> {
        let (samples, sampling) = (self.config.record_samples, self.sampling());
        let force = force::milling(&self.cutting, cut, &sampling, &mut generator());
        let axes = self.config.mounting.force_axes;
        let along = |axis: usize| {
            let along = axes.matrix().column(axis).into_owned();
            force.iter().step_by(OVERSAMPLING).take(samples).map(|f| f.dot(&along) as f32).collect()
        };
        Box::new(Record {
            start_s: 0.0,
            pose: self.config.model.driven().map(|_| 0.0).collect(),
            path: Default::default(),
            since_s: 0.0,
            rate_hz: sampling.rate_hz,
            force: [0, 1, 2].map(along),
            acceleration: [0, 1, 2].map(|_| std::iter::repeat_n(0.0, samples).collect()),
            force_noise: [sampling.force_noise() as f32; 3],
            acceleration_noise: [sampling.acceleration_noise() as f32; 3],
            force_noise_shape: Default::default(),
            acceleration_noise_shape: Default::default(),
            has_doubtful_rate: false,
            starts_at_rest: true,
            point: [0.0; 3],
        })
    }
}

/// A generator that gives every cut the same roughness.
pub(super) fn generator() -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(SEED.into())
}
