//! How often a robot of a population is called outside it, and whether one that is outside is named with an interval that holds how far.

#[path = "../../../core/tests/common/mod.rs"]
mod common;
mod readings;

use common::Random;
use flexid_prediction::fleet::{Judged, OTHERS, Shown, populations};
use flexid_prediction::history::Epoch;
use nalgebra::{DMatrix, DVector};
use readings::{ERRORS, PARAMETERS, Place, deviations, effects};

/// Standard deviation of what an error of the size of its prior does to a parameter: the model's masses carry each by 12 % or so.
const BY_ERROR: f64 = 0.05;
/// The parameter that is off: joint_2 ry, a stiffness.
const OFF: usize = 12 + 4;
const ROBOTS: usize = 50;
/// Fleets whose intervals are counted.
const SEEDS: u64 = 20;
/// Fleets with a robot that is off.
const FLEETS: u64 = 50;
const LEVEL: f64 = 0.05;

/// Robots of one type.
struct Type {
    stds: Vec<f64>,
    by_error: DMatrix<f64>,
    /// Errors of the model, which all robots share.
    errors: DVector<f64>,
    /// Means and spreads of the logarithms.
    means: Vec<f64>,
    spreads: Vec<f64>,
}

impl Type {
    /// A type whose robots differ by up to so much, each parameter by its own.
    fn new(largest: f64, random: &mut Random) -> Self {
        Self {
            stds: deviations(random),
            by_error: effects(BY_ERROR, random),
            errors: DVector::from_fn(ERRORS, |_, _| random.normal()),
            means: (0..PARAMETERS).map(|_| random.uniform(0.0, 20.0)).collect(),
            spreads: (0..PARAMETERS).map(|_| random.uniform(0.0, largest)).collect(),
        }
    }

    /// Logarithms of a robot.
    fn robot(&self, random: &mut Random) -> DVector<f64> {
        let drawn = self
            .means
            .iter()
            .zip(&self.spreads)
            .map(|(mean, spread)| mean + spread * random.normal());
        DVector::from_iterator(PARAMETERS, drawn)
    }

    /// A finding of a robot with these logarithms, which cuts in a way of its own.
    fn finding(&self, logarithms: &DVector<f64>, random: &mut Random) -> Epoch {
        self.with(logarithms, &self.errors, random)
    }

    fn with(&self, logarithms: &DVector<f64>, errors: &DVector<f64>, random: &mut Random) -> Epoch {
        // One has milled up to a hundred times as much as another.
        let more = 10_f64.powf(random.uniform(-0.5, 0.5));
        let stds: Vec<f64> = self.stds.iter().map(|std| std * more).collect();
        let place = Place::new(&stds, &self.by_error, random);
        let mut truth = errors.clone().resize_vertically(ERRORS + PARAMETERS, 0.0);
        truth.rows_mut(ERRORS, PARAMETERS).copy_from(logarithms);
        place.epoch(&place.estimate(&truth, random))
    }

    /// Findings of so many robots, and their logarithms.
    fn fleet(&self, robots: usize, random: &mut Random) -> (Vec<Epoch>, Vec<DVector<f64>>) {
        let all: Vec<_> = (0..robots).map(|_| self.robot(random)).collect();
        (all.iter().map(|own| self.finding(own, random)).collect(), all)
    }
}

/// Parameter, robot and judgement of each that is outside.
fn outside(shown: &[Shown]) -> Vec<(usize, usize, Judged)> {
    let members = shown
        .iter()
        .enumerate()
        .flat_map(|(own, shown)| shown.members.iter().map(move |member| (own, member)));
    let outside = members.filter(|(_, member)| member.is_outside);
    outside.map(|(own, member)| (own, member.robot, member.judged.unwrap())).collect()
}

/// 5 % of 100 fleets are 5, and three standard deviations of that number 7; of 20 fleets 1 and 3. Robots do not differ, or by up to so much.
#[test]
fn robots_of_a_population_are_seldom_called_outside() {
    for (robots, fleets, most) in [(4, 100, 11), (8, 100, 11), (15, 100, 11), (ROBOTS, 20, 3)] {
        for largest in [0.0, 0.01, 0.05] {
            let mut called = 0;
            for seed in 0..fleets {
                let mut random = Random::new(1000 + seed);
                let of_type = Type::new(largest, &mut random);
                let (epochs, _) = of_type.fleet(robots, &mut random);
                called += u32::from(!outside(&populations(&epochs, LEVEL)).is_empty());
            }
            println!("{robots} robots that differ by up to {largest}: {called} of {fleets} fleets");
            assert!(called <= most, "{robots} {largest}: {called}");
        }
    }
}

