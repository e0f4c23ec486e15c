//! The daemon's command line.
#![forbid(unsafe_code)]

mod log;
mod service;

use std::path::PathBuf;
use std::process::ExitCode;
use std::thread;

use anyhow::Context as _;
use clap::Parser;
use flexid_edge::console::{self, PrintError};
use flexid_edge::daemon::Daemon;
use flexid_edge::health::{Health, Level};
use flexid_edge::history;
use flexid_edge::manager::Watchdog;
use flexid_edge::reload::Reload;
use flexid_edge::server::Listener;
use flexid_edge::store::{ClaimError, Store};
use flexid_edge::threads::{Detached, no_thread};
use flexid_edge::usage;
use flexid_pipeline::config::Config;
use flexid_pipeline::input::BadInput;
use flexid_pipeline::report::Summary;
use flexid_pipeline::source::{CanSocket, FrameSource, OpenError};
use flexid_pipeline::stop::Stop;
use flexid_pipeline::text::printable;
use log::Log;
use service::{Service, Signals};
use tracing::info;

/// Finds the stiffness and damping of a robot's joints while it mills, from force and acceleration on the CAN
/// bus. Runs until SIGTERM or SIGINT; SIGHUP has it read its config again. Exit status: 0 done, 2 bad input or usage, 1 anything else;
/// with --check 0 well, 1 a warning, 2 critical, 3 unknown.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// The file that names robot, bus, signals and bounds
    #[arg(long, value_name = "EDGE.toml")]
    config: PathBuf,
    /// Say how the running daemon of this config is, as a plugin of Nagios does
    #[arg(long)]
    check: bool,
    /// With --check, warn of a newest record that is so many seconds old
    #[arg(long, value_name = "S", requires = "check", value_parser = clap::value_parser!(u64).range(1..))]
    max_age: Option<u64>,
}

fn main() -> ExitCode {
    let arguments: Arguments = match usage::parse() {
        Ok(arguments) => arguments,
        Err(_) if std::env::args_os().any(|argument| argument == "--check") => {
            return ExitCode::from(Level::Unknown as u8);
        }
        Err(status) => return status,
    };
    if arguments.check {
        return check(&arguments);
    }
    let mut log = Log::start();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            log.end(&format!("flexid-edge: {}", printable(&format!("{error:#}"))));
            let is_mistake = error.downcast_ref().is_some_and(BadInput::is_mistake);
            ExitCode::from(if is_mistake { 2 } else { 1 })
        }
    }
}

/// Prints the health of the daemon that runs with this config.
fn check(arguments: &Arguments) -> ExitCode {
    let health = match Config::load_live(&arguments.config) {
        Ok(Config { file, listen, .. }) => match listen.first() {
            Some(address) => Health::of(address, arguments.max_age),
            None => Health::unknown(BadInput::new(&file, "[server] listen names no address")),
        },
        Err(error) => Health::unknown(error),
    };
    // Without its line a status means little.
    let level = console::print(&health.to_string()).map_or(Level::Unknown, |()| health.level);
    ExitCode::from(level as u8)
}

fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let signals = Signals::catch().context("signals cannot be caught")?;
    let Some(config) = signals.read_config(&arguments.config)? else { return Ok(()) };
    let store = Store::find(config.state.as_deref());
    let history = history::folder(&config, store.as_ref())?;
    let bad = |section: &str, error: &dyn std::fmt::Display| {
        BadInput::new(&config.file, format!("[{section}] {error}"))
    };
    let mut bus = CanSocket::open(&config.interface).map_err(|error| match error {
        OpenError::Io { .. } => anyhow::Error::new(error),
        _ => bad("bus", &error).into(),
    })?;
    let bind = |address| Listener::bind_for(address, &config.socket_access);
    let listeners = config.listen.iter().map(bind).collect::<Result<Vec<_>, _>>();
    let listeners = listeners.map_err(|error| match error.is_bad_input() {
        true => bad("server", &error).into(),
        false => anyhow::Error::new(error),
    })?;

    if let Some(store) = &store {
        let (file, own) = (store.file().display(), store.clone());
        let claim =
            Detached::begin("flexid-store", format!("locking {file}"), move || own.claim())?;
        match signals.wait_for(claim)? {
            None => return Ok(()),
            Some(Err(error @ ClaimError::Taken)) => return Err(error).context(file.to_string()),
            Some(_) => {}
        }
    }

    let (stop, reload) = (Stop::new(), Reload::new());
    let service =
        Service { config: &config, signals, stop: &stop, reload: &reload, store: store.as_ref() };
    let bytes = bus.health().receive_buffer_bytes;
    info!("reading {}, receive buffer {bytes} bytes", config.interface);
    for listener in &listeners {
        info!("listening on {}", listener.address());
    }
    match &store {
        Some(store) => info!("keeps its numbers in {}", store.file().display()),
        None => info!("keeps its numbers until it ends: [state] names no file"),
    }
    if let Some(folder) = history {
        info!("leaves the finding of each epoch in {}", folder.display());
    }
    let daemon = Daemon {
        config: &config,
        listeners: &listeners,
        stop: &stop,
        reload: Some(&reload),
        store: store.as_ref(),
        watchdog: Watchdog::of_this_process(),
    };
    let outcome = thread::scope(|scope| {
        thread::Builder::new()
            .name("flexid-service".into())
            .spawn_scoped(scope, || service.attend())
            .map_err(no_thread("flexid-service"))?;
        let outcome = daemon.run(&mut bus);
        // The daemon may have failed before it could request the end.
        stop.request();
        outcome
    })?;

    let result = match &outcome.finding {
        Some(finding) => Summary(&finding.report).to_string(),
        None => format!("nothing identified: {}\n", outcome.state),
    };
    match console::print(&result) {
        Ok(()) | Err(PrintError::Closed) => {}
        Err(error) => return Err(error.into()),
    }
    match outcome.broken {
        Some(error) => {
            Err(error).context(format!("{}: the bus cannot be read any more", config.interface))
        }
        None => Ok(()),
    }
}
