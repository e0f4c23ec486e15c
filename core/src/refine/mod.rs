//! Refinement: damped Gauss-Newton (Levenberg-Marquardt) in the logarithms of the parameters, with the exact
//! gradient, every bin weighted by its noise, and the seam of every record projected out.
//!
//! One [`Refinement::step`] tries one step. It ends when the step that is left would lower the sum of squares by
//! less than 1e-4: a hundredth of a standard deviation in all parameters together.

mod equations;
pub(crate) mod normal;
pub(crate) mod seam;
pub(crate) mod whitening;

use fearless_simd::Level;

use crate::chain::Chain;
use crate::parameters::{Bounds, Bushings, MAX_PARAMETERS, from_logarithms, logarithms};
use crate::receptance::Terms;
use crate::receptance::lanes::Precision;
use crate::spectrum::{Accelerometer, Experiment, Measurement};
use crate::{DOF, MAX_JOINTS};
use equations::{Assembly, RecordNormal, Similarity, Unknowns};
use normal::{Normal, packed};
use seam::{MAX_SEAM, Seam, unknowns};

/// Predicted gain in the sum of squares (whose expectation is its degrees of freedom) that ends the refinement.
const NEGLIGIBLE: f64 = 1e-4;
/// A step may not change a parameter by more than this factor's logarithm.
const LONGEST_STEP: f64 = 1.0;
/// First damping, relative to the information of each parameter.
const FIRST_DAMPING: f64 = 1e-2;
/// The damping at which nothing moves any more.
const LAST_DAMPING: f64 = 1e8;
/// Steps after which a refinement ends wherever it is.
const MAX_ITERATIONS: u32 = 50;
/// Information per parameter that damping starts from, so that an unobserved one stays put.
const FLOOR: f64 = 1e-6;

/// What a seam's unknowns cost, as a part of what they explain: with many joints some hardly differ in the band,
/// and would grow without bound against each other.
const SMALL_SEAM: f64 = 1e-11;

/// What is held fixed while refining.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a> {
    /// The robot.
    pub chain: &'a Chain,
    /// What was measured.
    pub measurement: &'a Measurement,
    /// Where the parameters may lie.
    pub bounds: &'a Bounds,
    /// Instruction set.
    pub level: Level,
}

/// How a refinement stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Another step is worth while.
    Improving,
    /// No step would gain anything.
    Converged,
    /// It has had its steps, and is not at a minimum.
    Exhausted,
}

/// How well the parameters explain the records.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Sum of squares of the whitened residuals.
    pub sum_of_squares: f64,
    /// Its expectation if the model is right: real residuals less unknowns.
    pub degrees_of_freedom: f64,
    /// Standard deviation of the logarithm of each parameter; infinite where the data do not tell.
    pub deviations: [f64; MAX_PARAMETERS],
    /// Surface similarity parameter per direction and experiment, median and largest.
    pub ssp: [f64; 2],
}

type ParameterNormal = Normal<{ packed(MAX_PARAMETERS + 1) }>;

/// State of a refinement. `T` is the precision of the recursion; the normal equations are always solved in `f64`.
#[derive(Clone, Debug)]
pub struct Refinement<T> {
    logarithms: [f64; MAX_PARAMETERS],
    /// Normal equations at `logarithms`, the seams projected out.
    normal: ParameterNormal,
    record: RecordNormal,
    assembled: bool,
    damping: f64,
    iterations: u32,
    precision: core::marker::PhantomData<T>,
}

impl<T: Precision> Refinement<T> {
    /// From a first guess, one bushing per joint.
    pub fn new(guess: &Bushings) -> Self {
        Self {
            logarithms: logarithms(guess),
            normal: Normal::new(),
            record: Normal::new(),
            assembled: false,
            damping: FIRST_DAMPING,
            iterations: 0,
            precision: core::marker::PhantomData,
        }
    }

