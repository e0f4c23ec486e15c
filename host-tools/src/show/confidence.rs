//! The confidence of a report, in lines for people.

use flexid_pipeline::text::count;
use flexid_report::directions::distinct;
use flexid_report::imperfection::{
    Size, Standing, accuracy, judgement, standing, sum_if_minor, words,
};
use flexid_wire::confidence::{Confidence, Correlations, HeldOut, Nuisance};
use flexid_wire::directions::{WeakDirection, named};
use flexid_wire::explanation::{Deviation, Explanation};
use flexid_wire::finding::Finding;
use flexid_wire::left_over::LeftOver;
use flexid_wire::report::Acceptance;

/// Correlations above this size are shown, per cent.
const STRONG: u8 = 90;
/// Largest number of correlations, and of weak directions, that are shown. Chosen: the worst show of what kind they are; the result file has
/// all.
const MOST: usize = 2;
/// Column at which the lines begin, after their heading.
pub(super) const INDENT: usize = 13;

/// Said before the explanations of a fit that is not settled.
const MAYBE: &str =
    "the searches disagree: the lines below hold only if this minimum is the right one";

/// Stands above the explanations where no linear model explains what is left.
const NOT_LINEAR: &str =
    "no linear model explains what is left: the lines below may be effects of that";

/// One paragraph for each part of the confidence of a finding that is not empty.
pub(crate) fn lines(Finding { report, confidence, .. }: &Finding) -> String {
    let Confidence {
        nuisances,
        explanations,
        correlations,
        weak_directions,
        residuals,
        left_over,
        held_out,
        retired,
        ..
    } = confidence;
    let is_unsettled = report.fit.acceptance == Acceptance::Unsettled;
    let is_shown =
        |own: &&Explanation| size(&own.deviation).is_shown(own.share, own.is_contradicted());
    let shown = || explanations.iter().filter(is_shown);
    let is_not_linear = left_over.iter().any(|own| matches!(own, LeftOver::Distortion { .. }));
    let is_suspect = report.fit.acceptance == Acceptance::ModelSuspect;
    let contradicted = explanations.iter().filter(|own| is_suspect && own.is_contradicted());
    let caveat = match (shown().next().is_some(), is_not_linear) {
        (true, true) => Some(NOT_LINEAR.to_owned()),
        (true, false) if is_unsettled => Some(MAYBE.to_owned()),
        (true, false) => sum_if_minor(contradicted.map(|own| own.share)).map(another_cause),
        (false, _) => None,
    };
    let (sought, fitted): (Vec<_>, Vec<_>) = nuisances.iter().partition(|own| own.entry.is_none());
    let explained = shown().flat_map(|one| explanation(one, nuisances));
    let paragraphs = [
        ("residuals", vec![residuals.to_string()]),
        ("left over", left_over.iter().map(ToString::to_string).collect()),
        ("explained", caveat.into_iter().chain(explained).collect()),
        ("held out", prediction(held_out).into_iter().collect()),
        ("retired", retirement(*retired).into_iter().collect()),
        ("weak", worst(&distinct(weak_directions, names))),
        ("correlated", strongest(correlations)),
        ("calibration", sought.into_iter().map(calibration).collect()),
        ("imperfect", imperfections(fitted, nuisances.is_full())),
    ];
    let mut text = String::new();
    for (about, lines) in paragraphs {
        for (number, line) in lines.iter().enumerate() {
            let about = if number == 0 { about } else { "" };
            text += &format!("{about:INDENT$}{line}\n");
        }
    }
    text
}

/// How well each record is predicted from the others: the median over records and axes, and the worst.
fn prediction(held_out: &[HeldOut]) -> Option<String> {
    let summary = |of: fn(&HeldOut) -> [f64; 3]| {
        let mut values: Vec<f64> = held_out.iter().flat_map(of).collect();
        values.sort_by(f64::total_cmp);
        let (worst, middle) = (*values.first()?, values.len() / 2);
        let median = 0.5 * (values[(values.len() - 1) / 2] + values[middle]);
        Some(format!("{:.2} % (worst {:.2} %)", 100.0 * median, 100.0 * worst))
    };
    let (frac, vaf) = (summary(|record| record.frac)?, summary(|record| record.vaf)?);
    let records = count(held_out.len() as u64, "record");
    Some(format!(
        "each of {records} predicted from the others: FRAC (shape) {frac}, VAF (shape and size) {vaf}"
    ))
}

