//! When a parameter changed.
//!
//! With each finding the newest 1, 2, 4, … findings are tested against all before them since the last change, for each parameter. Look
//! number l, the first with the second finding, has the level `α / (l (l + 1))`, whose sum over all looks is α, and Holm's method shares
//! it among its tests. So the chance of a false change in a robot's life is at most α, however often its history is read, and whatever
//! the correlations are (Bonferroni). What a look finds depends on the findings up to it alone: it stays found.

use super::series::{Series, scatter};
use crate::findings::{Epoch, Pool};
use crate::holm::holm;

/// A change of a parameter that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Alarm {
    /// First entry of the series behind the change.
    pub(super) split: usize,
    /// Number of the finding with which it was found.
    pub(super) found: usize,
    /// Chance of so large a change of any parameter in any look.
    pub(super) chance: f64,
}

/// The changes of each parameter, the series of each, and what all findings say of the errors.
pub(super) struct Detected {
    pub(super) alarms: Vec<Vec<Alarm>>,
    pub(super) series: Vec<Series>,
    pub(super) pool: Pool,
}

/// Goes through the findings, in their order, of so many parameters and shared errors.
pub(super) fn detect(epochs: &[Epoch], parameters: usize, errors: usize, level: f64) -> Detected {
    let mut pool = Pool::new(errors);
    let mut series = vec![Series::new(errors); parameters];
    let mut alarms: Vec<Vec<Alarm>> = vec![Vec::new(); parameters];
    for (finding, epoch) in epochs.iter().enumerate() {
        pool.add(epoch);
        for (parameter, own) in series.iter_mut().enumerate() {
            own.add(epoch, parameter, finding);
        }
        if finding == 0 {
            continue;
        }
        let looks = (finding * (finding + 1)) as f64;
        let of_look = level / looks;
        let tests: Vec<(usize, f64)> = series
            .iter()
            .enumerate()
            .filter(|(_, own)| own.findings.last() == Some(&finding))
            .flat_map(|(parameter, own)| {
                let first = alarms[parameter].last().map_or(0, |alarm| alarm.split);
                let pool = &pool;
                newest(own.len() - first).map(move |count| {
                    (parameter, deviations(own, first, own.len() - count, pool, of_look))
                })
            })
            .collect();
        let chances = holm(&tests.iter().map(|(_, deviations)| *deviations).collect::<Vec<_>>());
        for ((parameter, _), chance) in tests.into_iter().zip(chances) {
            let (own, before) = (&series[parameter], &mut alarms[parameter]);
            if chance < of_look && before.last().is_none_or(|last| last.found < finding) {
                let first = before.last().map_or(0, |alarm| alarm.split);
                let split = largest_step(own, first, own.len(), &pool);
                before.push(Alarm { split, found: finding, chance: chance * looks });
            }
        }
    }
    Detected { alarms, series, pool }
}

/// Numbers of the newest findings that are tested against the others of so many.
fn newest(count: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(1_usize), |own| own.checked_mul(2))
        .take_while(move |own| *own < count)
}

/// Standard deviations of the step at `split` from zero. What is not significant even if the errors were known is not worked out further.
fn deviations(series: &Series, first: usize, split: usize, pool: &Pool, level: f64) -> f64 {
    let range = first..series.len();
    let step = series.step(range.clone(), split);
    let most = step.most_deviations(pool);
    if holm(&[most])[0] > level {
        return most;
    }
    let chi_squared =
        series.about_mean(first..split, pool) + series.about_mean(split..range.end, pool);
    step.value(pool) / step.deviation(scatter(chi_squared, range.len() - 2), pool)
}

/// The split of these entries at which the means differ by most of their standard deviations.
pub(super) fn largest_step(series: &Series, first: usize, end: usize, pool: &Pool) -> usize {
    let size = |split: &usize| {
        let step = series.step(first..end, *split);
        step.value(pool).abs() / step.deviation(1.0, pool)
    };
    let all = (first + 1..end).map(|split| (split, size(&split)));
    all.max_by(|one, other| one.1.total_cmp(&other.1)).map_or(first, |(split, _)| split)
}
