//! The rows of all methods, and the comparisons that the paper makes, from the outcome of every method on every
//! robot.

use super::Findings;
use super::method::{Kind, METHODS, Method, Sensitivity};
use super::robot::median;
use super::solve::Outcome;
use super::statistics::{self, POWER, Paired, SIGNIFICANT};
use super::tables::{Comparison, CurvePoint, Mean, Measure, MethodRow, SensitivityCost, Verdict};

/// Methods that the paper's random search outperforms, as the paper states without figures.
const OUTPERFORMED: [&str; 2] = ["ga", "pso"];

use Measure::{DisplacementError, ParameterDeviation};

/// Method, the method it is compared with, and the measure. The adaptions are compared with the baseline; adapted,
/// GSA and Jacobian with each other; and the rivals and flexid.
const COMPARISONS: [(&str, &str, Measure); 24] = [
    ("mse", "baseline", ParameterDeviation),
    ("ssp", "baseline", ParameterDeviation),
    ("lo", "baseline", ParameterDeviation),
    ("abg", "baseline", ParameterDeviation),
    ("abl", "baseline", ParameterDeviation),
    ("adapted", "baseline", ParameterDeviation),
    ("gsa", "baseline", ParameterDeviation),
    ("jacobian", "baseline", ParameterDeviation),
    ("gsa", "adapted", ParameterDeviation),
    ("jacobian", "adapted", ParameterDeviation),
    ("jacobian", "gsa", ParameterDeviation),
    ("adapted", "baseline", DisplacementError),
    ("gsa", "baseline", DisplacementError),
    ("jacobian", "baseline", DisplacementError),
    ("gsa", "adapted", DisplacementError),
    ("jacobian", "adapted", DisplacementError),
    ("jacobian", "gsa", DisplacementError),
    ("ga", "baseline", ParameterDeviation),
    ("pso", "baseline", ParameterDeviation),
    ("cma_es", "baseline", ParameterDeviation),
    ("flexid", "baseline", ParameterDeviation),
    ("flexid", "jacobian", ParameterDeviation),
    ("flexid", "baseline", DisplacementError),
    ("flexid", "jacobian", DisplacementError),
];

/// One row for each method, in their order.
pub(super) fn rows(findings: &[Findings]) -> Vec<MethodRow> {
    METHODS.iter().enumerate().map(|(index, method)| row(method, index, findings)).collect()
}

/// All comparisons.
pub(super) fn comparisons(rows: &[MethodRow]) -> Vec<Comparison> {
    let find = |key: &str| rows.iter().find(|row| row.key == key);
    COMPARISONS
        .iter()
        .filter_map(|&(method, against, measure)| compare(find(method)?, find(against)?, measure))
        .collect()
}

/// Cost of the sensitivities. The evaluations are the same for every robot, and the seconds are the mean.
pub(super) fn sensitivity_costs(findings: &[Findings]) -> Vec<SensitivityCost> {
    let mut costs = Vec::new();
    for (index, method) in METHODS.iter().enumerate() {
        let Kind::Search(variant) = method.kind else { continue };
        if variant.sensitivity == Sensitivity::None {
            continue;
        }
        let each: Vec<_> = outcomes(findings, index).map(|outcome| outcome.sensitivities).collect();
        let seconds = mean(each.iter().map(|cost| cost.seconds));
        let evaluations = each.first().map_or(0, |cost| cost.evaluations);
        costs.push(SensitivityCost { name: method.name.into(), evaluations, seconds });
    }
    costs
}

/// Outcomes of one method, robot by robot.
fn outcomes(findings: &[Findings], method: usize) -> impl Iterator<Item = &Outcome> {
    findings.iter().filter_map(move |one| one.outcomes[method].as_ref())
}

