//! `flexid model import`: makes the model, which the other commands read, from a URDF file.

use std::path::{Path, PathBuf};

use anyhow::Result;
use flexid_console::exit::BadArgument;
use flexid_console::output::{self, Output};
use flexid_edge::console::{complain, print};
use flexid_pipeline::input::{self, BadInput};
use flexid_pipeline::model::{Model, ModelError};
use flexid_pipeline::text::count;
use nalgebra::Isometry3;

use crate::dh::{self, Convention};
use crate::urdf::{self, Base, Masses, UrdfError};

/// The subcommands.
#[derive(Debug, clap::Subcommand)]
pub(super) enum Command {
    /// Makes a model of the chain from the root of a URDF file to the tool
    Import(ImportArgs),
}

const AFTER_HELP: &str = "Examples:
  $ flexid model import mill3.urdf --tcp tcp -o mill3-model.toml
  $ flexid model import mill3.urdf --tcp tcp --pedestal -o mill3-model.toml
  $ flexid model import kr210.urdf --tcp tip --total-mass 1077 --payload 40 -o kr210-model.toml
  $ flexid model import kr6.csv --dh modified --total-mass 235 -o kr6-model.toml";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct ImportArgs {
    /// The robot: a URDF file, or with --dh a table of Denavit-Hartenberg parameters (CSV or TOML)
    robot: PathBuf,
    /// Link at whose origin force and acceleration are measured, along its axes: that at the tool's tip. Without it the links to choose
    /// from are listed
    #[arg(long, value_name = "LINK")]
    tcp: Option<String>,
    /// The robot is a table of Denavit-Hartenberg parameters of this convention; its TCP is the frame after the last row
    #[arg(long, value_name = "CONVENTION")]
    dh: Option<Convention>,
    /// Mass of the robot by its data sheet, base included and tool not. Links without a mass get one by the volume of their meshes and the length
    /// of arm that they carry, or without meshes by that length alone. The model says how far that may be off
    #[arg(long, value_name = "KG", allow_negative_numbers = true)]
    total_mass: Option<f64>,
    /// Mass of what the flange carries beside the links in the file: clamp, sensor, spindle, tool
    #[arg(
        long,
        value_name = "KG",
        default_value_t = 0.0,
        hide_default_value = true,
        allow_negative_numbers = true
    )]
    payload: f64,
    /// The base gives way: seek six stiffnesses and dampings under it, as of a joint
    #[arg(long)]
    pedestal: bool,
    /// File of the model
    #[arg(short, long, value_name = "MODEL.toml")]
    output: Option<PathBuf>,
}

pub(super) fn run(Command::Import(args): &Command) -> Result<()> {
    let file = &args.robot;
    let text = input::read(file)?;
    if text.trim().is_empty() {
        return Err(BadInput::new(file, "is empty: name a URDF file").into());
    }
    let base = if args.pedestal { Base::Pedestal } else { Base::Rigid };
    let masses = Masses {
        total: args.total_mass.map(|kg| (kg, "--total-mass")),
        folder: Some(file.parent().unwrap_or(Path::new(""))),
        payload_kg: args.payload,
    };
    let is_xml = text.trim_start_matches('\u{feff}').trim_start().starts_with('<');
    let import = || match (args.dh, &args.tcp) {
        (Some(_), _) if is_xml => Err(BadInput::new(file, "is a URDF: leave --dh out")),
        (Some(convention), tcp) => {
            let name = file.file_stem().unwrap_or_default().to_string_lossy();
            dh::import(&text, &name, convention, tcp.as_deref(), base, &masses)
                .map_err(|error| error.of(file))
        }
        (None, _) if dh::is_table(&text) => Err(BadInput::new(
            file,
            "is a table and no URDF: add --dh standard or --dh modified, the convention of its parameters",
        )),
        (None, Some(tcp)) => {
            urdf::import_with_masses(&text, tcp, base, &masses).map_err(|error| match error {
                UrdfError::NoMass(_) => BadInput::new(
                    file,
                    format!("{error}, or add --total-mass KG, the robot's mass by its data sheet"),
                ),
                error => BadInput::new(file, error),
            })
        }
        (None, None) => Err(BadInput::new(file, urdf::without_tcp(&text))),
    };
    if args.output.is_none() && (args.tcp.is_some() || args.dh.is_some()) {
        return Err(BadArgument("-o MODEL.toml is missing: say where the model goes".into()).into());
    }
    let imported = import()?;
    let Some(output) = &args.output else { return Ok(()) };
    output::is_not_stdout([&**output])?;
    output::keeps([&**file], [&**output])?;
    for warning in &imported.warnings {
        complain(&format!("warning: {}: {warning}", file.display()));
    }
    Output::create(output)?.finish(&imported.to_toml()?)?;
    let model = imported.model;
    let mass: f64 = model.driven().map(|joint| joint.mass_kg).sum();
    let guessed = model.accuracy.map_or_else(String::new, |own| {
        format!(
            "; masses are guessed, to {:.0} %, inertias beside them to {:.0} %, centres to {} m: the model says so to identify",
            100.0 * own.link_mass, 100.0 * own.link_inertia, own.centre_of_mass_m
        )
    });
    // A table read by the wrong convention has its tip elsewhere.
    let place = match args.dh {
        Some(_) => {
            let [x, y, z] = place_at_zero(&model)?.map(|own| (1e3 * own).round() / 1e3 + 0.0);
            format!(" at x {x:.3}, y {y:.3}, z {z:.3} m with all joints at 0")
        }
        None => String::new(),
    };
    Ok(print(&format!(
        "{}: {} with {}{} and {mass:.1} kg of moving mass, tool at '{}'{place}{guessed}\n",
        output.display(),
        model.name,
        count(model.driven().count() as u64, "joint"),
        if args.pedestal { " on a pedestal" } else { "" },
        model.tcp.name
    ))?)
}

/// Place of the TCP in the base with all joints at 0, m.
fn place_at_zero(model: &Model) -> Result<[f64; 3], ModelError> {
    let chain = model.chain()?;
    let frames = chain.joints().iter().map(|joint| joint.frame(0.0));
    let last = frames.fold(Isometry3::identity(), |all, own| all * own);
    Ok((last * chain.tcp()).translation.vector.into())
}
