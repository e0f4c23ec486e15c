//! The main job in one command: a simulated robot mills along paths, the daemon identifies it while the frames arrive,
//! and the readout shows what is found.

mod bus;

use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, anyhow, ensure};
use clap::Parser;
use flexid_console::exit;
use flexid_edge::console::print;
use flexid_edge::daemon;
use flexid_edge::server::Listener;
use flexid_pipeline::config::{Config, Listen};
use flexid_pipeline::stop::Stop;
use flexid_simulation::bus::BusSender;
use flexid_simulation::coverage::Coverage;
use flexid_simulation::shipped::{MILL3_FEED, MILL6};
use flexid_simulation::simulator::{Simulator, Truth};
use flexid_simulation::transmission::Quality;
use flexid_simulation::truth::Shared;
use flexid_simulation::validation;

use crate::show::screen::Screen;
use crate::show::table;
use crate::show::view::{REDRAW, View};
use crate::window;
use flexid_edge::client::Client;

use bus::DemoBus;

/// Number of experiments that the robot does, from the first of the scenario.
const EXPERIMENTS: usize = 3;
/// Time that the daemon may work after the last frame.
const PATIENCE: Duration = Duration::from_secs(90);
/// Time after the last frame until the daemon has cut the last record.
const SILENCE: Duration = Duration::from_secs(2);

/// Lines that say what to try after the demo.
const NEXT: &str = "
The robot above is simulated without any error but noise; a real one has more, and its intervals are wider.
Next, your own robot, before anything is on the bus:
  flexid new ROBOT.urdf --tcp LINK --out my-robot      model, signals, configuration and a plausible scenario
  flexid identify --help                               from a recording to stiffnesses and dampings
";

/// Shows flexid at work: a simulated milling robot, the daemon, and what it finds.
#[derive(Debug, Parser)]
#[command(name = "flexid-demo", version)]
struct Args {
    /// Which robot: nominal, or drawn:SEED for one drawn from the scenario's bounds, or plausibly without any
    #[arg(long, default_value = "nominal")]
    truth: Truth,
    /// A robot of six joints in gravity, of which no bounds are known; it stands in each of three poses
    #[arg(long)]
    six_joints: bool,
    /// Seed of cutting forces and noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// The demo's `main`.
pub fn main() -> ExitCode {
    exit::main(run)
}

fn run(args: &Args) -> Result<()> {
    let folder = tempfile::tempdir().context("no temporary folder")?;
    let scenario = if args.six_joints { MILL6 } else { MILL3_FEED };
    let mut config = Config::load(&scenario.write(folder.path()).context("temporary folder")?)?;
    let quality = Quality { noise: 1.0, drop: 0.0 };
    let simulator = Simulator::new(&config, args.truth, quality, args.seed)?;
    let truth = Shared::of(&simulator, &config)?;
    let scenario = simulator.scenario().clone();
    let experiments = scenario.experiments.len().min(EXPERIMENTS) as u64;
    let DemoBus { robot, daemon, name, what } = DemoBus::new(&config.interface)?;
    config.interface = name;
    print(&format!("bus: {what}\n"))?;
    let listeners = config.listen.iter().map(Listener::bind).collect::<Result<Vec<_>, _>>()?;
    let address = config.listen.first().context("edge.toml: [server] listen is empty")?;

    let stop = Stop::new();
    let (view, daemon, robot) = thread::scope(|scope| {
        // The bus closes when the daemon ends, so that the robot fails to send.
        let daemon = scope.spawn(|| {
            let mut source = daemon;
            daemon::run(&config, &mut source, &listeners, &stop)
        });
        let robot = scope.spawn(move || mill(simulator, robot));
        let view = watch(address, experiments, || robot.is_finished());
        stop.request();
        (view, daemon.join(), robot.join())
    });
    let view = view?;
    let outcome = daemon.map_err(|_| anyhow!("the daemon panicked"))??;
    robot.map_err(|_| anyhow!("the robot panicked"))??;
    if let Some(error) = outcome.broken {
        return Err(error).context("the bus broke");
    }

    let finding = view.finding.as_ref().context("the daemon has sent no report")?;
    print(&window::fit(&table::finding(finding, None, Some(&truth.bushings))))?;
    if let Some(line) = view.bus_line() {
        print(&(line + "\n"))?;
    }
    let estimate = table::bushings(&finding.report);
    print(&validation::compare(&config, Some(&scenario), &truth, &estimate)?)?;
    print(&Coverage::of(finding, &truth).to_string())?;
    ensure!(view.identified(experiments), "the robot was not identified: {}", view.summary());
    Ok(print(NEXT)?)
}

/// The robot does its experiments in real time. Returns its end of the bus: a daemon whose bus is closed ends.
fn mill(mut simulator: Simulator, mut bus: BusSender) -> Result<BusSender> {
    let experiments = simulator.scenario().experiments.clone();
    for experiment in experiments.iter().take(EXPERIMENTS) {
        bus.play(&simulator.perform(experiment, |_| ())?, |_| {})?;
    }
    Ok(bus)
}

/// Shows the daemon's messages until it has settled on all experiments.
fn watch(address: &Listen, experiments: u64, robot_is_done: impl Fn() -> bool) -> Result<View> {
    let mut client = Client::connect(address, None)?;
    let (mut view, mut screen) = (View::default(), Screen::new(false));
    let mut patience = None;
    loop {
        let message = client.next(REDRAW)?;
        if message.is_some_and(|message| view.take(message)) {
            screen.hear(&view)?;
        }
        screen.draw(&view)?;
        if robot_is_done() && patience.is_none() {
            patience = Some(Instant::now() + PATIENCE);
        }
        // A record still comes out when the bus has fallen silent.
        let is_late = patience.is_some_and(|end| Instant::now() + PATIENCE > end + SILENCE);
        let done =
            is_late && view.settled().is_some_and(|report| report.fit.records >= experiments);
        if done || patience.is_some_and(|end| Instant::now() > end) {
            screen.clear()?;
            return Ok(view);
        }
    }
}
