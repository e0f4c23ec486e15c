//! `flexid export`: the robot, or its receptance, for other programs.

use std::path::PathBuf;
use std::str::FromStr as _;

use anyhow::Result;
use flexid_console::exit::BadArgument;
use flexid_console::output::{self, Output};
use flexid_console::progress;
use flexid_edge::console::complain;
use flexid_export::{Format, Robot, export};
use flexid_pipeline::input::BadInput;
use flexid_pipeline::text::count;
use flexid_prediction::document::Found;
use flexid_prediction::receptance::{Grid, MOST};
use flexid_wire::report::Verdict;

use super::pose::given_or_first;
use crate::constant;
use crate::numbers::{Numbers, numbers};
use crate::predict::{self, Prediction, Request};

const AFTER_HELP: &str = "Examples:
  $ flexid export found.json --format mjcf --out robot.xml
  $ flexid export found.json --format uff --pose 0.1,-0.5,0.4,0.1,0.2,0.3 --out receptance.uff";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// A result, as `identify --json` writes it
    #[arg(value_name = "FOUND.json")]
    found: PathBuf,
    /// mjcf (MuJoCo), simscape (MATLAB), drake (Python), csv, or uff (the receptance for modal analysis programs). A URDF cannot
    /// carry a stiffness
    #[arg(long, value_name = "FORMAT", value_parser = wanted)]
    format: Wanted,
    /// File to write
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
    /// Joint angles in which the drives hold the robot, base first, rad (m) [default: the pose of the first record]
    #[arg(long, value_name = "Q1,Q2,...", value_parser = numbers, allow_hyphen_values = true)]
    pose: Option<Numbers>,
    /// Number of frequencies of the receptance (uff) [default: as many as show the peak of each mode, 400 to 20000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=MOST as i64))]
    points: Option<u32>,
}

/// The robot that is exported.
#[derive(Clone, Copy, Debug)]
enum Wanted {
    /// The robot.
    Robot(Format),
    /// Its receptance along the band that was fitted, as a universal file.
    Receptance,
}

fn wanted(name: &str) -> Result<Wanted, String> {
    if name == "uff" {
        return Ok(Wanted::Receptance);
    }
    Format::from_str(name).map(Wanted::Robot).map_err(|error| format!("{error}, uff"))
}

pub(super) fn run(args: &Args) -> Result<()> {
    let found = Found::load(&args.found)?;
    let robot = found.robot.found();
    let pose = &match (args.format, &args.pose) {
        // The table is that of the parameters alone.
        (Wanted::Robot(Format::Csv), None) => vec![0.0; found.robot.model().driven().count()],
        (_, given) => given_or_first(&args.found, &found, given.as_ref())?,
    };
    if let (Some(_), Wanted::Robot(_)) = (args.points, args.format) {
        let message = "--points is of the receptance: leave it out, or take --format uff";
        return Err(BadArgument(message.into()).into());
    }
    if let Wanted::Receptance = args.format {
        predict::Format::Uff.holds(&args.found, &found.fit)?;
    }
    output::keeps([&*args.found], [&*args.out])?;
    let output = Output::create(&args.out)?;
    let format = match args.format {
        Wanted::Robot(format) => format,
        Wanted::Receptance => {
            let highest_hz = found.robot.band_hz()[1];
            let own = predict::Format::Uff;
            let grid = args.points.map_or(own.grid(), |points| Grid::Even(points as usize));
            let request = Request { force: None, highest_hz, grid: Some(grid) };
            let bar = progress::parts(1, "predicting");
            let done = |part| progress::done(&bar, 0, part);
            let prediction = Prediction::new(&found.robot, pose, &request, done)
                .map_err(|fault| BadInput::new(&args.found, format!("pose {pose:?}: {fault}")))?;
            bar.finish_and_clear();
            let predictions = [prediction];
            output.finish_and_say(&own.text(&predictions, &found.fit)?, "receptance")?;
            predict::table::warn_of(&args.out, &found.fit);
            own.warn_of_open(&args.out, &predictions);
            return Ok(());
        }
    };
    let band_hz = found.robot.band_hz();
    let lowest = found.robot.at(pose).ok().and_then(|dynamics| dynamics.lowest_mode(band_hz[1]));
    let imperfections: Vec<_> =
        robot.imperfections.iter().map(|own| (own.imperfection, own.value)).collect();
    let exported = Robot {
        imperfections: &imperfections,
        band_hz,
        reference_hz: found.robot.reference_hz(),
        // The lowest mode moves the tool most.
        at_hz: lowest.map_or(found.robot.reference_hz(), |mode| mode.frequency_hz.value),
        model: &robot.model,
        joints: &found.joints,
        gravity_m_per_s2: robot.gravity_m_per_s2,
        pose,
        verdict: predict::table::verdict(&found.fit),
        note: None,
    };
    let note = match format {
        Format::Csv => None,
        _ => constant::differences(&found, &exported)
            .map_err(|error| BadInput::new(&args.found, error))?,
    };
    let exported = Robot { note: note.as_deref(), ..exported };
    let text = export(&exported, format).map_err(|error| BadInput::new(&args.found, error))?;
    output.finish_and_say(&text, "robot")?;
    if let Some(note) = note {
        complain(&format!("note: {}: {note}", args.out.display()));
    }
    warn(args, &found);
    Ok(())
}

/// Says on stderr what the comments in the file say.
fn warn(args: &Args, found: &Found) {
    let name = args.out.display();
    predict::table::warn_of(&args.out, &found.fit);
    let verdicts = found
        .joints
        .iter()
        .flat_map(|joint| joint.stiffness_verdict.iter().chain(&joint.damping_verdict).copied());
    let open = verdicts.filter(|verdict| *verdict == Verdict::NotObservable).count();
    if open > 0 {
        let parameters = count(open as u64, "parameter");
        complain(&format!(
            "warning: {name}: {parameters} not observable, marked in the file: their values are as good as any"
        ));
    }
}
