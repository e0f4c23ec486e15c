//! `flexid simulate`: the scenario's robot, onto a bus, into a log or into tables.

mod tables;

use std::io::BufWriter;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use clap::{ArgGroup, value_parser};
use flexid_console::exit::BadArgument;
use flexid_console::output::{self, Growing, Output};
use flexid_console::progress;
use flexid_edge::console::{complain, print};
use flexid_pipeline::config::Config;
use flexid_pipeline::source::OpenError;
use flexid_pipeline::text::count;
use flexid_simulation::bus::BusSender;
use flexid_simulation::scenario::{Experiment, Scenario};
use flexid_simulation::simulator::{Simulator, Truth};
use flexid_simulation::transmission::{PAUSE_S, Quality, Transmission};
use flexid_simulation::truth::{TrueExperiment, TruthFile};
use flexid_simulation::{candump, interface};
use indicatif::ProgressBar;
use rand_core::SeedableRng as _;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Largest number of experiments, and of repetitions: half a day of milling each.
const MOST: u64 = 10_000;

const AFTER_HELP: &str =
    "Before a plant is identified, leave [accuracy] assume = \"perfect\" out of the configuration.

Examples:
  $ flexid simulate --config mill3-edge.toml --candump cut.log --truth-json truth.json
  $ flexid simulate --config mill3-edge.toml --plant mill3-plant.toml --experiments 5 --can vcan0
  $ flexid simulate --config mill6-blows.toml --tables .";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP, group(ArgGroup::new("destination").args(["can", "candump", "tables"]).required(true)))]
