//! The course of the joints while the tool mills along a path.
//!
//! The path is a row of straight lines. The joint angles q are a function of the distance s along a line: inverse kinematics gives q and
//! q′ = dq/ds at knots, and cubics go through them. The time law gives s(t), so that
//!
//! ```text
//! q̇ = q′ ṡ          q̈ = q″ ṡ² + q′ s̈
//! ```
//!
//! are the exact derivatives of q(t). The robot rests, feeds, and stays where the path ends.
//!
//! | module      | holds                                                   |
//! | ----------- | ------------------------------------------------------- |
//! | `law`       | distance along a line over time                         |
//! | `reach`     | joint angles at a place of the tool                     |
//! | [`guide`]   | the motion of the joint frames, for the equation of motion |

pub mod guide;
mod law;
mod reach;
#[cfg(test)]
mod tests;

use flexid_core::MAX_JOINTS;
use flexid_core::chain::Chain;
use nalgebra::{Isometry3, Translation3, Vector3};

use law::Law;
use reach::Reach;

/// Rest before the feed, s. Chosen: a record begins up to a second before its cut, and takes the noise of the sensors from there.
pub const REST_S: f64 = 1.0;
/// Largest distance between knots, m. Chosen: cubics through tangents miss an arm of a metre by 1e-15 rad, and the jumps of their second
/// derivatives shake it by 1e-9 m/s² at 0.1 m/s.
const KNOTS_M: f64 = 1e-3;
/// Largest turn of a joint from knot to knot, rad (m). Chosen: a joint that turns by more than 20 rad over a metre of path is next to a
/// singular pose, where robots stop.
const MOST_TURN: f64 = 0.02;

/// A path of the tool as it is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// Corners, relative to the TCP at the start, along the axes of the base, m. The tool stops at each.
    pub points: Vec<Vector3<f64>>,
    /// Feed along the path, m/s.
    pub feed: f64,
    /// Largest acceleration along the path, m/s².
    pub acceleration: f64,
}

/// Joint angles over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    lines: Vec<Line>,
    /// Time at which the last line ends, s.
    ends_s: f64,
}

/// A straight line of the tool.
#[derive(Clone, Debug, PartialEq)]
struct Line {
    /// Direction of the feed along the axes of the TCP where the line begins.
    heading: Vector3<f64>,
    start_s: f64,
    law: Law,
    /// Distance between knots, m.
    spacing: f64,
    knots: Vec<Knot>,
}

/// Angles, rad (m), and their slopes over the distance, 1/m, of the driven joints, base first.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Knot {
    angles: Angles,
    slopes: Angles,
}

/// One number per driven joint, base first; 0 beyond.
type Angles = [f64; MAX_JOINTS];

/// Angle, rate and acceleration of each driven joint, base first; 0 beyond: rad (m), rad/s and rad/s².
pub type Motion = [[f64; 3]; MAX_JOINTS];

impl Course {
    /// The course of a robot that follows `path` from `pose`. `limits` are those of the driven joints, with their names. A robot of six driven
    /// joints or more keeps the tool's orientation.
    ///
    /// # Errors
    /// The path cannot be followed. The error names the point, and what is wrong on the way to it.
    pub fn new(
        path: &Path,
        chain: &Chain,
        pose: &[f64],
        limits: &[(&str, [f64; 2])],
    ) -> Result<Self, String> {
        let mut follower = Follower {
            chain,
            reach: Reach::new(chain),
            start: chain.tool(pose),
            limits,
            angles: pose.to_vec(),
        };
        let (mut lines, mut ends_s, mut from) = (Vec::new(), REST_S, Vector3::zeros());
        for (point, to) in path.points.iter().enumerate() {
            // A first point at the start is no line.
            if *to == from {
                continue;
            }
            let law = Law::new((to - from).norm(), path.feed, path.acceleration);
            let line = follower.line(&from, to, ends_s, law);
            let of = path.points.len();
            lines.push(line.map_err(|why| format!("point {} of {of}: {why}", point + 1))?);
            ends_s += law.lasts_s();
            from = *to;
        }
        if lines.is_empty() {
            return Err("moves nowhere: give a point apart from the start".into());
        }
        Ok(Self { lines, ends_s })
    }

    /// Time at which the tool is at the end of the path, s.
    pub fn ends_s(&self) -> f64 {
        self.ends_s
    }

    /// Times at which the tool enters and leaves the work, s: while the feed is up to speed, from the end of the first ramp to the beginning of the
    /// last one.
    pub fn cut_s(&self) -> [f64; 2] {
        let ramp = |line: Option<&Line>| line.map_or(0.0, |line| line.law.ramp_s());
        [REST_S + ramp(self.lines.first()), self.ends_s - ramp(self.lines.last())]
    }

    /// Joint angles after `time` seconds, with their rates and accelerations.
    pub fn at(&self, time: f64) -> Motion {
        self.line(time).map_or_else(Motion::default, |line| line.at(time - line.start_s))
    }

