//! An experiment, and its entry in the scenario file.

use flexid_pipeline::model::Model;
use flexid_pipeline::text::count;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::engagement::Engagement;
use super::limits::within;
use super::sampling::Sampling;
use crate::course::{Course, Path, REST_S};

/// Acceleration along a path that the file does not state, mm/s². Chosen: a ramp to 10 mm/s then lasts 0.2 s, a period of the lowest modes of
/// robots that mill, so that it hardly rings; makers tune their limits to that.
const ACCELERATION: f64 = 100.0;
/// Rate of the joint angles of a robot that feeds, Hz. Chosen: straight lines between them miss the ramps of the feed by 1e-6 rad.
const FEEDING_HZ: f64 = 100.0;
/// Least part of the feed across the tool's axis where the force follows the path. Chosen: a steeper way is drilled, not milled.
const ACROSS: f64 = 0.5;

/// One cut, at one pose or along a path.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Name for people.
    pub name: String,
    /// Joint angles at the start, rad (m), base first.
    pub pose: Vec<f64>,
    /// Spindle speed at the beginning and at the end of the cut, revolutions per minute.
    pub spindle_rpm: [f64; 2],
    /// Axis of the TCP along which the cutter's force takes the tool to be fed.
    pub feed: Feed,
    /// Length, s; `None` for that of the [`Sampling`].
    pub duration_s: Option<f64>,
    /// Motion of the joints; `None` for a robot that stands.
    pub course: Option<Course>,
    /// Part of the tool in the work along the course.
    pub engagement: Engagement,
}

/// An `[[experiment]]` of the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Entry {
    name: String,
    pose: Vec<f64>,
    spindle_rpm: [f64; 2],
    feed: Feed,
    duration_s: Option<f64>,
    path_mm: Option<Vec<[f64; 3]>>,
    feed_mm_per_s: Option<f64>,
    acceleration_mm_per_s2: Option<f64>,
    engagement_by_mm: Option<Vec<[f64; 2]>>,
}

/// An axis of the TCP.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Feed {
    /// Along x; the tool's axis is z.
    X,
    /// Along y; the tool's axis is x.
    Y,
    /// Along z; the tool's axis is y.
    Z,
    /// Along each line of the path; the tool's axis is z.
    Path,
}

impl Entry {
    /// The experiment, with the motion along its path.
    pub(super) fn check(self, model: &Model, sampling: &Sampling) -> Result<Experiment, String> {
        let path = self.path()?;
        let Self { name, pose, spindle_rpm, feed, duration_s, engagement_by_mm, .. } = self;
        let standing = Experiment::standing(&name, spindle_rpm, feed);
        let mut own = Experiment { pose, duration_s, ..standing };
        own.check(model)?;
        own.sampling(sampling).check_duration(&own.place())?;
        if let Some(path) = path {
            let course = own.follow(&path, model)?;
            let points = engagement_by_mm.unwrap_or_default();
            let engagement = Engagement::new(&points, course.length());
            own.engagement =
                engagement.map_err(|error| format!("{} engagement_by_mm: {error}", own.place()))?;
            own.course = Some(course);
            own.outlasts_path(sampling)?;
        }
        Ok(own)
    }

