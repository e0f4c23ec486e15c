//! Each robot by the others.

use flexid_pipeline::dynamics::PositiveEstimate;
use nalgebra::DVector;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF as _, StudentsT};

use super::population::{Normal, Value, interval};
use crate::findings::{Epoch, Pool};
use crate::holm::adjusted;

/// Fewest robots that another is judged by. Chosen: the spread of two has an interval that says nothing, its ends 70 times apart.
pub const OTHERS: usize = 3;
/// Chance that a number is above its 95 % interval.
const TAIL: f64 = 0.025;

/// A parameter in the robots whose findings determine it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Shown {
    /// The robots, in the order of the findings.
    pub members: Vec<Member>,
    /// The population, without the robots outside it. `None` of fewer robots than [`OTHERS`] and one.
    pub population: Option<Population>,
}

/// A parameter in a population.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Population {
    /// Number of its robots.
    pub robots: usize,
    /// Mean over robots of this type, in the unit of the parameter: the exponential of μ.
    pub mean: PositiveEstimate,
    /// Standard deviation of the logarithm between robots: τ.
    pub spread: f64,
    /// Its 95 % interval. Both ends are 0 where findings scatter less than they state.
    pub spread_interval: [f64; 2],
    /// 95 % interval of a further robot, in the unit of the parameter.
    pub next: [f64; 2],
}

/// A parameter in a robot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Member {
    /// Number of the robot, from 0.
    pub robot: usize,
    /// Value, in its unit, with the errors that robots share as all findings have these.
    pub value: f64,
    /// Standard deviation of its logarithm by what is its own.
    pub relative_std: f64,
    /// The robot beside the others. `None` of fewer others than [`OTHERS`].
    pub judged: Option<Judged>,
    /// True if it lies outside the population.
    pub is_outside: bool,
}

/// A parameter of a robot beside the others.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Judged {
    /// Number of the others: robots that are not outside.
    pub others: usize,
    /// Value over the mean of the others.
    pub ratio: PositiveEstimate,
    /// Its logarithm, in standard deviations of a robot that the others predict.
    pub deviations: f64,
    /// Chance that any robot of a population lies so far off in any parameter.
    pub chance: f64,
}

/// A robot's value: number of the robot, logarithm and variance of its own, slopes along the shared errors.
struct Entry {
    robot: usize,
    value: Value,
    slopes: DVector<f64>,
}

/// Each parameter in the robots of a type, of which each has one of these findings. `level` is the chance that a fleet without a robot outside has one
/// called so.
pub fn populations(epochs: &[Epoch], level: f64) -> Vec<Shown> {
    let Some(first) = epochs.first() else { return Vec::new() };
    let (parameters, errors) = first.slopes.shape();
    let mut pool = Pool::new(errors);
    epochs.iter().for_each(|epoch| pool.add(epoch));
    let entries = (0..parameters).map(|parameter| {
        let of = |(robot, epoch): (usize, &Epoch)| {
            let (value, variance) = epoch.values[parameter]?;
            let slopes = epoch.slopes.row(parameter).transpose();
            let value = (value + slopes.dot(&pool.errors), variance);
            Some(Entry { robot, value, slopes })
        };
        epochs.iter().enumerate().filter_map(of).collect()
    });
    let entries: Vec<Vec<Entry>> = entries.collect();
    let mut shown: Vec<Shown> = entries.iter().map(|own| Shown::unjudged(own)).collect();
    while judge(&entries, &mut shown, &pool, level) {}
    for (own, shown) in entries.iter().zip(&mut shown) {
        shown.population = population(own, &shown.members, &pool);
    }
    shown
}

impl Shown {
    fn unjudged(entries: &[Entry]) -> Self {
        let members = entries.iter().map(|&Entry { robot, value: (value, variance), .. }| Member {
            robot,
            value: value.exp(),
            relative_std: variance.sqrt(),
            judged: None,
            is_outside: false,
        });
        Self { members: members.collect(), population: None }
    }
}