/// Number of older records that are no longer kept, if there are any.
fn retirement(records: u64) -> Option<String> {
    let records = (records > 0).then(|| count(records, "older record"))?;
    Some(format!("{records}, no longer kept: their information is in the numbers"))
}

/// The strongest correlations, if they are strong.
fn strongest(correlations: &Correlations) -> Vec<String> {
    let strong = |(_, _, percent): &(_, _, i8)| percent.unsigned_abs() > STRONG;
    let mut pairs: Vec<_> = correlations.pairs().filter(strong).collect();
    // The sort keeps the order of equal correlations.
    pairs.sort_by_key(|(_, _, percent)| std::cmp::Reverse(percent.unsigned_abs()));
    let names = &correlations.unknowns;
    let line = |&(row, column, percent): &(usize, usize, i8)| {
        format!("{:+.2}  {} and {}", f64::from(percent) / 100.0, names[column], names[row])
    };
    let mut lines: Vec<String> = pairs.iter().take(MOST).map(line).collect();
    if pairs.len() > MOST {
        let more = pairs.len() - MOST;
        lines.push(format!("and {more} more above 0.{STRONG} (JSON: confidence.correlations)"));
    }
    lines
}

/// The directions that the data determine least.
fn worst(directions: &[&WeakDirection]) -> Vec<String> {
    let mut lines: Vec<String> = directions.iter().take(MOST).map(ToString::to_string).collect();
    if directions.len() > MOST {
        let more = directions.len() - MOST;
        lines.push(format!("and {more} more (JSON: confidence.weak_directions)"));
    }
    lines
}

/// Stands above explanations of this share of the misfit.
fn another_cause(share: f64) -> String {
    format!(
        "in all {:.0} % of the misfit: most of it has another cause, of which the lines below may be effects",
        100.0 * share
    )
}

/// Lines on an explanation: what it is, what is off as well, what explains as much, and what to do.
fn explanation(
    explanation: &Explanation,
    nuisances: &[Nuisance],
) -> impl Iterator<Item = String> + use<> {
    let alike = explanation.alike(nuisances).map(|alike| format!("  {alike}"));
    let alternatives = explanation.alternatives().map(|rivals| format!("  {rivals}"));
    let remedy = explanation
        .remedy()
        .map_or_else(|| "  nothing to do".to_owned(), |remedy| format!("  {remedy}"));
    std::iter::once(explanation.to_string()).chain(alike).chain(alternatives).chain([remedy])
}

/// A line on what `[calibration]` seeks, and its verdict.
fn calibration(nuisance: &Nuisance) -> String {
    format!("{}, {}", words(nuisance), judgement(nuisance))
}

/// The imperfections whose accuracies the records contradict, each beside its accuracy, and the numbers of the others. There may be further
/// ones if the list `is_full`.
fn imperfections(fitted: Vec<&Nuisance>, is_full: bool) -> Vec<String> {
    let number = |of: Standing| fitted.iter().filter(|own| standing(own) == of).count();
    let line = |own: &Nuisance| {
        let beside = accuracy(own).map_or_else(String::new, |own| format!(" (accuracy: {own})"));
        format!("{}, {}{beside}", words(own), judgement(own))
    };
    let counted = [
        (number(Standing::Unknown), "not known: the fit allows no interval"),
        (number(Standing::Expected), "as expected by their accuracies"),
    ];
    let off = fitted.iter().filter(|own| standing(own) == Standing::Contradicted);
    let mut lines: Vec<String> = off.map(|own| line(own)).collect();
    lines.extend(
        counted
            .iter()
            .filter(|(number, _)| *number > 0)
            .map(|(number, words)| format!("{number} {words} (JSON: confidence.nuisances)")),
    );
    if is_full {
        lines.push("only these are listed; the fit allows for others, too".to_owned());
    }
    lines
}

