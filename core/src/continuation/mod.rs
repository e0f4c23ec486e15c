//! A descent into the basin: it fits the records from their lowest frequencies upward.
//!
//! Far below its resonances a robot responds like the springs of its joints, and the compliances of springs in series add up.
//! There the cost has a single basin. Each level adds half an octave and begins at the minimum of the level before. A
//! resonance therefore enters the band when its frequency in the model is already close to that of the robot. This is the
//! multiscale inversion of seismology (Bunks, Saleck, Zaleski and Chavent, "Multiscale seismic waveform inversion",
//! Geophysics 60, 1995; Pratt, "Seismic waveform inversion in the frequency domain", Geophysics 64, 1999), on spectra that
//! are damped by `e^(−αt)`, as in the Laplace-Fourier domain (Shin and Cha, Geophysical Journal International 177, 2009): the
//! search's line s = α + iω.
//!
//! The chain sags under gravity with its present bushings. A soft wrist sags by some degrees, and a chain without this sag is
//! a wrong model of it.
//!
//! On every level the descent takes steps of Levenberg and Marquardt along compliances ([`crate::refine::compliance`]). The loop is
//! not the refinement's: a trial is linearised at once, a level ends by relative gains, and no unknown needs a floor of information,
//! since priors determine all of them.
//!
//! Priors hold the parameters that a level does not determine near the start of the descent ([`priors`]). They end with the
//! descent.

mod line;
mod priors;

use crate::loss::target::Target;
use crate::parameters::Bushings;
use crate::receptance::Terms;
use crate::refine::compliance;
use crate::refine::damping::Damping;
use crate::refine::levels::{LAST_RELATIVE, NEGLIGIBLE, RELATIVE};
use crate::refine::proposal::least_within;
use crate::refine::{ParameterNormal, Problem};
use crate::sought::Coordinates;
use crate::spectrum::{Experiment, Site};

/// Number of levels below the whole band, half an octave each. Chosen: the first level ends at a 128th of the highest frequency, where most
/// joints that can mill have no resonance yet.
const WIDENING: u32 = 14;
/// Last level: the whole band once more, with residuals that noise alone may explain.
const LAST: u32 = WIDENING + 1;
/// Number of levels.
pub(crate) const LEVELS: usize = LAST as usize + 1;
/// Largest number of steps on a level. Chosen: a level that has not ended by then goes on in the next one.
const MAX_STEPS: u32 = 40;
/// Largest change of a parameter's logarithm in a step. Chosen: a factor of 4.5, so that a decade takes two steps.
const LONGEST_STEP: f64 = 1.5;
/// Least damping of the steps. Chosen: four rejected steps raise it to the first one.
const LEAST_DAMPING: f64 = 1e-6;
/// Damping above which a level ends. Chosen: a step then moves no unknown by more than 1e-4 of the way to its own minimum.
const LAST_DAMPING: f64 = 1e4;

/// State of a descent.
#[derive(Clone, Debug)]
pub(crate) struct Continuation {
    /// Start of the descent, which is the mean of the priors on the parameters.
    start: Coordinates,
    coordinates: Coordinates,
    /// Present level. From [`WIDENING`] on a level has the whole band; above [`LAST`] the descent has ended.
    level: u32,
    /// Number of steps on this level.
    steps: u32,
    damping: Damping,
    /// True if the normal equations are those at `coordinates`.
    assembled: bool,
    /// Number of rows of the records in the normal equations.
    rows: usize,
    /// Mean square of the residuals at the end of each level, or at the present point of the present level.
    misfits: [f64; LEVELS],
}

impl Continuation {
    /// A descent from the lowest frequencies upward.
    pub(crate) fn new(start: Coordinates) -> Self {
        Self::from_level(start, 0)
    }

    /// A descent that begins on `level`. The fewer levels it has, the more its end depends on its start.
    pub(crate) fn from_level(start: Coordinates, level: u32) -> Self {
        Self {
            start,
            coordinates: start,
            level,
            steps: 0,
            damping: Damping::first(LEAST_DAMPING),
            assembled: false,
            rows: 0,
            misfits: [f64::INFINITY; LEVELS],
        }
    }

    /// Present coordinates of the descent.
    pub(crate) fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    /// Mean square of the residuals on each level that has ended, including those of the priors. For noise it is a half,
    /// since the real and imaginary parts each have half of its power. It is infinite on levels that the descent skipped.
    pub(crate) fn misfits(&self) -> &[f64] {
        &self.misfits[..(self.level as usize).min(LEVELS)]
    }

    /// Part of the descent that is done, 0 to 1.
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
        self.damping = Damping::first(LEAST_DAMPING);
        self.assembled = false;
    }

    /// Tries one step. `normal` is the caller's storage for the normal equations, which the caller must not change between
    /// the steps.
    // Normal equations are large: inlined, this function would need their size on the stack of every caller.
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
            *damped.entry(i, i) *= 1.0 + self.damping.value();
        }
        let step = least_within(problem.level, &damped, &room);
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
            self.damping.follow(gain / predicted);
            normal.clone_from(trial);
        } else {
            self.coordinates = before;
            self.damping.rise();
        }
        self.note(normal.sum_of_squares());
        let settled = gain > 0.0 && gain < NEGLIGIBLE * standing;
        if settled || self.steps >= MAX_STEPS || self.damping.value() > LAST_DAMPING {
            self.begin(self.level + 1);
        }
    }

    /// Stores the mean square of the residuals at the present coordinates.
    fn note(&mut self, sum_of_squares: f64) {
        self.misfits[self.level as usize] = sum_of_squares / self.rows as f64;
    }

    /// Computes the normal equations at the present coordinates.
    // Normal equations are large, see `step`.
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
            let site = Site { pose: &experiment.thinned.pose, ..experiment.site() };
            let Some(terms) = sagged(problem, site, &bushings) else {
                debug_assert!(false, "an experiment of another chain");
                continue;
            };
            let highest = part * experiment.thinned.omega.last().copied().unwrap_or_default();
            let weighing = line::Weighing { highest, relative };
            self.rows += line::add(normal, &terms, experiment, weighing, sought, level);
        }
        priors::add(normal, &self.coordinates, &self.start, sought, bounds);
    }
}

/// Terms of the chain at a site with its sag. Without an equilibrium under gravity they are those before it sags; `None` for a pose
/// of another chain.
fn sagged(problem: &Problem<'_>, site: Site<'_>, bushings: &Bushings) -> Option<Terms<f32>> {
    let Problem { chain, measurement, .. } = *problem;
    let sensors = measurement.sensors(&site);
    let sagged = chain
        .linearise(site.pose, measurement.gravity(), bushings)
        .and_then(|linear| Terms::new(&linear, bushings, &sensors));
    let unsagged = || Some(Target::new(chain, measurement, site).ok()?.terms(bushings));
    sagged.ok().or_else(unsagged)
}

#[cfg(test)]
mod tests;
