//! Blows of a hammer in place of cuts, a table each, as `[recording] poses` lists them.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context as _, Result};
use flexid_console::output::{self, Output};
use flexid_console::progress;
use flexid_edge::console::print;
use flexid_pipeline::config::Config;
use flexid_pipeline::input::BadInput;
use flexid_pipeline::poses::{Cut, Direction};
use flexid_pipeline::text::count;
use flexid_simulation::experiment::Response;
use flexid_simulation::scenario::Scenario;
use flexid_simulation::truth::{TrueExperiment, TruthFile};
use nalgebra::Vector3;

use super::{Args, quality, simulator};

/// A blow, and the table that it becomes.
struct Blow<'a> {
    table: &'a str,
    pose: &'a [f64],
    direction: Direction,
}

/// Writes the tables into a folder.
pub(super) fn run(args: &Args, folder: &Path) -> Result<()> {
    let quality = quality(args)?;
    let config = Config::load_recorded(&args.config)?;
    let blows = blows(&config)?;
    let scenario = Scenario::of(&config)?;
    let mut simulator = simulator(args, &config, scenario, quality)?;
    let read = config.files().chain(config.scenario.as_deref()).chain(args.plant.as_deref());
    output::is_not_stdout(args.truth_json.as_deref())?;
    output::keeps(read, args.truth_json.as_deref())?;
    let truth_json = args.truth_json.as_deref().map(Output::create).transpose()?;
    fs::create_dir_all(folder).with_context(|| format!("{}: cannot be made", folder.display()))?;
    let present = blows.iter().map(|blow| folder.join(blow.table)).find(|table| table.exists());
    if let Some(table) = present {
        let message =
            "is there already, and may be a measurement: name another folder, or remove it";
        return Err(BadInput::new(&table, message).into());
    }
    let robot = simulator.robot(&config.model);
    let mut truth = TruthFile::new(&config.model, simulator.truth(), &simulator.joints(), robot);
    let seconds = simulator.scenario().measurement.duration_s;
    let bar = progress::simulated(blows.len() as f64 * seconds, "simulating");
    for (done, Blow { table, pose, direction }) in blows.iter().enumerate() {
        let along = Vector3::from(direction.vector(1.0).map(f64::from));
        let tell = |share| progress::reached(&bar, (done as f64 + share) * seconds);
        let response = simulator.strike(table, pose, &along, tell)?;
        let text = text(&config, &response, &along, config.rate_hz);
        Output::create(&folder.join(table))?.finish(&text)?;
        truth.experiments.push(TrueExperiment {
            name: (*table).to_owned(),
            pose: pose.to_vec(),
            seq_start: 0,
            frames: response.force.len() as u64,
            dropped_force: 0,
            dropped_acc: 0,
        });
    }
    bar.finish_and_clear();
    if let Some(file) = truth_json {
        file.finish(&(serde_json::to_string_pretty(&truth)? + "\n"))?;
    }
    let written = count(blows.len() as u64, "blow");
    Ok(print(&format!("{written} written into {}\n", folder.display()))?)
}

/// The blows that a configuration lists.
fn blows(config: &Config) -> Result<Vec<Blow<'_>>, BadInput> {
    let bad = |message: &str| BadInput::new(&config.file, message);
    let poses = config.poses.as_ref().ok_or_else(|| {
        bad("[recording] poses is missing: --tables writes the tables that it lists (as host-tools/scenario/mill6-blows.toml does)")
    })?;
    let one = |(table, cut)| blow(table, cut).map_err(bad);
    poses.lines().map(one).collect()
}

fn blow<'a>(table: &'a str, cut: &'a Cut) -> Result<Blow<'a>, &'static str> {
    let [Some(direction), None] = cut.directions else {
        return Err(
            "[recording] poses must have a column force, and none of acceleration: --tables writes blows of a hammer; use --candump for cuts",
        );
    };
    if cut.point != [0.0; 3] {
        return Err(
            "[recording] poses has px, py, pz: --tables strikes at the TCP: leave them out",
        );
    }
    if Path::new(table).file_name().is_none_or(|name| name != table) {
        return Err("[recording] poses names files in folders: name them by their names alone");
    }
    Ok(Blow { table, pose: &cut.pose, direction })
}

/// A table of force along the direction of the blow, and of acceleration.
fn text(config: &Config, response: &Response, direction: &Vector3<f64>, rate_hz: f64) -> String {
    let [hammer, _, _, x, y, z] = &config.signals.axes;
    let mut text = format!("time [s],{hammer} [N],{x} [m/s^2],{y} [m/s^2],{z} [m/s^2]\n");
    for (index, (force, acceleration)) in
        response.force.iter().zip(&response.acceleration).enumerate()
    {
        let (time_s, force) = (index as f64 / rate_hz, force.dot(direction));
        let [x, y, z] = (*acceleration).into();
        // A string takes all.
        let _ = writeln!(text, "{time_s:.6},{force:.4},{x:.5},{y:.5},{z:.5}");
    }
    text
}
