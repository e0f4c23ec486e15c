//! `flexid collect`: findings of a plant's broker into PostgreSQL.

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use flexid_edge::console::{complain, print};
use flexid_fleet::collect::{Collector, Config, migrate};
use flexid_pipeline::stop::Stop;

/// The help text on use and exit status.
const USE: &str = "\
A message is acknowledged once the database has it: what comes while the database is off waits at the broker. Messages that are no findings
go into the table refused.

Exit status: 0 when Ctrl-C or SIGTERM ends it, or the tables are made; 2 for a wrong configuration; 1 for anything that may mend itself.

Examples:
  $ flexid collect --migrate dbname=flexid
  tables: from number 0 to 1
  $ flexid collect --config collect.toml";

#[derive(Debug, clap::Args)]
#[command(after_help = USE)]
#[group(required = true, multiple = false)]
pub(super) struct Args {
    /// Broker and database
    #[arg(long, value_name = "COLLECT.toml")]
    config: Option<PathBuf>,
    /// Make the tables of this database, or change them to those of this version, as their owner: words of libpq, host=/run/postgresql user=postgres dbname=flexid
    #[arg(long, value_name = "DATABASE")]
    migrate: Option<String>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    if let Some(words) = &args.migrate {
        let (before, after) = migrate(words).context("database")?;
        print(&format!("tables: from number {before} to {after}\n"))?;
    }
    let Some(file) = &args.config else { return Ok(()) };
    let config = Config::load(file)?;
    let stop = Stop::on_signals().context("signals cannot be caught")?;
    Collector::new(&config, &complain)
        .run(&stop)
        .context("no thread for the connection to the broker")
}
