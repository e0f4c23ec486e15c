//! The information before the first experiment of a plan.

use std::path::Path;

use flexid_core::parameters::{Bushing, Bushings};
use flexid_core::refine::Information;
use flexid_core::sought::{Coordinate, Sought};
use flexid_pipeline::config::Config;
use flexid_pipeline::input::{self, BadInput};
use flexid_prediction::document::COMMAND;
use flexid_wire::report::{Acceptance, JointReport};
use flexid_wire::text::{Name, clipped};

use crate::json::{FoundJson, SCHEMA, VersionJson};

/// Smallest standard deviation, relative to the value, and relative margin of the bounds.
const LEAST: f64 = 1e-9;

/// The assumed parameters, and the information of the experiments done.
#[derive(Clone, Debug)]
pub struct Start {
    /// Assumed bushings, base first. Fixed and tied parameters have their imposed values.
    pub bushings: Bushings,
    /// Information of the experiments done, without that of the bounds and of the nuisances' priors.
    pub information: Information,
    /// True if the information contains the static tests.
    pub has_statics: bool,
    /// Why the standard deviations may be too small, if there is a reason.
    pub doubt: Option<&'static str>,
}

impl Start {
    /// A start without information. Every parameter lies in the middle of its bounds, on the logarithmic scale. The
    /// plan adds the static tests.
    pub fn unknown(config: &Config, sought: &Sought) -> Self {
        let mut bushings = config.bounds.middle(sought.joints());
        sought.impose(&mut bushings);
        let information = Information::none(sought.unknowns());
        Self { bushings, information, has_statics: false, doubt: None }
    }

    /// The estimate that `flexid identify --json` has written to `file`, or the last of `flexid watch --json`. Each parameter counts with its standard
    /// deviation, as if it had been measured alone: the file has the correlations to a per cent only, which is too
    /// rough for the inverse of a covariance. The nuisances of the file are not used.
    ///
    /// # Errors
    /// The file is wrong. The error is one line that names the file, the joint, and the right input.
    pub fn load(file: &Path, config: &Config, sought: &Sought) -> Result<Self, BadInput> {
        Self::parse(file, &input::read(file)?, config, sought)
    }

    fn parse(file: &Path, text: &str, config: &Config, sought: &Sought) -> Result<Self, BadInput> {
        let bad = |message: String| BadInput::new(file, message);
        let VersionJson { schema } = input::parse_json(file, text, COMMAND)?;
        if schema > SCHEMA {
            return Err(bad(format!(
                "is of schema {schema}, this flexid reads 1 to {SCHEMA}: install the newer flexid"
            )));
        }
        let report: FoundJson = input::parse_json(file, text, COMMAND)?;
        let found: Vec<Name> = report.joints.iter().map(|joint| joint.name.clone()).collect();
        // The names are as in a report, which clips very long ones.
        let wanted: Vec<Name> =
            config.model.joints.iter().map(|joint| clipped(&joint.name)).collect();
        if found != wanted {
            return Err(bad(format!(
                "is of the joints [{}], but {} has the model with [{}]: name the result of this robot",
                found.join(", "),
                file_name(&config.file),
                wanted.join(", ")
            )));
        }
        let doubt = match report.fit.acceptance {
            Acceptance::Consistent => None,
            Acceptance::ModelSuspect => {
                Some("\"model_suspect\": noise does not explain its residuals")
            }
            Acceptance::Unsettled => Some("\"unsettled\": it may have missed the right minimum"),
        };
        let mut start = Self { has_statics: true, doubt, ..Self::unknown(config, sought) };
        for (joint, found) in report.joints.iter().enumerate() {
            let JointReport { stiffness, damping, .. } = *found;
            start.bushings[joint] = Bushing { stiffness, damping };
            let kinds = [
                (
                    "stiffness",
                    &stiffness,
                    &found.stiffness_std,
                    &config.bounds.joints[joint].stiffness,
                ),
                ("damping", &damping, &found.damping_std, &config.bounds.joints[joint].damping),
            ];
            for (kind, values, deviations, bounds) in kinds {
                for (dof, (&value, deviation)) in values.iter().zip(deviations).enumerate() {
                    if !(value > 0.0 && value.is_finite()) {
                        return Err(bad(format!(
                            "{} {kind} is {value:e}: must be positive",
                            found.name
                        )));
                    }
                    if let Some(deviation) =
                        deviation.filter(|d| !(*d >= LEAST * value && d.is_finite()))
                    {
                        return Err(bad(format!(
                            "{} {kind}_std is {deviation:e}: must be at least {LEAST:e} of the value",
                            found.name
                        )));
                    }
                    let coordinate = match kind {
                        "stiffness" => Coordinate::Stiffness { joint, dof },
                        _ => Coordinate::Damping { joint, dof },
                    };
                    // A fixed parameter may lie outside its bounds.
                    let [lower, upper] = bounds[dof];
                    let within = lower * (1.0 - LEAST)..=upper * (1.0 + LEAST);
                    if sought.unknown(coordinate).is_some() && !within.contains(&value) {
                        return Err(bad(format!(
                            "{} {kind} is {value:.3e}, outside the bounds of {}: name the result of this robot",
                            found.name,
                            file_name(&config.file)
                        )));
                    }
                    // A tied parameter was measured once, but the file lists it under each of its names.
                    let own = |unknown: &usize| sought.coordinate(*unknown) == Some(coordinate);
                    if let (Some(unknown), Some(deviation)) =
                        (sought.unknown(coordinate).filter(own), deviation)
                    {
                        start.information.add_known(unknown, deviation / value);
                    }
                }
            }
        }
        sought.impose(&mut start.bushings);
        Ok(start)
    }
}

