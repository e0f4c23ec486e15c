//! Reading of a robot that moves through a part of a record, beyond that at the part's mean pose: the first order in the movement.
//!
//! Let Z(s) be the dynamic stiffness at the mean pose, x the displacements of the links there, and λ(s) those due to a unit observation, each in the
//! axes of its link. In these axes the inertias are constant, and the transformations X from link to link change. At the time t from the middle of
//! the part, the mean pose lacks the load −t Ż x. An operator of the derivative by time has `λ(d/dt) (t w) = t λ w + λ′ w`, so that the reading
//! exceeds that at the mean pose by
//!
//! ```text
//! Δ = −λ(d/dt)ᵀ (t Ż x) + C = t Ȧ + ∂B(σ, s)/∂σ + C at σ = s          B(σ, s) = −λ(σ)ᵀ Ż x(s)
//! ```
//!
//! Ȧ is the derivative of the reading by time as the pose changes: B(s, s), and what the turning axes of the sensors add. Over the length T of the
//! part, t is a sawtooth, whose spectrum n bins from the mean is `i T/(2π n)`. What this leaves at the ends of the part is the seam's. C is due
//! to the Coriolis acceleration 2 ω × v: of the links, and of the accelerometer, which reads `2 ω × A/s`.
//!
//! Δ is subtracted from the reading. The next order is taken to be as much smaller than Δ as Δ is than the reading A. It adds to the noise, with the
//! mean square `|Δ|² Σ|Δ|²/Σ|A|²`, the sums over the part.
//!
//! Zadeh, Proceedings of the IRE 38, 1950, describes systems that vary in time by functions of frequency and time.

use core::f64::consts::TAU;

use heapless::Vec;
use nalgebra::Matrix3;

use super::super::batch::{Batch, Bins, spill};
use super::super::equations::{Reading, seam_loads};
use super::super::model::Model;
use super::super::seam::Seam;
use super::super::sum_of_squares::SumOfSquares;
use super::super::{Plant, Problem, Refinement};
use super::change::Change;
use super::columns::{force_that_cuts, of_change};
use super::motion::Motions;
use crate::receptance::lanes::{Kernel, Lanes, Precision};
use crate::receptance::{Complex, Observation, Response};
use crate::spectrum::{Experiment, Movement, Part, Site, Spectrum};
use crate::{DOF, MAX_JOINTS};

/// Step of σ, in s. Chosen: a resonance of 0.1 % damping bends B by a hundredth over it, and rounding changes the difference by 1e-11.
const STEP: f64 = 1e-4;

impl Refinement {
    /// Gives the divided records the movement of the model where the fit stands: that of the plant, if there is one. Returns by how much its next
    /// step then reduces the sum of squares; nothing where no record is divided, or where gravity leaves the robot no equilibrium.
    #[inline(never)]
    pub(crate) fn follow_movement<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        plant: Option<&mut Plant>,
        experiments: &mut [Experiment<B>],
    ) -> f64 {
        let mut is_any = false;
        for (record, experiment) in experiments.iter_mut().enumerate() {
            let own = plant.as_deref();
            if !experiment.is_whole()
                && let Some(movement) = self.movement(problem, own, experiment, record)
            {
                experiment.replace_movement(movement);
                is_any = true;
            }
        }
        if !is_any {
            return 0.0;
        }
        let Some(plant) = plant else {
            let Self { coordinates, minimiser, workspace, retired, every, .. } = self;
            let mut objective = SumOfSquares::new(problem, experiments, retired, workspace, *every);
            return minimiser.gain_anew(problem, &mut objective, coordinates);
        };
        let (domain, mut objective, minimiser, point) =
            self.minimisation(problem, experiments, plant);
        minimiser.gain_anew(&domain, &mut objective, point)
    }

    /// Movement of a divided record of this number where the fit stands. `None` where gravity leaves the robot no equilibrium.
    fn movement<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        plant: Option<&Plant>,
        experiment: &Experiment<B>,
        record: usize,
    ) -> Option<Movement<B>> {
        let coordinates = plant.map_or(self.coordinates, Plant::coordinates);
        let (mut movement, length) = (Movement::NONE, experiment.length());
        let is_measured: [bool; 3] = core::array::from_fn(|axis| experiment.measures(axis));
        for (part, stage) in experiment.parts().zip(&experiment.path) {
            let at = |side: f64| {
                let pose = part.site.pose.iter().zip(part.site.rates);
                let pose = pose.map(|(q, rate)| q + side * rate * length);
                let pose: Vec<f64, MAX_JOINTS> = pose.collect();
                let part = Part { site: Site { pose: &pose, ..part.site }, ..part.clone() };
                self.model_of(problem, &coordinates, plant, &part, record).ok()
            };
            let [start, model, end] = [at(-0.5)?, at(0.0)?, at(0.5)?];
            let bins = Bins::of(experiment, &part);
            let (seam, _) = self.workspace.fit_seam(problem, &model, bins.clone());
            let [mut rate, mut constant] = [const { Spectrum::<B>::EMPTY }; 2];
            let take = &mut |values: &[Reading; 2]| {
                rate.push(&values[0]);
                constant.push(&values[1]);
            };
            let change = Change::of_pose([&start, &end], length);
            let passing = Passing { model: &model, change, bins, seam: &seam, take };
            f64::dispatch(problem.level, passing);
            for bin in 0..part.bins.len() {
                let (mut order, swept) =
                    (constant.at(bin), swept(&rate, bin, experiment.first_bin, length));
                for (order, swept) in order.as_flattened_mut().iter_mut().zip(swept.as_flattened())
                {
                    *order += swept;
                }
                // Nothing is read along an axis that is not measured.
                for axis in (0..3).filter(|axis| !is_measured[*axis]) {
                    order[axis] = [0.0; 2];
                }
                movement.order.push(&order);
            }
            movement.leave_next_order(&experiment.acceleration, stage, part.bins);
        }
        Some(movement)
    }
}

