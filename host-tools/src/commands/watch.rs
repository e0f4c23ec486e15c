//! `flexid watch`: what a running daemon finds, live.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, bail};
use clap::value_parser;
use flexid_console::exit::BadArgument;
use flexid_edge::client::{self, Client, ClientError};
use flexid_pipeline::config::Listen;
use flexid_pipeline::stop::Stop;

use crate::metrics::Metrics;
use crate::show::screen::Screen;
use crate::show::view::View;

/// Longest time until the command sees a key or a signal.
const LOOK: Duration = Duration::from_millis(50);
/// The help text on use and exit status.
const USE: &str = "\
Keys: 1 to 6, Tab and arrows turn the pages, up, down and space move a long one, q ends. NO_COLOR=1 leaves colours out.

Exit status: 0 when what --until names is reached, or without --until when the --timeout, Ctrl-C, SIGTERM or the key q ends the
watch; 1 when it is not reached, or there is no daemon any more; 2 for wrong arguments. Into a pipe or a file go one line for each
change and, at the end, the table.

Examples:
  $ flexid watch unix:flexid.sock
  $ flexid watch unix:flexid.sock --until identified --records 3 --timeout 120 --json
It prints lines, of which the last is the report:
  {\"status\":{\"model\":\"mill3\",\"state\":\"waiting for frames\",...}}
  {\"progress\":{\"phase\":\"searching\",\"fraction\":0.25,...}}
  {\"schema\":2,\"joints\":[{\"name\":\"joint_1\",\"stiffness\":[6.0e7,...],...}],\"fit\":{\"records\":3,...},...}";

#[derive(Debug, clap::Args)]
#[command(after_help = USE)]
pub(super) struct Args {
    /// The daemon: unix:PATH or tcp:IP:PORT
    address: String,
    /// Print each report as one line of JSON; before the first, {"status": …} and {"progress": …} as they change
    #[arg(long)]
    json: bool,
    /// End as soon as this is reached
    #[arg(long, value_name = "STATE")]
    until: Option<Until>,
    /// Wait until the report rests on at least so many records
    #[arg(long, value_name = "N", requires = "until", default_value_t = 1, value_parser = value_parser!(u64).range(1..))]
    records: u64,
    /// End after so many seconds; until then wait for a daemon that is not there yet
    #[arg(long, value_name = "S")]
    timeout: Option<f64>,
    /// Keep the numbers in this file, FILE.prom, for the folder of text files of node_exporter; flexid_up is 0 once the daemon is lost
    #[arg(long, value_name = "FILE")]
    metrics: Option<PathBuf>,
}

/// The event to wait for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Until {
    /// A report with parameters that the data determine, settled and consistent with the noise
    Identified,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let address =
        client::address(&args.address).map_err(|error| BadArgument(format!("ADDRESS: {error}")))?;
    let deadline = match args.timeout {
        None => None,
        Some(seconds) => Some(deadline(seconds)?),
    };
    let mut metrics = Metrics::new(args.metrics.as_deref())?;
    let outcome = watch(args, &address, deadline, &mut metrics);
    if outcome.as_ref().is_err_and(|error| error.is::<ClientError>()) {
        metrics.write_lost()?;
    }
    outcome
}

fn watch(
    args: &Args,
    address: &Listen,
    deadline: Option<Instant>,
    metrics: &mut Metrics,
) -> Result<()> {
    let mut client = Client::connect(address, deadline)?;
    let interrupted = Stop::on_signals().context("signals cannot be caught")?;
    let mut view = View::default();
    let mut screen = Screen::with_keys(args.json);
    loop {
        let left = deadline.map_or(LOOK, |end| end.saturating_duration_since(Instant::now()));
        let message = match client.next(left.min(LOOK)) {
            Ok(message) => message,
            Err(error) => {
                screen.end(&view)?;
                return Err(error.into());
            }
        };
        if message.is_some_and(|message| view.take(message)) {
            screen.hear(&view)?;
        }
        let quits = screen.obey();
        screen.draw(&view)?;
        metrics.update(&view)?;
        if args.until == Some(Until::Identified) && view.identified(args.records) {
            metrics.write(&view)?;
            return screen.end(&view);
        }
        let when = if deadline.is_some_and(|end| Instant::now() >= end) {
            "within the --timeout"
        } else if quits || interrupted.requested() {
            "when it was interrupted"
        } else {
            continue;
        };
        metrics.write(&view)?;
        screen.end(&view)?;
        return match args.until {
            Some(Until::Identified) => {
                bail!("{address}: not identified {when}: {}", view.summary())
            }
            None => Ok(()),
        };
    }
}

fn deadline(seconds: f64) -> Result<Instant, BadArgument> {
    let wrong =
        || BadArgument(format!("--timeout {seconds}: must be a positive number of seconds"));
    let timeout = Duration::try_from_secs_f64(seconds).map_err(|_| wrong())?;
    Instant::now().checked_add(timeout).filter(|_| seconds > 0.0).ok_or_else(wrong)
}
