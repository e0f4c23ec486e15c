//! A descent into the basin: the records are fitted from their lowest frequencies upward.
//!
//! Far below its resonances a robot answers like the springs of its joints, and the compliances of springs in series add up:
//! there the cost has one valley. Each level adds half an octave, and begins at the minimum of the one before, so that a
//! resonance enters when the model has it nearly where the robot has it. This is the multiscale inversion of seismology
//! (Bunks, Saleck, Zaleski and Chavent, "Multiscale seismic waveform inversion", Geophysics 60, 1995; Pratt, "Seismic
//! waveform inversion in the frequency domain", Geophysics 64, 1999), on spectra that are damped by `e^(−αt)`, as in the
//! Laplace-Fourier domain (Shin and Cha, Geophysical Journal International 177, 2009): the search's line s = α + iω.
//!
//! Under gravity a robot sags by what its bushings, as they stand, give way: a soft wrist sags by degrees, and a chain that does
//! not is a wrong model of it.
//!
//! On every level Levenberg and Marquardt's steps are taken along compliances ([`crate::refine::compliance`]). Priors hold
//! what a level does not tell where the descent has begun ([`priors`]); they end with the descent.

mod line;
mod priors;

use crate::calibration::Calibration;
use crate::parameters::Bushings;
use crate::receptance::Terms;
use crate::refine::compliance;
use crate::refine::proposal::least_within;
use crate::refine::{ParameterNormal, Problem};
use crate::spectrum::{Accelerometer, Experiment};
use crate::unknowns::Coordinates;

/// Levels below the whole band, half an octave each: the first ends at a 128th of the highest frequency, where most joints that
/// can mill have no resonance yet.
const WIDENING: u32 = 14;
/// The last level: the whole band once more, with residuals that noise alone may explain.
const LAST: u32 = WIDENING + 1;
/// How many levels there are.
pub(crate) const LEVELS: usize = LAST as usize + 1;
/// Part of its size by which the model may miss a spectrum, η: while the band widens, where 0.05 and 0.1 find the basin equally
/// often and 0.3 less; and on the last level, from where the refinement, which weighs by the noise alone, finds the minimum.
const RELATIVE: f64 = 0.05;
const LAST_RELATIVE: f64 = 0.0125;
/// Steps on each level.
const MAX_STEPS: u32 = 40;
/// A level ends when a step lowers its cost by less than this part.
const NEGLIGIBLE: f64 = 1e-3;
/// A step may not change the logarithm of a parameter by more.
const LONGEST_STEP: f64 = 1.5;
/// First damping of the steps, relative to the information of each unknown, the least, and the one at which nothing moves
/// any more.
const FIRST_DAMPING: f64 = 1e-2;
const LEAST_DAMPING: f64 = 1e-6;
const LAST_DAMPING: f64 = 1e4;

/// Where a descent stands.
#[derive(Clone, Debug)]
pub(crate) struct Continuation {
    /// Where it has begun, which is the centre of the priors.
    start: Coordinates,
    coordinates: Coordinates,
    /// The whole band from [`WIDENING`] on; behind [`LAST`] is the end.
    level: u32,
    /// Taken on this level.
    steps: u32,
    damping: f64,
    /// Whether the normal equations are those at `coordinates`.
    assembled: bool,
    /// Rows of the records in the normal equations.
    rows: usize,
    /// Mean square of the residuals on each level, where it has ended or stands.
    misfits: [f64; LEVELS],
}

impl Continuation {
    /// From the lowest frequencies upward.
    pub(crate) fn new(start: Coordinates) -> Self {
        Self::from_level(start, 0)
    }

    /// Without the frequencies of the levels before this one: the fewer levels, the more the end depends on the start.
    pub(crate) fn from_level(start: Coordinates, level: u32) -> Self {
        Self {
            start,
            coordinates: start,
            level,
            steps: 0,
            damping: FIRST_DAMPING,
            assembled: false,
            rows: 0,
            misfits: [f64::INFINITY; LEVELS],
        }
    }

    /// Where the descent stands.
    pub(crate) fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    /// Mean square of the residuals on each level that has ended, the priors' included: a half if they are noise, since real and
    /// imaginary parts have half of its power each. Infinite on levels that were left out.
    pub(crate) fn misfits(&self) -> &[f64] {
        &self.misfits[..(self.level as usize).min(LEVELS)]
    }