    /// The path, m and s, if there is one.
    fn path(&self) -> Result<Option<Path>, String> {
        let place = place(&self.name);
        let Some(points) = &self.path_mm else {
            let lonely = [
                ("feed_mm_per_s", self.feed_mm_per_s.is_some()),
                ("acceleration_mm_per_s2", self.acceleration_mm_per_s2.is_some()),
                ("engagement_by_mm", self.engagement_by_mm.is_some()),
                ("feed = \"path\"", self.feed == Feed::Path),
            ];
            return match lonely.into_iter().find(|(_, is_given)| *is_given) {
                Some((key, _)) => Err(format!(
                    "{place} {key} is of no use without path_mm: give a path, or remove it"
                )),
                None => Ok(None),
            };
        };
        let Some(feed) = self.feed_mm_per_s else {
            return Err(format!("{place} path_mm is given without feed_mm_per_s: give the feed"));
        };
        let acceleration = self.acceleration_mm_per_s2.unwrap_or(ACCELERATION);
        within(&format!("{place} feed_mm_per_s"), feed, 1e4)?;
        within(&format!("{place} acceleration_mm_per_s2"), acceleration, 1e6)?;
        // A longer way is none of a robot.
        if let Some(wrong) = points.iter().flatten().find(|mm| !(-1e5..=1e5).contains(*mm)) {
            return Err(format!("{place} path_mm is {wrong}: must lie within 1e5"));
        }
        let points = points.iter().map(|point| 1e-3 * Vector3::from(*point)).collect();
        Ok(Some(Path { points, feed: 1e-3 * feed, acceleration: 1e-3 * acceleration }))
    }
}

impl Experiment {
    /// An experiment of the common length at which the robot stands, without a pose.
    pub fn standing(name: &str, spindle_rpm: [f64; 2], feed: Feed) -> Self {
        let (name, pose) = (name.to_owned(), Vec::new());
        let engagement = Engagement::default();
        Self { name, pose, spindle_rpm, feed, duration_s: None, course: None, engagement }
    }

    /// The sampling of this experiment, where that of all is `sampling`.
    pub fn sampling(&self, sampling: &Sampling) -> Sampling {
        let feeding = self.course.as_ref().map(|_| FEEDING_HZ);
        Sampling {
            duration_s: self.duration_s.unwrap_or(sampling.duration_s),
            angle_rate_hz: sampling.angle_rate_hz.or(feeding),
            ..*sampling
        }
    }

    fn place(&self) -> String {
        place(&self.name)
    }

    fn follow(&self, path: &Path, model: &Model) -> Result<Course, String> {
        let bad = |why: String| format!("{} path_mm: {why}", self.place());
        let chain = model.chain().map_err(|error| bad(error.to_string()))?;
        let limits: Vec<_> =
            model.driven().map(|joint| (joint.name.as_str(), joint.limits)).collect();
        let course = Course::new(path, &chain, &self.pose, &limits).map_err(bad)?;
        let drilled = course.headings().position(|heading| heading.xy().norm() < ACROSS);
        match drilled.filter(|_| self.feed == Feed::Path) {
            Some(line) => Err(bad(format!(
                "line {} goes along the axis of the tool, z of the TCP, which feed = \"path\" cannot cut: turn it, or give another feed",
                line + 1
            ))),
            None => Ok(course),
        }
    }

    fn outlasts_path(&self, sampling: &Sampling) -> Result<(), String> {
        let (lasts, ends) =
            (self.sampling(sampling).duration_s, self.course.as_ref().map_or(0.0, Course::ends_s));
        if lasts >= ends {
            return Ok(());
        }
        Err(format!(
            "{} path_mm takes {:.2} s after a rest of {REST_S} s, but the experiment lasts {lasts} s: give it duration_s = {:.0} or more",
            self.place(),
            ends - REST_S,
            ends.ceil()
        ))
    }

    pub(super) fn check(&self, model: &Model) -> Result<(), String> {
        let place = self.place();
        let driven = model.driven().count();
        if self.pose.len() != driven {
            return Err(format!(
                "{place} pose has {}, but the model has {}: one angle a driven joint, base first",
                count(self.pose.len() as u64, "angle"),
                count(driven as u64, "driven joint")
            ));
        }
        for (&angle, joint) in self.pose.iter().zip(model.driven()) {
            let [lower, upper] = joint.limits;
            if !(lower..=upper).contains(&angle) {
                return Err(format!(
                    "{place} pose: {angle} is outside the limits of {}, {lower} to {upper}",
                    joint.name
                ));
            }
        }
        self.spindle_rpm
            .iter()
            .try_for_each(|&rpm| within(&format!("{place} spindle_rpm"), rpm, 1e6))
    }
}

fn place(name: &str) -> String {
    format!("[[experiment]] \"{name}\"")
}
