//! `flexid publish`: findings of the daemon to the broker of the box.

use std::path::PathBuf;
use std::thread;

use anyhow::{Context as _, Result};
use flexid_edge::console::complain;
use flexid_fleet::outbox::OutboxError;
use flexid_fleet::publish::{Config, Publisher};
use flexid_pipeline::stop::Stop;

use crate::feed::{self, TOOL};

/// The help text on use and exit status.
const USE: &str = "\
Each finding that settles is kept in the outbox, and then published to flexid/v1/SITE/ROBOT/finding, with quality 1 and retained. What is
published to .../resend, a sequence or the first and the last (17-20), is sent once more.

Exit status: 0 when Ctrl-C or SIGTERM ends it; 2 for a wrong configuration; 1 for anything that may mend itself.

Examples:
  $ flexid publish --config publish.toml";

#[derive(Debug, clap::Args)]
#[command(after_help = USE)]
pub(super) struct Args {
    /// Robot, daemon, outbox and broker
    #[arg(long, value_name = "PUBLISH.toml")]
    config: PathBuf,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let config = Config::load(&args.config)?;
    let publisher = Publisher::new(&config, TOOL, &complain).map_err(|error| match error {
        OutboxError::Input(error) => error.into(),
        taken => anyhow::Error::from(taken),
    })?;
    let stop = Stop::on_signals().context("signals cannot be caught")?;
    let (followed, inlet) = (config.clone(), publisher.inlet());
    // It ends with the process.
    thread::Builder::new()
        .name("flexid-follow".into())
        .spawn(move || feed::follow(&followed, &inlet))
        .context("no thread for the connection to the daemon")?;
    publisher.run(&stop).context("no thread for the connection to the broker")
}