/// What is taken as one error of all is a spread where it is each robot's own. 5 % of 100 fleets are 5, and three standard deviations of that number 7.
#[test]
fn errors_that_are_not_shared_call_no_robot_outside() {
    let mut called = 0;
    for seed in 0..100 {
        let mut random = Random::new(2000 + seed);
        let of_type = Type::new(0.02, &mut random);
        let epochs: Vec<Epoch> = (0..20)
            .map(|_| {
                let (robot, errors) =
                    (of_type.robot(&mut random), DVector::from_fn(ERRORS, |_, _| random.normal()));
                of_type.with(&robot, &errors, &mut random)
            })
            .collect();
        called += u32::from(!outside(&populations(&epochs, LEVEL)).is_empty());
    }
    println!("{called} of 100 fleets");
    assert!(called <= 11, "{called}");
}

/// Fleets of so many robots, one of which is off by a factor: in how many it is named, and nothing else, and its interval holds how far it is from the
/// mean.
fn named(robots: usize, factor: f64, largest: f64) -> [usize; 3] {
    let (mut alone, mut named, mut held) = (0, 0, 0);
    for seed in 0..FLEETS {
        let mut random = Random::new(7000 + seed);
        let of_type = Type::new(largest, &mut random);
        let (mut epochs, mut truth) = of_type.fleet(robots - 1, &mut random);
        let mut robot = of_type.robot(&mut random);
        robot[OFF] += factor.ln();
        epochs.insert(seed as usize % robots, of_type.finding(&robot, &mut random));
        truth.push(robot.clone());
        let found = outside(&populations(&epochs, LEVEL));
        let own = found
            .iter()
            .find(|(parameter, robot, _)| (*parameter, *robot) == (OFF, seed as usize % robots));
        alone += usize::from(own.is_some() && found.len() == 1);
        let Some((.., judged)) = own else { continue };
        named += 1;
        let [low, high] = judged.ratio.interval;
        held += usize::from((low..=high).contains(&(robot[OFF] - of_type.means[OFF]).exp()));
        assert_eq!(judged.others, robots - 1);
    }
    [alone, named, held]
}

/// An interval holds in 95 % of the fleets, three standard deviations of which are 9 % of so many.
#[test]
fn a_robot_that_is_off_is_named_and_its_interval_holds_how_far() {
    let [alone, named, held] = named(ROBOTS, 0.85, 0.015);
    println!("15 % less: named alone in {alone} of {FLEETS}, {held} of {named} intervals hold");
    assert!(alone >= 40 && held as f64 >= 0.86 * named as f64, "{alone} {named} {held}");
}

/// Mean, spread and the next robot, each within its interval in 95 % of 720 parameters, three standard deviations of that number being 2.4 %; fewer are
/// independent.
#[test]
fn intervals_of_the_population_hold_it() {
    for robots in [6, 20] {
        let (mut means, mut spreads, mut next, mut all) = (0, 0, 0, 0);
        for seed in 0..SEEDS {
            let mut random = Random::new(3000 + seed);
            let of_type = Type::new(0.05, &mut random);
            let (epochs, _) = of_type.fleet(robots, &mut random);
            let further = of_type.robot(&mut random);
            for (own, shown) in populations(&epochs, LEVEL).iter().enumerate() {
                let found = shown.population.unwrap();
                let within =
                    |[low, high]: [f64; 2], value: f64| usize::from((low..=high).contains(&value));
                means += within(found.mean.interval, of_type.means[own].exp());
                spreads += within(found.spread_interval, of_type.spreads[own]);
                next += within(found.next, further[own].exp());
                all += 1;
            }
        }
        let per_cent = [means, spreads, next].map(|own| 100.0 * own as f64 / all as f64);
        println!("{robots} robots: mean, spread, next robot within {per_cent:.1?} %");
        assert!(per_cent.iter().all(|own| *own > 92.0), "{per_cent:?}");
    }
}

/// Two that are off by as much hide one another less than they show: the rest is judged again without the first.
#[test]
fn a_second_robot_is_found_behind_the_first() {
    let mut random = Random::new(5);
    let of_type = Type::new(0.02, &mut random);
    let (mut epochs, _) = of_type.fleet(ROBOTS - 2, &mut random);
    for factor in [0.4, 0.85] {
        let mut robot = of_type.robot(&mut random);
        robot[OFF] += f64::ln(factor);
        epochs.push(of_type.finding(&robot, &mut random));
    }
    let found = outside(&populations(&epochs, LEVEL));
    let named: Vec<_> =
        found.iter().map(|(own, robot, judged)| (*own, *robot, judged.others)).collect();
    assert_eq!(named, [(OFF, ROBOTS - 2, ROBOTS - 2), (OFF, ROBOTS - 1, ROBOTS - 2)]);
}

