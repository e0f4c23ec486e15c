//! Predictions for drawn robots in poses that no identification has seen: the 95 % bands of receptance, deflection and natural
//! frequencies hold those of the true robot.
//!
//! The plants are those of `plants`, and perfect ones. The truth is evaluated as the predictions are, which a test of that crate proves
//! against a dense model.

use anyhow::{Context, Result, ensure};
use flexid_core::identify::Acceptance;
use flexid_core::imperfection::Accuracies;
use flexid_pipeline::robot::{FoundRobot, FoundValue};
use flexid_prediction::Robot;
use flexid_prediction::receptance::grid;
use flexid_simulation::experiment::Cut;
use flexid_simulation::plant::Plant;
use rayon::prelude::*;

use crate::figure::Figure;
use crate::find::{OnPlant, settled, settled_on_plant};
use crate::intervals::Intervals;
use crate::study::{Purpose, Study, random};
use crate::{plants, spread};

/// Poses of each robot.
const POSES: u64 = 2;
/// Frequencies of the receptance in each of them.
const FREQUENCIES: usize = 12;
/// Natural frequencies.
const MODES: usize = 3;
/// Forces on the tool along its axes, N; no moments.
const FORCE: [f64; 6] = [120.0, -80.0, 200.0, 0.0, 0.0, 0.0];
/// Least share of the fits that are settled, percent: that of `plants`.
const SETTLED: f64 = 95.0;
/// Largest distance from 95 % of the share of bands that hold, percent.
const OFF: f64 = 2.0;

/// Errors of what is predicted of a robot, in standard deviations.
#[derive(Default)]
struct Scores {
    receptance: Vec<f64>,
    deflection: Vec<f64>,
    frequencies: Vec<f64>,
}

/// A robot as it was found, and as it is.
struct Predicted {
    acceptance: Acceptance,
    found: Robot,
    truth: Robot,
}

/// Predictions of as many robots of three joints, on perfect and on drawn plants.
pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let mut figures = figures(study, &Accuracies::default(), robots, details)?;
    figures.extend(self::figures(study, &Accuracies::typical(), robots, details)?);
    Ok(figures)
}

/// The proof for robots of six joints, on drawn plants.
pub(crate) fn prove_of_six_joints(_: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    figures(&Study::of_six_joints()?, &Accuracies::typical(), robots, details)
}

fn figures(
    study: &Study,
    accuracies: &Accuracies,
    robots: usize,
    details: bool,
) -> Result<Vec<Figure>> {
    let cuts = study.cuts();
    let one = |robot: u64| {
        let cuts = &cuts[robot as usize % cuts.len()];
        let Some(predicted) = predicted(study, cuts, accuracies, robot)? else { return Ok(None) };
        scores(study, &predicted, robot, details).map(|scores| Some((predicted.acceptance, scores)))
    };
    let all = (0..robots as u64).into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
    let all: Vec<_> = all.into_iter().flatten().collect();
    let settled = all.iter().filter(|(acceptance, _)| *acceptance != Acceptance::Unsettled);
    let mut kinds = [(); 3].map(|()| Intervals::default());
    let mut count = 0;
    for (_, Scores { receptance, deflection, frequencies }) in settled {
        count += 1;
        for (intervals, scores) in kinds.iter_mut().zip([receptance, deflection, frequencies]) {
            intervals.push(scores.iter().copied());
        }
    }
    let plants = if accuracies.are_perfect() { "perfect plants" } else { "drawn plants" };
    let least = spread::percentages(all.len(), SETTLED / 100.0, [SETTLED, 100.0])[0];
    let mut figures = vec![Figure::count(
        format!("{plants}: fits that are settled"),
        all.len(),
        100.0 * f64::from(count) >= least * all.len() as f64,
        count as usize,
        &format!("at least {least:.0} %"),
    )];
    let names = ["receptance", "deflection", "first three natural frequencies"];
    for (kind, intervals) in names.into_iter().zip(&kinds) {
        let what = format!("{plants}: {kind}, 95 % bands");
        // On a drawn plant the error of a gain moves all bands of a robot.
        figures.push(intervals.cover(&what, OFF, !accuracies.are_perfect()));
    }
    Ok(figures)
}

