//! The place of the work: which poses a plan chooses from.
//!
//! A cut needs a workpiece, and that stands in front of a robot, not behind or above it. Where the front is, poses tell that are known to be
//! of use, the references:
//!
//! | rule    | of each pose                                                                                                        |
//! | ------- | ------------------------------------------------------------------------------------------------------------------- |
//! | turns   | no joint is more than half a turn from the mean of the references: more winds up the hoses, and gives no other pose |
//! | floor   | neither the tool nor a joint is below the base plane, or below the lowest of the references                         |
//! | front   | the tool is on the references' side of the base: the mean of their directions from its vertical axis                |
//! | ceiling | the tool is no higher than the shoulder, or than the highest of the references                                      |
//!
//! A box in which the tool is to be stands in for the last two.

use std::f64::consts::FRAC_1_SQRT_2;

use flexid_core::chain::{Chain, JointKind};
use flexid_pipeline::model::{Kind, Model};
use flexid_simulation::scenario::reach;
use nalgebra::{Isometry3, Vector2, Vector3};

/// Seed of the poses.
const SEED: u32 = 1;
/// Poses of a Sobol sequence of one seed (`sobol_burley`).
const SEQUENCE: usize = 1 << 16;
/// Most poses that are drawn. Chosen: a second of work; a place that fewer than one in a million of them reaches is a point.
const MOST_DRAWN: usize = 16 * SEQUENCE;
/// How many times as many poses are drawn for those nearest to the references. Chosen: in space the nearest sixteenth is within two fifths of
/// the reach.
const TIMES: usize = 16;

/// Lower and upper ends of a box along the axes of the base, m.
pub type ToolBox = [[f64; 2]; 3];

/// The place of the work.
#[derive(Clone, Debug)]
pub struct Place<'a> {
    chain: &'a Chain,
    /// Range of each driven joint, rad (m).
    ranges: Vec<[f64; 2]>,
    /// Lowest place of tool and joints along the vertical axis of the base, m.
    floor: f64,
    /// Horizontal direction of the front.
    front: Option<Vector2<f64>>,
    /// Highest place of the tool, m.
    ceiling: f64,
    tool_box: Option<ToolBox>,
    /// Tools of the references, m, where the nearest poses are wanted.
    near: Vec<Vector3<f64>>,
}

/// Places of a pose along the axes of the base, m.
struct Stance {
    tool: Vector3<f64>,
    /// Height of the lowest joint.
    lowest_joint: f64,
    /// Height of the shoulder: the first joint that turns about an axis more level than upright, and so lifts the arm. The first without one.
    shoulder: f64,
}

/// Poses of a place.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    /// Joint angles, base first, rad (m).
    pub poses: Vec<Vec<f64>>,
    /// The box about all tools that keep the rules, within the box that was asked for or not. Empty where no pose keeps them.
    pub reached: Option<ToolBox>,
}

impl<'a> Place<'a> {
    /// The place about `references`, at least one, within `tool_box` if there is one, and of the poses nearest to them if that `is_near`.
    pub fn new(
        model: &Model,
        chain: &'a Chain,
        references: &[Vec<f64>],
        tool_box: Option<ToolBox>,
        is_near: bool,
    ) -> Self {
        let stances: Vec<Stance> = references.iter().map(|pose| Stance::of(chain, pose)).collect();
        let range = |(joint, driven): (usize, _)| {
            let limits @ [lower, upper] = reach(driven);
            if driven.kind != Kind::Revolute {
                return limits;
            }
            let sum: f64 = references.iter().map(|pose| pose[joint]).sum();
            let middle = (sum / references.len() as f64).clamp(lower, upper);
            let half = std::f64::consts::PI;
            [lower.max(middle - half), upper.min(middle + half)]
        };
        let ranges = model.driven().enumerate().map(range).collect();
        let sideways: Vector2<f64> = stances.iter().map(|own| own.tool.xy()).sum();
        let highest = stances.iter().map(|own| own.tool.z.max(own.shoulder)).reduce(f64::max);
        Self {
            chain,
            ranges,
            floor: stances.iter().map(Stance::lowest).fold(0.0, f64::min),
            front: sideways.try_normalize(0.0).filter(|_| tool_box.is_none()),
            ceiling: highest.filter(|_| tool_box.is_none()).unwrap_or(f64::INFINITY),
            tool_box,
            near: if is_near { stances.iter().map(|own| own.tool).collect() } else { Vec::new() },
        }
    }

