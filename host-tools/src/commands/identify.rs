//! `flexid identify`: the daemon's pipeline over recordings, or modal or static tests alone.

use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use flexid_console::output::{self, Output};
use flexid_console::progress;
use flexid_edge::console::{complain, print};
use flexid_pipeline::check::Survey;
use flexid_pipeline::clocks::{FoundClocks, Untold};
use flexid_pipeline::config::Config;
use flexid_pipeline::dynamics::Robot;
use flexid_pipeline::input::BadInput;
use flexid_pipeline::report::{MAX_CONSISTENCY, StaticReport};
use flexid_pipeline::robot::FoundRobot;
use flexid_pipeline::shared::Shared as SharedErrors;
use flexid_pipeline::{Outcome, run_offline, run_statics};
use flexid_report::document::Document;
use flexid_report::evidence::{self, Evidence, Origin, sha256};
use flexid_report::{friction, render};
use flexid_simulation::coverage::Coverage;
use flexid_simulation::scenario::Scenario;
use flexid_simulation::truth::{self, Shared};
use flexid_simulation::validation;
use flexid_wire::explanation::Explanation;
use flexid_wire::finding::Finding;
use flexid_wire::left_over::LeftOver;
use flexid_wire::report::Acceptance;
use flexid_wire::residuals::Meaning;
use flexid_wire::state::{Obstacle, State};
use flexid_wire::trouble::Trouble;

use crate::check::{Check, of_other_angles};
use crate::json::ResultJson;
use crate::recording;
use crate::recording::meter::{Meter, Work};
use crate::show::table;
use crate::summary::Summary;
use crate::{urdf, window};

/// Most driven joints that one pose may determine: those of the reference robot.
const ONE_POSE: usize = 3;

const AFTER_HELP: &str = "Exit status: 0 whatever the numbers are worth; 1 where a recording breaks off, of which what came before is used; 2 for bad input.

Examples:
  $ flexid identify --config edge.toml cut.log --json found.json
  $ flexid identify --config edge.toml first.log.gz second.log --explain --report report.html
  $ flexid identify --config edge.toml cut.log --json cut.json --summary cut.csv";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// The daemon's configuration
    #[arg(long, value_name = "EDGE.toml")]
    config: PathBuf,
    /// Recordings: logs of candump -L, tables (CSV, LVM), MF4, TDMS, MAT or MCAP, also packed (.gz, .zst), in their order; - is standard input.
    /// None where tests of [receptance] or [static] are enough
    #[arg(value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// Adopt what explains the records: take each accuracy that they contradict as worse, and fit again
    #[arg(long)]
    explain: bool,
    /// Write the result as JSON
    #[arg(long, value_name = "OUT.json")]
    json: Option<PathBuf>,
    /// Write the page that `report` makes of the result
    #[arg(long, value_name = "REPORT.html")]
    report: Option<PathBuf>,
    /// Write a table of one line as CSV: the recordings, exit status and reason, how good the fit is, stiffnesses and dampings
    ///
    /// It is written when the run ends, whole or not at all, whether there is a result or an error. Only a wrong configuration or command line
    /// writes none. Each of many runs has a file of its own, and `cat` joins them.
    #[arg(long, value_name = "LINE.csv")]
    summary: Option<PathBuf>,
    /// Compare with the truth, as `simulate --truth-json` writes it: how far each number is off, how many intervals hold, and which miss
    #[arg(long, value_name = "TRUTH.json")]
    truth: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let mut summary = None;
    let end = identify(args, &mut summary);
    match summary {
        Some(summary) => summary.finish(end),
        None => end,
    }
}

