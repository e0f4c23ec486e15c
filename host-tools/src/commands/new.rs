//! `flexid new`: a folder with all that one's own robot needs before anything is on the bus.

use std::path::PathBuf;

use anyhow::Result;
use flexid_console::output::NewFolder;
use flexid_edge::console::{complain, print};
use flexid_pipeline::input::{self, BadInput};
use flexid_pipeline::text::count;
use flexid_report::evidence::quoted;

use crate::new::{self, EDGE, PATH, PLANT};
use crate::urdf::{self, Base, Masses};

const AFTER_HELP: &str = "Examples:
  $ flexid new kr210.urdf --tcp tip --out kr210
  $ flexid new irb6640.urdf --tcp tip --mass 1310 --out irb6640";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// The robot
    #[arg(value_name = "ROBOT.urdf")]
    urdf: PathBuf,
    /// Link at whose origin force and acceleration are measured, along its axes: that at the tool's tip. Without it the links to choose
    /// from are listed
    #[arg(long, value_name = "LINK")]
    tcp: Option<String>,
    /// Mass of the robot by its data sheet, base and tool included. It is spread over the links that have none in the file, and the model
    /// says how far that may be off. With the meshes at hand, `model import --total-mass` is nearer
    #[arg(long, value_name = "KG")]
    mass: Option<f64>,
    /// The folder to be made: model.toml, robot.dbc, edge.toml, scenario.toml, plant.toml, path.csv
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let Args { urdf: file, out, .. } = args;
    let text = input::read(file)?;
    let bad = |error: &dyn std::fmt::Display| BadInput::new(file, error);
    if text.trim().is_empty() {
        return Err(bad(&"is empty: name a URDF file").into());
    }
    let Some(tcp) = &args.tcp else { return Err(bad(&urdf::without_tcp(&text)).into()) };
    let masses = Masses { total: args.mass.map(|kg| (kg, "--mass")), ..Masses::default() };
    let imported = urdf::import_with_masses(&text, tcp, Base::Rigid, &masses);
    let imported = imported.map_err(|error| match error {
        urdf::UrdfError::NoMass(_) => {
            bad(&format!("{error}, or add --mass KG, the robot's mass by its data sheet"))
        }
        error => bad(&error),
    })?;
    let model = &imported.model;
    let chain = model.chain().map_err(|error| bad(&error))?;
    let folder = NewFolder::create(out)?;
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let files = new::files(&imported, &chain, &name)?;
    for warning in imported.warnings.iter().chain(&files.warnings) {
        complain(&format!("warning: {}: {warning}", file.display()));
    }
    folder.finish(&files.files)?;
    let mass: f64 = model.driven().map(|joint| joint.mass_kg).sum();
    let names = files.files.map(|(name, _)| name).join(", ");
    let [edge, plant, path] =
        [EDGE, PLANT, PATH].map(|name| quoted(&out.join(name).to_string_lossy()));
    let driven = model.driven().count();
    let map = match driven {
        ..3 => "",
        _ => "      flexid map found.json --positions x,z --out map.svg\n",
    };
    Ok(print(&format!(
        "{}: {names} of {} with {} and {mass:.1} kg of moving mass, tool at '{tcp}'\n\n\
         next: flexid simulate --config {edge} --experiments 3 --candump cut.log --truth-json truth.json\n      \
         flexid check --config {edge} cut.log\n      \
         flexid identify --config {edge} cut.log --truth truth.json --json found.json\n      \
         flexid report found.json --out report.html\n      \
         flexid predict found.json --force 0,200,0\n\
         {map}      \
         flexid lobes found.json --teeth 2 --kt 700 --milling down --immersion 0.5 --feed 1,0,0 --rpm 1000,6000 --out lobes.svg\n      \
         flexid compensate found.json {path} -o offsets.csv\n\n\
         simulate with --plant {plant} adds what a real plant has besides: it takes longer to identify, with wider intervals\n",
        out.display(),
        model.name,
        count(driven as u64, "joint"),
    ))?)
}
