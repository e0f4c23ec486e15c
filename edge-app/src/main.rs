//! The daemon's command line.
#![forbid(unsafe_code)]

mod log;

use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Context as _;
use clap::Parser;
use flexid_edge::config::Config;
use flexid_edge::daemon;
use flexid_edge::input::BadInput;
use flexid_edge::server::Listener;
use flexid_edge::source::{CanSocket, FrameSource, OpenError};
use flexid_edge::stop::Stop;
use flexid_edge::summary::Summary;
use flexid_edge::usage;
use sd_notify::NotifyState;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use tracing::{info, warn};

/// Finds the stiffness and damping of a robot's joints while it mills, from force and acceleration on the CAN
/// bus. Runs until SIGTERM or SIGINT. Exit status: 0 done, 2 bad input or usage, 1 anything else.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// The file that names robot, bus, signals and bounds
    #[arg(long, value_name = "EDGE.toml")]
    config: PathBuf,
}

fn main() -> ExitCode {
    let arguments: Arguments = match usage::parse() {
        Ok(arguments) => arguments,
        Err(status) => return status,
    };
    let (mut log, _flush_at_end) = log::start();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // The log's way never waits; it does not fail either.
            let _ = writeln!(log, "flexid-edge: {error:#}");
            ExitCode::from(if error.is::<BadInput>() { 2 } else { 1 })
        }
    }
}

fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let config = Config::load(&arguments.config)?;
    let bad = |section: &str, error: &dyn std::fmt::Display| {
        BadInput::new(&config.file, format!("[{section}] {error}"))
    };
    let mut bus = CanSocket::open(&config.interface).map_err(|error| match error {
        OpenError::Io { .. } => anyhow::Error::new(error),
        _ => bad("bus", &error).into(),
    })?;
    let listeners = config.listen.iter().map(Listener::bind).collect::<Result<Vec<_>, _>>();
    let listeners = listeners.map_err(|error| bad("server", &error))?;

    let stop = Stop::new();
    for signal in [SIGTERM, SIGINT] {
        // The first asks, the second does not wait; registered in the order in which they are run.
        flag::register_conditional_shutdown(signal, 1, stop.flag())
            .and_then(|_| flag::register(signal, stop.flag()))
            .context("signals cannot be caught")?;
    }
    let bytes = bus.health().receive_buffer_bytes;
    info!("reading {}, receive buffer {bytes} bytes", config.interface);
    for listener in &listeners {
        info!("listening on {}", listener.address());
    }
    tell_service_manager(NotifyState::Ready);
    let outcome = daemon::run(&config, &mut bus, &listeners, &stop)?;
    tell_service_manager(NotifyState::Stopping);

    let result = match &outcome.finding {
        Some(finding) => Summary(&finding.report).to_string(),
        None => format!("nothing identified: {}\n", outcome.state),
    };
    std::io::stdout().write_all(result.as_bytes()).context("the result cannot be printed")?;
    match outcome.broken {
        Some(error) => {
            Err(error).context(format!("{}: the bus cannot be read any more", config.interface))
        }
        None => Ok(()),
    }
}

/// Does nothing where there is no systemd.
fn tell_service_manager(state: NotifyState) {
    if let Err(error) = sd_notify::notify(&[state]) {
        warn!("the service manager does not listen: {error}");
    }
}
