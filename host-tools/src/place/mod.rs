//! The place of the work: poses to cut in.
//!
//! A cut needs a workpiece, and that stands in front of a robot, not behind or above it. Where the front is, poses tell that are known to be
//! of use, the references. Heights are against gravity, or along the base's z where there is none:
//!
//! | rule    | of each pose                                                                                                        |
//! | ------- | ------------------------------------------------------------------------------------------------------------------- |
//! | turns   | no joint is more than half a turn from the mean of the references: more winds up the hoses, and gives no other pose |
//! | floor   | neither the tool nor a joint is below the base plane, the lowest of the references, or the box                      |
//! | front   | the tool is on the references' side of the base: the mean of their directions from its vertical axis                |
//! | ceiling | the tool is no higher than the shoulder, or than the highest of the references                                      |
//!
//! A box in which the tool is to be stands in for the last two. Without references the front is the base's x, with narrower rules.

mod stance;

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};

use flexid_core::chain::Chain;
use flexid_pipeline::model::{Kind, Model};
use flexid_simulation::scenario::reach;
use nalgebra::{Unit, Vector3};

pub(crate) use stance::tool;

use stance::Stance;

/// Seed of the poses.
const SEED: u32 = 1;
/// Poses of a Sobol sequence of one seed (`sobol_burley`).
const SEQUENCE: usize = 1 << 16;
/// Most poses that are drawn. Chosen: a second of work; a place that fewer than one in a million of them reaches is a point.
const MOST_DRAWN: usize = 16 * SEQUENCE;
/// How many times as many poses are drawn for those nearest to the references. Chosen: in space the nearest sixteenth is within two fifths of
/// the reach.
const TIMES: usize = 16;
/// Largest turn of a joint from its zero, without references. Chosen: what hoses and cables bear without a guide.
const TURN: f64 = FRAC_PI_2;
/// Least distance of the tool in front of the base over the length of the arm, without references. Chosen: nearer, it is above the robot's foot.
const NEAREST: f64 = 0.25;
/// Greatest height of the tool over the length of the arm, without references. Chosen: workpieces lie below the elbow, in the middle of an arm.
const HIGHEST: f64 = 0.5;

/// Lower and upper ends of a box along the axes of the base, m.
pub(crate) type ToolBox = [[f64; 2]; 3];

/// The place of the work.
#[derive(Clone, Debug)]
pub(crate) struct Place<'a> {
    chain: &'a Chain,
    /// Direction against gravity.
    up: Unit<Vector3<f64>>,
    /// Range of each driven joint, rad (m).
    ranges: Vec<[f64; 2]>,
    /// Lowest height of tool and joints, m.
    floor: f64,
    front: Option<Front>,
    /// Greatest height of the tool, m.
    ceiling: f64,
    tool_box: Option<ToolBox>,
    /// Tools of the references, m, where the nearest poses are wanted.
    near: Vec<Vector3<f64>>,
}

/// The side of the base where the workpiece stands.
#[derive(Clone, Copy, Debug)]
struct Front {
    /// Its level direction from the base.
    direction: Unit<Vector3<f64>>,
    /// Least distance of the tool in this direction, m.
    nearest: f64,
    /// Least cosine of the angle between it and the level direction of the tool.
    cosine: f64,
}

/// Poses of a place.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Poses {
    /// Joint angles, base first, rad (m).
    pub(crate) poses: Vec<Vec<f64>>,
    /// The box about all tools that keep the rules, within the box that was asked for or not. Empty where no pose keeps them.
    pub(crate) reached: Option<ToolBox>,
}

impl<'a> Place<'a> {
    /// The place about `references`, at least one, within `tool_box` if there is one, and of the poses nearest to them if that `is_near`.
    /// `gravity` is along the axes of the base.
    pub(crate) fn about(
        model: &Model,
        chain: &'a Chain,
        gravity: [f64; 3],
        references: &[Vec<f64>],
        tool_box: Option<ToolBox>,
        is_near: bool,
    ) -> Self {
        let up = Unit::try_new(-Vector3::from(gravity), 0.0).unwrap_or_else(Vector3::z_axis);
        let stance = |pose: &Vec<f64>| Stance::of(chain, &up, pose);
        let stances: Vec<Stance> = references.iter().map(stance).collect();
        let middle = |joint: usize| {
            references.iter().map(|pose| pose[joint]).sum::<f64>() / references.len() as f64
        };
        let lowest = stances.iter().map(|own| own.lowest).fold(0.0, f64::min);
        let sideways: Vector3<f64> =
            stances.iter().map(|own| own.tool - own.height * up.into_inner()).sum();
        let front = |direction| Front { direction, nearest: 0.0, cosine: 0.0 };
        let highest = stances.iter().map(|own| own.height.max(own.shoulder)).reduce(f64::max);
        Self {
            chain,
            up,
            ranges: ranges(model, middle, PI),
            floor: tool_box.map_or(lowest, |own| lowest.min(bottom(&own, &up))),
            front: Unit::try_new(sideways, 0.0).filter(|_| tool_box.is_none()).map(front),
            ceiling: highest.filter(|_| tool_box.is_none()).unwrap_or(f64::INFINITY),
            tool_box,
            near: if is_near { stances.iter().map(|own| own.tool).collect() } else { Vec::new() },
        }
    }

