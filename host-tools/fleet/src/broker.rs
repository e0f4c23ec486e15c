//! The section `[broker]` of a configuration.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use flexid_pipeline::input::{BadInput, read};
use serde::Deserialize;

use crate::link::Access;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct BrokerSection {
    address: String,
    user: Option<String>,
    password_file: Option<PathBuf>,
}

impl BrokerSection {
    /// Checks the section of `file`, and reads the password.
    pub(crate) fn access(self, file: &Path) -> Result<Access, BadInput> {
        let bad = |message: String| BadInput::new(file, message);
        let address: SocketAddr = self.address.parse().map_err(|_| {
            bad(format!(
                "[broker] address {:?}: write an address and a port, \"127.0.0.1:1883\"",
                self.address
            ))
        })?;
        let credentials = match (self.user, self.password_file) {
            (None, None) => None,
            (Some(user), Some(password)) => {
                let base = file.parent().unwrap_or(Path::new(""));
                let password = read(&base.join(password))?;
                Some((user, password.trim_end_matches(['\r', '\n']).to_owned()))
            }
            _ => return Err(bad("[broker] has one of user and password_file: give both".into())),
        };
        Ok(Access { address, credentials })
    }
}
