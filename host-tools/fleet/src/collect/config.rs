//! `COLLECT.toml`: from which broker into which database.

use std::path::{Path, PathBuf};
use std::str::FromStr as _;

use flexid_pipeline::input::{BadInput, parse_toml, read};
use serde::Deserialize;

use crate::broker::BrokerSection;
use crate::link::Access;

/// A checked `COLLECT.toml`.
#[derive(Clone, Debug)]
pub struct Config {
    /// File from which it was read.
    pub file: PathBuf,
    /// Words of a connection to PostgreSQL, `host=/run/postgresql user=flexid-collect dbname=flexid`.
    pub database: String,
    /// The broker of the plant.
    pub broker: Access,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    database: String,
    broker: BrokerSection,
}

impl Config {
    /// Reads and checks the file. Relative paths start at its folder.
    ///
    /// # Errors
    /// The error is one line that names the file, the place and the correction.
    pub fn load(file: &Path) -> Result<Self, BadInput> {
        Self::parse(file, &read(file)?)
    }

    /// [`Config::load`], of the `text` of the file.
    ///
    /// # Errors
    /// The errors are those of [`Config::load`].
    pub fn parse(file: &Path, text: &str) -> Result<Self, BadInput> {
        let own: File = parse_toml(file, text)?;
        let mend = "write \"host=/run/postgresql user=flexid-collect dbname=flexid\"";
        postgres::Config::from_str(&own.database)
            .map_err(|error| BadInput::new(file, format!("database: {error}: {mend}")))?;
        let broker = own.broker.access(file)?;
        Ok(Self { file: file.to_owned(), database: own.database, broker })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_mistake_is_a_line_with_its_mend() {
        let text = "database = \"host=/run/postgresql user=flexid-collect dbname=flexid\"\n\n[broker]\naddress = \"10.0.0.2:1883\"\n";
        let parse = |text: &str| Config::parse(Path::new("collect.toml"), text);
        assert_eq!(parse(text).unwrap().broker.address.port(), 1883);
        for (from, to, says) in [
            ("dbname=flexid", "dbname", "collect.toml: database: "),
            ("10.0.0.2:1883", "plant", "[broker] address \"plant\": write"),
            ("database", "data_base", "data_base"),
        ] {
            let error = parse(&text.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(error.contains(says) && !error.contains('\n'), "{error}");
        }
    }
}