/// The unknowns that the line of a direction names.
fn names(direction: &WeakDirection) -> impl Iterator<Item = &str> {
    named(direction.shares.iter().map(|own| (own.name.as_str(), own.weight)))
}

/// The size of a deviation.
fn size(own: &Deviation) -> Size {
    Size { value: own.value, std: own.std }
}

#[cfg(test)]
mod tests {
    use flexid_wire::accuracy::Accuracy;
    use flexid_wire::directions::Share;
    use flexid_wire::left_over::LeftOver;
    use flexid_wire::report::Verdict;
    use flexid_wire::residuals::{Meaning, Residuals};
    use flexid_wire::text::clipped;

    use super::*;
    use crate::show::page::tests::view;

    fn nuisance(name: &str, unit: &str, [value, lower, upper]: [f64; 3]) -> Nuisance {
        Nuisance {
            name: clipped(name),
            entry: None,
            accuracy: None,
            unit: clipped(unit),
            value,
            std: None,
            interval: (lower < upper).then_some([lower, upper]),
            verdict: if lower < upper { Verdict::Identified } else { Verdict::NotObservable },
        }
    }

    fn imperfection(own: Nuisance) -> Nuisance {
        Nuisance { entry: Some(Accuracy::TcpM), accuracy: Some(1e-3), ..own }
    }

    /// The last paragraph of the test below.
    const IMPERFECT: &str = "\
imperfect    TCP z 3.0 mm (2.0 to 4.0 mm), differs from zero (accuracy: tcp_m 1.00 mm)
             2 not known: the fit allows no interval (JSON: confidence.nuisances)
             2 as expected by their accuracies (JSON: confidence.nuisances)
";

    fn explanation([name, rival]: [&str; 2], evidence: f64) -> Explanation {
        let deviation = |name: &str| Deviation {
            entry: Accuracy::TcpM,
            name: clipped(name),
            unit: clipped("m"),
            value: 2e-3,
            std: Some(4e-4),
            accuracy: 1e-3,
        };
        Explanation {
            deviation: deviation(name),
            times: 2.2,
            share: 0.6,
            evidence,
            adopted: false,
            rivals: (!rival.is_empty()).then(|| deviation(rival)).into_iter().collect(),
        }
    }

