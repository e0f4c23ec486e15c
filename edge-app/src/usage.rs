//! The command line of flexid's programs. A mistake there is reported in one line, as in the files.

use std::process::ExitCode;

use clap::Parser;
use clap::error::{ContextKind, ContextValue, ErrorKind};

use crate::console::complain;

/// Reads the arguments of this program. Help and version go to stdout, and the program ends.
///
/// # Errors
/// The error is exit status 2. One line on stderr has named the mistake. Where a command is missing, stderr has the help.
pub fn parse<Arguments: Parser>() -> Result<Arguments, ExitCode> {
    Arguments::try_parse().map_err(|error| {
        if !error.use_stderr() {
            error.exit();
        }
        if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
            // There is no other place to report the failure.
            let _ = error.print();
            return ExitCode::from(2);
        }
        complain(&format!("{}: {}", Arguments::command().get_name(), one_line(&error)));
        ExitCode::from(2)
    })
}

/// Returns the first paragraph of clap's message, which names the mistake, and the name that may have been meant.
fn one_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let lines = text.lines().map(str::trim).take_while(|line| !line.is_empty());
    let first = lines.collect::<Vec<_>>().join(" ");
    let meant = nearest(error).map(|name| format!(": did you mean '{name}'?")).unwrap_or_default();
    format!("{}{meant} (see --help)", first.trim_start_matches("error: "))
}

/// Returns the argument, subcommand or value that is most like the wrong one.
fn nearest(error: &clap::Error) -> Option<String> {
    let kinds =
        [ContextKind::SuggestedArg, ContextKind::SuggestedSubcommand, ContextKind::SuggestedValue];
    kinds.into_iter().find_map(|kind| match error.get(kind)? {
        ContextValue::String(name) => Some(name.clone()),
        // The most similar name is the last.
        ContextValue::Strings(names) => names.last().cloned(),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Parser)]
    struct Arguments {
        #[arg(long)]
        config: String,
        #[arg(long)]
        seed: Option<u64>,
    }

    #[test]
    fn mistakes_are_one_line() {
        let mistakes: [(&[&str], &str); 4] = [
            (
                &["x"],
                "the following required arguments were not provided: --config <CONFIG> (see --help)",
            ),
            (&["x", "--colour"], "unexpected argument '--colour' found (see --help)"),
            (
                &["x", "--confg", "a"],
                "unexpected argument '--confg' found: did you mean '--config'? (see --help)",
            ),
            (
                &["x", "--config", "a", "--seed", "b"],
                "invalid value 'b' for '--seed <SEED>': invalid digit found in string (see --help)",
            ),
        ];
        for (arguments, message) in mistakes {
            assert_eq!(one_line(&Arguments::try_parse_from(arguments).unwrap_err()), message);
        }
        let right = Arguments::try_parse_from(["x", "--config", "a"]).unwrap();
        assert_eq!((right.config.as_str(), right.seed), ("a", None));
    }
}