#[test]
fn robots_that_are_alike_have_no_spread_and_that_of_noise_is_not_taken_for_one() {
    let mut random = Random::new(6);
    let of_type = Type::new(0.0, &mut random);
    let (epochs, _) = of_type.fleet(ROBOTS, &mut random);
    let shown = populations(&epochs, LEVEL);
    let none = shown.iter().filter(|own| own.population.unwrap().spread == 0.0).count();
    let held = shown.iter().filter(|own| own.population.unwrap().spread_interval[0] == 0.0).count();
    println!("no spread {none}, interval from zero {held} of {PARAMETERS}");
    assert!(none > PARAMETERS / 4 && held >= 33, "{none} {held}");
}

#[test]
fn too_few_robots_have_no_population() {
    let mut random = Random::new(7);
    let of_type = Type::new(0.02, &mut random);
    let robots: Vec<_> = (0..=OTHERS).map(|_| of_type.robot(&mut random)).collect();
    // The first does not determine the last parameter, whatever its number is.
    let epochs = |number: f64, random: &mut Random| -> Vec<Epoch> {
        let own = robots.iter().enumerate().map(|(robot, logarithms)| {
            let place = Place::new(&of_type.stds, &of_type.by_error, random);
            let mut truth = of_type.errors.clone().resize_vertically(ERRORS + PARAMETERS, 0.0);
            truth.rows_mut(ERRORS, PARAMETERS).copy_from(logarithms);
            let mut posterior = place.posterior(&place.estimate(&truth, random));
            if robot == 0 {
                posterior.logarithms[PARAMETERS - 1] = None;
                posterior.logarithms[0] =
                    posterior.logarithms[0].map(|(own, std)| (own + number, std));
            }
            Epoch::new(&posterior, ERRORS).unwrap()
        });
        own.collect()
    };
    let shown = populations(&epochs(0.0, &mut Random::new(8)), LEVEL);
    let [first, last] = [&shown[0], &shown[PARAMETERS - 1]];
    assert_eq!((first.members.len(), first.population.unwrap().robots), (OTHERS + 1, OTHERS + 1));
    assert!(first.members.iter().all(|own| own.judged.unwrap().others == OTHERS));
    assert_eq!((last.members.len(), last.population), (OTHERS, None));
    assert!(last.members.iter().all(|own| own.judged.is_none() && own.robot > 0));
    assert!(populations(&[], LEVEL).is_empty());
}

/// The same numbers, whatever the order of the robots is; and a factor common to all in one parameter is one of its mean alone.
#[test]
fn order_does_not_matter_and_a_shift_of_all_moves_the_mean_alone() {
    let by = 0.3;
    let epochs = |shift: f64| {
        let mut random = Random::new(9);
        let mut of_type = Type::new(0.03, &mut random);
        of_type.means[OFF] += shift;
        let (mut epochs, _) = of_type.fleet(9, &mut random);
        let mut robot = of_type.robot(&mut random);
        robot[OFF] -= 1.0;
        epochs.push(of_type.finding(&robot, &mut random));
        epochs
    };
    let close = |one: f64, other: f64| (one - other).abs() <= 1e-6 * one.abs().max(1e-3);
    let before = populations(&epochs(0.0), LEVEL);
    let mut turned = epochs(0.0);
    turned.reverse();
    let (turned, shifted) = (populations(&turned, LEVEL), populations(&epochs(by), LEVEL));
    assert_eq!(outside(&before).len(), 1);
    for (own, before) in before.iter().enumerate() {
        let factor = if own == OFF { f64::exp(by) } else { 1.0 };
        for (after, factor, is_turned) in
            [(&turned[own], 1.0, true), (&shifted[own], factor, false)]
        {
            let (old, new) = (before.population.unwrap(), after.population.unwrap());
            assert!(
                close(new.mean.value / factor, old.mean.value) && close(new.spread, old.spread),
                "{own}: {old:?} {new:?}"
            );
            for (number, old) in before.members.iter().enumerate() {
                let new = after.members
                    [if is_turned { before.members.len() - 1 - number } else { number }];
                let [one, other] = [old, &new].map(|member| member.judged.unwrap());
                assert!(
                    close(one.deviations, other.deviations) && close(one.chance, other.chance),
                    "{own}: {one:?} {other:?}"
                );
                assert_eq!(old.is_outside, new.is_outside);
            }
        }
    }
}