    #[test]
    fn each_thing_has_its_paragraph() {
        let direction = |names: &[&str]| WeakDirection {
            relative_std: None,
            shares: names.iter().map(|name| Share { name: clipped(name), weight: 0.5 }).collect(),
            of_nuisance: false,
        };
        let held_out = |worst| HeldOut {
            pose: Default::default(),
            frac: [1.0, 0.99, worst],
            vaf: [0.98, 0.97, -worst],
        };
        let mut percent = [0; 21];
        // The pairs are (1, 0) and (2, 1) … (6, 5); the last one is just not strong.
        for (pair, value) in [(0, -91), (2, 95), (5, -97), (9, 95), (14, 92), (20, 99), (1, 90)] {
            percent[pair] = value;
        }
        let confidence = Confidence {
            joints: Default::default(),
            nuisances: [
                nuisance("delay", "s", [3e-4, 2.9e-4, 3.1e-4]),
                nuisance("force gain x", "", [1.1, 0.0, 0.0]),
                imperfection(nuisance("TCP z", "m", [3e-3, 2e-3, 4e-3])),
                imperfection(nuisance("TCP y", "m", [1e-3, -1e-3, 3e-3])),
                imperfection(nuisance("TCP x", "m", [1e-3, 0.0, 0.0])),
                imperfection(nuisance("TCP w", "m", [1e-3, -1e-3, 3e-3])),
                // Ten accuracies, of which a fit that allows no interval says nothing.
                imperfection(nuisance("TCP v", "m", [1e-2, 0.0, 0.0])),
            ]
            .into_iter()
            .collect(),
            explanations: [explanation(["TCP z", "TCP y"], 12.0), explanation(["TCP x", ""], 0.0)]
                .into_iter()
                .collect(),
            correlations: Correlations {
                unknowns: ["a", "b", "c", "d", "e", "f", "g"].into_iter().map(clipped).collect(),
                percent: percent.into_iter().collect(),
            },
            weak_directions: [&["a", "b"][..], &["c"], &["b", "a"], &["d"]]
                .map(direction)
                .into_iter()
                .collect(),
            left_over: [
                LeftOver::Frequency { from_hz: 8.0, to_hz: 90.4, times: 3.42 },
                LeftOver::Direction { axis: 2, times: 2.2 },
                LeftOver::Record {
                    record: 2,
                    pose: [0.3, -0.45].into_iter().collect(),
                    times: 2.0,
                },
                LeftOver::Time { from: 0.75, to: 0.875, times: 1.8 },
                LeftOver::Force { exponent: 2.9, std: 0.3 },
            ]
            .into_iter()
            .collect(),
            residuals: Residuals {
                consistency: 1.0,
                whiteness: 0.5,
                structure: 0.05,
                size_objects: false,
                whiteness_objects: false,
                structure_objects: false,
                meaning: Meaning::Noise,
            },
            held_out: [held_out(0.5), held_out(0.6)].into_iter().collect(),
            retired: 24,
            left_out: 0,
            robust_widening: None,
        };
        let expected = "\
residuals    noise explains them (χ²/dof 1.00)
left over    8.0 to 90 Hz: 3.4 times the rest: a filter or resonance of a sensor, a resonance that the model lacks, or noise that grows there
             direction z: 2.2 times the others: gain, axis or cable of that axis
             record 2 (pose 0.30 -0.45): 2.0 times the others: its joint angles, clock or trigger, or what differed in that cut
             75 to 88 % of the records: 1.8 times the rest: drift, warming or feed, or what the cut does then
             at the same pose as force^2.9 ± 0.3, not force^1: nonlinear: springs that stiffen or soften with load
explained    TCP z 2.0 ± 0.4 mm explains 60 % of the misfit: 2.2 times its accuracy (tcp_m, 1.00 mm)
               as likely: TCP y 2.0 ± 0.4 mm
               measure the TCP and correct it in the model, or state tcp_m as it is
             TCP x 2.0 ± 0.4 mm explains 60 % of the misfit: allowed by its accuracy (tcp_m, 1.00 mm)
               nothing to do
held out     each of 2 records predicted from the others: FRAC (shape) 99.00 % (worst 50.00 %), VAF (shape and size) 97.00 % (worst -60.00 %)
retired      24 older records, no longer kept: their information is in the numbers
weak         a and b trade off in these poses (not determined at all)
             c is not determined at all
             and 1 more (JSON: confidence.weak_directions)
correlated   +0.99  f and g
             -0.97  c and d
             and 4 more above 0.90 (JSON: confidence.correlations)
calibration  delay 300 µs (290 to 310 µs), identified
             force gain x 1.10, not observable
";
        let expected = format!("{expected}{IMPERFECT}");
        let finding = |confidence, acceptance| {
            let mut finding = view(3, &[]).finding.unwrap();
            finding.report.fit.acceptance = acceptance;
            Finding { confidence, ..finding }
        };
        let settled = finding(confidence.clone(), Acceptance::ModelSuspect);
        assert_eq!(lines(&settled), expected);
        let unsettled = lines(&finding(confidence.clone(), Acceptance::Unsettled));
        let explained = format!("explained    {MAYBE}\n             TCP z");
        assert_eq!(unsettled, expected.replace("explained    TCP z", &explained));
        let mut of_little = confidence.clone();
        of_little.explanations.iter_mut().for_each(|own| own.share = 0.28);
        let of_little = lines(&finding(of_little, Acceptance::ModelSuspect));
        let caveat = "explained    in all 28 % of the misfit: most of it has another cause";
        assert!(of_little.contains(caveat), "{of_little}");
        let nothing = Confidence {
            nuisances: Default::default(),
            explanations: Default::default(),
            left_over: Default::default(),
            correlations: Correlations {
                unknowns: Default::default(),
                percent: Default::default(),
            },
            weak_directions: Default::default(),
            held_out: Default::default(),
            retired: 0,
            ..confidence
        };
        assert_eq!(
            lines(&finding(nothing, Acceptance::Unsettled)),
            "residuals    noise explains them (χ²/dof 1.00)\n"
        );
    }
}
