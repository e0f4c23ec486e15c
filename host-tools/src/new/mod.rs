//! A folder for one's own robot: all files that simulation, check and identification need before anything is on the bus.
//!
//! | module       | holds                                                       |
//! | ------------ | ----------------------------------------------------------- |
//! | [`poses`]    | where the robot cuts                                        |
//! | [`scenario`] | a plausible robot and its cuts, for `flexid simulate`       |
//! | [`plant`]    | what a real plant has besides                               |
//! | [`path`]     | places under their forces, for `flexid compensate`          |
//! | [`dbc`]      | the layout of the frames                                    |
//! | [`edge`]     | the configuration, from the commented example               |

mod dbc;
mod edge;
mod path;
mod plant;
mod poses;
mod scenario;

use flexid_core::chain::Chain;
use flexid_pipeline::model::Model;
use flexid_simulation::plausible;
use rand_core::SeedableRng as _;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::urdf::Imported;

/// Name of the configuration in the folder.
pub(crate) const EDGE: &str = "edge.toml";
const MODEL: &str = "model.toml";
const DBC: &str = "robot.dbc";
const SCENARIO: &str = "scenario.toml";
pub(crate) const PLANT: &str = "plant.toml";
pub(crate) const PATH: &str = "path.csv";
/// Seed of the plausible robot and of its plant.
const SEED: u64 = 1;

/// The files of a folder, each with its name and its text, and a warning for each thing that could not be had.
#[derive(Clone, Debug)]
pub(crate) struct Files {
    pub(crate) files: [(&'static str, String); 6],
    pub(crate) warnings: Vec<String>,
}

/// The files for the robot of the file `urdf`, whose chain is `chain`.
///
/// # Errors
/// The model cannot be written.
pub(crate) fn files(imported: &Imported, chain: &Chain, urdf: &str) -> anyhow::Result<Files> {
    let model = &imported.model;
    let (poses, warning) = poses::choose(model, chain);
    let robot = plausible::draw(chain, &mut Xoshiro256PlusPlus::seed_from_u64(SEED));
    let force = scenario::force(chain, &robot);
    let files = [
        (MODEL, imported.to_toml()?),
        (DBC, dbc::text(model, force)),
        (EDGE, edge::text(model, urdf)),
        (SCENARIO, scenario::text(model, chain, &robot, force, &poses)),
        (PLANT, plant::text(model)),
        (PATH, path::text(model, &poses, force)),
    ];
    Ok(Files { files, warnings: warning.into_iter().collect() })
}

/// Names of the signals of the joint angles, base first.
fn angles(model: &Model) -> impl Iterator<Item = String> {
    (1..=model.driven().count()).map(|number| format!("q{number}"))
}

/// A string in TOML.
fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

#[cfg(test)]
mod tests;
