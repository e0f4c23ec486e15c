//! How often a history calls a robot changed that stays the same, and whether it names a change with an interval that holds it.

#[path = "../../../core/tests/common/mod.rs"]
mod common;
mod readings;

use common::Random;
use flexid_prediction::history::{Course, Epoch, courses};
use nalgebra::{DMatrix, DVector};
use readings::{ERRORS, PARAMETERS, Place, deviations, effects};

/// Standard deviation of what an error of the size of its prior does to a parameter.
const BY_ERROR: f64 = 0.02;
/// The parameter that changes: joint_2 ry, a stiffness.
const CHANGED: usize = 12 + 4;
const YEAR: usize = 365;
const LEVEL: f64 = 0.05;

/// A robot that mills at two places in turn. Its errors stay.
struct Robot {
    places: Vec<Place>,
    errors: DVector<f64>,
}

impl Robot {
    fn new(random: &mut Random) -> Self {
        let stds = deviations(random);
        let by_error = effects(BY_ERROR, random);
        let places = (0..2).map(|_| Place::new(&stds, &by_error, random)).collect();
        let errors = DVector::from_fn(ERRORS, |_, _| random.normal());
        Self { places, errors }
    }

    /// What is found on a day, on which the logarithm of the parameter that changes is off by `change`.
    fn estimate(&self, day: usize, change: f64, random: &mut Random) -> DVector<f64> {
        let place = &self.places[day % self.places.len()];
        let mut truth = DVector::zeros(ERRORS + PARAMETERS);
        truth.rows_mut(0, ERRORS).copy_from(&self.errors);
        truth[ERRORS + CHANGED] = change;
        place.estimate(&truth, random)
    }

    /// A finding with this estimate.
    fn epoch(&self, day: usize, estimate: &DVector<f64>) -> Epoch {
        self.places[day % self.places.len()].epoch(estimate)
    }

    /// Its findings of so many days, with such a change by the day.
    fn findings(
        &self,
        days: usize,
        change: impl Fn(usize) -> f64,
        random: &mut Random,
    ) -> Vec<Epoch> {
        (0..days).map(|day| self.epoch(day, &self.estimate(day, change(day), random))).collect()
    }
}

/// The courses over findings of a day each.
fn over(epochs: &[Epoch], level: f64) -> Vec<Course> {
    let times: Vec<f64> = (0..epochs.len()).map(|day| day as f64).collect();
    courses(epochs, &times, level).into_iter().map(Option::unwrap).collect()
}

/// The parameters that are called changed.
fn changed(courses: &[Course]) -> Vec<usize> {
    (0..courses.len()).filter(|own| !courses[*own].steps.is_empty()).collect()
}

/// Of 50 robots, 5 % are 2.5, and four standard deviations of that number 6. With a fiftieth of the level, it is that of all of them.
#[test]
fn robots_that_stay_the_same_are_seldom_called_changed_in_a_year_of_days() {
    let robots = 50;
    let mut called = [0, 0];
    for seed in 0..robots {
        let mut random = Random::new(1000 + seed);
        let robot = Robot::new(&mut random);
        let epochs = robot.findings(YEAR, |_| 0.0, &mut random);
        for (called, level) in called.iter_mut().zip([LEVEL, LEVEL / robots as f64]) {
            *called += u32::from(!changed(&over(&epochs, level)).is_empty());
        }
    }
    println!("called changed: {} of {robots}, and {} as a fleet", called[0], called[1]);
    assert!(called[0] <= 8 && called[1] == 0, "{called:?}");
}