/// Judges all by those that are not outside. True if one more is found there.
fn judge(entries: &[Vec<Entry>], shown: &mut [Shown], pool: &Pool, level: f64) -> bool {
    for (own, shown) in entries.iter().zip(&mut *shown) {
        let inside: Vec<bool> = shown.members.iter().map(|member| !member.is_outside).collect();
        for (number, member) in shown.members.iter_mut().enumerate() {
            let others = own.iter().enumerate();
            let others = others.filter(|(other, _)| inside[*other] && *other != number);
            let others: Vec<&Entry> = others.map(|(_, own)| own).collect();
            member.judged = beside(&own[number], &others, pool).or(member.judged);
        }
    }
    let mut all: Vec<(&mut Judged, &mut bool)> = Vec::new();
    for member in shown.iter_mut().flat_map(|own| &mut own.members) {
        all.extend(member.judged.as_mut().map(|judged| (judged, &mut member.is_outside)));
    }
    let chances = adjusted(&all.iter().map(|(own, _)| own.chance).collect::<Vec<_>>());
    let mut is_more = false;
    for ((judged, is_outside), chance) in all.into_iter().zip(chances) {
        judged.chance = chance;
        is_more |= chance < level && !*is_outside;
        *is_outside |= chance < level;
    }
    is_more
}

/// A robot beside others, with the chance of this test alone. `None` if they are too few.
fn beside(own: &Entry, others: &[&Entry], pool: &Pool) -> Option<Judged> {
    let count = others.len();
    if count < OTHERS {
        return None;
    }
    let (normal, slopes) = of(others);
    let of_errors = pool.variance(&(&own.slopes - slopes));
    let off = own.value.0 - normal.mean;
    let of_ratio = own.value.1 + normal.variance + of_errors;
    let whole = of_ratio + normal.between;
    let deviations = off / whole.sqrt();
    let chance =
        2.0 * student(normal.freedoms(whole).min((count - 1) as f64))?.sf(deviations.abs());
    let ratio = estimate(off, of_ratio, (count - 1) as f64)?;
    Some(Judged { others: count, ratio, deviations, chance })
}

/// The population of the robots that are not outside.
fn population(entries: &[Entry], members: &[Member], pool: &Pool) -> Option<Population> {
    let inside = entries.iter().zip(members).filter(|(_, member)| !member.is_outside);
    let inside: Vec<&Entry> = inside.map(|(own, _)| own).collect();
    let robots = inside.len();
    if entries.len() <= OTHERS || robots < OTHERS {
        return None;
    }
    let (normal, slopes) = of(&inside);
    let of_mean = normal.variance + pool.variance(&slopes);
    let reach =
        student((robots - 2) as f64)?.inverse_cdf(1.0 - TAIL) * (normal.between + of_mean).sqrt();
    let values: Vec<Value> = inside.iter().map(|own| own.value).collect();
    Some(Population {
        robots,
        mean: estimate(normal.mean, of_mean, (robots - 1) as f64)?,
        spread: normal.between.sqrt(),
        spread_interval: interval(&values).map(f64::sqrt),
        next: [-reach, reach].map(|off| (normal.mean + off).exp()),
    })
}

/// The population of these, and the slopes of its mean along the shared errors.
fn of(entries: &[&Entry]) -> (Normal, DVector<f64>) {
    let values: Vec<Value> = entries.iter().map(|own| own.value).collect();
    let normal = Normal::new(&values);
    let mut slopes = DVector::zeros(entries[0].slopes.len());
    for (own, share) in entries.iter().zip(&normal.shares) {
        slopes.axpy(*share, &own.slopes, 1.0);
    }
    (normal, slopes)
}

/// The exponential of a number with this variance, which has so many freedoms.
fn estimate(logarithm: f64, variance: f64, freedoms: f64) -> Option<PositiveEstimate> {
    let std = variance.sqrt();
    let reach = student(freedoms)?.inverse_cdf(1.0 - TAIL) * std;
    let interval = [-reach, reach].map(|off| (logarithm + off).exp());
    Some(PositiveEstimate { interval, ..PositiveEstimate::new(logarithm.exp(), std) })
}

/// Student's t distribution. `None` without a freedom.
fn student(freedoms: f64) -> Option<StudentsT> {
    StudentsT::new(0.0, 1.0, freedoms).ok()
}
