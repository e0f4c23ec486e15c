//! The bodies that the joints of a chain carry, out of the links of a file, with warnings of what is left out or lumped together.

use std::path::Path;

use flexid_core::chain::{INERTIA_TOLERANCE, inertia_excess};
use flexid_pipeline::model::{Kind, ModelJoint};
use nalgebra::{Isometry3, Matrix3, Unit};

use super::body::Body;
use super::document::{self, Inertial, Joint};
use super::error::{HEAVIEST_KG, UrdfError, shown};
use super::meshes::{self, Part};
use super::pedestal;
use super::shapes::{self, Drawn};
use super::tree::Tree;

/// Collects the bodies that the chain carries, and the warnings.
pub(super) struct Importer<'a> {
    tree: &'a Tree<'a>,
    pub(super) warnings: Vec<String>,
    /// The folder from which the paths of meshes begin. `None` if links without a mass get none by their shapes.
    folder: Option<&'a Path>,
    /// The shapes that stand for links without a mass, each with the name of its link.
    drawn: Vec<(String, Drawn)>,
}

impl<'a> Importer<'a> {
    pub(super) fn new(tree: &'a Tree<'a>, folder: Option<&'a Path>) -> Self {
        Self { tree, warnings: Vec::new(), folder, drawn: Vec::new() }
    }

    /// The body that moves with the joint above `link`, in that link's frame: the links up to the next
    /// movable joint of `chain`, and every side branch.
    pub(super) fn carried(&mut self, chain: &[&Joint], link: &str) -> Result<Part, UrdfError> {
        let mut part = Part::default();
        let body = &mut part.known;
        let first = link;
        let mut impossible = Vec::new();
        let mut open = vec![(link.to_owned(), Isometry3::identity(), None::<String>)];
        while let Some((link, pose, branch)) = open.pop() {
            let (own, moments) = self.body(&link, &pose)?;
            if own.mass > 0.0
                && let Some(branch) = branch.as_ref()
            {
                self.warnings.push(format!(
                    "link '{link}' ({} kg) hangs beside the chain on '{branch}': lumped in rigidly",
                    own.mass
                ));
            }
            if inertia_excess(moments) > INERTIA_TOLERANCE * moments[2] {
                impossible.push((link.clone(), moments));
            }
            body.add(&own);
            if link != first {
                part.beyond_kg += own.mass;
            }
            if own.mass <= 0.0
                && let Some(drawn) = self.drawn(&link)?
            {
                part.drawn.add(&drawn.body.at(&pose));
                self.drawn.push((link.clone(), drawn));
            }
            for joint in self.tree.joints_below(&link) {
                let in_chain = chain.iter().any(|other| other.name == joint.name);
                let moves = movable(joint)?.is_some();
                if in_chain && moves {
                    continue;
                }
                if moves {
                    self.warnings.push(format!(
                        "joint '{}' is not between the root and the TCP: held at 0",
                        joint.name
                    ));
                }
                let branch = branch.clone().or_else(|| (!in_chain).then(|| joint.name.clone()));
                open.push((joint.child.clone(), pose * joint.origin, branch));
            }
        }
        // What matters is the body as a whole: frames of no size are given any inertia.
        let largest = principal_moments(&body.central_inertia())[2];
        for (link, moments) in impossible {
            if inertia_excess(moments) > INERTIA_TOLERANCE * largest {
                return Err(UrdfError::Inertia { link, moments });
            }
            self.warnings.push(format!(
                "the inertia of link '{link}' belongs to no body (principal moments {} kg m²), and is too small to matter: lumped in",
                shown(&moments)
            ));
        }
        Ok(part)
    }

    /// The shapes of a link without a mass, in its own frame.
    fn drawn(&mut self, name: &str) -> Result<Option<Drawn>, UrdfError> {
        let (Some(folder), Some(link)) = (self.folder, self.tree.link(name)) else {
            return Ok(None);
        };
        let mut drawn = shapes::of_link(link, folder)?;
        self.warnings.extend(drawn.iter_mut().flat_map(|own| std::mem::take(&mut own.warnings)));
        Ok(drawn)
    }

    /// Checks that no shape is far larger than an arm of this length, m, and not all are far smaller if every moving link has one.
    pub(super) fn check_sizes(&self, arm: f64, is_all_drawn: bool) -> Result<(), UrdfError> {
        let largest = self.drawn.iter().max_by(|a, b| a.1.size.total_cmp(&b.1.size));
        let fits =
            |size: f64| meshes::fits(size, arm) && (!is_all_drawn || meshes::fits(arm, size));
        match largest {
            Some((link, drawn)) if arm > 0.0 && !fits(drawn.size) => {
                Err(UrdfError::Scale { link: link.clone(), size: drawn.size, arm })
            }
            _ => Ok(()),
        }
    }

