//! `flexid lobes`: the depth of cut at which the tool begins to chatter.

use std::path::PathBuf;

use anyhow::Result;
use clap::ValueEnum;
use flexid_console::exit::BadArgument;
use flexid_console::progress;
use flexid_edge::console::{complain, print};
use flexid_pipeline::input::BadInput;
use flexid_prediction::document::Found;
use flexid_prediction::lobes::Lobes;
use flexid_prediction::milling::{Cutter, Milling, plane};

use super::pose::given_or_first;
use super::range::within;
use crate::json::Judged;
use crate::lobes::{self, Diagram};
use crate::numbers::{Numbers, numbers};
use crate::picture::{Format, outputs};
use crate::predict::table::{doubt, lacks_damping};
use crate::window;

/// Range of the tangential force per area of the chip, N/mm². Chosen: from soft plastics to ten times that of nickel alloys.
const TANGENTIAL: [f64; 2] = [1.0, 1e5];
/// Range of the radial over the tangential force. Chosen: tables have 0.1 to 1.
const RADIAL: [f64; 2] = [0.01, 10.0];
/// Highest spindle speed, turns a minute. The fastest spindles make some 3e5.
const FASTEST_RPM: f64 = 1e6;

const AFTER_HELP: &str = "Examples:
  $ flexid lobes found.json --teeth 2 --kt 700 --milling down --immersion 0.5 --feed 1,0,0 --rpm 1000,12000 --out lobes.svg
  stable from 1000 to 5998 rpm: depths below 0.29238 (0.29157 to 0.29319) mm, at 1000 rpm
  ...";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP, allow_negative_numbers = true)]