/// Spectrum of t times a signal in a bin. `spectrum` has the bins of the signal from number `first` on; it is real, and has no others.
fn swept<const B: usize>(spectrum: &Spectrum<B>, bin: usize, first: usize, length: f64) -> Reading {
    let mut sum = [[0.0; 2]; 3];
    for other in 0..spectrum.re[0].len() {
        let value = spectrum.at(other);
        let mirrored = length / (TAU * (bin + other + 2 * first) as f64);
        let apart = bin as f64 - other as f64;
        let own = if apart == 0.0 { 0.0 } else { length / (TAU * apart) };
        for (sum, [re, im]) in sum.iter_mut().zip(value) {
            sum[0] += (mirrored - own) * im;
            sum[1] += (mirrored + own) * re;
        }
    }
    sum
}

/// Calls `take` with Ȧ and with `∂B/∂σ + C` in each bin of a part.
struct Passing<'a> {
    model: &'a Model,
    /// Derivative of the model by time.
    change: Change,
    bins: Bins<'a>,
    seam: &'a Seam,
    take: &'a mut dyn FnMut(&[Reading; 2]),
}

impl Kernel<f64> for Passing<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes<Scalar = f64>>(self, like: V) {
        let Self { model, change, bins, seam, take } = self;
        let spins = change.spins(model);
        let mut of_sensor = Matrix3::zeros();
        if let Observation::Acceleration { translation, .. } = &model.terms.observation
            && let Some(spin) = spins.last()
        {
            let axes = Matrix3::from_fn(|axis, i| translation[axis][i]);
            of_sensor = (axes * spin).cross_matrix();
        }
        // The impulse of a seam is inertial: no bushing bears it.
        let borne = Seam { impulse: [[0.0; DOF]; MAX_JOINTS], ..*seam };
        let mut response = Response::new(like);
        for first in (0..bins.bins()).step_by(V::WIDTH) {
            let batch = Batch::new(like, &bins, model, first);
            let [loads, borne] = [seam, &borne].map(|own| seam_loads(own, batch.inverse_s));
            response.evaluate(&model.terms, batch.s, &batch.force, Some(&loads));
            let motions = Motions::new(model, &response, batch.s, &borne);
            let cut = force_that_cuts(model, &batch, &motions);
            let rate = of_change(&change, &response, model, batch.s, &cut, &motions);
            let observed = response.observed;
            let [below, above] = [-STEP, STEP].map(|step| {
                let sigma = batch.s.scale(like.fill(1.0 + step));
                response.evaluate(&model.terms, sigma, &batch.force, None);
                let motions = motions.observed_at(model, &response, sigma);
                let mut b = [Complex::zero(like); 3];
                for (joint, change) in &change.from_parent {
                    motions.add_from_parent(*joint, change, &mut b);
                }
                b
            });
            let per_step = batch.inverse_s.scale(like.fill(0.5 / STEP));
            let mut constant: [Complex<V>; 3] =
                core::array::from_fn(|axis| (above[axis] - below[axis]) * per_step);
            for (joint, (own, spin)) in model.terms.joints.iter().zip(&spins).enumerate() {
                motions.add_coriolis(joint, &own.inertia, spin, batch.s, &mut constant);
            }
            let velocity = observed.map(|own| own * batch.inverse_s);
            for (axis, constant) in constant.iter_mut().enumerate() {
                for (other, velocity) in velocity.iter().enumerate() {
                    let turn = like.fill(2.0 * of_sensor[(axis, other)]);
                    *constant = constant.add_mul_real(*velocity, turn);
                }
            }
            let [rate, constant] = [rate, constant].map(|own| own.map(spill));
            for lane in 0..V::WIDTH.min(bins.bins() - first) {
                take(
                    &[&rate, &constant]
                        .map(|own| own.each_ref().map(|[re, im]| [re[lane], im[lane]])),
                );
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::boxed::Box;
    use std::vec::Vec as List;

    use nalgebra::Vector3;

    use super::*;
    use crate::refine::modelled;
    use crate::refine::tests::divided::{PARTS, along};
    use crate::refine::tests::{BINS, SAMPLES, bounds, bushings, chain, measurement, problem};
    use crate::sought::Sought;

    /// Rates of the joints, rad/s.
    const RATES: [f64; 2] = [0.02, -0.03];

    /// The first part of a record of a robot that feeds, whose force acts along one axis.
    struct Fed {
        experiment: Box<Experiment<BINS>>,
        push: usize,
    }

    impl Fed {
        fn new(push: usize) -> Self {
            let buffer = &mut [0.0; SAMPLES];
            let record = along(PARTS);
            let experiment = Experiment::<BINS>::new(&chain(), &measurement(), &record, buffer);
            let mut experiment = Box::new(experiment.unwrap());
            let Spectrum { re, im } = &mut experiment.force;
            let parts = re.iter_mut().zip(im).enumerate();
            parts.filter(|(axis, _)| *axis != push).for_each(|(_, (re, im))| {
                re.fill(0.0);
                im.fill(0.0);
            });
            let rates = RATES.into_iter().collect();
            experiment.rates.iter_mut().for_each(|own| own.clone_from(&rates));
            Self { experiment, push }
        }

        fn bins(&self) -> usize {
            self.experiment.bins_of_part()
        }

        /// s of a bin.
        fn s(&self, bin: usize) -> Complex<f64> {
            Complex { re: 0.0, im: self.experiment.omega(bin) }
        }

        /// The model after a time from the middle of the part, s.
        fn model(&self, time: f64) -> Model {
            let (chain, bounds, measurement) = (chain(), bounds(), measurement());
            let sought = Sought::new(2).unwrap();
            let part = self.experiment.parts().next().unwrap();
            let pose = [0, 1].map(|joint| part.site.pose[joint] + time * RATES[joint]);
            let site = Site { pose: &pose, ..part.site };
            let problem = problem(&chain, &measurement, &bounds, &sought);
            modelled::perfect(&problem, &sought.coordinates(&bushings()), site).unwrap()
        }

        /// Reading at s after a time from the middle of the part, to the force of a bin.
        fn reading(&self, bin: usize, s: Complex<f64>, time: f64) -> [Complex<f64>; 3] {
            let mut response = Response::new(0.0);
            let force = core::array::from_fn(|axis| Complex {
                re: f64::from(self.experiment.force.re[axis][bin]),
                im: f64::from(self.experiment.force.im[axis][bin]),
            });
            response.evaluate(&self.model(time).terms, s, &force, None);
            response.observed
        }

        /// Ȧ at s to the force of a bin, by a difference of the recursion alone.
        fn rate(&self, bin: usize, s: Complex<f64>) -> [Complex<f64>; 3] {
            let step = 1e-3;
            let [before, after] = [-step, step].map(|time| self.reading(bin, s, time));
            core::array::from_fn(|axis| (after[axis] - before[axis]).scale(0.5 / step))
        }

        /// Spin of the last link, along its own axes, rad/s: its joint turns about y, the one before about z.
        fn spin(&self) -> Vector3<f64> {
            let model = self.model(0.0);
            model.from_parent[1].rotation * (Vector3::z() * RATES[0]) + Vector3::y() * RATES[1]
        }

        /// What is called Ȧ and `∂B/∂σ + C` in each bin.
        fn passing(&self) -> List<[Reading; 2]> {
            let mut values = List::new();
            let (start, end) = (self.model(-0.1), self.model(0.1));
            let part = self.experiment.parts().next().unwrap();
            let passing = Passing {
                model: &self.model(0.0),
                change: Change::of_pose([&start, &end], 0.2),
                bins: Bins::of(&*self.experiment, &part),
                seam: &Seam::ZERO,
                take: &mut |own| values.push(*own),
            };
            f64::dispatch(fearless_simd::Level::new(), passing);
            values
        }
    }

    fn apart(one: [f64; 2], other: Complex<f64>) -> f64 {
        libm::hypot(one[0] - other.re, one[1] - other.im)
    }

    #[test]
    fn the_rate_is_the_difference_of_the_readings() {
        for push in 0..3 {
            let fed = Fed::new(push);
            let passing = fed.passing();
            assert_eq!(passing.len(), fed.bins());
            for (bin, [rate, _]) in passing.iter().enumerate() {
                let expected = fed.rate(bin, fed.s(bin));
                let size = libm::sqrt(expected.iter().map(|own| own.square()).sum());
                for axis in 0..3 {
                    let apart = apart(rate[axis], expected[axis]);
                    assert!(apart < 1e-4 * size, "bin {bin}, axis {axis}: {apart} of {size}");
                }
            }
        }
    }

    /// The robot is reciprocal: where force and reading share an axis, `B/σ²` does not change if σ and s are swapped, so that
    /// `∂B/∂σ = Ȧ/s + ½ dȦ/ds`. Coriolis forces do no work: along that axis the links read nothing of them.
    #[test]
    fn the_constant_part_is_that_of_a_reciprocal_robot() {
        for push in 0..3 {
            let fed = Fed::new(push);
            for (bin, [_, constant]) in fed.passing().iter().enumerate() {
                let (s, step) = (fed.s(bin), 1e-5);
                let at = |step: f64| fed.rate(bin, s.scale(1.0 + step))[fed.push];
                let slope = (at(step) - at(-step)) * s.reciprocal().scale(0.5 / step);
                let [a, b] = [1, 2].map(|next| (push + next) % 3);
                let (reading, spin) = (fed.reading(bin, s, 0.0), fed.spin());
                let coriolis = reading[b].scale(2.0 * spin[a]) - reading[a].scale(2.0 * spin[b]);
                let expected = (at(0.0) + coriolis) * s.reciprocal() + slope.scale(0.5);
                let apart = apart(constant[push], expected);
                let size = libm::sqrt(expected.square());
                assert!(apart < 1e-2 * size, "bin {bin}, axis {push}: {apart} of {size}");
            }
        }
    }

    /// The middle of the first of N samples lies half a sample after the start, which changes the spectrum by 1/N.
    #[test]
    fn a_swept_signal_is_that_of_its_samples_times_t() {
        const N: usize = 4096;
        let (first, count, length) = (3, 20, 0.5);
        let mut spectrum = Spectrum::<BINS>::EMPTY;
        let value = |bin: usize| [libm::sin(bin as f64 * 1.7), libm::cos(bin as f64 * 2.9)];
        (0..count).for_each(|bin| spectrum.push(&[value(bin); 3]));
        let turn = |bin: usize, n: usize| TAU * ((bin * n) % N) as f64 / N as f64;
        let signal = |n: usize| -> f64 {
            let of_bin = |bin: usize| {
                let ([re, im], (sin, cos)) = (value(bin), libm::sincos(turn(first + bin, n)));
                2.0 * (re * cos - im * sin)
            };
            (0..count).map(of_bin).sum()
        };
        let times_t: List<f64> =
            (0..N).map(|n| ((n as f64 + 0.5) / N as f64 - 0.5) * length * signal(n)).collect();
        for bin in 0..count {
            let mut expected = Complex { re: 0.0, im: 0.0 };
            for (n, value) in times_t.iter().enumerate() {
                let (sin, cos) = libm::sincos(turn(first + bin, n));
                expected.re += value * cos / N as f64;
                expected.im -= value * sin / N as f64;
            }
            let [own, ..] = swept(&spectrum, bin, first, length);
            assert!(apart(own, expected) < 2e-2 * length, "{bin}: {own:?} {expected:?}");
        }
    }
}