    /// The shapes that stand for links, a line each.
    pub(super) fn origins(&self) -> impl Iterator<Item = String> {
        self.drawn.iter().map(|(link, drawn)| {
            format!("link '{link}': {}, {:.3e} m³", drawn.named, drawn.body.mass)
        })
    }

    /// The pedestal of what hangs on the root up to the first movable joint.
    pub(super) fn pedestal(&mut self, standing: &Body, moving_kg: f64) -> ModelJoint {
        if standing.mass > 0.0 {
            return pedestal::joint(standing);
        }
        let body = pedestal::assumed(moving_kg);
        self.warnings.push(format!(
            "no mass before the first movable joint: the pedestal is taken as {:.1} kg, a fifth of what moves; put its own \
             mass_kg and inertia_kg_m2 into the model file",
            body.mass
        ));
        pedestal::joint(&body)
    }

    /// The body of one link alone, and its principal moments, ascending, kg m²; `pose` is the pose of the link in the frame of the result.
    fn body(&mut self, name: &str, pose: &Isometry3<f64>) -> Result<(Body, [f64; 3]), UrdfError> {
        let inertial = self.tree.link(name).and_then(|link| link.inertial.as_ref());
        let Some(&Inertial { mass, ref centre, ref inertia }) = inertial else {
            return Ok(Default::default());
        };
        if !(0.0..=HEAVIEST_KG).contains(&mass) {
            return Err(UrdfError::Mass { link: name.to_owned(), mass });
        }
        if mass == 0.0 {
            if *inertia != Matrix3::zeros() {
                self.warnings.push(format!("link '{name}' has inertia but no mass: ignored"));
            }
            return Ok(Default::default());
        }
        Ok((Body::new(mass, &(pose * centre), inertia), principal_moments(inertia)))
    }

    /// The joint's limits, infinite where the file has none.
    pub(super) fn limits(&mut self, joint: &Joint, kind: Kind) -> [f64; 2] {
        let Joint { name, limits, .. } = joint;
        let is_continuous = joint.kind == CONTINUOUS;
        match *limits {
            Some([lower, upper]) if lower < upper => {
                if is_continuous && (lower.is_finite() || upper.is_finite()) {
                    self.warnings.push(format!(
                        "joint '{name}' is continuous, and its <limit> says {lower} to {upper} rad: taken as its limits"
                    ));
                }
                return [lower, upper];
            }
            // A `<limit>` without lower and upper limits speed and effort.
            None | Some([0.0, 0.0]) if is_continuous => {}
            _ => {
                let unit = if kind == Kind::Prismatic { "m" } else { "rad" };
                let given = match limits {
                    Some([lower, upper]) => format!(" ({lower} to {upper} {unit})"),
                    None => String::new(),
                };
                self.warnings
                    .push(format!("joint '{name}' has no usable limits{given}: left open"));
            }
        }
        [-f64::INFINITY, f64::INFINITY]
    }
}

/// The type of a joint that turns without end.
const CONTINUOUS: &str = "continuous";

/// The kind of a movable joint; `None` for a fixed joint.
pub(super) fn movable(joint: &Joint) -> Result<Option<Kind>, UrdfError> {
    match joint.kind.as_str() {
        document::FIXED => Ok(None),
        "revolute" | CONTINUOUS => Ok(Some(Kind::Revolute)),
        "prismatic" => Ok(Some(Kind::Prismatic)),
        other => Err(UrdfError::JointType { joint: joint.name.clone(), kind: other.to_owned() }),
    }
}

/// The axis of a joint with a drive of its own, of length 1.
pub(super) fn axis(joint: &Joint) -> Result<[f64; 3], UrdfError> {
    if let Some(leader) = &joint.leader {
        return Err(UrdfError::Mimic { joint: joint.name.clone(), leader: leader.clone() });
    }
    match Unit::try_new(joint.axis, 1e-9) {
        Some(axis) => Ok(axis.into_inner().into()),
        None => Err(UrdfError::ZeroAxis(joint.name.clone())),
    }
}

/// Principal moments of an inertia, ascending.
pub(super) fn principal_moments(inertia: &Matrix3<f64>) -> [f64; 3] {
    let mut moments: [f64; 3] = inertia.symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    moments
}
