//! The commands, one file for each.

mod check;
mod collect;
mod compare;
mod compensate;
mod completions;
mod export;
mod fleet;
mod history;
mod identify;
mod lobes;
mod man;
mod map;
mod model;
mod new;
mod plan;
mod pose;
mod predict;
mod publish;
mod range;
mod report;
mod reproduce;
mod simulate;
mod told;
mod watch;
mod web;

use std::process::ExitCode;

use clap::{CommandFactory as _, Parser, Subcommand};
use flexid_console::exit;

/// Finds the joint stiffness and damping of robots while they mill.
#[derive(Debug, Parser)]
#[command(name = "flexid", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Works on robot models
    #[command(subcommand)]
    Model(model::Command),
    /// Makes a folder for a robot of your own: model, DBC file, configuration, and a plausible robot to simulate
    New(new::Args),
    /// Simulates a milling robot that sends frames, onto a CAN bus or into a log
    Simulate(simulate::Args),
    /// Checks configuration, DBC file and logs before anybody identifies from them
    Check(check::Args),
    /// Identifies the joints from recordings and static tests, as the daemon would
    Identify(identify::Args),
    /// Plans which experiments to do next
    Plan(plan::Args),
    /// Predicts modes, receptance, compliance and deflection of an identified robot in any pose
    Predict(predict::Args),
    /// Says whether two fits of a robot agree within their intervals
    Compare(compare::Args),
    /// Says what has changed in a robot, over many results
    History(history::Args),
    /// Says which robots of one type lie outside the others, with mean and spread of each parameter
    Fleet(fleet::Args),
    /// Predicts the depth of cut at which a robot that mills chatters, by spindle speed
    Lobes(lobes::Args),
    /// Takes the deflection along a path back by joint offsets
    Compensate(compensate::Args),
    /// Maps compliance, natural frequency or deflection over the workspace
    Map(map::Args),
    /// Exports an identified robot for MuJoCo, Simscape, Drake, or as CSV
    Export(export::Args),
    /// Writes one page on a fit: verdict, receptance measured and modelled, residuals, modes, parameters
    Report(report::Args),
    /// Reproduces the paper's tables and figures
    Reproduce(reproduce::Args),
    /// Shows what a running daemon finds
    Watch(watch::Args),
    /// Serves what a running daemon finds as a page for browsers
    Web(web::Args),
    /// Keeps each finding of a running daemon in an outbox, and publishes it by MQTT
    Publish(publish::Args),
    /// Brings the findings of a plant from its MQTT broker into PostgreSQL
    Collect(collect::Args),
    /// Prints the completions of this command line for a shell
    Completions(completions::Args),
    /// Writes the manual pages
    Man(man::Args),
}

/// The command line's `main`.
pub fn main() -> ExitCode {
    exit::main(|cli: &Cli| match &cli.command {
        Command::Model(command) => model::run(command),
        Command::New(args) => new::run(args),
        Command::Simulate(args) => simulate::run(args),
        Command::Check(args) => check::run(args),
        Command::Identify(args) => identify::run(args),
        Command::Plan(args) => plan::run(args),
        Command::Predict(args) => predict::run(args),
        Command::Compare(args) => compare::run(args),
        Command::History(args) => history::run(args),
        Command::Fleet(args) => fleet::run(args),
        Command::Lobes(args) => lobes::run(args),
        Command::Compensate(args) => compensate::run(args),
        Command::Map(args) => map::run(args),
        Command::Export(args) => export::run(args),
        Command::Report(args) => report::run(args),
        Command::Reproduce(args) => reproduce::run(args),
        Command::Watch(args) => watch::run(args),
        Command::Web(args) => web::run(args),
        Command::Publish(args) => publish::run(args),
        Command::Collect(args) => collect::run(args),
        Command::Completions(args) => completions::run(args, Cli::command()),
        Command::Man(args) => man::run(args, Cli::command()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The commands below this one that have none below themselves, with their names.
    fn leaves(command: &clap::Command, name: &str) -> Vec<(String, clap::Command)> {
        let below = command
            .get_subcommands()
            .flat_map(|own| leaves(own, &format!("{name} {}", own.get_name())));
        match command.has_subcommands() {
            true => below.collect(),
            false => vec![(name.to_owned(), command.clone())],
        }
    }

    /// Examples of `found.json` are of the robot of the first session, and the manual shows the same output. So it does of `check`.
    #[test]
    fn examples_are_those_of_the_manual() {
        let manual = [
            include_str!("../../../README.md"),
            include_str!("../../docs/check.md"),
            include_str!("../../docs/predict.md"),
            include_str!("../../docs/results.md"),
        ]
        .concat();
        let (mut samples, mut poses) = (0, 0);
        let joints = |line: &str| {
            let (_, pose) = line.split_once(" --pose ")?;
            Some(pose.split_whitespace().next()?.split(',').count())
        };
        for (name, mut command) in leaves(&Cli::command(), "flexid") {
            let help = command.render_long_help().to_string();
            let (_, examples) = help.rsplit_once("\nExamples:\n").unwrap();
            if !examples.contains("found.json") && name != "flexid check" {
                continue;
            }
            for line in examples.lines().filter_map(|line| line.strip_prefix("  ")) {
                if let Some(joints) = joints(line) {
                    assert_eq!(joints, 6, "{name}: {line}");
                    poses += 1;
                } else if !line.starts_with("$ ") && line != "..." {
                    assert!(manual.lines().any(|own| own == line), "{name}: {line}");
                    samples += 1;
                }
            }
        }
        assert!((samples, poses) == (6, 2), "{samples} lines of samples, {poses} poses");
        for line in manual.lines().filter(|line| line.starts_with("flexid ")) {
            assert!(joints(line).is_none_or(|joints| joints == 6), "{line}");
        }
    }

    #[test]
    fn the_help_of_each_command_ends_with_examples_that_parse() {
        let commands = leaves(&Cli::command(), "flexid");
        assert!(commands.len() >= 17, "{}", commands.len());
        for (name, mut command) in commands {
            let help = command.render_long_help().to_string();
            let examples = help.rsplit_once("\nExamples:\n").map(|(_, examples)| examples);
            let examples = examples.unwrap_or_else(|| panic!("{name} has no examples"));
            assert!(!examples.contains("\n\nExit status"), "{name} does not end with its examples");
            let lines: Vec<&str> =
                examples.lines().filter_map(|line| line.strip_prefix("  $ ")).collect();
            assert!(!lines.is_empty(), "{name}: {examples}");
            for line in lines {
                assert!(line.starts_with(&name), "{name}: {line}");
                // What follows is the shell's.
                let words = line.split_whitespace().take_while(|word| *word != ">");
                if let Err(error) = Cli::try_parse_from(words) {
                    panic!("{line}: {error}");
                }
            }
        }
    }
}
