//! How near the kernel comes to what the core can do: its operations, counted, by the peak rate of fused
//! multiply-adds, measured.
//!
//! `cargo bench -p flexid-core --bench peak`. One thread, the best of many runs. Multiplications are counted, fused with
//! an addition or not ([`kernels::counted`]), and the least time they could take is that of as many fused multiply-adds
//! at the peak. By joints, it is also the table that shows how the cost grows with them.

#[path = "../tests/common/mod.rs"]
mod common;
mod kernels;

use std::hint::black_box;
use std::time::Instant;

use common::fits::{parameters, problem};
use common::milling::{Conditions, SAMPLES, cut, experiments, record};
use common::{MEASUREMENT, Random, bounds, mill3, nominal};
use fearless_simd::Level;
use flexid_core::chain::Chain;
use flexid_core::parameters::Bushings;
use flexid_core::receptance::lanes::{Kernel, Lanes, Precision};
use flexid_core::refine::{Outcome, Problem, Refinement};
use flexid_core::spectrum::Experiment;
use kernels::counted::{Operations, operations};
use kernels::{BINS, Bins, Gradients, Values, at_most_avx2, step};

/// Rounds of one timing of the peak: a few tens of µs.
const ROUNDS: usize = 20_000;
/// Timings of which the best counts.
const TRIES: usize = 2_000;
/// Steps of the refinement of which the shortest counts.
const STEPS: usize = 20;

/// Sums that fused multiply-adds go on, independent of each other.
struct Sums<const N: usize>;

impl<const N: usize> Kernel<f32> for Sums<N> {
    /// Multiply-adds of one lane.
    type Output = usize;

    #[inline(always)]
    fn run<V: Lanes<Scalar = f32>>(self, like: V) -> usize {
        let [factor, term] = black_box([0.9, 0.1]).map(|value| like.fill(value));
        let mut sums = [like; N];
        for _ in 0..ROUNDS {
            for sum in &mut sums {
                *sum = sum.mul_add(factor, term);
            }
        }
        let mut lanes = [0.0; 16];
        for sum in sums {
            sum.store(&mut lanes);
            black_box(lanes);
        }
        N * ROUNDS * V::WIDTH
    }
}

fn main() {
    println!(
        "{:<8} {:>2} {:>16} {:>10} {:>10} {:>12} {:>12} {:>12}",
        "level",
        "J",
        "multiplications",
        "additions",
        "ns a bin",
        "10⁹ mul./s",
        "peak 10⁹/s",
        "time/least"
    );
    for level in [Level::new(), at_most_avx2()] {
        let peak = peak(level);
        for joints in 1..=7 {
            let bins = Bins::<f32>::new(joints);
            let Operations { multiplications, additions } = operations(Values(&bins));
            let (_, seconds) = best(|| f32::dispatch(level, Values(black_box(&bins))));
            let rate = 1e-9 * multiplications as f64 / seconds;
            println!(
                "{:<8} {joints:>2} {:>16} {:>10} {:>10.1} {rate:>12.1} {peak:>12.1} {:>12.2}",
                name(level),
                multiplications / BINS as u64,
                additions / BINS as u64,
                1e9 * seconds / BINS as f64,
                peak / rate
            );
        }
        let bins = Bins::<f64>::new(3);
        let (_, value) = best(|| f64::dispatch(level, Values(black_box(&bins))));
        let [without, with] = [false, true].map(|seam| {
            let gradients = || Gradients { bins: black_box(&bins), seam };
            best(|| f64::dispatch(level, gradients())).1 / value
        });
        println!(
            "{:<8}  3 f64: value and gradient of 36 parameters take {without:.2} times the value, with a seam {with:.2}",
            name(level)
        );
        for (joints, robot) in [(3, Robot::scenario()), (6, Robot::random(6))] {
            let least = robot.multiplications() / (0.5e9 * peak);
            let seconds = robot.step(level);
            println!(
                "{:<8} {joints:>2} f64: a step of the refinement on three experiments takes {:.2} ms, {:.2} times what its multiplications take",
                name(level),
                1e3 * seconds,
                seconds / least
            );
        }
    }
}

