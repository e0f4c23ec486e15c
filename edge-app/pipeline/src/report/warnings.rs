//! Warnings about an estimate, with corrections.

use flexid_core::identify::{Acceptance, Estimate};
use flexid_core::parameters::{self, Bounds, Bushings};
use flexid_core::sought::{Coordinate, Sought};
use flexid_core::verdict::MAX_DIRECTIONS;
use flexid_wire::misfits::MisfitKind;
use flexid_wire::warning::{BoundsAdvice, End, OnBound, OnBounds, UnsureCause, Warning};

use super::basis::Basis;
use super::directions::of_parameters;
use super::residuals::Residuals;
use super::statics;
use crate::config::Config;
use crate::intake::{Counts, plausibility, rate_used, wrong_rate};
use crate::names::{DOF_NAMES, name};

/// Most troubles that have a warning of their own. There may be some for each of many recordings.
const MAX_TROUBLES: usize = 4;
/// Frames of which one may be left out, since another of its sample is missing, without a warning: a stream bridges one sample in so many.
const LEFT_OUT: u64 = 200;

/// Returns the warnings, the gravest first.
pub(super) fn warnings(
    config: &Config,
    sought: &Sought,
    estimate: &Estimate,
    basis: &Basis,
) -> Vec<Warning> {
    let Counts { implausible, at_limit, .. } = &basis.counts;
    // Implausible readings come first: the fit is no better than its readings.
    let mut warnings: Vec<Warning> = basis.scale.iter().chain(&basis.axes).cloned().collect();
    let implausible = plausibility::warnings(implausible, at_limit, config);
    warnings.extend(implausible.into_iter().map(Warning::Implausible));
    let residuals = Residuals::of(estimate, basis.distortion);
    // What is named below may be an effect of what is excluded.
    if residuals.structure_objects && config.assumes_perfect {
        warnings.push(Warning::AssumedPerfect);
    }
    // Noise that is too loud, and a doubtful rate, have warnings of their own.
    let explained = residuals.noise_too_loud || basis.doubtful_rate;
    if estimate.acceptance == Acceptance::Unsettled && !explained {
        let directions = of_parameters(sought, &estimate.weak_directions);
        let drowned = (!estimate.stands_clear).then_some(estimate.ssp_median);
        warnings.push(if basis.records > 0 {
            Warning::UnsureMinimum(unsure(residuals.size_objects, directions, drowned))
        } else if estimate.degrees_of_freedom < 1.0 {
            Warning::FewStaticTests
        } else {
            Warning::UnsettledStaticTests
        });
    }
    let settled = estimate.acceptance != Acceptance::Unsettled;
    let [stated, by_mass] = on_bounds(config, sought, &estimate.bushings);
    if let Some(parameters) = stated {
        // This warning comes before doubts about the model: bounds that leave out the robot make any model look wrong.
        let advice = match (settled, residuals.are_sane()) {
            (true, true) if basis.records > 0 => BoundsAdvice::Widen,
            (true, true) => BoundsAdvice::AddTests,
            _ => BoundsAdvice::Remove,
        };
        warnings.push(Warning::OnStatedBounds { parameters, advice });
    }
    warnings.extend(residuals.objection().map(Warning::Objection));
    // What is not linear is explained by imperfections that are not there.
    warnings.extend(basis.contradicted.clone().filter(|_| basis.distortion.is_none()));
    if settled && (residuals.size_objects || basis.contradicted.is_some()) && sought.imposes() {
        warnings.push(Warning::ImposedParameters);
    }
    if let Some(excess) = estimate.static_consistency.filter(|_| estimate.statics_object) {
        warnings.push(Warning::StaticTestsOff { deviations: excess.sqrt() });
    }
    warnings.extend(statics::outlier(&config.statics, estimate));
    warnings.extend(by_mass.filter(|_| settled).map(Warning::OnMassBounds));
    // This is the only reason for doubt that no residual shows.
    if estimate.acceptance == Acceptance::ModelSuspect
        && !residuals.size_objects
        && !estimate.is_structured_beyond_noise()
        && !estimate.statics_object
        && !estimate.is_of_implausible_plant
    {
        warnings.push(Warning::RecordsContradict);
    }
    if estimate.forgotten > 0 {
        warnings.push(Warning::RobotChanged { forgotten: estimate.forgotten });
    }
    warnings.extend(of_the_records(config, basis));
    warnings
}

/// Returns the likely cause of a search that is not sure of the minimum. If the residuals are too large, the model is the likely
/// cause, and the residuals have a warning of their own. `drowned` is the median SSP of records that do not stand clear of the
/// noise.
fn unsure(size_objects: bool, weak_directions: usize, drowned: Option<f64>) -> UnsureCause {
    match drowned {
        _ if size_objects => UnsureCause::Other,
        _ if weak_directions > 0 => UnsureCause::FewPoses {
            directions: weak_directions as u8,
            or_more: weak_directions >= MAX_DIRECTIONS,
        },
        Some(ssp) => UnsureCause::Noise { ssp },
        None => UnsureCause::Other,
    }
}

