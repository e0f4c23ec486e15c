//! `flexid map`: compliance, natural frequency or deflection over the workspace.

use std::path::PathBuf;

use anyhow::Result;
use clap::ValueEnum;
use flexid_console::exit::BadArgument;
use flexid_console::progress;
use flexid_edge::console::print;
use flexid_pipeline::model::{Kind, ModelJoint};
use flexid_pipeline::text::count;
use flexid_prediction::document::Found;

use super::pose::given_or_first;
use super::range;
use crate::json::Judged;
use crate::map::{self, Map, Over, Quantity};
use crate::numbers::{Numbers, numbers};
use crate::picture::{Format, outputs};
use crate::predict::table::{doubt, warn_of};
use crate::window;

const AFTER_HELP: &str = "Examples:
  $ flexid map found.json --over joint_2,joint_3 --positions x,z --out map.svg
  compliance, softest direction, µm/N, over joint_2 and joint_3, 441 poses
   least    2.45891 (2.45862 to 2.45921) in pose [0.000, 0.997, 1.020, 0.200, 0.750, -0.300], tool at 0.20, 0.07, -0.10 m
  ...";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// A result, as `identify --json` writes it
    #[arg(value_name = "FOUND.json")]
    found: PathBuf,
    /// Quantity that is shown
    #[arg(long, value_name = "QUANTITY", default_value = "compliance")]
    show: Shown,
    /// Show the deflection under this force on the tool along the axes of the tool centre point, N, in place of a quantity
    #[arg(long, value_name = "FX,FY,FZ", value_parser = numbers, allow_hyphen_values = true, conflicts_with = "show")]
    force: Option<Numbers>,
    /// Names of the two driven joints over which it is shown [default: the second and the third]
    #[arg(long, value_name = "JOINT,JOINT", value_delimiter = ',')]
    over: Vec<String>,
    /// Angles of the other joints: a whole pose, base first, rad (m) [default: the pose of the first record]
    #[arg(long, value_name = "Q1,Q2,...", value_parser = numbers, allow_hyphen_values = true)]
    pose: Option<Numbers>,
    /// Number of angles of each of the two joints, between their limits
    #[arg(long, value_name = "N", default_value_t = 21, value_parser = clap::value_parser!(u32).range(2..=200))]
    points: u32,
    /// Draw the places of the tool along two axes of the base, in place of the angles
    #[arg(long, value_name = "AXIS,AXIS", value_delimiter = ',')]
    positions: Vec<Axis>,
    /// Write all poses as OUT.csv, or a picture as OUT.svg; may be given more than once
    #[arg(short, long, value_name = "OUT.csv|OUT.svg")]
    out: Vec<PathBuf>,
    /// Print all poses as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Shown {
    /// Static compliance of the tool along its softest direction
    Compliance,
    /// Lowest natural frequency
    Frequency,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Axis {
    X,
    Y,
    Z,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let found = Found::load(&args.found)?;
    let pose = given_or_first(&args.found, &found, args.pose.as_ref())?;
    let quantity = match (&args.force, args.show) {
        (Some(force), _) => match range::force(force)? {
            [0.0, 0.0, 0.0] => return Err(BadArgument("--force is 0: moves nothing".into()).into()),
            force => Quantity::Deflection(force),
        },
        (None, Shown::Compliance) => Quantity::Compliance,
        (None, Shown::Frequency) => Quantity::Frequency,
    };
    let over = over(args, &found)?;
    let positions = match args.positions.as_slice() {
        [] => None,
        [first, second] if first != second => Some([*first as usize, *second as usize]),
        [_, _] => {
            let message = "--positions names an axis twice: name two different ones, such as x,z";
            return Err(BadArgument(message.into()).into());
        }
        axes => {
            let count = axes.len();
            return Err(
                BadArgument(format!("--positions names {count} of x, y, z: give two")).into()
            );
        }
    };
    let outputs = outputs(&args.found, &args.out)?;
    let bar = progress::bar((over.points * over.points) as u64, "mapping");
    let map = Map::new(&found.robot, quantity, over, &pose, || bar.inc(1));
    bar.finish_and_clear();
    for (format, output) in outputs {
        output.finish(&match format {
            Format::Csv => map.csv()?,
            Format::Svg => map::svg(&map, &found.robot, positions, doubt(&found.fit))?,
        })?;
    }
    let text = if args.json {
        warn_of(&args.found, &found.fit);
        let judged: Vec<_> = map.cells.iter().map(|own| Judged::of(&found.fit, own)).collect();
        serde_json::to_string_pretty(&judged)? + "\n"
    } else {
        let doubt = doubt(&found.fit).map(|line| format!("{line}\n")).unwrap_or_default();
        window::fit(&(doubt + &map::text(&map)))
    };
    Ok(print(&text)?)
}

/// The two joints, between their limits.
fn over(args: &Args, found: &Found) -> Result<Over, BadArgument> {
    let driven: Vec<&ModelJoint> = found.robot.model().driven().collect();
    let joints = match args.over.as_slice() {
        [first, second] => {
            let place = |name: &String| {
                driven.iter().position(|joint| joint.name == *name).ok_or_else(|| {
                    let names: Vec<&str> = driven.iter().map(|joint| joint.name.as_str()).collect();
                    BadArgument(format!(
                        "--over {name}: no driven joint has this name: there are {}",
                        names.join(", ")
                    ))
                })
            };
            [place(first)?, place(second)?]
        }
        [] if driven.len() < 2 => {
            return Err(BadArgument("this robot has one driven joint: a map is over two".into()));
        }
        // The first joint of an arm turns its stiffness with it.
        [] => [driven.len().min(3) - 2, driven.len().min(3) - 1],
        names => {
            let joints = count(names.len() as u64, "joint");
            return Err(BadArgument(format!("--over has {joints}: give two")));
        }
    };
    if joints[0] == joints[1] {
        return Err(BadArgument(format!("--over names {} twice: name two joints", args.over[0])));
    }
    let ranges = joints.map(|joint| match (driven[joint].limits, driven[joint].kind) {
        ([least, most], _) if least.is_finite() && most.is_finite() => [least, most],
        // A joint that turns without end is shown over a turn, and a slide of unknown length over 1 m.
        (_, Kind::Revolute) => [-std::f64::consts::PI, std::f64::consts::PI],
        _ => [0.0, 1.0],
    });
    let names = joints.map(|joint| driven[joint].name.clone());
    let units = joints.map(|joint| if driven[joint].kind == Kind::Revolute { "rad" } else { "m" });
    Ok(Over { joints, names, units, ranges, points: args.points as usize })
}