/// A robot, and records of it.
struct Robot {
    chain: Chain,
    bushings: Bushings,
    experiments: Vec<Experiment<{ common::BINS }>>,
}

impl Robot {
    /// The reference scenario's, of three joints.
    fn scenario() -> Self {
        let experiments = experiments(&nominal(), &mut Random::new(1));
        Self { chain: mill3(), bushings: nominal(), experiments }
    }

    /// A robot drawn at random, with three experiments like those of the scenario.
    fn random(joints: usize) -> Self {
        let mut random = Random::new(0);
        let (chain, bushings) = (random.chain(joints), random.bushings(joints));
        let mut buffer = [0.0; SAMPLES];
        let experiments = (0..3).map(|feed| {
            let force = cut(&mut random, [700.0, 4000.0], feed);
            let pose = random.pose(joints);
            let conditions = Conditions::default();
            let record = record(&chain, &pose, &bushings, &force, &conditions, &mut random);
            let experiment = Experiment::new(&chain, &MEASUREMENT, &record, &mut buffer);
            experiment.expect("a good record")
        });
        Self { experiments: experiments.collect(), chain, bushings }
    }

    fn multiplications(&self) -> f64 {
        let bins = self.experiments.iter().map(Experiment::bins).sum();
        step::multiplications(self.chain.joints().len(), bins, self.experiments.len())
    }

    /// Shortest time of an accepted step, s.
    fn step(&self, level: Level) -> f64 {
        let Self { chain, bushings, experiments } = self;
        let (bounds, sought) = (bounds(), parameters(chain.joints().len()));
        let problem = Problem { level, ..problem(chain, &MEASUREMENT, &bounds, &sought) };
        let mut guess = bushings.clone();
        guess.iter_mut().flat_map(|bushing| &mut bushing.stiffness).for_each(|k| *k *= 1.05);
        let mut shortest = f64::INFINITY;
        for _ in 0..STEPS {
            let mut refinement = Box::new(Refinement::new(&sought, &guess));
            // The first step begins where nothing has been evaluated.
            assert_eq!(refinement.step(&problem, experiments), Outcome::Improving);
            let before = refinement.bushings(&sought);
            let start = Instant::now();
            black_box(refinement.step(&problem, experiments));
            shortest = shortest.min(start.elapsed().as_secs_f64());
            assert!(refinement.bushings(&sought) != before, "the step is rejected");
        }
        shortest
    }
}

/// Fused multiply-adds, 10⁹ lanes a second, with as many sums as serve best: enough to hide their latency, and
/// few enough for the registers.
fn peak(level: Level) -> f64 {
    let rates = [
        best(|| f32::dispatch(level, Sums::<4>)),
        best(|| f32::dispatch(level, Sums::<5>)),
        best(|| f32::dispatch(level, Sums::<6>)),
        best(|| f32::dispatch(level, Sums::<8>)),
        best(|| f32::dispatch(level, Sums::<10>)),
        best(|| f32::dispatch(level, Sums::<12>)),
    ];
    rates.into_iter().map(|(done, seconds)| 1e-9 * done as f64 / seconds).fold(0.0, f64::max)
}

/// The result of `run`, and its shortest time, s.
fn best<T>(mut run: impl FnMut() -> T) -> (T, f64) {
    let mut shortest = f64::INFINITY;
    let mut result = run();
    for _ in 0..TRIES {
        let start = Instant::now();
        result = black_box(run());
        shortest = shortest.min(start.elapsed().as_secs_f64());
    }
    (result, shortest)
}

/// `Avx512`, `Avx2`, `Neon`.
fn name(level: Level) -> String {
    let debug = format!("{level:?}");
    debug.split('(').next().unwrap_or_default().to_string()
}
