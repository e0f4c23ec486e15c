//! What people should know before they trust the numbers, and what to do about it.

use std::fmt::Display;

use flexid_core::identify::{Acceptance, Estimate};
use flexid_core::parameters::{Bounds, Bushings, End};
use flexid_core::unknowns::{Coordinate, Sought};
use flexid_core::verdict::MAX_DIRECTIONS;

use super::directions::of_parameters;
use super::names::{DOF_NAMES, enumerate, name};
use super::obstacle::wrong_rate;
use super::report::Basis;
use super::residuals::Residuals;
use super::{Counts, MisfitKind};
use crate::config::Config;
use crate::summary::count;

/// Bytes for the names of parameters: the line has 160.
const ROOM: usize = 100;

/// The gravest first.
pub(super) fn warnings(
    config: &Config,
    sought: &Sought,
    estimate: &Estimate,
    basis: &Basis,
) -> Vec<String> {
    let mut warnings = Vec::new();
    let residuals = Residuals::of(estimate);
    if estimate.acceptance == Acceptance::Unsettled {
        let directions = of_parameters(sought, &estimate.weak_directions);
        let drowned = (!estimate.stands_clear).then_some(estimate.ssp_median);
        warnings.push(if basis.records == 0 {
            "static tests alone tell too little to be tested: add tests, or records".to_owned()
        } else {
            unsettled(residuals.size_objects, directions, drowned)
        });
    }
    warnings.extend(residuals.advice());
    let parameters = sought.unknowns() - estimate.nuisances.len();
    if residuals.size_objects && parameters < 2 * DOF_NAMES.len() * config.model.joints.len() {
        warnings.push("what [parameters] fixes or ties may not be so: see without it".to_owned());
    }
    if let Some(excess) = estimate.static_consistency.filter(|_| estimate.statics_object) {
        warnings.push(format!(
            "static tests are off by {:.1} of their standard deviations: check poses, loads and signs in [static] file",
            excess.sqrt()
        ));
    }
    if let Some(names) = on_bounds(config, sought, &estimate.bushings) {
        // A wrong model drives parameters anywhere.
        let mend = if residuals.are_sane() {
            "widen them"
        } else {
            "look at their units, and at the model"
        };
        warnings.push(format!("on an end of [bounds]: {names}: {mend}"));
    }
    if estimate.forgotten > 0 {
        let records = count(estimate.forgotten, "older record");
        warnings.push(format!(
            "{records} forgotten that contradict the newer ones: the robot or its tool has changed"
        ));
    }
    warnings.extend(of_the_records(config, basis));
    warnings
}

/// That no minimum could be made sure of, with what can be done about the likely cause; where the residuals are too large
/// the model is that, of which they speak for themselves. `drowned` is the median SSP of records that do not stand clear of
/// the noise.
fn unsettled(size_objects: bool, weak_directions: usize, drowned: Option<f64>) -> String {
    let found = "the search is not sure of the minimum: the numbers may be those of a wrong one";
    if size_objects {
        found.to_owned()
    } else if weak_directions > 0 {
        let least = if weak_directions < MAX_DIRECTIONS { "" } else { "at least " };
        let directions = count(weak_directions as u64, "combination");
        format!(
            "{found}; these poses hardly tell {least}{directions} of parameters: record more poses"
        )
    } else if let Some(ssp) = drowned {
        format!("{found}; records hardly stand clear of the noise (SSP {ssp:.2}): cut harder")
    } else {
        found.to_owned()
    }
}

/// Which parameters the data push further than they may go.
fn on_bounds(config: &Config, sought: &Sought, bushings: &Bushings) -> Option<String> {
    let Bounds { stiffness, damping } = &config.bounds;
    let mut there = Vec::new();
    let mut look = |coordinate, value: f64, range: &[f64; 2]| {
        let end = match End::reached(*range, value) {
            // Who is fixed may lie anywhere.
            _ if sought.unknown(coordinate).is_none() => return,
            Some(End::Lower) => "lower",
            Some(End::Upper) => "upper",
            None => return,
        };
        there.push(format!("{} ({end})", name(&config.model, coordinate)));
    };
    for (joint, bushing) in bushings.iter().enumerate() {
        for (dof, range) in stiffness.iter().enumerate() {
            look(Coordinate::Stiffness { joint, dof }, bushing.stiffness[dof], range);
        }
        for (dof, range) in damping.iter().enumerate() {
            look(Coordinate::Damping { joint, dof }, bushing.damping[dof], range);
        }
    }
    (!there.is_empty()).then(|| enumerate(&there, ROOM))
}