/// Robot `number`, identified from `cuts`. `None` of a robot that gives way.
fn predicted(
    study: &Study,
    cuts: &[Cut],
    accuracies: &Accuracies,
    number: u64,
) -> Result<Option<Predicted>> {
    let search = random(Purpose::Search, number).0;
    let poses: [&[f64]; 0] = [];
    let (plant, bushings, found, estimate) = if accuracies.are_perfect() {
        let (plant, bushings) = (Plant::default(), study.robot(number));
        let records = plants::records(study, cuts, &plant, &bushings, number)?;
        let identifier = settled(&study.task(), &records, search)?;
        let estimate = identifier.estimate().context("a settled identifier without an estimate")?;
        let sought = identifier.sought();
        let found = FoundRobot::new(&study.config, sought, estimate, None, &poses);
        (plant, bushings, found, estimate.clone())
    } else {
        let Some((plant, bushings)) = plants::drawn_robot(study, accuracies, number) else {
            return Ok(None);
        };
        let records = plants::records(study, cuts, &plant, &bushings, number)?;
        let OnPlant { identifier, plant: fitted, found: of_plant, .. } =
            settled_on_plant(&study.task(), accuracies, &records, search)?;
        let (sought, on_plant) = (identifier.sought(), Some((&*fitted, &of_plant)));
        let found = FoundRobot::new(&study.config, sought, &of_plant.estimate, on_plant, &poses);
        (plant, bushings, found, of_plant.estimate)
    };
    let imperfections = plant.imperfections(&study.chain).into_iter();
    let imperfections =
        imperfections.map(|(imperfection, value)| FoundValue { imperfection, value }).collect();
    let mut truth = FoundRobot { imperfections, ..found.clone() };
    let size = 12 * study.chain.joints().len() + truth.imperfections.len();
    truth.covariance = vec![0.0; size * (size + 1) / 2];
    Ok(Some(Predicted {
        acceptance: estimate.acceptance,
        found: Robot::new(found, estimate.bushings)?,
        truth: Robot::new(truth, bushings)?,
    }))
}

/// The errors in poses that no identification has seen.
fn scores(study: &Study, predicted: &Predicted, number: u64, details: bool) -> Result<Scores> {
    let Predicted { acceptance, found, truth } = predicted;
    let mut scores = Scores::default();
    for pose in study.unseen_poses(POSES * number..POSES * (number + 1)) {
        let (at, true_at) = (found.at(&pose)?, truth.at(&pose)?);
        let frequencies = grid(found.band_hz(), FREQUENCIES);
        for hz in frequencies {
            let point = at.receptance(hz).context("no response")?;
            let expected = true_at.receptance_value(hz).context("no response")?;
            for row in 0..3 {
                for column in 0..=row {
                    let own = point.magnitude[row][column];
                    let error = (expected[row][column].norm() / own.value).ln();
                    scores.receptance.push(error / own.relative_std);
                    if details && error.abs() > 3.0 * own.relative_std {
                        let [error, std] = [error, own.relative_std].map(|part| 100.0 * part);
                        eprintln!(
                            "robot {number}, {row}{column} at {hz:.0} Hz: {error:.2} % off, ± {std:.2} %"
                        );
                    }
                }
            }
        }
        let deflected = |at: &flexid_prediction::Dynamics<'_>| {
            at.compliance().map(|compliance| at.deflection(&compliance, FORCE).translation)
        };
        let own = deflected(&at).context("no stiffness")?;
        let expected = deflected(&true_at).context("no stiffness")?;
        scores.deflection.extend(
            own.iter().zip(expected).map(|(own, truth)| (truth.value - own.value) / own.std),
        );
        let highest = 2.0 * found.band_hz()[1];
        let (own, expected) = (at.modes(highest), true_at.modes(highest));
        ensure!(own.len().min(expected.len()) >= MODES, "fewer than {MODES} modes");
        if details {
            for (own, truth) in own.iter().zip(&expected).take(MODES + 1) {
                let found = own.frequency_hz;
                let score = (truth.frequency_hz.value / found.value).ln() / found.relative_std;
                eprintln!(
                    "robot {number}: {:.4} Hz ± {:.4} %, damping ratio {:.4}, is {:.4} Hz, {:.4}: {score:.1} σ",
                    found.value,
                    100.0 * found.relative_std,
                    own.damping_ratio.value,
                    truth.frequency_hz.value,
                    truth.damping_ratio.value,
                );
            }
        }
        scores.frequencies.extend(own.iter().zip(&expected).take(MODES).map(|(own, truth)| {
            let own = own.frequency_hz;
            (truth.frequency_hz.value / own.value).ln() / own.relative_std
        }));
    }
    if details {
        let share = |scores: &[f64]| {
            let within = scores.iter().filter(|score| score.abs() < 1.96).count();
            format!("{within} of {}", scores.len())
        };
        eprintln!(
            "robot {number}: {acceptance:?}, bands that hold: receptance {}, deflection {}, frequencies {}",
            share(&scores.receptance),
            share(&scores.deflection),
            share(&scores.frequencies)
        );
    }
    Ok(scores)
}