/// One robot of 50 loses 5 % of one stiffness. A finding by itself does not know that stiffness as well.
#[test]
fn a_loss_of_a_twentieth_is_named_and_its_interval_holds_it() {
    let (mut named, mut held, mut delays) = (0, 0, Vec::new());
    for seed in 0..20 {
        let mut random = Random::new(seed);
        let robot = Robot::new(&mut random);
        let day = 100 + seed as usize;
        let loss = |own: usize| if own < day { 0.0 } else { 0.95_f64.ln() };
        let courses = over(&robot.findings(YEAR, loss, &mut random), LEVEL / 50.0);
        let own = &courses[CHANGED];
        let is_named = changed(&courses) == [CHANGED] && own.steps.len() == 1 && !own.is_drift;
        named += u32::from(is_named);
        let Some(step) = own.steps.first() else { continue };
        let [low, high] = step.ratio.interval;
        held += u32::from((low..=high).contains(&0.95));
        assert!(step.since.abs_diff(day) <= 3, "{seed}: {step:?}");
        delays.push(step.found - day);
        let variance = robot.places[0].covariance[(ERRORS + CHANGED, ERRORS + CHANGED)];
        assert!(variance.sqrt() > 5.0 * step.ratio.relative_std, "{seed}: {step:?}");
    }
    delays.sort_unstable();
    println!("named {named}, held {held} of 20, found after {delays:?} days");
    assert!(named >= 19 && held >= 19 && delays[10] <= 7, "{named} {held} {delays:?}");
}

#[test]
fn a_drift_is_a_line_and_its_interval_holds_it() {
    let mut held = 0;
    for seed in 0..20 {
        let mut random = Random::new(100 + seed);
        let robot = Robot::new(&mut random);
        let drift = |day: usize| -0.1 * day as f64 / YEAR as f64;
        let courses = over(&robot.findings(YEAR, drift, &mut random), LEVEL);
        let own = &courses[CHANGED];
        let line = own.line.unwrap();
        assert!(own.is_drift && changed(&courses).contains(&CHANGED), "{seed}: {own:?}");
        let off = (line.growth + 0.1 / YEAR as f64) / line.growth_std;
        held += u32::from(off.abs() < 1.96);
        // χ² of 363 has a standard deviation of 27.
        assert!((line.chi_squared - line.freedoms as f64).abs() < 110.0, "{seed}: {line:?}");
    }
    assert!(held >= 17, "{held}");
}

/// By all equations at once: errors, the parameters of the first finding, and those of the second.
#[test]
fn the_errors_that_findings_share_are_marginalised_once() {
    let mut random = Random::new(7);
    let robot = Robot::new(&mut random);
    let size = ERRORS + 2 * PARAMETERS;
    let mut all = DMatrix::<f64>::zeros(size, size);
    let mut right = DVector::<f64>::zeros(size);
    (0..ERRORS).for_each(|own| all[(own, own)] = 1.0);
    let mut epochs = Vec::new();
    for day in 0..2 {
        let estimate = robot.estimate(day, 0.0, &mut random);
        let (information, epoch) = (&robot.places[day].information, robot.epoch(day, &estimate));
        // The readings say what the estimate says without its priors.
        let mut whole = information.clone();
        (0..ERRORS).for_each(|own| whole[(own, own)] += 1.0);
        let readings = whole * &estimate;
        let place = |own: usize| if own < ERRORS { own } else { own + day * PARAMETERS };
        for row in 0..ERRORS + PARAMETERS {
            right[place(row)] += readings[row];
            for column in 0..ERRORS + PARAMETERS {
                all[(place(row), place(column))] += information[(row, column)];
            }
        }
        epochs.push(epoch);
    }
    let covariance = all.try_inverse().unwrap();
    let solution = &covariance * right;
    for (own, course) in over(&epochs, LEVEL).iter().enumerate() {
        let [first, second] = [ERRORS + own, ERRORS + PARAMETERS + own];
        let difference = solution[second] - solution[first];
        let variance = covariance[(first, first)] + covariance[(second, second)]
            - 2.0 * covariance[(first, second)];
        let line = course.line.unwrap();
        let off = line.ratio.value.ln() - difference;
        assert!(off.abs() < 1e-9 * variance.sqrt().max(1e-3), "{own}: {off}");
        assert!((line.ratio.relative_std / variance.sqrt() - 1.0).abs() < 1e-6, "{own}: {line:?}");
    }
}