/// Identifies. Makes the summary, if it is wanted, as soon as the configuration is known.
fn identify(args: &Args, summary: &mut Option<Summary>) -> Result<()> {
    // All input is checked before the work begins, so that no work is wasted.
    let mut config = match args.logs.as_slice() {
        [] => Config::load_statics(&args.config)?,
        _ => Config::load_recorded(&args.config)?,
    };
    let logs = recording::split(&args.logs, &mut config);
    if args.explain {
        can_explain(args, &config)?;
        config.adopts_explanations = true;
    }
    let truth = args.truth.as_deref().map(|file| truth::load(file, &config)).transpose()?;
    // The scenario of another robot, one without the pedestal say, has no truth of each joint.
    let scenario = match (truth.as_ref().and_then(Shared::whole), &config.scenario) {
        (Some(_), Some(file)) => Some(Scenario::load(file, &config.model)?),
        _ => None,
    };
    let named = args.logs.iter().map(PathBuf::as_path);
    let read = config.files().chain(named).chain(args.truth.as_deref());
    let written = [&args.json, &args.report, &args.summary].map(Option::as_deref);
    output::keeps(read, written.into_iter().flatten())?;
    output::is_not_stdout(written.into_iter().flatten())?;
    let [json, page, line] = written.map(|file| file.map(Output::create).transpose());
    let (json, page) = (json?, page?);
    *summary = line?.map(|line| Summary::new(line, &config, &args.logs));
    let Identified { config, finding, robot, shared, statics, evidence, clocks, broken } =
        match logs.as_slice() {
            [] if config.receptances.is_empty() => {
                warn_at_once(&config, None);
                let nothing = "nothing to identify from: name a LOG of candump -L or a table, or give static tests in [static], or modal tests in [receptance]";
                let identified = run_statics(&config)?;
                let (finding, statics, robot) =
                    identified.ok_or_else(|| BadInput::new(&args.config, nothing))?;
                let (robot, statics) = (Some(robot), Some(statics));
                Identified {
                    config,
                    finding,
                    robot,
                    shared: None,
                    statics,
                    evidence: None,
                    clocks: None,
                    broken: None,
                }
            }
            logs => from_logs(&config, logs)?,
        };
    summary.iter_mut().for_each(|summary| summary.note(&finding.report));
    let coverage = truth.as_ref().map(|truth| Coverage::of(&finding, truth));
    let written = if json.is_some() || page.is_some() {
        let origin = origin(args, &config, evidence.as_ref());
        let result = ResultJson::from(&finding)
            .with_model_warnings(urdf::warnings(&config.model))
            .of_robot(robot.as_ref(), shared.as_ref())
            .with_static_tests(statics.as_ref())
            .with_evidence(evidence.as_ref(), &origin)
            .with_clocks(clocks.as_ref())
            .with_truth(coverage.as_ref());
        let text = serde_json::to_string_pretty(&result)? + "\n";
        write(args, &text, json, page)
    } else {
        Ok(())
    };
    let known = truth.as_ref().map(|truth| truth.bushings.as_slice());
    let mut text = table::finding(&finding, statics.as_ref(), known);
    if let Some(truth) = truth {
        let estimate = table::bushings(&finding.report);
        // The table waits for it.
        let _bar = progress::endless("comparing with the truth");
        text += &validation::compare(&config, scenario.as_ref(), &truth, &estimate)?;
    }
    if let Some(clocks) = &clocks {
        text += &format!("clocks: {clocks}\n");
    }
    text += &coverage.map(|own| own.to_string()).unwrap_or_default();
    if let Some(loads) = evidence.as_ref().and_then(|own| loads_of(&finding, robot, own)) {
        text += &loads;
    }
    if args.explain {
        if !finding.confidence.explanations.iter().any(|own| own.adopted) {
            text += &format!("--explain adopts nothing: {}\n", nothing_adopted(&finding));
        } else if finding.report.fit.acceptance == Acceptance::ModelSuspect {
            text += &stays_suspect(&finding);
        }
    }
    // The table is printed even if a file cannot be written, and the error of a recording that broke off is reported even if the table
    // cannot be printed.
    let printed = print(&window::fit(&text));
    written?;
    match broken {
        Some(error) => Err(error),
        None => Ok(printed?),
    }
}

