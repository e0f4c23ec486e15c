//! `flexid model import`: from a URDF file to the model that everything else reads.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context as _, Result};
use flexid_edge::input::BadInput;

use crate::urdf;

/// The subcommands.
#[derive(Debug, clap::Subcommand)]
pub(super) enum Command {
    /// Makes a model of the chain from the root of a URDF file to the tool
    Import(ImportArgs),
}

#[derive(Debug, clap::Args)]
pub(super) struct ImportArgs {
    /// The robot
    urdf: PathBuf,
    /// Link at whose origin force and acceleration are measured, along its axes
    #[arg(long, value_name = "LINK")]
    tcp: String,
    /// Where the model goes
    #[arg(short, long, value_name = "MODEL.toml")]
    output: PathBuf,
}

pub(super) fn run(Command::Import(args): &Command) -> Result<()> {
    let file = &args.urdf;
    let text = fs::read_to_string(file)
        .map_err(|error| BadInput::new(file, format!("cannot be read: {error}")))?;
    let imported = urdf::import(&text, &args.tcp).map_err(|error| BadInput::new(file, error))?;
    for warning in &imported.warnings {
        eprintln!("warning: {}: {warning}", file.display());
    }
    let model = imported.model;
    fs::write(&args.output, model.to_toml()?)
        .with_context(|| format!("{} cannot be written", args.output.display()))?;
    let mass: f64 = model.joints.iter().map(|joint| joint.mass_kg).sum();
    println!(
        "{}: {} with {} joints and {mass:.1} kg of moving mass, tool at '{}'",
        args.output.display(),
        model.name,
        model.joints.len(),
        model.tcp.name
    );
    Ok(())
}
