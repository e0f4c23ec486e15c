//! The points that the paper leaves open, and the choices made here.

use super::displacement::ROLL_OFF;
use super::effort::Effort;
use super::method::{FIRST, LAST, OUTSIDE, SAMPLES};
use super::robot::{Study, UNSEEN};
use super::tables::Choice;

/// One row for each choice.
pub fn choices(study: &Study, effort: &Effort) -> Vec<Choice> {
    let scenario = &study.scenario;
    let sampling = &scenario.measurement;
    let bounds = study.bounds();
    let range = |[lower, upper]: [f64; 2], unit: &str| format!("{lower:e} to {upper:e} {unit}");
    let rows: [(&str, String, &str); 14] = [
        (
            "Robot",
            format!(
                "{} joints; masses and geometry of the scenario's model",
                study.model.joints.len()
            ),
            "the paper shows a picture of its robot and no data",
        ),
        (
            "Bounds",
            format!(
                "stiffness {}, {}; damping {}, {}",
                range(bounds.joints[0].stiffness[0], "N/m"),
                range(bounds.joints[0].stiffness[3], "Nm/rad"),
                range(bounds.joints[0].damping[0], "Ns/m"),
                range(bounds.joints[0].damping[3], "Nms/rad"),
            ),
            "broad, the same for every joint: no expert knowledge",
        ),
        (
            "Truth",
            format!("{} robots, each parameter uniform within its bounds", effort.robots()),
            "the paper runs ten simulations, and does not say what changes between them; how many robots a comparison \
             needs follows from the scatter between robots, not from its outcome",
        ),
        (
            "Initial centre",
            "the middle of the bounds".into(),
            "nothing else is known; with uniform truths it already has a mean deviation of 25 %",
        ),
        (
            "Scale of the samples",
            "linear between the bounds".into(),
            "parameter deviation is measured so",
        ),
        (
            "Samples an iteration",
            format!("{SAMPLES}, the first of them the centre itself, in every variant"),
            "with the centre among them nothing is given up for a worse sample; the combination that sensitivities make \
             of several samples may be worse all the same",
        ),
        (
            "Look Outside",
            format!(
                "{OUTSIDE} of the {SAMPLES} samples: each moves one parameter, chosen at random, anywhere within its bounds"
            ),
            "half exploits, half explores",
        ),
        (
            "Scheduled shrinking",
            format!(
                "radius {FIRST} to {LAST} of the bound ranges, a constant factor an iteration; samples uniform in the ball"
            ),
            "a ball of radius 1 moves a single parameter by 1/√(P + 2) of its range: a sixth of it where P is 36",
        ),
        (
            "Adaptive bounds, global and local",
            "the radius shrinks when an iteration has not bettered the centre; locally also where a parameter's step \
             was less than its typical one; both end at the schedule's last radius if half of the iterations fail"
                .into(),
            "the paper says only that they follow the loss; not tuned",
        ),
        (
            "Sensitivities in the search",
            "each parameter from the sample with the smallest loss of its own; samples that look outside \
             count for their parameter alone"
                .into(),
            "section 4.2 gives the losses, not the recombination",
        ),
        (
            "Global sensitivity analysis",
            format!(
                "Sobol total order over the bounds, Saltelli's samples, Jansen's estimator, {} base samples; its \
                 evaluations come on top of the search's",
                effort.sobol_samples
            ),
            "the paper names no estimator and no sample size",
        ),
        (
            "Reference and experiments",
            format!(
                "the nonlinear equation of motion, integrated in time; {} experiments of {:.3} s, milling forces with \
                 roughness, from rest, without gravity",
                scenario.experiments.len(),
                sampling.duration_s
            ),
            "the paper shows none",
        ),
        (
            "Losses",
            format!(
                "on the displacement up to {:.0} Hz, from the first sample to the last, without noise; SSP over its bins \
                 up to {:.0} Hz, where it begins to roll off; mean over directions and experiments",
                sampling.band_hz[1],
                sampling.band_hz[1] * (1.0 - ROLL_OFF)
            ),
            "rate, length and band are not given",
        ),
        (
            "Validation",
            format!(
                "{UNSEEN} experiments a robot, poses drawn within the joints' limits, the equation of motion integrated with \
                 the fitted parameters; RMS(x − x̂)/RMS(x) from {:.0} to {:.0} Hz for every direction, median over all; \
                 geometric mean over the robots",
                sampling.band_hz[0], sampling.band_hz[1]
            ),
            "“relative error” is not defined",
        ),
    ];
    rows.map(|(open, chosen, why)| Choice { open: open.into(), chosen, why: why.into() }).into()
}