fn row(method: &Method, index: usize, findings: &[Findings]) -> MethodRow {
    let outcomes: Vec<_> = outcomes(findings, index).collect();
    let deviations: Vec<f64> = outcomes.iter().map(|outcome| outcome.deviation).collect();
    let validated = || outcomes.iter().filter(|outcome| !outcome.errors.is_empty());
    let errors: Vec<f64> = validated().map(|outcome| median(&outcome.errors)).collect();
    // A fit that gives way has errors that are NaN.
    let all_errors = validated().flat_map(|outcome| &outcome.errors);
    let all_errors = all_errors.map(|&error| if error.is_nan() { f64::INFINITY } else { error });
    let points = outcomes.iter().map(|outcome| outcome.curve.len()).min().unwrap_or(0);
    let curve = (0..points).map(|point| {
        let values: Vec<f64> = outcomes.iter().map(|outcome| outcome.curve[point]).collect();
        let spread = statistics::mean(&values).map_or(0.0, |mean| mean.standard_deviation);
        CurvePoint { mean: mean(values.into_iter()), spread }
    });
    MethodRow {
        key: method.key.into(),
        name: method.name.into(),
        description: method.description.into(),
        origin: method.origin(),
        deviation: with_interval(&deviations),
        paper_deviation: method.paper_deviation,
        displacement_error: (!errors.is_empty()).then(|| geometric(&errors)),
        paper_displacement_error: method.paper_displacement_error,
        largest_displacement_error: all_errors.reduce(f64::max),
        curve: curve.collect(),
        deviations,
        displacement_errors: errors,
        seconds: mean(outcomes.iter().map(|outcome| outcome.seconds)),
    }
}

fn compare(method: &MethodRow, against: &MethodRow, measure: Measure) -> Option<Comparison> {
    let rows = [method, against];
    let [mut ours, mut other] = rows.map(|row| match measure {
        ParameterDeviation => row.deviations.clone(),
        // Errors differ by factors, so that their logarithms are compared.
        DisplacementError => row.displacement_errors.iter().map(|error| error.ln()).collect(),
    });
    // Only the robots that both methods have met are compared.
    ours.truncate(other.len());
    other.truncate(ours.len());
    let [paper, paper_other] = rows.map(|row| match measure {
        ParameterDeviation => row.paper_deviation,
        DisplacementError => row.paper_displacement_error.map(f64::ln),
    });
    let paper = paper.zip(paper_other).map(|(ours, other)| ours - other);
    let to_effect = |difference: f64| match measure {
        ParameterDeviation => difference,
        DisplacementError => difference.exp_m1(),
    };
    if ours.is_empty() {
        return None;
    }
    // A fit that has given way leaves the comparison undecided.
    let test = statistics::paired(&ours, &other).unwrap_or(Paired {
        difference: statistics::Mean {
            count: ours.len(),
            mean: f64::NAN,
            standard_deviation: f64::NAN,
            interval: [f64::NAN; 2],
        },
        p: f64::NAN,
    });
    let deviation = test.difference.standard_deviation;
    let outperformed = OUTPERFORMED.contains(&method.key.as_str()) && measure == ParameterDeviation;
    let expected = paper.or(outperformed.then_some(1.0));
    let verdict = expected.map(|expected| {
        if test.p.is_nan() || test.p >= SIGNIFICANT {
            Verdict::Undecided
        } else if test.difference.mean * expected > 0.0 {
            Verdict::Agrees
        } else {
            Verdict::Contradicts
        }
    });
    Some(Comparison {
        method: method.key.clone(),
        against: against.key.clone(),
        measure,
        pairs: test.difference.count,
        effect: to_effect(test.difference.mean),
        interval: test.difference.interval.map(to_effect),
        p: test.p,
        paper_effect: paper.map(to_effect),
        power: paper.map(|effect| statistics::power(effect, deviation, test.difference.count)),
        pairs_for_power: paper
            .and_then(|effect| statistics::pairs_for_power(effect, deviation, POWER))
            .map(|pairs| pairs as u64),
        verdict,
    })
}

fn with_interval(values: &[f64]) -> Mean {
    match statistics::mean(values) {
        Ok(mean) => Mean { mean: mean.mean, interval: mean.interval },
        Err(_) => Mean { mean: mean(values.iter().copied()), interval: [f64::NAN; 2] },
    }
}

