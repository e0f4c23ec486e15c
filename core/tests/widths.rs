//! One loss and one fit, whatever the width of the vectors.

use flexid_core::chain::Chain;
use flexid_core::loss::spectral;
use flexid_core::parameters::Bushings;
use flexid_core::refine::{Problem, Refinement};
use flexid_core::spectrum::Experiment;

use crate::common::fits::{parameters, problem, targets, values};
use crate::common::milling::{Conditions, SAMPLES, cut, record};
use crate::common::{BINS, MEASUREMENT, Random, bounds};
use fearless_simd::Level;

/// The level of the machine, and AVX2 where that is more; the [baseline](Level::baseline) of x86-64 has neither, and takes one
/// lane.
fn wider() -> Vec<(&'static str, Level)> {
    #[cfg_attr(not(any(target_arch = "x86", target_arch = "x86_64")), allow(unused_mut))]
    let mut levels = vec![("detected", Level::new())];
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(avx2) = Level::new().as_avx2() {
        levels.push(("AVX2", Level::Avx2(avx2)));
    }
    levels
}

struct Robot {
    chain: Chain,
    guess: Bushings,
    experiments: Vec<Experiment<BINS>>,
}

impl Robot {
    /// At random, with two records, and a guess that is some way off.
    fn new(joints: usize) -> Self {
        let mut random = Random::new(120 + joints as u64);
        let (chain, truth) = (random.chain(joints), random.bushings(joints));
        let mut buffer = [0.0; SAMPLES];
        let experiments = (0..2)
            .map(|feed| {
                let pose = random.pose(joints);
                let force = cut(&mut random, [600.0, 4200.0], feed);
                let conditions = Conditions::default();
                let record = record(&chain, &pose, &truth, &force, &conditions, &mut random);
                Experiment::new(&chain, &MEASUREMENT, &record, &mut buffer).expect("a good record")
            })
            .collect();
        let mut guess = truth;
        for bushing in &mut guess {
            for value in bushing.stiffness.iter_mut().chain(&mut bushing.damping) {
                *value *= (0.05 * random.normal()).exp();
            }
        }
        Self { chain, guess, experiments }
    }

    fn losses(&self, level: Level) -> Vec<f64> {
        let targets = targets(&self.chain, &MEASUREMENT, &self.experiments);
        let losses = spectral::losses(&targets, &self.experiments, &self.guess, level);
        losses.into_iter().map(f64::from).collect()
    }

    /// At the guess: sum of squares and deviations; and where one step leads to.
    fn fit(&self, level: Level) -> [Vec<f64>; 3] {
        let (bounds, sought) = (bounds(), parameters(self.guess.len()));
        let problem = Problem { level, ..problem(&self.chain, &MEASUREMENT, &bounds, &sought) };
        let mut refinement = Box::new(Refinement::new(&sought, &self.guess));
        let fit = refinement.fit(&problem, &self.experiments);
        let _ = refinement.step(&problem, &self.experiments);
        let deviations = fit.deviations[..12 * self.guess.len()].to_vec();
        [vec![fit.sum_of_squares], deviations, values(&refinement.bushings(&sought))]
    }
}

/// Largest difference, each by what `size` makes of the numbers.
fn gap(ours: &[f64], other: &[f64], size: impl Fn(f64) -> f64) -> f64 {
    assert_eq!(ours.len(), other.len());
    let gaps = ours.iter().zip(other).map(|(a, b)| (a - b).abs() / size(*b));
    gaps.fold(0.0, f64::max)
}

/// Up to rounding: one lane has no fused multiply-adds. What is fitted has the condition of the seam's normal equations
/// beside, 4e7 with three joints, and 1e11 with seven, which is where the fit stops it.
#[test]
fn every_width_gives_the_same() {
    for (joints, limit) in [(1, 1e-12), (3, 1e-8), (7, 2e-5)] {
        let robot = Robot::new(joints);
        for experiment in &robot.experiments {
            // The last vector is not full, however wide.
            assert!(experiment.bins() % 2 == 1 && experiment.thinned.bins % 2 == 1);
        }
        let one_lane = Level::baseline();
        let (losses, fit) = (robot.losses(one_lane), robot.fit(one_lane));
        for (name, level) in wider() {
            let loss = gap(&robot.losses(level), &losses, |_| 1.0);
            let own = robot.fit(level);
            let gaps = [0, 1, 2].map(|i| gap(&own[i], &fit[i], f64::abs));
            println!(
                "{joints} joints, {name}: loss {loss:.1e}, sum of squares {:.1e}, deviations {:.1e}, step {:.1e}",
                gaps[0], gaps[1], gaps[2]
            );
            assert!(loss < 1e-5, "{joints} joints, {name}: loss {loss:e}");
            assert!(gaps[0] < 1e-9, "{joints} joints, {name}: sum of squares {:e}", gaps[0]);
            assert!(gaps.iter().all(|gap| *gap < limit), "{joints} joints, {name}: {gaps:?}");
        }
    }
}