    /// Way of the tool along the path after `time` seconds, m.
    pub fn distance(&self, time: f64) -> f64 {
        self.lines.iter().map(|line| line.law.at(time - line.start_s)[0]).sum()
    }

    /// Length of the path, m.
    pub fn length(&self) -> f64 {
        self.distance(self.ends_s)
    }

    /// Unit vector of the feed after `time` seconds, along the axes of the TCP where its line begins.
    pub fn heading(&self, time: f64) -> Vector3<f64> {
        self.line(time).map_or_else(Vector3::zeros, |line| line.heading)
    }

    /// The headings of all lines, in their order.
    pub fn headings(&self) -> impl Iterator<Item = Vector3<f64>> {
        self.lines.iter().map(|line| line.heading)
    }

    /// The line at `time`: the first one before it begins, where its law stands still.
    fn line(&self, time: f64) -> Option<&Line> {
        let line = self.lines.iter().rev().find(|line| line.start_s <= time);
        line.or(self.lines.first())
    }
}

/// A robot that follows a path, and where it has got to.
struct Follower<'a> {
    chain: &'a Chain,
    reach: Reach<'a>,
    /// Pose of the tool at the start of the path, in the base.
    start: Isometry3<f64>,
    limits: &'a [(&'a str, [f64; 2])],
    angles: Vec<f64>,
}

impl Follower<'_> {
    /// The line between two places of the tool. The error states how far the robot gets.
    fn line(
        &mut self,
        from: &Vector3<f64>,
        to: &Vector3<f64>,
        start_s: f64,
        law: Law,
    ) -> Result<Line, String> {
        let length = (to - from).norm();
        let along = (to - from) / length;
        let heading = self.chain.tool(&self.angles).rotation.inverse() * along;
        let count = (length / KNOTS_M).ceil();
        let spacing = length / count;
        let knot = |knot: usize| {
            let done = knot as f64 * spacing;
            let place = Translation3::from(from + done * along);
            let knot = self.knot(&place, &along, if knot == 0 { 0.0 } else { spacing });
            knot.map_err(|why| format!("after {:.0} mm of the way to it {why}", 1e3 * done))
        };
        let knots = (0..=count as usize).map(knot).collect::<Result<_, _>>()?;
        Ok(Line { heading, start_s, law, spacing, knots })
    }

    /// The knot at a place of the tool, `distance` m from the last one `along` the line.
    fn knot(
        &mut self,
        place: &Translation3<f64>,
        along: &Vector3<f64>,
        distance: f64,
    ) -> Result<Knot, String> {
        let Self { reach, start, limits, angles, .. } = self;
        let unreached = || {
            "the tool is out of reach, or the robot next to a singular pose: start the path elsewhere"
                .to_owned()
        };
        let guess = reach.ahead(angles, along, distance).ok_or_else(unreached)?;
        let found = reach.angles(&(*place * *start), guess).ok_or_else(unreached)?;
        let slopes = reach.slopes(&found, along).ok_or_else(unreached)?;
        if found.iter().zip(angles.iter()).any(|(new, old)| (new - old).abs() > MOST_TURN) {
            return Err(unreached());
        }
        let limited = found.iter().zip(*limits);
        for (angle, (name, [lower, upper])) in limited {
            if !(*lower..=*upper).contains(angle) {
                return Err(format!(
                    "{name} leaves its limits, {lower} to {upper}: start the path elsewhere"
                ));
            }
        }
        let knot = Knot { angles: padded(&found), slopes: padded(&slopes) };
        *angles = found;
        Ok(knot)
    }
}

impl Line {
    fn at(&self, time: f64) -> Motion {
        let [s, speed, acceleration] = self.law.at(time);
        let last = self.knots.len() - 2;
        let first = ((s / self.spacing) as usize).min(last);
        let (h, x) = (self.spacing, s / self.spacing - first as f64);
        let [from, to] = [&self.knots[first], &self.knots[first + 1]];
        std::array::from_fn(|joint| {
            // Hermite's cubic, from the angle a with the slopes b and c at the ends, as a + h (b x + (3d − 2b − c) x² + (b + c − 2d) x³) with the mean slope d.
            let (a, b, c) = (from.angles[joint], from.slopes[joint], to.slopes[joint]);
            let d = (to.angles[joint] - a) / h;
            let (second, third) = (3.0 * d - 2.0 * b - c, b + c - 2.0 * d);
            let slope = b + x * (2.0 * second + 3.0 * x * third);
            let bend = (2.0 * second + 6.0 * x * third) / h;
            [
                a + h * x * (b + x * (second + x * third)),
                slope * speed,
                bend * speed * speed + slope * acceleration,
            ]
        })
    }
}

fn padded(angles: &[f64]) -> Angles {
    std::array::from_fn(|joint| angles.get(joint).copied().unwrap_or(0.0))
}