/// Geometric mean of values that differ by factors.
fn geometric(values: &[f64]) -> Mean {
    let logarithms: Vec<f64> = values.iter().map(|value| value.ln()).collect();
    let Mean { mean, interval } = with_interval(&logarithms);
    Mean { mean: mean.exp(), interval: interval.map(f64::exp) }
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len();
    values.sum::<f64>() / count as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables::Origin;

    /// A method with these deviations and errors of four robots, and the paper's figures for it.
    fn row(
        key: &str,
        deviations: [f64; 4],
        errors: [f64; 4],
        paper: Option<[f64; 2]>,
    ) -> MethodRow {
        MethodRow {
            key: key.into(),
            name: key.into(),
            description: String::new(),
            origin: Origin::Paper,
            deviation: with_interval(&deviations),
            paper_deviation: paper.map(|[deviation, _]| deviation),
            displacement_error: Some(with_interval(&errors)),
            paper_displacement_error: paper.map(|[_, error]| error),
            largest_displacement_error: Some(0.0),
            deviations: deviations.into(),
            displacement_errors: errors.into(),
            curve: Vec::new(),
            seconds: 0.0,
        }
    }

    fn baseline() -> MethodRow {
        row("baseline", [0.26, 0.20, 0.32, 0.28], [0.04, 0.02, 0.08, 0.06], Some([0.25, 0.04]))
    }

    #[test]
    fn effects_are_differences_of_deviations_and_ratios_of_errors() {
        let better = row(
            "adapted",
            [0.21, 0.16, 0.26, 0.23],
            [0.02, 0.0101, 0.041, 0.0299],
            Some([0.20, 0.03]),
        );
        let compared = compare(&better, &baseline(), ParameterDeviation).unwrap();
        assert!((compared.effect + 0.05).abs() < 1e-12, "{compared:?}");
        assert!((compared.paper_effect.unwrap() + 0.05).abs() < 1e-12);
        assert_eq!((compared.verdict, compared.pairs), (Some(Verdict::Agrees), 4));
        assert!(compared.p < 0.01 && compared.power.unwrap() > 0.99, "{compared:?}");

        let compared = compare(&better, &baseline(), DisplacementError).unwrap();
        assert!((compared.effect + 0.497).abs() < 0.01, "halved: {compared:?}");
        assert!((compared.paper_effect.unwrap() + 0.25).abs() < 1e-12);
        assert!(compared.interval[0] < compared.effect && compared.effect < compared.interval[1]);
    }

    #[test]
    fn the_verdict_follows_sign_and_significance() {
        let paper = Some([0.20, 0.03]);
        let worse = row("adapted", [0.31, 0.24, 0.38, 0.33], [0.1; 4], paper);
        let verdict = |method: &MethodRow| {
            compare(method, &baseline(), ParameterDeviation).unwrap().verdict.unwrap()
        };
        assert_eq!(verdict(&worse), Verdict::Contradicts);
        let scattered = row("adapted", [0.10, 0.35, 0.22, 0.31], [0.1; 4], paper);
        assert_eq!(verdict(&scattered), Verdict::Undecided);
        // The paper gives no figures of the rivals, only that they are worse.
        let rival = row("ga", [0.31, 0.24, 0.38, 0.33], [0.1; 4], None);
        assert_eq!(verdict(&rival), Verdict::Agrees);
        assert_eq!(compare(&rival, &baseline(), ParameterDeviation).unwrap().power, None);
        let unheard_of = row("own", [0.01, 0.02, 0.02, 0.01], [0.001; 4], None);
        assert_eq!(compare(&unheard_of, &baseline(), ParameterDeviation).unwrap().verdict, None);
    }

    #[test]
    fn only_robots_that_both_have_met_make_pairs() {
        let mut few = row("adapted", [0.21, 0.16, 0.26, 0.23], [0.02; 4], Some([0.2, 0.03]));
        few.deviations.truncate(3);
        let compared = compare(&few, &baseline(), ParameterDeviation).unwrap();
        assert_eq!(compared.pairs, 3);
        assert!((compared.effect + 0.05).abs() < 1e-12, "{compared:?}");
    }

    #[test]
    fn a_fit_that_gives_way_decides_nothing() {
        let gone = row(
            "adapted",
            [0.21, 0.16, 0.26, 0.23],
            [0.02, f64::NAN, 0.04, 0.03],
            Some([0.2, 0.03]),
        );
        let compared = compare(&gone, &baseline(), DisplacementError).unwrap();
        assert_eq!((compared.verdict, compared.pairs), (Some(Verdict::Undecided), 4));
    }

    #[test]
    fn every_comparison_is_of_methods_that_there_are() {
        for (method, against, _) in COMPARISONS {
            let known = |key| METHODS.iter().any(|method| method.key == key);
            assert!(known(method) && known(against), "{method} against {against}");
        }
    }
}