/// What is wrong with the records, or was on their way.
fn of_the_records(config: &Config, basis: &Basis) -> Vec<String> {
    let mut warnings = Vec::new();
    let mut warn = |warning: &dyn Display| warnings.push(warning.to_string());
    if !basis.trouble.is_empty() {
        warn(&basis.trouble);
    }
    for reason in [&basis.left_out, &basis.refusal].into_iter().flatten() {
        warn(reason);
    }
    let Counts { wrong_length, bus_errors, misfit, at_limit, .. } = &basis.counts;
    if let Some(wrong_rate) = wrong_rate(&basis.counts, config) {
        let records = basis.counts.stream.wrong_rate;
        warn(&format_args!("{}: {wrong_rate}", count(records, "record")));
    }
    let clipped = config.signals.axes.iter().zip(at_limit).filter(|(_, frames)| **frames > 0);
    let clipped: Vec<_> = clipped.map(|(name, frames)| format!("{name} in {frames}")).collect();
    if !clipped.is_empty() {
        warn(&format_args!(
            "at the limit: {} frames: widen the range of the sensor or the signal",
            clipped.join(", ")
        ));
    }
    if basis.dropped > 0 {
        let records = count(basis.dropped, "older record");
        let poses = match basis.dropped_poses {
            0 => String::new(),
            poses => format!(" (and {})", count(poses, "pose")),
        };
        warn(&format_args!(
            "{records}{poses} lost to make room: what they told is kept only where noise explains the residuals"
        ));
    }
    if basis.too_short > 0 {
        let records = count(basis.too_short, "short record");
        warn(&format_args!("{records} left out: at the same pose there are longer ones"));
    }
    match misfit {
        Some(misfit) if matches!(misfit.kind, MisfitKind::Length { .. }) => {
            let frames = count(*wrong_length, "frame");
            warn(&format_args!("{frames} of another length than [bus] dbc says: {misfit}"));
        }
        // Others ask for data, too.
        Some(misfit) if misfit.kind != MisfitKind::Remote => warn(misfit),
        _ => {}
    }
    if *bus_errors > 0 {
        warn(&format_args!("the bus reported {}", count(*bus_errors, "error")));
    }
    warnings
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use flexid_core::calibration::Nuisances;
    use flexid_core::parameters::Bushing;

    use super::*;

    #[test]
    fn more_poses_are_asked_for_only_where_poses_lack() {
        let poses = "hardly tell 1 combination of parameters: record more poses";
        assert!(unsettled(false, 1, Some(0.3)).ends_with(poses));
        let drowned = unsettled(false, 0, Some(0.2));
        assert!(drowned.ends_with("clear of the noise (SSP 0.20): cut harder"), "{drowned}");
        for line in [unsettled(false, 0, None), unsettled(true, 8, Some(0.3))] {
            assert!(line.ends_with("those of a wrong one"), "{line}");
        }
        let many = unsettled(false, MAX_DIRECTIONS, Some(0.3));
        assert!(many.contains("hardly tell at least 8 combinations"), "{many}");
        let longest = [many, drowned];
        assert!(longest.iter().all(|line| line.len() <= 160));
    }

    #[test]
    fn who_lies_on_a_bound_is_named_with_its_end() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-tools/scenario/edge.toml");
        let config = Config::load(&file).unwrap();
        let Bounds { stiffness, damping } = config.bounds;
        let middle = Bushing {
            stiffness: stiffness.map(|[lower, upper]| (lower * upper).sqrt()),
            damping: damping.map(|[lower, upper]| (lower * upper).sqrt()),
        };
        let mut bushings = Bushings::from_iter([middle; 3]);
        let mut sought = Sought::new(3, &Nuisances::default());
        assert_eq!(on_bounds(&config, &sought, &bushings), None);
        bushings[1].damping[5] = damping[5][0];
        bushings[0].stiffness[0] = stiffness[0][1] * (1.0 - 1e-14);
        bushings[2].stiffness[2] = stiffness[2][1];
        bushings[2].stiffness[3] = stiffness[3][1];
        sought.fix(Coordinate::Stiffness { joint: 2, dof: 3 }, stiffness[3][1]);
        assert_eq!(
            on_bounds(&config, &sought, &bushings).unwrap(),
            "joint_1 tx stiffness (upper), joint_2 rz damping (lower) and joint_3 tz stiffness (upper)",
        );
        for bushing in &mut bushings {
            bushing.damping = damping.map(|[_, upper]| upper);
        }
        let names = on_bounds(&config, &sought, &bushings).unwrap();
        assert!(names.ends_with("(upper) and 17 more") && names.len() <= 115, "{names}");
    }
}