/// Returns the parameters that the data push to an end of their range: of a range in `[bounds]`, then of a range that follows
/// from the masses.
fn on_bounds(config: &Config, sought: &Sought, bushings: &Bushings) -> [Option<OnBounds>; 2] {
    let by_mass = config.model.chain().ok().map(|chain| Bounds::of(&chain));
    let (mut stated, mut silent) = (Vec::new(), Vec::new());
    let mut look = |coordinate, value: f64, range: [f64; 2], by_mass: Option<[f64; 2]>| {
        let end = match parameters::End::reached(range, value) {
            // A fixed parameter may lie anywhere.
            _ if sought.unknown(coordinate).is_none() => return,
            Some(parameters::End::Lower) => End::Lower,
            Some(parameters::End::Upper) => End::Upper,
            None => return,
        };
        let which = if by_mass == Some(range) { &mut silent } else { &mut stated };
        which.push(OnBound { parameter: name(&config.model, coordinate), end });
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
    [stated, silent].map(|all| (!all.is_empty()).then(|| OnBounds::from_iter(all)))
}

/// Returns the warnings about the records and their way from the bus.
fn of_the_records(config: &Config, basis: &Basis) -> Vec<Warning> {
    let Counts { stream, wrong_length, bus_errors, misfit, at_limit, left_out, .. } = &basis.counts;
    let (own, further) = basis.troubles.split_at(basis.troubles.len().min(MAX_TROUBLES));
    let mut warnings: Vec<Warning> = own.iter().cloned().map(Warning::Trouble).collect();
    if !further.is_empty() {
        warnings.push(Warning::MoreTroubles { troubles: further.len() as u64 });
    }
    warnings.extend(basis.unfinished.iter().chain(&basis.refused).cloned().map(Warning::Unused));
    warnings.extend(basis.repeated.clone());
    warnings.extend(wrong_rate(&basis.counts, config).map(|rate| Warning::WrongRate {
        records: stream.wrong_rate.max(stream.doubtful_rate),
        rate,
        used: rate_used(stream),
    }));
    warnings.extend(plausibility::signals(at_limit, config).map(Warning::AtLimit));
    warnings.extend(basis.lines.clone());
    warnings.extend(basis.louder_cut.clone());
    if basis.dropped > 0 {
        warnings.push(Warning::MadeRoom { records: basis.dropped, poses: basis.dropped_poses });
    }
    if basis.too_short > 0 {
        warnings.push(Warning::TooShort { records: basis.too_short });
    }
    match *misfit {
        Some(worst) if matches!(worst.kind, MisfitKind::Length { .. }) => {
            warnings.push(Warning::WrongLength { frames: *wrong_length, worst });
        }
        // A few frames are lost on any bus.
        Some(misfit) if misfit.kind == MisfitKind::Incomplete => {
            let is_many = left_out * LEFT_OUT > stream.frames;
            warnings.extend(is_many.then_some(Warning::Misfit(misfit)));
        }
        // Other nodes may send remote requests, too.
        Some(misfit) if misfit.kind != MisfitKind::Remote => warnings.push(Warning::Misfit(misfit)),
        _ => {}
    }
    if *bus_errors > 0 {
        warnings.push(Warning::BusErrors { errors: *bus_errors });
    }
    warnings
}

#[cfg(test)]
mod tests {
    use flexid_core::identify::Effort;
    use flexid_core::parameters::{Bushing, Ranges};
    use flexid_wire::text::clipped;
    use flexid_wire::trouble::Trouble;
    use std::path::Path;

    use super::*;

    #[test]
    fn more_poses_are_asked_for_only_where_poses_lack() {
        assert_eq!(
            unsure(false, 1, Some(0.3)),
            UnsureCause::FewPoses { directions: 1, or_more: false }
        );
        assert_eq!(
            unsure(false, MAX_DIRECTIONS, Some(0.3)),
            UnsureCause::FewPoses { directions: 8, or_more: true }
        );
        assert_eq!(unsure(false, 0, Some(0.2)), UnsureCause::Noise { ssp: 0.2 });
        for cause in [unsure(false, 0, None), unsure(true, 8, Some(0.3))] {
            assert_eq!(cause, UnsureCause::Other);
        }
    }

    #[test]
    fn troubles_of_many_recordings_leave_room_for_other_warnings() {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tools/scenario/mill3-edge.toml");
        let config = Config::load(&file).unwrap();
        let trouble =
            |log: u64| Trouble::Unreadable(clipped(format_args!("{log}.log: cannot be read")));
        let troubles: Vec<_> = (0..40).map(trouble).collect();
        let basis = Basis {
            effort: Effort::default(),
            records: 0,
            counts: Counts { bus_errors: 1, ..Counts::default() },
            seconds: 0.0,
            refused: None,
            repeated: None,
            unfinished: None,
            dropped: 0,
            dropped_poses: 0,
            too_short: 0,
            doubtful_rate: false,
            scale: None,
            axes: None,
            contradicted: None,
            lines: None,
            louder_cut: None,
            distortion: None,
            troubles: &troubles,
        };
        let mut expected: Vec<_> = troubles[..4].iter().cloned().map(Warning::Trouble).collect();
        expected.push(Warning::MoreTroubles { troubles: 36 });
        expected.push(Warning::BusErrors { errors: 1 });
        assert_eq!(of_the_records(&config, &basis), expected);
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
        let mut sought = Sought::new(3).unwrap();
        assert_eq!(on_bounds(&config, &sought, &bushings), [None, None]);
        bushings[1].damping[5] = damping[5][0];
        bushings[0].stiffness[0] = stiffness[0][1] * (1.0 - 1e-14);
        bushings[2].stiffness[2] = stiffness[2][1];
        bushings[2].stiffness[3] = stiffness[3][1];
        sought.fix(Coordinate::Stiffness { joint: 2, dof: 3 }, stiffness[3][1]).unwrap();
        assert_eq!(
            on_bounds(&config, &sought, &bushings)[0].as_ref().unwrap().to_string(),
            "joint_1 tx stiffness (upper), joint_2 rz damping (lower) and joint_3 tz stiffness (upper)",
        );
        for bushing in &mut bushings {
            bushing.damping = damping.map(|[_, upper]| upper);
        }
        let [names, by_mass] = on_bounds(&config, &sought, &bushings);
        let names = names.unwrap().to_string();
        assert_eq!(by_mass, None);
        assert!(names.ends_with("(upper) and 13 more"), "{names}");
    }
}
