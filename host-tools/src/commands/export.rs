//! `flexid export`: the robot for other programs.

use std::path::PathBuf;
use std::str::FromStr as _;

use anyhow::Result;
use flexid_export::{Format, Robot, export};
use flexid_pipeline::input::BadInput;
use flexid_prediction::document::Found;
use flexid_wire::report::Acceptance;

use super::pose::given_or_first;
use crate::numbers::{Numbers, numbers};
use crate::output::Output;

#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  flexid export found.json --format mjcf --out robot.xml")]
pub(super) struct Args {
    /// A result, as `identify --json` writes it
    #[arg(value_name = "FOUND.json")]
    found: PathBuf,
    /// mjcf (MuJoCo), simscape (MATLAB), drake (Python) or csv. A URDF cannot carry a stiffness
    #[arg(long, value_name = "FORMAT", value_parser = Format::from_str)]
    format: Format,
    /// File to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Joint angles in which the drives hold the robot, base first, rad (m) [default: the pose of the first record]
    #[arg(long, value_name = "Q1,Q2,...", value_parser = numbers, allow_hyphen_values = true)]
    pose: Option<Numbers>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let found = Found::load(&args.found)?;
    let robot = found.robot.found();
    let pose = &given_or_first(&args.found, &found, args.pose.as_ref())?;
    let output = Output::create(&args.out)?;
    let verdict = match found.fit.acceptance {
        Acceptance::Consistent => "consistent: noise explains the residuals of the fit",
        Acceptance::ModelSuspect => "MODEL SUSPECT: the fit leaves more than noise",
        Acceptance::Unsettled => "NOT SETTLED: the fit may have missed the right minimum",
    };
    let exported = Robot {
        model: &robot.model,
        joints: &found.joints,
        gravity_m_per_s2: robot.gravity_m_per_s2,
        pose,
        verdict,
    };
    let text = export(&exported, args.format).map_err(|error| BadInput::new(&args.found, error))?;
    output.finish(&text)
}
