//! `flexid model import`: makes the model, which the other commands read, from a URDF file.

use std::path::PathBuf;

use anyhow::Result;
use flexid_console::exit::BadArgument;
use flexid_console::output::{self, Output};
use flexid_edge::console::{complain, print};
use flexid_pipeline::input::{self, BadInput};
use flexid_pipeline::text::count;

use crate::urdf::{self, Base};

/// The subcommands.
#[derive(Debug, clap::Subcommand)]
pub(super) enum Command {
    /// Makes a model of the chain from the root of a URDF file to the tool
    Import(ImportArgs),
}

const AFTER_HELP: &str = "Examples:
  $ flexid model import mill3.urdf --tcp tcp -o mill3-model.toml
  $ flexid model import mill3.urdf --tcp tcp --pedestal -o mill3-model.toml";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct ImportArgs {
    /// The robot
    urdf: PathBuf,
    /// Link at whose origin force and acceleration are measured, along its axes: that at the tool's tip. Without it the links to choose
    /// from are listed
    #[arg(long, value_name = "LINK")]
    tcp: Option<String>,
    /// The base gives way: seek six stiffnesses and dampings under it, as of a joint
    #[arg(long)]
    pedestal: bool,
    /// File of the model
    #[arg(short, long, value_name = "MODEL.toml")]
    output: Option<PathBuf>,
}

pub(super) fn run(Command::Import(args): &Command) -> Result<()> {
    let file = &args.urdf;
    let text = input::read(file)?;
    if text.trim().is_empty() {
        return Err(BadInput::new(file, "is empty: name a URDF file").into());
    }
    let Some(tcp) = &args.tcp else {
        return Err(BadInput::new(file, urdf::without_tcp(&text)).into());
    };
    let Some(output) = &args.output else {
        return Err(BadArgument("-o MODEL.toml is missing: say where the model goes".into()).into());
    };
    let base = if args.pedestal { Base::Pedestal } else { Base::Rigid };
    let imported = urdf::import(&text, tcp, base).map_err(|error| BadInput::new(file, error))?;
    output::is_not_stdout([&**output])?;
    output::keeps([&**file], [&**output])?;
    for warning in &imported.warnings {
        complain(&format!("warning: {}: {warning}", file.display()));
    }
    let model = imported.model;
    Output::create(output)?.finish(&model.to_toml()?)?;
    let mass: f64 = model.driven().map(|joint| joint.mass_kg).sum();
    Ok(print(&format!(
        "{}: {} with {}{} and {mass:.1} kg of moving mass, tool at '{}'\n",
        output.display(),
        model.name,
        count(model.driven().count() as u64, "joint"),
        if args.pedestal { " on a pedestal" } else { "" },
        model.tcp.name
    ))?)
}