/// The loads of the cuts beside those at which drives slip, where what is left is no response to the force.
fn loads_of(finding: &Finding, robot: Option<FoundRobot>, evidence: &Evidence) -> Option<String> {
    let is_distorted = |own: &LeftOver| matches!(own, LeftOver::Distortion { .. });
    finding.confidence.left_over.iter().find(|own| is_distorted(own))?;
    let bushings = table::bushings(&finding.report).into_iter().collect();
    let robot = Robot::new(robot?, bushings).ok()?;
    let loads = friction::loads(&evidence.records, &robot)?;
    Some(format!("friction: the largest force was {loads}; {}\n", friction::TYPICAL))
}

/// Writes the result, and the page that `report` makes of it.
fn write(args: &Args, result: &str, json: Option<Output>, page: Option<Output>) -> Result<()> {
    if let Some(json) = json {
        json.finish(result)?;
    }
    if let Some(page) = page {
        page.finish(&page_of(args, result)?)?;
    }
    Ok(())
}

/// The origin of the result.
fn origin(args: &Args, config: &Config, evidence: Option<&Evidence>) -> Origin {
    let configuration: Vec<&Path> = config.files().collect();
    let logs: Vec<&Path> = args.logs.iter().map(PathBuf::as_path).collect();
    let options: &[&str] = if args.explain { &["--explain"] } else { &[] };
    let start_s = evidence.and_then(Evidence::start_s);
    evidence::origin("identify", options, &configuration, &logs, start_s)
}

/// The page that `report` makes of the result.
fn page_of(args: &Args, result: &str) -> Result<String> {
    // Without a result file the page names the configuration.
    let file = args.json.as_deref().unwrap_or(&args.config);
    let document = Document::parse(file, result)?;
    let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
    let hash = args.json.as_ref().map(|_| sha256(result.as_bytes()));
    Ok(render(&document, &name, hash.as_deref()))
}

/// Checks that there are records, and accuracies that they may contradict.
fn can_explain(args: &Args, config: &Config) -> Result<(), BadInput> {
    let bad = |message: &str| Err(BadInput::new(&args.config, message));
    if args.logs.is_empty() && config.receptances.is_empty() {
        bad("--explain explains records: name a LOG of candump -L or a table")
    } else if config.accuracies.are_perfect() {
        bad(
            "--explain needs an accuracy that may be wrong, and [accuracy] is perfect: leave out assume = \"perfect\"",
        )
    } else {
        Ok(())
    }
}

/// Says what to think of explanations that are adopted and leave the model suspect.
fn stays_suspect(Finding { report, confidence, .. }: &Finding) -> String {
    let residuals = &confidence.residuals;
    let structure = match residuals.whiteness_objects {
        true => format!(", structure {:.0} %", 100.0 * residuals.structure),
        false => String::new(),
    };
    format!(
        "what is adopted does not make the model right (χ²/dof {:.2}{structure}): it may stand for another cause, such as friction\n",
        report.fit.consistency
    )
}

/// Why no explanation of a result is adopted.
fn nothing_adopted(Finding { report, confidence, .. }: &Finding) -> &'static str {
    let explanations = &confidence.explanations;
    if report.fit.records == 0 {
        "the numbers rest on no record: see the warnings"
    } else if !(0.0..=MAX_CONSISTENCY).contains(&report.fit.consistency) {
        "the fit is too far from the records (χ²/dof is not between 0 and 10) to say what is off: see the warnings"
    } else if explanations.iter().any(Explanation::is_contradicted) {
        // `restated.rs` of the core: what changes an accuracy by a factor below 1.2 is not worth another fit, and the number of fits is limited.
        "the records contradict an accuracy, but by less than a fifth more than the fit allows for, or no longer once it is adopted"
    } else if report.fit.acceptance == Acceptance::Unsettled {
        "the fit is not settled, so that it does not say what is off: see the warnings"
    } else if !explanations.is_empty() {
        "the records contradict no accuracy: what explains a part of the misfit is allowed by its accuracy, and fitted already"
    } else if confidence.residuals.meaning == Meaning::Noise {
        "noise explains what the fit leaves, and the records contradict no accuracy: no larger one makes them more probable by a factor e"
    } else {
        "the records contradict no accuracy: no larger one makes them more probable by a factor e, and what is left has another cause \
         (see the warnings)"
    }
}