    /// Starts anew from `guess`.
    pub fn restart(&mut self, guess: &Bushings) {
        self.logarithms = logarithms(guess);
        self.assembled = false;
        self.damping = FIRST_DAMPING;
        self.iterations = 0;
    }

    /// Steps tried since the start.
    pub fn iterations(&self) -> u32 {
        self.iterations
    }

    /// The parameters as they stand.
    pub fn bushings(&self, joints: usize) -> Bushings {
        from_logarithms(&self.logarithms, joints)
    }

    /// Tries one step; keeps it if the residuals shrink.
    pub fn step<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &mut [Experiment<B>],
    ) -> Outcome {
        if !self.assembled {
            self.fit_seams(problem, experiments, true);
            self.assemble(problem, experiments);
        }
        self.iterations += 1;
        let before = self.logarithms;
        let standing = self.normal.sum_of_squares();
        let (step, predicted) = self.propose(problem);
        if predicted < NEGLIGIBLE {
            if predicted >= 0.0 && self.damping <= FIRST_DAMPING {
                return Outcome::Converged;
            }
            // A damped step that gains nothing says little; nor does one that the bounds turned uphill.
            self.damping *= if predicted < 0.0 { 10.0 } else { 0.1 };
            return self.unless_exhausted();
        }
        for (logarithm, step) in self.logarithms.iter_mut().zip(&step) {
            *logarithm += step;
        }
        let reached = self.fit_seams(problem, experiments, false);
        if reached < standing {
            let agreement = (standing - reached) / predicted;
            self.damping *= if agreement > 0.75 {
                0.1
            } else if agreement > 0.25 {
                1.0
            } else {
                4.0
            };
            self.damping = self.damping.max(1e-9);
            self.assemble(problem, experiments);
        } else {
            self.logarithms = before;
            self.damping *= 10.0;
        }
        self.unless_exhausted()
    }

    fn unless_exhausted(&self) -> Outcome {
        if self.damping > LAST_DAMPING {
            Outcome::Converged
        } else if self.iterations >= MAX_ITERATIONS {
            Outcome::Exhausted
        } else {
            Outcome::Improving
        }
    }

    /// Evaluates the fit at the parameters as they stand.
    pub fn fit<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &mut [Experiment<B>],
    ) -> Fit {
        self.fit_seams(problem, experiments, true);
        let ssp = self.assemble(problem, experiments);
        let joints = problem.chain.joints().len();
        let residuals: usize = experiments.iter().map(|e| 6 * e.bins()).sum();
        let sought = 2 * DOF * joints + experiments.len() * unknowns(joints);
        Fit {
            sum_of_squares: self.normal.sum_of_squares(),
            degrees_of_freedom: residuals.saturating_sub(sought) as f64,
            deviations: self.deviations(),
            ssp,
        }
    }

    /// The seams that fit best at the parameters; returns the sum of squares that remains.
    fn fit_seams<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &mut [Experiment<B>],
        reweigh: bool,
    ) -> f64 {
        let joints = problem.chain.joints().len();
        let mut total = 0.0;
        for experiment in experiments {
            let terms = self.terms(problem, experiment);
            let normal = &mut self.record;
            Assembly { terms: &terms, experiment, unknowns: Unknowns::Seam, reweigh, normal }
                .run(problem.level);
            normal.prefer_small(&[0.0; MAX_SEAM][..unknowns(joints)], SMALL_SEAM);
            normal.eliminate(unknowns(joints));
            let mut solution = [0.0; MAX_SEAM];
            normal.substitute(unknowns(joints), &mut solution);
            experiment.seam = Seam::from_solution(&solution[..unknowns(joints)], joints);
            total += normal.sum_of_squares();
        }
        total
    }

    /// The normal equations of the parameters; returns median and largest SSP.
    fn assemble<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &mut [Experiment<B>],
    ) -> [f64; 2] {
        let joints = problem.chain.joints().len();
        self.normal.reset(2 * DOF * joints);
        let mut similarities = Similarities::default();
        for experiment in experiments {
            let terms = self.terms(problem, experiment);
            let unknowns = Unknowns::SeamAndParameters;
            let standing = experiment.seam;
            let normal = &mut self.record;
            let similarity =
                Assembly { terms: &terms, experiment, unknowns, reweigh: true, normal }
                    .run(problem.level);
            similarities.push(similarity);
            let seam = seam::unknowns(joints);
            normal.prefer_small(&standing.to_solution(joints)[..seam], SMALL_SEAM);
            normal.eliminate(seam);
            self.normal.add_complement(normal, seam);
        }
        self.assembled = true;
        similarities.median_and_largest()
    }

    fn terms<const B: usize>(&self, problem: &Problem<'_>, experiment: &Experiment<B>) -> Terms<T> {
        let bushings = self.bushings(problem.chain.joints().len());
        let gravity = problem.measurement.gravity();
        let linear = problem.chain.linearise(&experiment.pose, gravity, &bushings);
        let strapdown = problem.measurement.accelerometer == Accelerometer::Strapdown;
        Terms::new(&linear, &bushings, strapdown)
    }

    /// The damped step within the bounds, and the gain it promises.
    fn propose(&self, problem: &Problem<'_>) -> ([f64; MAX_PARAMETERS], f64) {
        let parameters = self.normal.unknowns();
        let (lower, upper) = problem.bounds.logarithms(parameters / (2 * DOF));
        // A parameter that would pass its bound, or go too far, is put there, and the others are solved for again.
        let mut put = [None; MAX_PARAMETERS];
        let mut step = [0.0; MAX_PARAMETERS];
        loop {
            let mut damped = self.normal.clone();
            for i in 0..parameters {
                let diagonal = damped.entry(i, i);
                *diagonal += self.damping * (*diagonal + FLOOR) + FLOOR;
            }
            damped.fix(&put[..parameters]);
            damped.eliminate(parameters);
            damped.substitute(parameters, &mut step);
            let mut beyond = false;
            for i in 0..parameters {
                let (least, most) = (lower[i] - self.logarithms[i], upper[i] - self.logarithms[i]);
                let inside =
                    step[i].max(least.clamp(-LONGEST_STEP, 0.0)).min(most.clamp(0.0, LONGEST_STEP));
                if let Some(value) = put[i] {
                    step[i] = value;
                } else if inside != step[i] {
                    put[i] = Some(inside);
                    beyond = true;
                }
            }
            if !beyond {
                break;
            }
        }
        (step, self.normal.gain(&step))
    }

    /// Standard deviations of the logarithms: the diagonal of the inverse.
    fn deviations(&self) -> [f64; MAX_PARAMETERS] {
        let parameters = self.normal.unknowns();
        let mut factor = self.normal.clone();
        for i in 0..parameters {
            *factor.entry(i, i) += FLOOR;
        }
        factor.eliminate(parameters);
        let mut deviations = [f64::INFINITY; MAX_PARAMETERS];
        for (i, deviation) in deviations[..parameters].iter_mut().enumerate() {
            *deviation = libm::sqrt(factor.inverse_diagonal(i));
        }
        deviations
    }
}

/// SSP per direction and experiment, of as many experiments as fit; the rest count only to the largest.
#[derive(Default)]
struct Similarities {
    values: heapless::Vec<f64, { 3 * 64 }>,
    largest: f64,
}

impl Similarities {
    fn push(&mut self, similarity: Similarity) {
        for value in similarity {
            let _ = self.values.push(value);
            self.largest = self.largest.max(value);
        }
    }

    fn median_and_largest(mut self) -> [f64; 2] {
        self.values.sort_unstable_by(f64::total_cmp);
        let middle = self.values.len() / 2;
        let median = match (self.values.len() % 2, self.values.get(middle)) {
            (0, Some(upper)) => 0.5 * (self.values[middle - 1] + upper),
            (_, Some(value)) => *value,
            _ => 0.0,
        };
        [median, self.largest]
    }
}

const _: () = assert!(MAX_PARAMETERS == 2 * DOF * MAX_JOINTS);
