//! Warnings about an estimate, with corrections.

use std::fmt::Display;

use flexid_core::identify::{Acceptance, Estimate};
use flexid_core::parameters::{Bounds, Bushings, End};
use flexid_core::sought::{Coordinate, Sought};
use flexid_core::verdict::MAX_DIRECTIONS;

use super::basis::Basis;
use super::directions::of_parameters;
use super::residuals::Residuals;
use crate::config::Config;
use crate::intake::{Counts, MisfitKind, plausibility, rate_used, wrong_rate};
use crate::names::{DOF_NAMES, clipped_name, enumerate, name};
use crate::text::count;

/// Room for the names of parameters, bytes. The line has 400.
const ROOM: usize = 200;

/// Returns the warnings, the gravest first.
pub(super) fn warnings(
    config: &Config,
    sought: &Sought,
    estimate: &Estimate,
    basis: &Basis,
) -> Vec<String> {
    let Counts { implausible, at_limit, .. } = &basis.counts;
    // Implausible readings come first: the fit is no better than its readings.
    let mut warnings: Vec<String> = basis.scale.iter().cloned().collect();
    warnings.extend(plausibility::warnings(implausible, at_limit, config));
    let residuals = Residuals::of(estimate);
    // Noise that is too loud, and a doubtful rate, have warnings of their own.
    let explained = residuals.noise_too_loud || basis.doubtful_rate;
    if estimate.acceptance == Acceptance::Unsettled && !explained {
        let directions = of_parameters(sought, &estimate.weak_directions);
        let drowned = (!estimate.stands_clear).then_some(estimate.ssp_median);
        warnings.push(if basis.records > 0 {
            unsettled(residuals.size_objects, directions, drowned)
        } else if estimate.degrees_of_freedom < 1.0 {
            "static tests alone tell too little to be tested: add tests, or records".to_owned()
        } else {
            "the fit to the static tests comes to no end: check their poses, loads and signs, and [bounds]"
                .to_owned()
        });
    }
    let settled = estimate.acceptance != Acceptance::Unsettled;
    let [stated, by_mass] = on_bounds(config, sought, &estimate.bushings);
    if let Some(names) = stated {
        // This warning comes before doubts about the model: bounds that leave out the robot make any model look wrong.
        let mend = match (settled, residuals.are_sane()) {
            (true, true) if basis.records > 0 => "widen them",
            (true, true) => "add tests, or widen them",
            _ => "before anything else, run again without [bounds]",
        };
        warnings.push(format!("on an end of [bounds]: {names}: {mend}"));
    }
    warnings.extend(residuals.advice());
    let parameters = sought.unknowns() - estimate.nuisances.len();
    if settled
        && residuals.size_objects
        && parameters < 2 * DOF_NAMES.len() * config.model.joints.len()
    {
        warnings.push("what [parameters] fixes or ties may not be so: see without it".to_owned());
    }
    if let Some(excess) = estimate.static_consistency.filter(|_| estimate.statics_object) {
        warnings.push(format!(
            "static tests are off by {:.1} of their standard deviations: check poses, loads and signs in [static] file",
            excess.sqrt()
        ));
    }
    if settled && let Some(names) = by_mass {
        warnings
            .push(format!("not observable beyond the bounds that follow from the masses: {names}"));
    }
    // This is the only reason for doubt that no residual shows.
    if estimate.acceptance == Acceptance::ModelSuspect
        && !residuals.size_objects
        && !estimate.is_structured_beyond_noise()
        && !estimate.statics_object
    {
        warnings.push(
            "older records and the newer ones do not fit one robot: it or its tool has changed, or the model is wrong"
                .to_owned(),
        );
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

/// Returns the warning that the search is not sure of the minimum, with advice for the likely cause. If the residuals are too
/// large, the model is the likely cause, and the residuals have advice of their own. `drowned` is the median SSP of records
/// that do not stand clear of the noise.
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

/// Returns the parameters that the data push to an end of their range: of a range in `[bounds]`, then of a range that follows
/// from the masses.
fn on_bounds(config: &Config, sought: &Sought, bushings: &Bushings) -> [Option<String>; 2] {
    let by_mass = config.model.chain().ok().map(|chain| Bounds::of(&chain));
    let (mut stated, mut silent) = (Vec::new(), Vec::new());
    let mut look = |coordinate, value: f64, range: [f64; 2], by_mass: Option<[f64; 2]>| {
        let end = match End::reached(range, value) {
            // A fixed parameter may lie anywhere.
            _ if sought.unknown(coordinate).is_none() => return,
            Some(End::Lower) => "lower",
            Some(End::Upper) => "upper",
            None => return,
        };
        let which = if by_mass == Some(range) { &mut silent } else { &mut stated };
        which.push(format!("{} ({end})", name(&config.model, coordinate)));
    };
    for (joint, (bushing, own)) in bushings.iter().zip(&config.bounds.joints).enumerate() {
        let by_mass = by_mass.map(|bounds| bounds.joints[joint]);
        for dof in 0..DOF_NAMES.len() {
            let coordinate = Coordinate::Stiffness { joint, dof };
            let default = by_mass.map(|ranges| ranges.stiffness[dof]);
            look(coordinate, bushing.stiffness[dof], own.stiffness[dof], default);
        }
        for dof in 0..DOF_NAMES.len() {
            let coordinate = Coordinate::Damping { joint, dof };
            let default = by_mass.map(|ranges| ranges.damping[dof]);
            look(coordinate, bushing.damping[dof], own.damping[dof], default);
        }
    }
    [stated, silent].map(|names| (!names.is_empty()).then(|| enumerate(&names, ROOM)))
}

/// Returns the warnings about the records and their way from the bus.
fn of_the_records(config: &Config, basis: &Basis) -> Vec<String> {
    let mut warnings = Vec::new();
    let mut warn = |warning: &dyn Display| warnings.push(warning.to_string());
    if !basis.trouble.is_empty() {
        warn(&basis.trouble);
    }
    for reason in [&basis.left_out, &basis.refusal, &basis.repeats].into_iter().flatten() {
        warn(reason);
    }
    let Counts { wrong_length, bus_errors, misfit, at_limit, .. } = &basis.counts;
    if let Some(wrong_rate) = wrong_rate(&basis.counts, config) {
        let stream = &basis.counts.stream;
        let records = count(stream.wrong_rate.max(stream.doubtful_rate), "record");
        warn(&format_args!("{records}: {wrong_rate}, {}", rate_used(stream)));
    }
    let clipped = config.signals.axes.iter().zip(at_limit).filter(|(_, frames)| **frames > 0);
    let clipped: Vec<_> =
        clipped.map(|(name, frames)| format!("{} in {frames}", clipped_name(name))).collect();
    if !clipped.is_empty() {
        warn(&format_args!(
            "at the limit: {} frames: widen the range of the sensor or the signal",
            enumerate(&clipped, ROOM)
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
        // Other nodes may send remote requests, too.
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
    use flexid_core::identify::Effort;
    use flexid_core::parameters::{Bushing, Ranges};
    use flexid_wire::text::Text;

    use super::*;
    use crate::intake::{Excess, Implausible, Misfit};

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

    /// Each name and each number is as long as it can be.
    #[test]
    fn the_longest_lines_fit() {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tools/scenario/mill3-edge.toml");
        let mut config = Config::load(&file).unwrap();
        config.file = "e".repeat(255).into();
        let long = |kind: &str| kind.repeat(64);
        config.model.joints.iter_mut().for_each(|joint| joint.name = long("joint"));
        config.signals.axes = std::array::from_fn(|_| long("axis"));
        config.signals.joints = vec![long("q"); 3];
        let excess = Some(Excess { value: -1.234_567e12, by: 1e12 });
        let mut counts = Counts {
            wrong_length: u64::MAX,
            misfit: Some(Misfit {
                id: embedded_can::ExtendedId::MAX.into(),
                kind: MisfitKind::Length { got: 64, expected: 64 },
                frames: u64::MAX,
                others_fit: true,
            }),
            at_limit: [u64::MAX; 6],
            bus_errors: u64::MAX,
            ..Counts::default()
        };
        counts.stream.wrong_rate = u64::MAX;
        counts.stream.doubtful_rate = u64::MAX;
        counts.stream.measured_rate_hz = 123_456.78;
        let number = u64::MAX;
        counts.implausible = Implausible {
            spikes: [u64::MAX; 6],
            stuck: [u64::MAX; 6],
            joints: [excess; flexid_core::MAX_JOINTS],
            rest: Some([9806.65, 0.0, 0.0]),
            ..Implausible::default()
        };
        let refusal = "NNNNNNNNNNNNNNNNNNNN records refused, the first because the record's force in the band is hardly above its noise: cut harder";
        let basis = Basis {
            effort: Effort::default(),
            records: 0,
            counts,
            seconds: 0.0,
            refusal: Some(refusal.into()),
            left_out: None,
            dropped: u64::MAX,
            dropped_poses: u64::MAX,
            too_short: u64::MAX,
            repeats: Some(format!(
                "{number} records came again and are left out: record {number} is record {number}, and so on"
            )),
            doubtful_rate: true,
            scale: None,
            trouble: "",
        };
        let implausible =
            |implausible, at_limit| plausibility::warnings(&implausible, &at_limit, &config);
        let flat = Implausible { flat: [u64::MAX; 6], ..counts.implausible };
        let mut lines = implausible(counts.implausible, counts.at_limit);
        lines.extend(implausible(flat, [0; 6]));
        lines.extend(implausible(counts.implausible, [0; 6]));
        // A state of the daemon also contains what the daemon waits for.
        let waiting = plausibility::faint_force(&Implausible { largest_force: 0.5, ..flat });
        let waiting = format!(
            "no record: waiting for the first record: 4.1 s of milling at one pose{waiting}; "
        );
        lines.iter_mut().for_each(|line| line.insert_str(0, &waiting));
        lines.extend(of_the_records(&config, &basis));
        lines.extend([1e-30, 0.1, 1e30].into_iter().filter_map(plausibility::Scale::line));
        let there = [
            "reads ",
            "m/s^2 at rest",
            "stuck",
            "flat",
            "spikes",
            "the acceleration is",
            "at the limit",
            "frames come at",
        ];
        for start in there {
            assert!(lines.iter().any(|line| line.contains(start)), "{start} is not in {lines:?}");
        }
        for line in lines {
            assert!(line.len() <= Text::new().capacity(), "{}: {line}", line.len());
        }
    }

    #[test]
    fn who_lies_on_a_bound_is_named_with_its_end() {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tools/scenario/mill3-edge.toml");
        let config = Config::load(&file).unwrap();
        let Ranges { stiffness, damping } = config.bounds.joints[0];
        let middle = Bushing {
            stiffness: stiffness.map(|[lower, upper]| (lower * upper).sqrt()),
            damping: damping.map(|[lower, upper]| (lower * upper).sqrt()),
        };
        let mut bushings = Bushings::from_iter([middle; 3]);
        let mut sought = Sought::new(3, &Nuisances::default()).unwrap();
        assert_eq!(on_bounds(&config, &sought, &bushings), [None, None]);
        bushings[1].damping[5] = damping[5][0];
        bushings[0].stiffness[0] = stiffness[0][1] * (1.0 - 1e-14);
        bushings[2].stiffness[2] = stiffness[2][1];
        bushings[2].stiffness[3] = stiffness[3][1];
        sought.fix(Coordinate::Stiffness { joint: 2, dof: 3 }, stiffness[3][1]).unwrap();
        assert_eq!(
            on_bounds(&config, &sought, &bushings)[0].as_deref().unwrap(),
            "joint_1 tx stiffness (upper), joint_2 rz damping (lower) and joint_3 tz stiffness (upper)",
        );
        for bushing in &mut bushings {
            bushing.damping = damping.map(|[_, upper]| upper);
        }
        let [names, by_mass] = on_bounds(&config, &sought, &bushings);
        let names = names.unwrap();
        assert_eq!(by_mass, None);
        assert!(names.ends_with("(upper) and 13 more") && names.len() <= 215, "{names}");
    }
}
