//! Findings of a solver.

use flexid_core::identify::{Acceptance, Estimate};
use flexid_wire::answer::Answer;
use flexid_wire::confidence::Confidence;
use flexid_wire::finding::Finding;
use flexid_wire::report::Report;
use flexid_wire::trouble::Trouble;
use flexid_wire::unused::Unused;

use super::{CoursePoint, Solver};
use crate::intake::Counts;
use crate::report::{self, Basis, Details, Place, StaticReport, confidence, report};
use crate::robot::FoundRobot;
use crate::shared::Shared;

impl Solver {
    /// Returns report and confidence of the present estimate, if there is one. `counts` is what has come in, `troubles`
    /// are those of the source.
    pub fn finding(&self, counts: &Counts, troubles: &[Trouble]) -> Option<Finding> {
        let Self { config, sought, .. } = self;
        let counts = self.state.earlier.added_to(*counts);
        let mut estimate = self.estimate()?.clone();
        let doubtful_rate = self.sources.iter().flatten().any(|record| record.has_doubtful_rate);
        if doubtful_rate {
            // A wrong rate makes every parameter wrong by a factor, which the residuals do not show.
            estimate.acceptance = Acceptance::Unsettled;
        }
        if self.plant.is_some() && self.of_plant.is_none() && estimate.experiments > 0 {
            // The intervals are those of a perfect plant.
            estimate.acceptance = Acceptance::Unsettled;
        }
        let records = self.poses.len() as u64 + estimate.retired;
        let of_records = records - self.receptances().min(records);
        let left_out = self.settled.saturating_sub(of_records);
        let basis = Basis {
            effort: self.identifier.progress().effort,
            records,
            counts,
            seconds: self.spent.as_secs_f64(),
            refused: self.refused(),
            repeated: self.taken.repeated(),
            unfinished: self.unfinished(),
            dropped: left_out.saturating_sub(self.too_short + estimate.forgotten),
            dropped_poses: self.dropped_poses,
            too_short: self.too_short,
            doubtful_rate,
            scale: self.scale.warning(),
            axes: self.axes.warning(),
            contradicted: report::contradicted(self.of_plant.as_deref(), &config.model),
            lines: report::lines(&self.experiments),
            louder_cut: report::louder_cut(&self.experiments),
            distortion: report::distortion(&self.left_over),
            troubles,
        };
        let report = report(config, sought, &estimate, &basis);
        let details = Details {
            of_plant: self.of_plant.as_deref(),
            left_over: &self.left_over,
            poses: &self.poses,
            left_out,
        };
        let confidence = confidence(config, sought, &estimate, &report, &details);
        let answer = self.answer(&estimate, &report, &confidence);
        Some(Finding { report, confidence, answer })
    }

    /// Returns the answer at the pose of the newest record of the estimate, or without records at that of the last static test.
    fn answer(
        &self,
        estimate: &Estimate,
        report: &Report,
        confidence: &Confidence,
    ) -> Option<Answer> {
        let (pose, record) = match (self.poses.last(), self.state.settled.as_ref()) {
            (Some(pose), Some(settled)) => {
                let receptances = self.receptances();
                let newest = settled.numbers.last().copied().or(Some(receptances));
                (pose.as_slice(), newest.filter(|number| *number > 0))
            }
            _ => (self.config.statics.tests.last()?.pose.as_slice(), None),
        };
        report::answer(self.robot()?, estimate, report, confidence, Place { pose, record })
    }

    /// Returns what the present estimate says of each static test. Returns `None` without an estimate or without static tests.
    pub fn static_report(&self) -> Option<StaticReport> {
        StaticReport::new(&self.config.statics, self.estimate()?, self.static_deviation)
    }

    /// Returns what predicts the robot's motion by the present estimate, if there is one.
    pub fn robot(&self) -> Option<FoundRobot> {
        let plant = self.plant.as_deref().zip(self.of_plant.as_deref());
        Some(FoundRobot::new(&self.config, &self.sought, self.estimate()?, plant, &self.poses))
    }

    /// Returns what the present estimate shares with others of the robot, if there is one.
    pub fn shared(&self) -> Option<Shared> {
        let plant = self.plant.as_deref().zip(self.of_plant.as_deref());
        Some(Shared::new(&self.config, &self.sought, self.estimate()?, plant))
    }

    /// Returns where the refinements stood in the course of the work: every step, or one of two, four, ... steps of long work.
    pub fn course(&self) -> &[CoursePoint] {
        self.course.points()
    }

    /// Number of measured receptances in the fit.
    fn receptances(&self) -> u64 {
        self.sources.iter().filter(|source| source.is_none()).count() as u64
    }

    pub(super) fn estimate(&self) -> Option<&Estimate> {
        self.of_plant.as_ref().map(|of_plant| &of_plant.estimate).or(self.identifier.estimate())
    }

    /// Returns the records that were not used. Returns `None` if all were used.
    pub fn unused(&self) -> Option<Unused> {
        self.refused().or_else(|| self.unfinished())
    }

    fn refused(&self) -> Option<Unused> {
        self.refused.unused(self.records)
    }

    fn unfinished(&self) -> Option<Unused> {
        let records = self.records - self.settled + self.waiting;
        (records > 0).then_some(Unused::Unfinished { records })
    }
}