/// The file's name without its folder.
fn file_name(file: &Path) -> std::path::Display<'_> {
    file.file_name().map_or(file, Path::new).display()
}

#[cfg(test)]
mod tests {
    use flexid_wire::report::{Fit, FoundBy, Report, Verdict};

    use super::*;

    fn config() -> Config {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/scenario/mill3-edge.toml");
        Config::load(Path::new(file)).unwrap()
    }

    /// A report with stiffnesses of 1e7, 2e7, … N/m, known to a tenth, and undetermined dampings of 1e4 Ns/m.
    fn found(acceptance: Acceptance) -> String {
        let stiffness = std::array::from_fn(|dof| 1e7 * (dof + 1) as f64);
        let joint = |name: &str| JointReport {
            name: name.try_into().unwrap(),
            stiffness,
            stiffness_std: stiffness.map(|value| Some(0.1 * value)),
            stiffness_verdict: [Verdict::Weak; 6],
            damping: [1e4; 6],
            damping_std: [None; 6],
            damping_verdict: [Verdict::NotObservable; 6],
        };
        let fit = Fit {
            records: 1,
            frames: 0,
            frames_lost: 0,
            ssp: 0.0,
            ssp_max: 0.0,
            consistency: 1.0,
            search_evaluations: 0,
            refine_iterations: 0,
            starts: 1,
            bridged: 0,
            seconds: 1.0,
            acceptance,
            found_by: FoundBy::Descent,
            random_searches: 0,
            branches: 1,
        };
        let joints = ["joint_1", "joint_2", "joint_3"].map(joint).into_iter().collect();
        serde_json::to_string(&Report { joints, fit, warnings: Default::default() }).unwrap()
    }

    fn parse(sought: &Sought, acceptance: Acceptance) -> Result<Start, BadInput> {
        Start::parse(Path::new("found.json"), &found(acceptance), &config(), sought)
    }

    /// The unknowns, with the stiffnesses of joint 1 tied to the first, and the damping of joint 2 along x fixed.
    fn sought() -> Sought {
        let mut sought = Sought::new(3).unwrap();
        let stiffness = |dof| Coordinate::Stiffness { joint: 0, dof };
        for dof in 1..6 {
            sought.tie(stiffness(dof), stiffness(0)).unwrap();
        }
        sought.fix(Coordinate::Damping { joint: 1, dof: 0 }, 7e3).unwrap();
        sought
    }

    #[test]
    fn what_is_tied_is_known_once() {
        let sought = sought();
        let start = parse(&sought, Acceptance::Consistent).unwrap();
        let covariance = start.information.covariance();
        let deviation = |coordinate| covariance.deviation(sought.unknown(coordinate).unwrap());
        for (joint, dof) in [(0, 0), (0, 5), (1, 0), (2, 5)] {
            let deviation = deviation(Coordinate::Stiffness { joint, dof });
            assert!((deviation - 0.1).abs() < 1e-12, "joint {joint}, DOF {dof}: {deviation}");
        }
        assert_eq!(deviation(Coordinate::Damping { joint: 0, dof: 0 }), f64::INFINITY);
    }

    #[test]
    fn starts_from_a_robot_that_the_fit_can_find() {
        let sought = sought();
        let unknown = Start::unknown(&config(), &sought);
        for start in [unknown, parse(&sought, Acceptance::Consistent).unwrap()] {
            let [first, second, _] = start.bushings[..] else { panic!("three joints") };
            assert_eq!(first.stiffness, [first.stiffness[0]; 6]);
            assert_eq!(second.damping[0], 7e3);
        }
    }

    #[test]
    fn a_fit_that_does_not_hold_is_doubted_and_taken() {
        let taken = |acceptance| parse(&sought(), acceptance).unwrap();
        let sound = taken(Acceptance::Consistent);
        for (acceptance, doubt) in [
            (Acceptance::ModelSuspect, "\"model_suspect\": noise does not explain"),
            (Acceptance::Unsettled, "\"unsettled\": it may have missed"),
        ] {
            let start = taken(acceptance);
            assert!(start.doubt.is_some_and(|own| own.starts_with(doubt)), "{:?}", start.doubt);
            assert_eq!(start.bushings, sound.bushings);
        }
        assert_eq!(sound.doubt, None);
    }

    /// A later schema may lack each of the present entries.
    #[test]
    fn a_file_of_a_later_schema_is_refused() {
        let whole = found(Acceptance::Consistent).replacen('{', "{\"schema\": 3,", 1);
        for text in [&whole, "{\"schema\": 3}"] {
            let refused = Start::parse(Path::new("found.json"), text, &config(), &sought());
            assert_eq!(
                refused.unwrap_err().to_string(),
                "found.json: is of schema 3, this flexid reads 1 to 2: install the newer flexid"
            );
        }
    }
}