/// A fit, and what goes with it.
struct Identified {
    /// The configuration, completed by the logs.
    config: Config,
    finding: Finding,
    /// The robot that predicts motion.
    robot: Option<FoundRobot>,
    /// What it shares with other findings of the robot.
    shared: Option<SharedErrors>,
    /// The static tests in the fit, if there are any.
    statics: Option<StaticReport>,
    /// Evidence that a report shows beside. `None` without records.
    evidence: Option<Evidence>,
    /// Clocks of the sensors, if each has its own.
    clocks: Option<FoundClocks>,
    /// The error that prevented reading the logs to their end, if there was one.
    broken: Option<anyhow::Error>,
}

fn from_logs(config: &Config, logs: &[PathBuf]) -> Result<Identified> {
    let meter = Meter::new();
    let (config, mut source) = recording::open(logs, config, &meter)?;
    let mut work = Work::default();
    let mut other_robot = None;
    let on_survey = |survey: &Survey| {
        meter.pause(|| warn_at_once(&config, Some(survey).filter(|_| !logs.is_empty())));
        other_robot = of_other_angles(&config, &survey.expected, &survey.unexpected);
    };
    let outcome =
        run_offline(&config, &mut source, on_survey, |progress| meter.show(&mut work, progress))?;
    meter.finish();
    let other_robot = other_robot.map(|finding| finding.to_string());
    let evidence = Some(Evidence::of(&outcome)).filter(|evidence| !evidence.records.is_empty());
    let Outcome { finding, robot, shared, statics, clocks, state, troubles, broken, .. } = outcome;

    let broken = broken.map(|error| anyhow!("the recording breaks off: {error}"));
    if let Some(finding) = finding {
        other_robot.iter().for_each(|other| complain(&format!("warning: {other}")));
        robot.iter().for_each(|robot| warn_of_one_pose(&config, robot));
        let clocks = clocks.and_then(|clocks| {
            let untold = |untold: &Untold| {
                complain(&format!("warning: no record of the logs is used: {untold}"));
            };
            clocks.inspect_err(untold).ok()
        });
        return Ok(Identified {
            config,
            finding,
            robot,
            shared,
            statics,
            evidence,
            clocks,
            broken,
        });
    }
    let Some(first) = logs.first() else {
        let what = format!("no receptance to identify from ({state}): see `flexid check`");
        return Err(BadInput::new(&config.file, what).into());
    };
    // Without time nothing else that is said of rates and records is right.
    let timeless = troubles.iter().find_map(|own| match own {
        Trouble::Stamps { fault, frames, .. } if fault.is_of_all() => {
            Some(format!("{}: {}", fault.of(*frames), fault.mend()))
        }
        _ => None,
    });
    if let Some(timeless) = timeless {
        return Err(BadInput::new(first, timeless).into());
    }
    if let Some(Err(untold)) = clocks.filter(|_| has_samples(&state)) {
        return Err(BadInput::new(first, untold).into());
    }
    // Where the recording breaks off is said with what to do about it.
    let others = troubles.iter().filter(|own| !matches!(own, Trouble::RecordingBroken(_)));
    let others = others.map(ToString::to_string).chain(other_robot);
    let besides = broken.iter().map(ToString::to_string).chain(others);
    Err(BadInput::new(first, no_record(&config, logs, &state, besides)).into())
}