    /// Up to `count` poses, spread evenly between the joints' limits.
    pub fn poses(&self, count: usize) -> Spread {
        let wanted = if self.near.is_empty() { count } else { TIMES * count };
        let (mut poses, mut reached) = (Vec::new(), None);
        for index in 0..MOST_DRAWN {
            let pose = self.draw(index);
            let stance = Stance::of(self.chain, &pose);
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
        Spread { poses: poses.into_iter().map(|(_, pose)| pose).collect(), reached }
    }

    /// Those of a user's poses whose tool is in the box. The other rules are the user's.
    pub fn keep(&self, poses: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let has = |pose: &Vec<f64>| self.has_in_box(&tool(self.chain, pose));
        poses.into_iter().filter(has).collect()
    }

    /// A point of a Sobol sequence between the ends of the joints' ranges.
    fn draw(&self, index: usize) -> Vec<f64> {
        let (seed, index) = (SEED + (index / SEQUENCE) as u32, (index % SEQUENCE) as u32);
        let angle = |([lower, upper], dimension): (&[f64; 2], u32)| {
            let part = sobol_burley::sample(index, dimension, seed);
            lower + (upper - lower) * f64::from(part)
        };
        self.ranges.iter().zip(0..).map(angle).collect()
    }

    fn keeps_rules(&self, stance: &Stance) -> bool {
        stance.lowest() >= self.floor
            && self.front.is_none_or(|front| stance.tool.xy().dot(&front) > 0.0)
            && stance.tool.z <= self.ceiling
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

impl Stance {
    fn of(chain: &Chain, pose: &[f64]) -> Self {
        let mut tip = Isometry3::identity();
        let (mut heights, mut shoulder) = (Vec::new(), None);
        for (joint, angle) in chain.joints().iter().zip(chain.angles(pose)) {
            tip *= joint.frame(angle);
            let height = tip.translation.z;
            heights.push(height);
            let axis = tip.rotation * joint.axis.into_inner();
            if joint.kind == JointKind::Revolute && axis.z.abs() < FRAC_1_SQRT_2 {
                shoulder = shoulder.or(Some(height));
            }
        }
        Self {
            tool: (tip * chain.tcp()).translation.vector,
            lowest_joint: heights.iter().copied().fold(f64::INFINITY, f64::min),
            shoulder: shoulder.or(heights.first().copied()).unwrap_or_default(),
        }
    }

    fn lowest(&self) -> f64 {
        self.lowest_joint.min(self.tool.z)
    }
}

/// Place of the tool along the axes of the base, m.
pub fn tool(chain: &Chain, pose: &[f64]) -> Vector3<f64> {
    Stance::of(chain, pose).tool
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
mod tests {
    use std::f64::consts::PI;
    use std::path::Path;

    use flexid_pipeline::config::Config;
    use flexid_simulation::scenario::Scenario;

    use super::*;

    /// A robot of the scenarios, and the poses of its experiments.
    fn robot(name: &str) -> (Model, Chain, Vec<Vec<f64>>) {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenario");
        let config = Config::load(&folder.join(format!("{name}-edge.toml"))).unwrap();
        let scenario = Scenario::of(&config).unwrap();
        let poses = scenario.experiments.iter().map(|own| own.pose.clone()).collect();
        let chain = config.model.chain().unwrap();
        (config.model, chain, poses)
    }

    #[test]
    fn poses_are_in_front_above_the_floor_and_below_the_ceiling() {
        for name in ["mill3", "mill6"] {
            let (model, chain, references) = robot(name);
            let place = Place::new(&model, &chain, &references[..1], None, false);
            let Spread { poses, .. } = place.poses(200);
            assert_eq!(poses.len(), 200);
            let nowhere =
                Place { floor: -9.0, ceiling: 9.0, front: None, ..place.clone() }.poses(200).poses;
            // The references mill along x, and the shoulders of both robots are below 1.2 m.
            let highest = tool(&chain, &references[0]).z.max(1.2);
            let behind = |pose: &Vec<f64>| tool(&chain, pose).x < -0.3;
            let above = |pose: &Vec<f64>| tool(&chain, pose).z > highest;
            let below = |pose: &Vec<f64>| Stance::of(&chain, pose).lowest() < place.floor;
            type Wrong<'a> = &'a dyn Fn(&Vec<f64>) -> bool;
            let cases: [(&str, Wrong<'_>); 3] =
                [("behind", &behind), ("above", &above), ("below", &below)];
            for (place_of, wrong) in cases {
                assert_eq!(poses.iter().filter(|own| wrong(own)).count(), 0, "{name} {place_of}");
                let others = nowhere.iter().filter(|own| wrong(own)).count();
                assert!(others > 10, "{name}: {others} {place_of}");
            }
        }
    }

    /// A pose that is reached with a whole turn less has its hoses not wound up.
    #[test]
    fn no_joint_is_more_than_half_a_turn_from_the_references() {
        let (model, chain, references) = robot("mill6");
        let place = Place::new(&model, &chain, &references[..1], None, false);
        assert!(model.driven().any(|joint| joint.limits[1] - joint.limits[0] > 3.0 * PI));
        for pose in place.poses(100).poses {
            for (angle, reference) in pose.iter().zip(&references[0]) {
                assert!((angle - reference).abs() <= PI, "{pose:?}");
            }
        }
    }

    #[test]
    fn a_box_holds_all_tools_and_one_beyond_reach_none() {
        let (model, chain, references) = robot("mill6");
        let tool_box = [[0.5, 0.9], [-0.3, 0.3], [0.2, 0.6]];
        let place = Place::new(&model, &chain, &references, Some(tool_box), false);
        let Spread { poses, .. } = place.poses(20);
        assert_eq!(poses.len(), 20);
        let kept = place.keep(poses.iter().chain(&references).cloned().collect());
        assert!(kept.len() >= 20 && kept[..20] == poses, "{}", kept.len());
        for pose in &poses {
            let at = tool(&chain, pose);
            for ([least, most], at) in tool_box.iter().zip(at.iter()) {
                assert!((*least..=*most).contains(at), "{at}");
            }
        }
        let far = Some([[9.0, 10.0], [-0.3, 0.3], [0.2, 0.6]]);
        let Spread { poses, reached } =
            Place::new(&model, &chain, &references, far, false).poses(4);
        let [[_, most], ..] = reached.unwrap();
        assert!(poses.is_empty() && (0.5..9.0).contains(&most), "{most}");
    }

    #[test]
    fn the_nearest_are_nearer_than_the_others() {
        let (model, chain, references) = robot("mill6");
        let of = |is_near| {
            let place = Place::new(&model, &chain, &references[..1], None, is_near);
            let there = tool(&chain, &references[0]);
            let mut far: Vec<f64> = place
                .poses(64)
                .poses
                .iter()
                .map(|pose| (tool(&chain, pose) - there).norm())
                .collect();
            far.sort_by(f64::total_cmp);
            far
        };
        let (near, all) = (of(true), of(false));
        assert!(near.len() == 64 && near[63] < 0.7 * all[32], "{} {}", near[63], all[32]);
    }

    /// A robot that has milled higher than its shoulder, and below its base, may do so again.
    #[test]
    fn the_references_widen_floor_and_ceiling() {
        let (model, chain, references) = robot("mill6");
        let of = |references: &[Vec<f64>]| Place::new(&model, &chain, references, None, false);
        let stances: Vec<_> = references.iter().map(|pose| Stance::of(&chain, pose)).collect();
        let highest = stances.iter().map(|own| own.tool.z).fold(0.0, f64::max);
        let shoulder = stances[0].shoulder;
        assert!(highest > shoulder, "{highest} {shoulder}");
        assert_eq!(of(&references).ceiling, highest);
        let own = of(&references[..1]);
        assert_eq!(own.ceiling, shoulder.max(stances[0].tool.z));
        assert_eq!(own.floor, stances[0].lowest().min(0.0));
        let tool_box = [[0.0, 1.0]; 3];
        let boxed = Place::new(&model, &chain, &references, Some(tool_box), false);
        assert!(boxed.front.is_none() && boxed.ceiling == f64::INFINITY);
    }
}
