//! Surveys frames before anybody identifies from them: what came, at which rate, and which records it gives. Nothing is fitted.
//!
//! | module       | holds                                                |
//! | ------------ | ---------------------------------------------------- |
//! | `traffic`    | the frames of each identifier, and their rate        |
//! | `record`     | one record: its pose, its rest, what it repeats      |
//! | `travel`     | where the robot goes in a record along a path        |
//! | `excitation` | where the force of a record stands clear of its noise |
//! | `shown`      | what all records show of the parameters              |
//! | `blows`      | the blows of a hammer in a record                    |
//!
//! The intake and the judgements of a record are those of the daemon: what the survey refuses, the daemon refuses.

mod blows;
mod excitation;
mod record;
mod shown;
mod traffic;
mod travel;

use std::collections::BTreeSet;
use std::io;
use std::time::Duration;

use flexid_core::parameters::Bushings;
use flexid_core::refine::Information;
use flexid_wire::implausible::{Implausible, Signals};
use flexid_wire::misfits::FrameId;
use flexid_wire::rate::{RateUsed, WrongRate};
use flexid_wire::state::{Obstacle, State};
use flexid_wire::text::clipped;
use flexid_wire::trouble::Trouble;
use flexid_wire::warning::Warning;

use crate::clocks::{FoundClocks, Untold};
use crate::config::Config;
use crate::intake::{Counts, Intake, obstacle, plausibility, rate_used, wrong_rate};
use crate::knowledge::Knowledge;
use crate::record::Record;
use crate::solver::Candidate;
use crate::source::{Flow, FrameSource};
use crate::stack::on_a_large_stack;
pub use blows::Blows;
pub use excitation::{Excitation, Octave};
pub use record::Examined;
use record::Examiner;
use shown::Shown;
use traffic::Watched;
pub use traffic::{Identifier, Traffic};
pub use travel::{Station, Travel};

pub use crate::intake::plausibility::rest::AtRest;

/// Content of frames, as far as it shows without a fit.
#[derive(Debug)]
pub struct Survey {
    /// Counts of the intake.
    pub counts: Counts,
    /// What was told of the clocks, if each sensor has its own.
    pub clocks: Option<Result<FoundClocks, Untold>>,
    /// Obstacle to records, or what the intake waited for at the end.
    pub state: State,
    /// Identifiers of the DBC file's signals: force, acceleration, then the joints, base first.
    pub expected: Vec<Identifier>,
    /// Identifiers without a signal, the most frequent first. At most 256 are told apart.
    pub unexpected: Vec<Identifier>,
    /// Records in the order in which they came.
    pub records: Vec<Examined>,
    /// What the records that a fit would take, and the static tests, show of the unknowns of the robot that is assumed. `None` where nobody asked
    /// for it.
    pub shown: Option<Information>,
    /// What these records alone say. `None` without any.
    pub knowledge: Option<Knowledge>,
    /// Reason why most frames cannot become records. Records may have come all the same.
    pub obstacle: Option<Obstacle>,
    /// Kinds of implausible readings, the gravest first.
    pub implausible: Vec<Implausible>,
    /// Signals with readings at the limit of their range.
    pub at_limit: Option<Signals>,
    /// Reading of the accelerometer at rest in the newest record of at least 1 s, if it should feel gravity.
    pub at_rest: Option<AtRest>,
    /// Largest force, N, if a cut has a larger one.
    pub faint_force_n: Option<f32>,
    /// Warning that force and acceleration do not agree with the model's masses.
    pub scale: Option<Warning>,
    /// Warning that axes of a sensor are swapped or have the wrong sign.
    pub axes: Option<Warning>,
    /// Measured rate, and which one the records have, if it is not that of the config.
    pub rate: Option<(WrongRate, RateUsed)>,
    /// Frames of identifiers of the DBC file that came on another bus, each with its name.
    pub elsewhere: Vec<(FrameId, String)>,
    /// Time of the first frame, s.
    pub began_s: f64,
    /// Signals of the joints whose angles came in a cycle, and not to the end, base first.
    pub silent: Vec<String>,
    /// Troubles of the source. The reason why it broke is the first.
    pub troubles: Vec<Trouble>,
    /// Error with which the source broke. `None` if it ended. The frames before the error have been surveyed.
    pub broken: Option<io::Error>,
}

impl Survey {
    /// Returns the records that a fit would take: those without a fault that repeat no other record.
    pub fn usable(&self) -> impl Iterator<Item = &Examined> {
        self.records.iter().filter(|record| record.is_usable())
    }

    /// Returns the number of poses of the records that a fit would take in which the robot stands.
    pub fn poses(&self) -> usize {
        self.usable().filter_map(|record| record.pose_number).collect::<BTreeSet<_>>().len()
    }