pub(super) struct Args {
    /// The daemon's configuration; its [simulation] section names the scenario
    #[arg(long, value_name = "EDGE.toml")]
    config: PathBuf,
    /// Send onto this CAN interface, at the real rate; it must be a virtual bus (vcan)
    #[arg(long, value_name = "IFACE")]
    can: Option<String>,
    /// Allow --can an interface that is no vcan: made-up forces and joint angles then reach whatever listens there
    #[arg(long, requires = "can")]
    onto_real_bus: bool,
    /// Write a log as candump -L would, as fast as possible
    #[arg(long, value_name = "OUT.log")]
    candump: Option<PathBuf>,
    /// Write into this folder, in place of cuts, a table of each blow of a hammer that [recording] poses lists
    #[arg(long, value_name = "DIR", conflicts_with_all = ["experiments", "repeat", "drop"])]
    tables: Option<PathBuf>,
    /// Which robot: nominal, or drawn:SEED for one drawn from the scenario's bounds, or plausibly without any
    #[arg(long, default_value = "nominal")]
    truth: Truth,
    /// Seed of cutting forces, noise, counters and losses
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of experiments; beyond those of the scenario, poses are drawn within the joints' limits
    #[arg(long, value_name = "N", value_parser = value_parser!(u64).range(1..=MOST))]
    experiments: Option<u64>,
    /// Do all experiments so many times
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u64).range(1..=MOST))]
    repeat: u64,
    /// Probability that a force or acceleration frame is lost
    #[arg(long, value_name = "PROB", default_value_t = 0.0)]
    drop: f64,
    /// Times the noise of the scenario
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    noise: f64,
    /// Plant: errors of sensors, clocks, geometry, masses and joints
    #[arg(long, value_name = "PLANT.toml")]
    plant: Option<PathBuf>,
    /// Write the true parameters, and what was lost
    #[arg(long, value_name = "OUT.json")]
    truth_json: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    if let Some(folder) = &args.tables {
        return tables::run(args, folder);
    }
    let quality = quality(args)?;
    let config = Config::load(&args.config)?;
    let most = args.experiments.map_or(usize::MAX, |count| count as usize);
    let scenario = Scenario::of_first(&config, most)?;
    let mut simulator = simulator(args, &config, scenario, quality)?;
    let experiments = experiments(args, &config, &simulator);
    let read = config.files().chain(config.scenario.as_deref()).chain(args.plant.as_deref());
    output::is_not_stdout(args.candump.as_deref().into_iter().chain(args.truth_json.as_deref()))?;
    output::keeps(read, args.candump.as_deref().into_iter().chain(args.truth_json.as_deref()))?;
    let truth_json = args.truth_json.as_deref().map(Output::create).transpose()?;
    let mut sink = match (&args.candump, &args.can) {
        (Some(file), _) => Sink::log(file, &config.interface)?,
        (None, Some(interface)) => Sink::bus(interface, args.onto_real_bus)?,
        (None, None) => return Err(no_destination().into()),
    };
    let robot = simulator.robot(&config.model);
    let mut truth = TruthFile::new(&config.model, simulator.truth(), &simulator.joints(), robot);
    let (mut done, mut frames) = (0, 0);
    let sampling = simulator.scenario().measurement;
    let lasts_s = |experiment: &Experiment| experiment.sampling(&sampling).duration_s;
    let bar = sink.bar(experiments.iter().map(lasts_s), args.repeat);
    let mut cut_s = 0.0;
    for experiment in (0..args.repeat).flat_map(|_| &experiments) {
        bar.set_message(format!("simulating experiment {}", done + 1));
        let own_s = lasts_s(experiment);
        let tell = |share| sink.simulated(&bar, cut_s + share * own_s);
        let sent = simulator.perform(experiment, tell)?;
        cut_s += own_s;
        bar.set_message(format!("sending experiment {}", done + 1));
        sink.take(&sent, &bar)?;
        done += 1;
        frames += sent.frames.len() as u64;
        if truth_json.is_some() {
            truth.experiments.push(TrueExperiment {
                name: experiment.name.clone(),
                pose: experiment.pose.clone(),
                seq_start: sent.first_counter,
                frames: sent.frames.len() as u64,
                dropped_force: sent.lost_force,
                dropped_acc: sent.lost_acceleration,
            });
        }
    }
    bar.finish_and_clear();
    sink.finish()?;
    if let Some(file) = truth_json {
        file.finish(&(serde_json::to_string_pretty(&truth)? + "\n"))?;
    }
    let done = format!("{} of {}", count(frames, "frame"), count(done, "experiment"));
    let what = if args.candump.is_some() { "written" } else { "sent" };
    Ok(print(&format!("{done} {what}\n"))?)
}

/// The simulator of a scenario, with the plant if there is one.
fn simulator(
    args: &Args,
    config: &Config,
    scenario: Scenario,
    quality: Quality,
) -> Result<Simulator> {
    let simulator = Simulator::of(config, scenario, args.truth, quality, args.seed)?;
    let Some(file) = &args.plant else { return Ok(simulator) };
    let simulator = simulator.with_plant(file, &config.model)?;
    warn_of_perfect_accuracies(config);
    Ok(simulator)
}

/// Warns of a configuration that excludes what a plant has beside the model.
fn warn_of_perfect_accuracies(config: &Config) {
    if config.assumes_perfect {
        complain(&format!(
            "warning: {}: [accuracy] takes as perfect what it does not state, which no plant is: leave assume = \"perfect\" out before you \
             identify it",
            config.file.display()
        ));
    }
}

/// The error for a missing destination, which the command line requires before.
fn no_destination() -> BadArgument {
    BadArgument(
        "--can IFACE, --candump OUT.log or --tables DIR is missing: say where the readings go"
            .to_owned(),
    )
}

fn quality(args: &Args) -> Result<Quality, BadArgument> {
    let Args { noise, drop, .. } = *args;
    if !(0.0..1.0).contains(&drop) {
        return Err(BadArgument(format!("--drop {drop}: must be at least 0 and below 1")));
    }
    if !(0.0..=1e6).contains(&noise) {
        return Err(BadArgument(format!("--noise {noise}: must lie between 0 and 1e6")));
    }
    Ok(Quality { noise, drop })
}

