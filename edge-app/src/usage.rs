//! The command line of flexid's programs: what a user gets wrong there, said in one line as everywhere else.

use std::process::ExitCode;

use clap::Parser;

/// Reads the arguments of this program. Help and version go to stdout, and the program ends.
///
/// # Errors
/// Exit status 2; one line on stderr has named the mistake.
pub fn parse<Arguments: Parser>() -> Result<Arguments, ExitCode> {
    Arguments::try_parse().map_err(|error| {
        if !error.use_stderr() {
            error.exit();
        }
        eprintln!("{}: {}", Arguments::command().get_name(), one_line(&error));
        ExitCode::from(2)
    })
}

/// The first paragraph says what is wrong; the rest is the usage.
fn one_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let lines = text.lines().map(str::trim).take_while(|line| !line.is_empty());
    let first = lines.collect::<Vec<_>>().join(" ");
    format!("{} (see --help)", first.trim_start_matches("error: "))
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
        let mistakes: [(&[&str], &str); 3] = [
            (
                &["x"],
                "the following required arguments were not provided: --config <CONFIG> (see --help)",
            ),
            (&["x", "--colour"], "unexpected argument '--colour' found (see --help)"),
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