/// Warns of what `check` sees in configuration and logs.
fn warn_at_once(config: &Config, survey: Option<&Survey>) {
    let check = Check::new(config, survey);
    check.at_once().for_each(|finding| complain(&format!("warning: {finding}")));
}

/// Returns whether samples of both sensors have come.
fn has_samples(state: &State) -> bool {
    !matches!(
        state,
        State::NoFrames
            | State::OnlyErrors { .. }
            | State::UnknownFrames(_)
            | State::NoForce
            | State::NoAcceleration
            | State::Obstacle(Obstacle::Misfit(_) | Obstacle::CounterStandsStill { .. })
    )
}

/// Why logs give no record, what was seen besides, and what to do.
fn no_record(
    config: &Config,
    logs: &[PathBuf],
    state: &State,
    besides: impl Iterator<Item = String>,
) -> String {
    let others = logs.len() - 1;
    let file = config.file.file_name().map_or(&*config.file, Path::new).display();
    let besides: String = besides.map(|line| format!("; {line}")).collect();
    if let State::UnknownFrames(frames) = state {
        let nor = if others > 0 { ", nor do the others" } else { "" };
        return format!(
            "holds no frame of any identifier of {file}{nor}: {frames}{besides}: name a log of this robot, or correct [bus] dbc"
        );
    }
    let more = if others > 0 { format!(" in it and {others} more") } else { String::new() };
    format!(
        "no record to identify from{more} ({state}{besides}): see `flexid check` of the same logs"
    )
}

/// Warns that one pose does not determine a robot of many joints, unless static tests add to it.
fn warn_of_one_pose(config: &Config, robot: &FoundRobot) {
    let joints = robot.model.driven().count();
    if joints > ONE_POSE && config.statics.tests.is_empty() && robot.has_one_pose() {
        complain(&format!(
            "warning: all records are of one pose, which does not determine a robot of {joints} joints: mill along paths in several regions, \
             or in poses that `flexid plan` proposes"
        ));
    }
}

#[cfg(test)]
mod tests {
    use flexid_wire::accuracy::Accuracy;
    use flexid_wire::explanation::Deviation;
    use flexid_wire::text::clipped;

    use super::*;
    use crate::show::page::tests::finding;

    #[test]
    fn what_is_contradicted_is_not_denied() {
        let explanation = |evidence| Explanation {
            deviation: Deviation {
                entry: Accuracy::TcpM,
                name: clipped("TCP z"),
                unit: clipped("m"),
                value: 1.1e-3,
                std: Some(1e-5),
                accuracy: 1e-3,
            },
            times: 1.1,
            share: 0.4,
            evidence,
            adopted: false,
            rivals: Default::default(),
        };
        let (settled, unsettled) = (Acceptance::Consistent, Acceptance::Unsettled);
        for (consistency, acceptance, evidence, said) in [
            (1.0, settled, Some(3.0), "the records contradict an accuracy, but by less than"),
            (1.0, unsettled, Some(3.0), "the records contradict an accuracy, but by less than"),
            (1.0, settled, Some(0.0), "the records contradict no accuracy: what explains a part"),
            (1.0, unsettled, Some(0.0), "the fit is not settled"),
            (1.0, unsettled, None, "the fit is not settled"),
            (1.0, settled, None, "noise explains what the fit leaves"),
            (11.0, settled, None, "the fit is too far from the records"),
            (f64::NAN, settled, None, "the fit is too far from the records"),
        ] {
            let mut finding = finding(3);
            finding.report.fit.consistency = consistency;
            finding.report.fit.acceptance = acceptance;
            finding.confidence.explanations = evidence.map(explanation).into_iter().collect();
            let why = nothing_adopted(&finding);
            assert!(why.starts_with(said), "{consistency} {acceptance:?} {evidence:?}: {why}");
        }
    }
}