/// The scenario's experiments first, then drawn ones.
fn experiments(args: &Args, config: &Config, simulator: &Simulator) -> Vec<Experiment> {
    let scenario = simulator.scenario();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(args.seed);
    rng.jump(); // keeps this apart from the forces and the noise, which have the same seed
    let count = args.experiments.map_or(scenario.experiments.len(), |count| count as usize);
    let drawn = std::iter::repeat_with(|| scenario.draw_experiment(&config.model, &mut rng));
    scenario.experiments.iter().cloned().chain(drawn).take(count).collect()
}

/// The destination of the frames.
enum Sink {
    /// The log, and the start of the next experiment, s since the epoch.
    Log { writer: candump::Writer<BufWriter<Growing>>, file: PathBuf, start_s: f64 },
    /// The bus, in real time, and the seconds sent on it so far.
    Bus { sender: BusSender, sent_s: f64 },
}

impl Sink {
    fn log(file: &Path, interface: &str) -> Result<Self> {
        let log = Output::create(file)?.grow()?;
        let writer = candump::Writer::new(BufWriter::new(log), interface);
        Ok(Self::Log { writer, file: file.to_owned(), start_s: candump::EPOCH_S })
    }

    /// Sends on `interface`, which must be a virtual bus unless a real one is `allowed`.
    fn bus(interface: &str, allowed: bool) -> Result<Self> {
        let sender = BusSender::open(interface).map_err(|error| match error {
            OpenError::Io { .. } => anyhow::Error::new(error),
            missing => BadArgument(format!("--can {interface}: {missing}")).into(),
        })?;
        if let Some(why) = interface::may_be_real(interface).filter(|_| !allowed) {
            let message = format!(
                "--can {interface}: {why}, and a robot's controller may read made-up frames there: send on a vcan, \
                 or add --onto-real-bus if nothing listens that moves"
            );
            return Err(BadArgument(message).into());
        }
        Ok(Self::Bus { sender, sent_s: 0.0 })
    }

    /// A bar of the seconds of these experiments, done `times`: for a log those of the cuts, for a bus those until their frames are sent,
    /// pauses between them included.
    fn bar(&self, lasts_s: impl ExactSizeIterator<Item = f64>, times: u64) -> ProgressBar {
        let count = (lasts_s.len() as u64 * times) as f64;
        let cuts_s = lasts_s.sum::<f64>() * times as f64;
        let seconds = match self {
            Self::Log { .. } => cuts_s,
            Self::Bus { .. } => cuts_s + PAUSE_S * (count - 1.0),
        };
        progress::simulated(seconds, "simulating")
    }

    /// Shows that so many seconds of cuts are simulated. On a bus those count that are sent.
    fn simulated(&self, bar: &ProgressBar, cuts_s: f64) {
        if let Self::Log { .. } = self {
            progress::reached(bar, cuts_s);
        }
    }

    fn take(&mut self, sent: &Transmission, bar: &ProgressBar) -> Result<()> {
        match self {
            Self::Log { writer, file, start_s } => {
                writer
                    .write(&sent.frames, *start_s)
                    .with_context(|| format!("{}: cannot be written", file.display()))?;
                *start_s += sent.lasts_s();
            }
            Self::Bus { sender, sent_s } => {
                sender
                    .play(sent, |lasted| progress::reached(bar, *sent_s + lasted.as_secs_f64()))
                    .context("the bus does not take frames")?;
                *sent_s += sent.lasts_s();
            }
        }
        Ok(())
    }

    fn finish(self) -> Result<()> {
        match self {
            Self::Log { writer, file, .. } => {
                let cannot = || format!("{}: cannot be written", file.display());
                let buffered = writer.finish().with_context(cannot)?;
                let log = buffered.into_inner().map_err(|error| error.into_error());
                log.with_context(cannot)?.finish()
            }
            Self::Bus { .. } => Ok(()),
        }
    }
}