    /// The place of a robot on the ground of which no pose is known.
    pub(crate) fn in_front(model: &Model, chain: &'a Chain) -> Self {
        let up = Vector3::z_axis();
        let ranges = ranges(model, |_| 0.0, TURN);
        let middle: Vec<f64> = ranges.iter().map(|[lower, upper]| 0.5 * (lower + upper)).collect();
        let arm = Stance::of(chain, &up, &middle).arm;
        let direction = Vector3::x_axis();
        Self {
            chain,
            up,
            ranges,
            floor: 0.0,
            front: Some(Front { direction, nearest: NEAREST * arm, cosine: FRAC_1_SQRT_2 }),
            ceiling: HIGHEST * arm,
            tool_box: None,
            near: Vec::new(),
        }
    }

    /// Ranges of the driven joints, rad (m).
    pub(crate) fn ranges(&self) -> &[[f64; 2]] {
        &self.ranges
    }

    /// Up to `count` poses, spread evenly between the joints' limits.
    pub(crate) fn poses(&self, count: usize) -> Poses {
        let wanted = if self.near.is_empty() { count } else { TIMES * count };
        let (mut poses, mut reached) = (Vec::new(), None);
        for pose in self.drawn() {
            let stance = self.stance(&pose);
            if !self.keeps_rules(&stance) {
                continue;
            }
            widen(&mut reached, &stance.tool);
            if self.has_in_box(&stance.tool) {
                poses.push((self.distance(&stance.tool), pose));
            }
            if poses.len() == wanted {
                break;
            }
        }
        if !self.near.is_empty() {
            poses.sort_by(|(a, _), (b, _)| a.total_cmp(b));
            poses.truncate(count);
        }
        Poses { poses: poses.into_iter().map(|(_, pose)| pose).collect(), reached }
    }

    /// Poses spread evenly between the joints' limits, in the place or not: a Sobol sequence between the ends of the joints' ranges.
    pub(crate) fn drawn(&self) -> impl Iterator<Item = Vec<f64>> {
        (0..MOST_DRAWN).map(|index| {
            let (seed, index) = (SEED + (index / SEQUENCE) as u32, (index % SEQUENCE) as u32);
            let angle = |([lower, upper], dimension): (&[f64; 2], u32)| {
                let part = sobol_burley::sample(index, dimension, seed);
                lower + (upper - lower) * f64::from(part)
            };
            self.ranges.iter().zip(0..).map(angle).collect()
        })
    }

    /// Those of a user's poses whose tool is in the box. The other rules are the user's.
    pub(crate) fn keep(&self, poses: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let has = |pose: &Vec<f64>| self.has_in_box(&self.stance(pose).tool);
        poses.into_iter().filter(has).collect()
    }

    /// Tells whether a pose is in the place.
    pub(crate) fn holds(&self, pose: &[f64]) -> bool {
        let own = |(q, [lower, upper]): (&f64, &[f64; 2])| (lower..=upper).contains(&q);
        let stance = self.stance(pose);
        pose.iter().zip(&self.ranges).all(own)
            && self.keeps_rules(&stance)
            && self.has_in_box(&stance.tool)
    }

    fn stance(&self, pose: &[f64]) -> Stance {
        Stance::of(self.chain, &self.up, pose)
    }

    fn keeps_rules(&self, stance: &Stance) -> bool {
        let level = stance.tool - stance.height * self.up.into_inner();
        let is_in_front = |Front { direction, nearest, cosine }: Front| {
            level.dot(&direction) > nearest.max(cosine * level.norm())
        };
        stance.lowest >= self.floor
            && self.front.is_none_or(is_in_front)
            && stance.height <= self.ceiling
    }

    fn has_in_box(&self, tool: &Vector3<f64>) -> bool {
        self.tool_box.is_none_or(|own| {
            own.iter().zip(tool.iter()).all(|([least, most], at)| (*least..=*most).contains(at))
        })
    }

    /// Distance of a tool from the nearest of the references, m.
    fn distance(&self, tool: &Vector3<f64>) -> f64 {
        self.near.iter().map(|own| (own - tool).norm()).fold(f64::INFINITY, f64::min)
    }
}

/// Ranges of the driven joints: their limits, those of a turning joint no more than `half` from its `middle`.
fn ranges(model: &Model, middle: impl Fn(usize) -> f64, half: f64) -> Vec<[f64; 2]> {
    let range = |(joint, driven)| {
        let limits @ [lower, upper] = reach(driven);
        if driven.kind != Kind::Revolute {
            return limits;
        }
        let middle = middle(joint).clamp(lower, upper);
        [lower.max(middle - half), upper.min(middle + half)]
    };
    model.driven().enumerate().map(range).collect()
}

/// Height of the lowest corner of a box.
fn bottom(own: &ToolBox, up: &Unit<Vector3<f64>>) -> f64 {
    own.iter().zip(up.iter()).map(|([least, most], up)| (least * up).min(most * up)).sum()
}

/// Widens a box so that it holds a place.
fn widen(reached: &mut Option<ToolBox>, at: &Vector3<f64>) {
    let own = reached.get_or_insert([0, 1, 2].map(|axis| [at[axis]; 2]));
    for ([least, most], at) in own.iter_mut().zip(at.iter()) {
        *least = least.min(*at);
        *most = most.max(*at);
    }
}

#[cfg(test)]
mod tests;
