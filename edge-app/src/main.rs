//! The daemon's command line.
#![forbid(unsafe_code)]

mod summary;

use std::io::IsTerminal;
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
use sd_notify::NotifyState;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use tracing::{info, warn};
use tracing_subscriber::EnvFilter;

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
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(help) if !help.use_stderr() => help.exit(),
        Err(error) => {
            // The first paragraph says what is wrong; the rest is the usage.
            let text = error.to_string();
            let first = text.lines().map(str::trim).take_while(|line| !line.is_empty());
            let first = first.collect::<Vec<_>>().join(" ");
            eprintln!("flexid-edge: {} (see --help)", first.trim_start_matches("error: "));
            return ExitCode::from(2);
        }
    };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("info"));
    let colours = std::io::stderr().is_terminal();
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_ansi(colours);
    log.with_writer(std::io::stderr).init();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("flexid-edge: {error:#}");
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

    match &outcome.report {
        Some(report) => print!("{}", summary::Summary(report)),
        None => println!("nothing identified: {}", outcome.state),
    }
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
