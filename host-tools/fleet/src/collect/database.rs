//! The database: its tables, and messages into it.

use std::error::Error as _;
use std::str::FromStr as _;
use std::sync::mpsc::{Receiver, channel};

use postgres::error::SqlState;
use postgres::{Client, Config, Error, NoTls};

/// Changes of the tables, by their number from 1. A change that was made anywhere never changes.
const MIGRATIONS: &[&str] = &[include_str!("migrations/0001.sql")];
/// Lock of those who migrate: no other program has it, by chance.
const LOCK: i64 = 0x666c_6578_6964;

/// Why the database does not take a message. Its text is one line with the mend.
#[derive(Debug, thiserror::Error)]
pub enum DatabaseError {
    /// PostgreSQL says no, or does not answer.
    #[error("{}", mend(.0))]
    Postgres(#[from] Error),
    /// The tables are those of an older program.
    #[error(
        "the tables are of number {0}, this flexid needs {1}: run `flexid collect --migrate` as their owner"
    )]
    Old(usize, usize),
}

/// A connection to the database.
pub(crate) struct Database {
    client: Client,
    warnings: Receiver<String>,
}

impl Database {
    /// Connects with the words of a connection.
    pub(crate) fn connect(words: &str) -> Result<Self, DatabaseError> {
        let (sender, warnings) = channel();
        let mut config = Config::from_str(words)?;
        config.application_name("flexid collect");
        config.notice_callback(move |notice| {
            if notice.severity() == "WARNING" {
                // Nobody listens any more at the end.
                let _ = sender.send(notice.message().to_owned());
            }
        });
        let mut client = config.connect(NoTls)?;
        match number(&mut client)? {
            old if old < MIGRATIONS.len() => Err(DatabaseError::Old(old, MIGRATIONS.len())),
            _ => Ok(Self { client, warnings }),
        }
    }

    /// Keeps a message. A message that comes again changes nothing.
    pub(crate) fn keep(&mut self, topic: &str, payload: &[u8]) -> Result<(), Error> {
        match str::from_utf8(payload) {
            Ok(text) if !text.contains('\0') => {
                self.client.execute(
                    "insert into message (topic, value) values ($1, $2)",
                    &[&topic, &text],
                )?;
            }
            _ => {
                let insert = "insert into refused (topic, why, payload) values ($1, 'is no text', $2) on conflict do nothing";
                self.client.execute(insert, &[&topic, &payload])?;
            }
        }
        Ok(())
    }

    /// Returns what the database has to say about the messages that it kept.
    pub(crate) fn warnings(&mut self) -> Vec<String> {
        self.warnings.try_iter().collect()
    }

    /// Returns site and name of each robot of which findings are missing.
    pub(crate) fn doubtful(&mut self) -> Result<Vec<(String, String)>, Error> {
        let rows = self.client.query("select distinct site, robot from gap", &[])?;
        rows.iter().map(|row| Ok((row.try_get(0)?, row.try_get(1)?))).collect()
    }

    /// Returns the sequences of the findings of a robot that are missing, in order.
    pub(crate) fn missing(&mut self, site: &str, robot: &str) -> Result<Vec<i64>, Error> {
        let select = "select missing from gap where site = $1 and robot = $2 order by missing";
        let rows = self.client.query(select, &[&site, &robot])?;
        rows.iter().map(|row| row.try_get(0)).collect()
    }
}

/// Makes the tables, or changes them to those of this program. Returns the numbers before and after.
///
/// # Errors
/// PostgreSQL does not answer, or this user may not.
pub fn migrate(words: &str) -> Result<(usize, usize), DatabaseError> {
    let mut client = Config::from_str(words)?.connect(NoTls)?;
    client.execute("select pg_advisory_lock($1)", &[&LOCK])?;
    let table = "create table if not exists migration (number int primary key, at timestamptz not null default now())";
    client.batch_execute(table)?;
    let before = number(&mut client)?;
    for (number, change) in MIGRATIONS.iter().enumerate().skip(before) {
        let mut transaction = client.transaction()?;
        transaction.batch_execute(change)?;
        let number = i32::try_from(number + 1).unwrap_or(i32::MAX);
        transaction.execute("insert into migration (number) values ($1)", &[&number])?;
        transaction.commit()?;
    }
    Ok((before, before.max(MIGRATIONS.len())))
}

fn number(client: &mut Client) -> Result<usize, Error> {
    let is_there: bool =
        client.query_one("select to_regclass('migration') is not null", &[])?.try_get(0)?;
    if !is_there {
        return Ok(0);
    }
    let number: i32 =
        client.query_one("select coalesce(max(number), 0) from migration", &[])?.try_get(0)?;
    Ok(usize::try_from(number).unwrap_or(0))
}

/// Returns the error in one line, with the mend.
fn mend(error: &Error) -> String {
    let Some(own) = error.as_db_error() else {
        let source = error.source().map_or_else(String::new, |source| format!(": {source}"));
        return format!("{error}{source}: is PostgreSQL running, and database right?")
            .replace('\n', " ");
    };
    let mend = match own.code() {
        code if *code == SqlState::DISK_FULL || code.code().starts_with("53") => "make room there",
        code if code.code().starts_with("28") => "correct database, or its pg_hba.conf",
        code if code.code().starts_with("3D") => "make the database first: createdb flexid",
        code if code.code().starts_with("42") => {
            "run `flexid collect --migrate` as the tables' owner"
        }
        code if code.code().starts_with("57") => "PostgreSQL stops or starts",
        _ => "see its log",
    };
    format!("{}: {mend}", own.message()).replace('\n', " ")
}