    /// Returns the number of paths of the records that a fit would take.
    pub fn paths(&self) -> usize {
        let travels = self.usable().filter_map(|record| record.travel.as_ref());
        travels.map(|travel| travel.path).collect::<BTreeSet<_>>().len()
    }
}

/// Surveys all frames of `source`: what they show of a robot in the middle of its bounds. Calls `on_record` after each record with the number of
/// records so far.
///
/// A recording that cannot be read to its end is no error: the part that was read is surveyed, and the survey contains the reason.
///
/// # Errors
/// The system cannot start a thread.
pub fn survey(
    config: &Config,
    source: &mut dyn FrameSource,
    on_record: impl FnMut(u64) + Send,
) -> io::Result<Survey> {
    let mut bushings = config.bounds.middle(config.sought.joints());
    config.sought.impose(&mut bushings);
    survey_about(config, bushings, source, on_record)
}

/// [`survey`], of a robot with these bushings, base first.
///
/// # Errors
/// Those of [`survey`].
pub fn survey_about(
    config: &Config,
    bushings: Bushings,
    source: &mut dyn FrameSource,
    mut on_record: impl FnMut(u64) + Send,
) -> io::Result<Survey> {
    on_a_large_stack(|| {
        let mut surveyor = Surveyor::new(config, source)?;
        let mut shown = Shown::new(config, bushings)?;
        let mut records = 0;
        let mut take = |Candidate { experiment, ratio, .. }: Candidate<'_>| {
            // A record that repeats another one has no ratio.
            if let (Ok(experiment), Some(_)) = (&experiment, ratio) {
                shown.add(experiment);
            }
            records += 1;
            on_record(records);
        };
        surveyor.read(&mut take);
        surveyor.finish(&mut take);
        let information = shown.information();
        Ok(Survey { shown: information, knowledge: shown.records, ..surveyor.survey() })
    })
}

/// Reads the frames of a source, and hands on each record that it has examined.
pub(crate) struct Surveyor<'a> {
    config: &'a Config,
    source: Watched<'a>,
    intake: Intake<'a>,
    examiner: Examiner<'a>,
    broken: Option<io::Error>,
}

impl<'a> Surveyor<'a> {
    /// # Errors
    /// A checked config gives no error.
    pub(crate) fn new(config: &'a Config, source: &'a mut dyn FrameSource) -> io::Result<Self> {
        Ok(Self {
            config,
            source: Watched::new(config, source),
            intake: Intake::new(config)?,
            examiner: Examiner::new(config)?,
            broken: None,
        })
    }

    /// Reads the frames to their end, or as far as they can be read.
    pub(crate) fn read(&mut self, mut take: impl FnMut(Candidate<'_>)) {
        let Self { source, intake, examiner, .. } = self;
        let mut examine = |record: &Record| take(examiner.examine(record));
        self.broken = loop {
            match intake.read(source, Duration::MAX, &mut examine) {
                Ok(Flow::Open) => {}
                Ok(Flow::Ended) => break None,
                Err(error) => break Some(error),
            }
        };
    }

    /// Returns what the frames tell of the clocks, if each sensor has its own. Their records come from [`Surveyor::finish`].
    pub(crate) fn tell_clocks(&mut self) -> Option<&Result<FoundClocks, Untold>> {
        self.intake.tell_clocks()
    }

    /// Hands on the last records.
    pub(crate) fn finish(&mut self, mut take: impl FnMut(Candidate<'_>)) {
        let Self { intake, examiner, .. } = self;
        intake.finish(|record| take(examiner.examine(record)));
    }

    /// Returns the content of the frames.
    pub(crate) fn survey(self) -> Survey {
        let Self { config, source, mut intake, examiner, broken } = self;
        let breaks = broken.iter().map(|error| Trouble::RecordingBroken(clipped(error)));
        let counts = intake.counts();
        let readings = &counts.implausible;
        Survey {
            clocks: intake.tell_clocks().cloned(),
            state: intake.state(config),
            shown: None,
            knowledge: None,
            obstacle: obstacle(&counts, config),
            elsewhere: source.elsewhere(),
            began_s: source.began_s().unwrap_or_default(),
            silent: intake.silent_joints().map(str::to_owned).collect(),
            troubles: breaks.chain(source.health().troubles).collect(),
            expected: source.expected(),
            unexpected: source.unexpected(),
            implausible: plausibility::warnings(readings, &counts.at_limit, config),
            at_limit: plausibility::signals(&counts.at_limit, config),
            at_rest: readings.rest.and_then(|mean| plausibility::rest::at_rest(mean, config)),
            faint_force_n: plausibility::faint_force(readings),
            scale: examiner.scale(),
            axes: examiner.axes(),
            rate: wrong_rate(&counts, config).map(|rate| (rate, rate_used(&counts.stream))),
            records: examiner.records,
            counts,
            broken,
        }
    }
}
