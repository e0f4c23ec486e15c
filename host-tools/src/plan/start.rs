//! What is known before the first experiment of a plan.

use std::path::Path;

use flexid_core::parameters::{Bounds, Bushing, Bushings};
use flexid_core::refine::Information;
use flexid_core::unknowns::{Coordinate, Sought};
use flexid_edge::config::Config;
use flexid_edge::input::{self, BadInput};
use flexid_wire::report::{JointReport, Report};

use super::file_name;

/// Where the parameters are thought to be, and what experiments have told of them.
#[derive(Clone, Debug)]
pub struct Start {
    /// Base first.
    pub bushings: Bushings,
    /// Of the experiments done; the bounds are not in it.
    pub information: Information,
}

impl Start {
    /// No experiment: every parameter in the middle of its bounds, on the logarithmic scale.
    pub fn unknown(config: &Config, sought: &Sought) -> Self {
        let Bounds { stiffness, damping } = config.bounds;
        let middle = |[lower, upper]: [f64; 2]| lower * (upper / lower).sqrt();
        let bushing = Bushing { stiffness: stiffness.map(middle), damping: damping.map(middle) };
        let bushings = config.model.joints.iter().map(|_| bushing).collect();
        Self { bushings, information: Information::none(sought.unknowns()) }
    }

    /// The estimate that `flexid identify --json` has written to `file`, each parameter with its standard deviation.
    ///
    /// # Errors
    /// One line that names the file, the joint, and what would be right.
    pub fn load(file: &Path, config: &Config, sought: &Sought) -> Result<Self, BadInput> {
        Self::parse(file, &input::read(file)?, config, sought)
    }

    fn parse(file: &Path, text: &str, config: &Config, sought: &Sought) -> Result<Self, BadInput> {
        let bad = |message: String| BadInput::new(file, message);
        let report: Report = serde_json::from_str(text).map_err(|error| {
            bad(format!("{error}: give a file as `flexid identify --json` writes it"))
        })?;
        let found: Vec<&str> = report.joints.iter().map(|joint| joint.name.as_str()).collect();
        let wanted: Vec<&str> = config.model.joints.iter().map(|joint| &*joint.name).collect();
        // A report clips names that are very long.
        let same = found.len() == wanted.len()
            && found.iter().zip(&wanted).all(|(found, wanted)| wanted.starts_with(found));
        if !same {
            return Err(bad(format!(
                "is of the joints [{}], but {} has the model with [{}]: name the result of this robot",
                found.join(", "),
                file_name(&config.file),
                wanted.join(", ")
            )));
        }
        let mut start = Self::unknown(config, sought);
        for (joint, found) in report.joints.iter().enumerate() {
            let JointReport { stiffness, damping, .. } = *found;
            start.bushings[joint] = Bushing { stiffness, damping };
            let kinds = [
                ("stiffness", &stiffness, &found.stiffness_std),
                ("damping", &damping, &found.damping_std),
            ];
            for (kind, values, deviations) in kinds {
                for (dof, (&value, deviation)) in values.iter().zip(deviations).enumerate() {
                    if !(value > 0.0 && value.is_finite()) {
                        return Err(bad(format!(
                            "{} {kind} is {value:e}: must be positive",
                            found.name
                        )));
                    }
                    let coordinate = match kind {
                        "stiffness" => Coordinate::Stiffness { joint, dof },
                        _ => Coordinate::Damping { joint, dof },
                    };
                    if let (Some(unknown), Some(deviation)) =
                        (sought.unknown(coordinate), deviation)
                    {
                        start.information.add_known(unknown, deviation / value);
                    }
                }
            }
        }
        Ok(start)
    }
}