pub(super) struct Args {
    /// A result, as `identify --json` writes it
    #[arg(value_name = "FOUND.json")]
    found: PathBuf,
    /// Joint angles, base first, rad (m) [default: the pose of the first record]
    #[arg(long, value_name = "Q1,Q2,...", value_parser = numbers, allow_hyphen_values = true)]
    pose: Option<Numbers>,
    /// Number of teeth of the cutter
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    teeth: u32,
    /// Tangential force per area of the chip, N/mm²
    #[arg(long, value_name = "N/MM2")]
    kt: f64,
    /// Radial over tangential force
    #[arg(long, value_name = "RATIO", default_value_t = 0.3)]
    kr: f64,
    /// Way of milling: chips begin thin (up) or end thin (down)
    #[arg(long, value_name = "WAY", requires = "immersion", required_unless_present = "angles")]
    milling: Option<Way>,
    /// Width of the cut, in diameters of the cutter: 1 is a slot
    #[arg(long, value_name = "RATIO", requires = "milling")]
    immersion: Option<f64>,
    /// Angles of entry and exit from the normal of the feed, deg, in place of --milling and --immersion
    #[arg(long, value_name = "ENTRY,EXIT", value_parser = numbers, allow_hyphen_values = true, conflicts_with = "milling")]
    angles: Option<Numbers>,
    /// Direction of the feed, along the axes of the tool centre point
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers, allow_hyphen_values = true)]
    feed: Numbers,
    /// Direction from the spindle to the tip, seen along which the cutter turns clockwise, along the axes of the tool centre point
    #[arg(long, value_name = "X,Y,Z", value_parser = numbers, allow_hyphen_values = true, default_value = "0,0,1")]
    axis: Numbers,
    /// Lowest and highest spindle speed, turns a minute
    ///
    /// The fit speaks of speeds at which the teeth pass within the band that was fitted: two teeth at 6000 rpm pass at 200 Hz. At others nothing is
    /// stated.
    #[arg(long, value_name = "MIN,MAX", value_parser = numbers, allow_hyphen_values = true)]
    rpm: Numbers,
    /// Number of spindle speeds: half equally far apart, half as the lobes are
    #[arg(long, value_name = "N", default_value_t = 400, value_parser = clap::value_parser!(u32).range(2..=20_000))]
    points: u32,
    /// Top of the picture, mm [default: that of the deepest cut]
    #[arg(long, value_name = "MM")]
    depth: Option<f64>,
    /// Write all speeds as OUT.csv, or a picture as OUT.svg; may be given more than once
    #[arg(short, long, value_name = "OUT.csv|OUT.svg")]
    out: Vec<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Way {
    Up,
    Down,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let found = Found::load(&args.found)?;
    if let Some(why) = lacks_damping(&found.fit) {
        return Err(BadInput::new(&args.found, why).into());
    }
    let pose = given_or_first(&args.found, &found, args.pose.as_ref())?;
    let cutter = cutter(args)?;
    let along = [args.feed.exactly("--feed")?, args.axis.exactly("--axis")?];
    let plane = plane(along[0], along[1]).ok_or_else(|| {
        BadArgument("--feed is along --axis, or one of them is 0,0,0: give the feed across the axis of the cutter".into())
    })?;
    let [lower, upper]: [f64; 2] = args.rpm.exactly("--rpm")?;
    if !(lower > 0.0 && lower < upper) {
        let message = format!("--rpm is {lower},{upper}: give two speeds above 0, the lower first");
        return Err(BadArgument(message).into());
    }
    within("--rpm", upper, [lower, FASTEST_RPM], "turns a minute")?;
    positive("--depth", args.depth.unwrap_or(1.0))?;
    let outputs = outputs(&args.found, &args.out)?;

    let bad = |fault: String| BadInput::new(&args.found, format!("pose {pose:?}: {fault}"));
    let dynamics = found.robot.at(&pose).map_err(|error| bad(error.to_string()))?;
    let band_hz = found.robot.band_hz();
    let bar = progress::endless("sampling the receptance");
    let lobes = Lobes::of(&dynamics, cutter, &plane, band_hz)
        .ok_or_else(|| bad("the robot does not stand there: it has no stiffness".into()))?;
    bar.finish_and_clear();
    let bar = progress::bar(args.points.into(), "seeking the lobes");
    let points = args.points as usize;
    let diagram = Diagram::new(pose, band_hz, &lobes, [lower, upper], points, || bar.inc(1));
    bar.finish_and_clear();
    let doubts: Vec<String> = doubt(&found.fit)
        .map(str::to_owned)
        .into_iter()
        .chain(lobes::open_damping(&dynamics.modes(band_hz[1])))
        .collect();
    let title = lobes::title(&diagram, &found.robot.model().name, &cutter);
    for (format, output) in outputs {
        output.finish(&match format {
            Format::Csv => diagram.csv()?,
            Format::Svg => lobes::svg(&diagram, &title, args.depth, &doubts.join("\n"))?,
        })?;
    }
    let text = if args.json {
        let file = args.found.display();
        doubts.iter().for_each(|doubt| complain(&format!("warning: {file}: {doubt}")));
        serde_json::to_string_pretty(&Judged::of(&found.fit, &diagram))? + "\n"
    } else {
        let doubts: String = doubts.iter().map(|line| format!("{line}\n")).collect();
        window::fit(&(doubts + &lobes::text(&diagram, &title, &cutter, window::columns())))
    };
    Ok(print(&text)?)
}

fn cutter(args: &Args) -> Result<Cutter, BadArgument> {
    within("--kt", args.kt, TANGENTIAL, "N/mm²")?;
    within("--kr", args.kr, RADIAL, "")?;
    let engagement = match (&args.angles, args.milling, args.immersion) {
        (Some(angles), ..) => {
            let [entry, exit] = angles.exactly("--angles")?;
            if !(entry >= 0.0 && entry < exit && exit <= 180.0) {
                return Err(BadArgument(format!(
                    "--angles are {entry},{exit}: give two between 0 and 180 deg, the entry first"
                )));
            }
            [entry, exit].map(f64::to_radians)
        }
        (None, Some(way), Some(immersion)) => {
            if !(immersion > 0.0 && immersion <= 1.0) {
                return Err(BadArgument(format!(
                    "--immersion is {immersion}: must be above 0, and at most 1, a slot"
                )));
            }
            let milling = match way {
                Way::Up => Milling::Up,
                Way::Down => Milling::Down,
            };
            milling.engagement(immersion)
        }
        _ => return Err(BadArgument("give --milling and --immersion, or --angles".into())),
    };
    // From N/mm² to N/m².
    let tangential = 1e6 * args.kt;
    Ok(Cutter { teeth: args.teeth, tangential, radial_ratio: args.kr, engagement })
}

/// Refuses what is not a positive number.
fn positive(name: &str, value: f64) -> Result<(), BadArgument> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(BadArgument(format!("{name} is {value}: must be above 0")))
}