    /// How much of it is done, 0 to 1.
    pub(crate) fn fraction(&self) -> f32 {
        let [done, of] = [self.steps, MAX_STEPS].map(|steps| steps as f32);
        (self.level as f32 + (done / of).min(1.0)) / (LAST + 1) as f32
    }

    pub(crate) fn finished(&self) -> bool {
        self.level > LAST
    }

    fn begin(&mut self, level: u32) {
        self.level = level;
        self.steps = 0;
        self.damping = FIRST_DAMPING;
        self.assembled = false;
    }

    /// Tries one step. `normal` is the caller's room for the normal equations, and stays untouched between the steps.
    // Normal equations are large: inlined, they would take room on the stack of every caller.
    #[inline(never)]
    pub(crate) fn step<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        normal: &mut ParameterNormal,
    ) {
        if self.finished() {
            return;
        }
        if !self.assembled {
            self.assemble(problem, experiments, normal);
            self.assembled = true;
        }
        self.steps += 1;
        let standing = normal.sum_of_squares();
        self.note(standing);
        let before = self.coordinates;
        let ranges = problem.sought.ranges(&self.coordinates, problem.bounds);
        let room = compliance::room(problem.sought, &ranges, LONGEST_STEP);
        let mut damped = normal.clone();
        for i in 0..damped.unknowns() {
            *damped.entry(i, i) *= 1.0 + self.damping;
        }
        let step = least_within(&damped, &room);
        let predicted = normal.gain(&step);
        if predicted < NEGLIGIBLE * standing {
            return self.begin(self.level + 1);
        }
        let moved = compliance::logarithms(problem.sought, &ranges, &step);
        problem.sought.advance(&mut self.coordinates, &moved);
        let trial = &mut damped;
        self.assemble(problem, experiments, trial);
        let gain = standing - trial.sum_of_squares();
        if gain > 0.0 {
            // Marquardt's damping by the agreement of the gain with the prediction.
            let factor = match gain / predicted {
                agreement if agreement > 0.75 => 0.1,
                agreement if agreement > 0.25 => 1.0,
                _ => 4.0,
            };
            self.damping = (factor * self.damping).max(LEAST_DAMPING);
            normal.clone_from(trial);
        } else {
            self.coordinates = before;
            self.damping *= 10.0;
        }
        self.note(normal.sum_of_squares());
        let settled = gain > 0.0 && gain < NEGLIGIBLE * standing;
        if settled || self.steps >= MAX_STEPS || self.damping > LAST_DAMPING {
            self.begin(self.level + 1);
        }
    }

    /// Remembers what the present coordinates cost.
    fn note(&mut self, sum_of_squares: f64) {
        self.misfits[self.level as usize] = sum_of_squares / self.rows as f64;
    }

    /// The normal equations at the coordinates.
    // As above.
    #[inline(never)]
    fn assemble<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        normal: &mut ParameterNormal,
    ) {
        let Problem { sought, bounds, level, .. } = *problem;
        normal.reset(sought.unknowns());
        let bushings = sought.bushings(&self.coordinates);
        let half_octaves = f64::from(WIDENING.saturating_sub(self.level));
        let part = libm::exp2(-0.5 * half_octaves) as f32;
        let relative = if self.level < LAST { RELATIVE } else { LAST_RELATIVE };
        self.rows = 0;
        for experiment in experiments {
            let search = &experiment.search;
            let terms = sagged(problem, experiment, &bushings);
            let highest = part * search.omega.last().copied().unwrap_or_default();
            let weighing = line::Weighing { highest, relative };
            self.rows += line::add(normal, &terms, experiment, weighing, sought, level);
        }
        priors::add(normal, &self.coordinates, &self.start, sought, bounds);
    }
}

/// The chain at a record's pose, as it sags there; where gravity leaves it no equilibrium, before it sags.
fn sagged<const B: usize>(
    problem: &Problem<'_>,
    experiment: &Experiment<B>,
    bushings: &Bushings,
) -> Terms<f32> {
    let Problem { measurement, .. } = *problem;
    let calibration = Calibration::default();
    let strapdown = measurement.accelerometer == Accelerometer::Strapdown;
    problem
        .linearise(&experiment.pose, bushings, &calibration)
        .and_then(|linear| {
            Terms::mounted(&linear, bushings, strapdown, &measurement.mounting, &calibration)
        })
        .unwrap_or_else(|_| {
            let mut terms = experiment.search.terms.clone();
            terms.set_bushings(bushings);
            terms
        })
}

#[cfg(test)]
mod tests;
