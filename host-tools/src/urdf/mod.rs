//! The import of a URDF file as a serial chain that can be simulated and identified.
//!
//! The chain runs from the root to the TCP link. The import removes fixed joints and lumps what they carry into the
//! link before them. It lumps side branches in as well, and holds their movable joints at 0.

#[cfg(test)]
mod arms;
mod body;
mod document;
mod error;
mod figures;
mod importer;
mod meshes;
mod payload;
mod pedestal;
mod plausibility;
mod shapes;
mod spread;
mod tree;

use std::fmt::Write as _;
use std::path::Path;

use flexid_core::MAX_JOINTS;
use flexid_pipeline::model::{Model, ModelError, ModelJoint, Tcp};
use nalgebra::{Isometry3, Matrix3, Translation3, Vector3};

use body::Body;
use document::Shapes;
pub(crate) use document::{FIXED, Inertial, Joint, Link, Robot};
use error::HEAVIEST_KG;
pub use error::UrdfError;
use figures::{INERTIA_ORDER, tidy};
use importer::{Importer, axis, movable, principal_moments};
use meshes::Part;
use payload::{PAYLOAD_DENSITY, Payload, payload};
pub(crate) use plausibility::{Doubt, limits_in_degrees};
use tree::Tree;

/// A robot imported from a URDF file.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The model, whose chain can be simulated.
    pub model: Model,
    /// Warnings for the engineer, one sentence each.
    pub warnings: Vec<String>,
    /// Sources of the masses that are not the file's, a line each. Empty if all are the file's.
    pub origins: Vec<String>,
}

/// Support of the first driven joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Base {
    /// A ground that does not give way.
    Rigid,
    /// A body that gives way against the ground: base plate, pedestal, frame. It is a fixed joint of the model.
    Pedestal,
}

/// Sources of the masses of links that have none in the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Masses<'a> {
    /// Mass of the robot by its data sheet, kg, and the option of the command line that states it. `None`: a link without a mass is an error.
    pub total: Option<(f64, &'a str)>,
    /// The folder from which the paths of meshes begin. `Some`: the total is that of the robot without its tool, and what is not in the file follows
    /// from meshes, if links have any. `None`: the total includes the tool, and is spread over the length of the arm.
    pub folder: Option<&'a Path>,
    /// Mass of what the flange carries beside the file, kg.
    pub payload_kg: f64,
}

/// Reads the chain from the root to the link `tcp` out of the text of a URDF file. On a pedestal, what the file has before the first
/// movable joint becomes the pedestal's body.
///
/// # Errors
/// The error names the link or the joint, and the correction.
pub fn import(text: &str, tcp: &str, base: Base) -> Result<Imported, UrdfError> {
    import_with_masses(text, tcp, base, &Masses::default())
}

/// [`import`], where links without a mass get one.
///
/// # Errors
/// Those of [`import`]; also if there is no link that needs a mass, if no mass is left, or if a mesh gives no body.
pub fn import_with_masses(
    text: &str,
    tcp: &str,
    base: Base,
    masses: &Masses<'_>,
) -> Result<Imported, UrdfError> {
    let draws = masses.total.is_some() && masses.folder.is_some();
    let robot = Robot::read(text, if draws { Shapes::Used } else { Shapes::Unused })?;
    import_robot(&robot, tcp, base, masses)
}

/// [`import_with_masses`] of a robot that is read.
///
/// # Errors
/// Those of [`import_with_masses`].
pub(crate) fn import_robot(
    robot: &Robot,
    tcp: &str,
    base: Base,
    masses: &Masses<'_>,
) -> Result<Imported, UrdfError> {
    masses.check()?;
    let tree = Tree::new(robot)?;
    let path = tree.path(tcp)?;
    let folder = masses.folder.filter(|_| masses.total.is_some());
    let mut importer = Importer::new(&tree, folder);

    let mut joints: Vec<ModelJoint> = Vec::new();
    let (mut parts, mut links) = (Vec::new(), Vec::new());
    // Pose of the present link in the frame of the last movable joint.
    let mut pose = Isometry3::identity();
    for (index, joint) in path.iter().enumerate() {
        pose *= joint.origin;
        let Some(kind) = movable(joint)? else { continue };
        let (axis, link) = (axis(joint)?, &joint.child);
        let part = importer.carried(&path[index + 1..], link)?;
        let mut own = ModelJoint {
            name: joint.name.clone(),
            kind,
            origin_xyz_m: tidy(pose.translation.vector.into()),
            origin_rpy_rad: tidy(pose.rotation.euler_angles().into()),
            axis,
            limits: importer.limits(joint, kind),
            mass_kg: 0.0,
            centre_of_mass_m: [0.0; 3],
            inertia_kg_m2: [0.0; 6],
        };
        put(&mut own, &part.known);
        parts.push(part);
        links.push(link.clone());
        joints.push(own);
        pose = Isometry3::identity();
    }
    if joints.is_empty() {
        return Err(UrdfError::Rigid(tcp.to_owned()));
    }
    let tcp = Tcp {
        name: tcp.to_owned(),
        xyz_m: tidy(pose.translation.vector.into()),
        rpy_rad: tidy(pose.rotation.euler_angles().into()),
    };
    let root = path.first().map(|joint| joint.parent.clone()).unwrap_or_default();
    let mut standing = match base {
        Base::Rigid if folder.is_none() => Part::default(),
        _ => importer.carried(&path, &root)?,
    };
    let mut model = Model { name: robot.name.clone(), joints, tcp, accuracy: None };
    let of_links = |is_meant: &dyn Fn(usize) -> bool| -> Vec<(String, String)> {
        let meant = (0..links.len()).filter(|index| is_meant(*index));
        meant.map(|index| (links[index].clone(), model.joints[index].name.clone())).collect()
    };
    let massless = of_links(&|index| parts[index].known.mass <= 0.0);
    let bodiless = of_links(&|index| parts[index].known.mass + parts[index].drawn.mass <= 0.0);
    let borrowing = of_links(&|index| {
        let Part { known, drawn, .. } = parts[index];
        known.mass > 0.0 && drawn.mass <= 0.0 && !tree.has_mass(&links[index])
    });
    let arm = spread::Arm::new(&model.joints, &model.tcp);
    let length = arm.as_ref().map_or(0.0, |arm| arm.whole);
    let mut origins = Vec::new();
    match masses.total {
        None if massless.is_empty() => {}
        None => return Err(UrdfError::NoMass(massless)),
        Some((kg, option)) if parts.iter().all(|part| part.drawn.mass <= 0.0) => {
            let beside = if folder.is_some() { meshes::tool(&parts) } else { 0.0 };
            let total = spread::Total { kg, beside, option };
            let accuracy = spread::spread(&mut model.joints, &model.tcp, &total);
            model.accuracy = Some(accuracy.map_err(UrdfError::Spread)?);
            origins.push(format!("{kg} kg ({option}), a sixth of them the base's, spread over links by the length of arm that each joint carries"));
        }
        Some((kg, option)) => {
            if !bodiless.is_empty() {
                return Err(UrdfError::NoShape(bodiless));
            }
            let is_all_drawn = parts.iter().all(|part| part.drawn.mass > 0.0);
            importer.check_sizes(length, is_all_drawn)?;
            let total = meshes::Total { kg, option };
            let shared = meshes::allot(&standing, &parts, arm.as_ref(), &total);
            let (on_base, shares) = shared.map_err(UrdfError::Spread)?;
            standing.fill(on_base);
            let volume: f64 = parts.iter().map(|part| part.drawn.mass).sum();
            let moving: f64 = shares.iter().sum();
            importer.warnings.extend(meshes::doubt(moving / volume));
            importer.warnings.extend(meshes::doubt_of_base(on_base, moving, &root));
            for ((part, joint), mass) in parts.iter_mut().zip(&mut model.joints).zip(shares) {
                part.fill(mass);
                put(joint, &part.known);
            }
            model.accuracy = Some(meshes::accuracy(length));
            origins.push(format!("{kg} kg ({option}), base included, over links in proportion to the root of (volume of the shapes x length of arm that the joint carries)"));
            origins.push(format!("base: {on_base:.1} kg"));
            origins.extend(importer.origins());
        }
    }
    if let (true, Some(part), Some(joint)) =
        (masses.payload_kg > 0.0, parts.last_mut(), model.joints.last_mut())
    {
        part.known = of_joint(joint);
        let (body, form) = payload(masses.payload_kg, model.tcp.xyz_m.into());
        part.known.add(&body);
        put(joint, &part.known);
        if form == Payload::Ball {
            importer.warnings.push(format!(
                "the TCP '{}' lies {:.3} m from joint '{}', nearer than a payload of {} kg is wide, which is taken as a ball there: name the link at the \
                 tool's tip by --tcp",
                model.tcp.name,
                Vector3::from(model.tcp.xyz_m).norm(),
                joint.name,
                masses.payload_kg
            ));
        }
        origins.push(format!(
            "{} kg (--payload) on the last link: a {} of {PAYLOAD_DENSITY} kg/m³",
            masses.payload_kg,
            form.named()
        ));
    }
    let refused = |error: ModelError, model: &Model, links: &[String]| match error {
        ModelError::JointCount(count) => {
            UrdfError::TooManyJoints { count, tcp: model.tcp.name.clone() }
        }
        ModelError::Inertia(name) => {
            let at = model.joints.iter().position(|joint| joint.name == name).unwrap_or_default();
            let inertia = of_joint(&model.joints[at]).central_inertia();
            UrdfError::Inertia { link: links[at].clone(), moments: principal_moments(&inertia) }
        }
        other => UrdfError::Model(other),
    };
    model.chain().map_err(|error| refused(error, &model, &links))?;
    if base == Base::Pedestal {
        let count = model.joints.len();
        if count == MAX_JOINTS {
            return Err(UrdfError::NoRoomForPedestal(count));
        }
        if model.joints.iter().any(|joint| joint.name == pedestal::NAME) {
            return Err(UrdfError::DuplicateJoint(pedestal::NAME.to_owned()));
        }
        let moving_kg = model.joints.iter().map(|joint| joint.mass_kg).sum();
        let pedestal = importer.pedestal(&standing.known, moving_kg);
        model.joints.insert(0, pedestal);
        links.insert(0, root);
        model.chain().map_err(|error| refused(error, &model, &links))?;
    }
    let mut warnings = importer.warnings;
    if let Some((_, option)) = masses.total {
        warnings.extend(borrowing.iter().map(|(link, joint)| {
            let mass = model.joints.iter().find(|own| own.name == *joint).map_or(0.0, |own| own.mass_kg);
            format!(
                "link '{link}' has no mass of its own, and gets none of {option}: it moves with the {mass:.1} kg of what is fixed to it alone"
            )
        }));
    }
    warnings.extend(doubts(&model).iter().map(Doubt::to_string));
    // Names may hold line breaks.
    let [warnings, origins] =
        [warnings, origins].map(|all| all.iter().map(|own| one_line(own)).collect());
    Ok(Imported { model, warnings, origins })
}

impl Imported {
    /// Returns the text of the model's file, with a heading that says where masses come from that are not the file's.
    ///
    /// # Errors
    /// An imported model gives no error.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        let mut text = String::new();
        if !self.origins.is_empty() {
            text += match self.model.accuracy {
                Some(_) => "# Masses, centres of mass and inertias are guessed:\n",
                None => "# Beside the masses of the file:\n",
            };
            for origin in &self.origins {
                let _ = writeln!(text, "# - {origin}");
            }
            if self.model.accuracy.is_some() {
                text += "# [accuracy] below says how far they may be off, one standard deviation. It holds unless the configuration's own [accuracy] states the same.\n";
            }
            text += "\n";
        }
        Ok(text + &self.model.to_toml()?)
    }
}

impl Masses<'_> {
    fn check(&self) -> Result<(), UrdfError> {
        let refuse = |option: &str, kg: f64, least: &str| {
            Err(UrdfError::Spread(format!(
                "{option} {kg}: must be {least} and at most {HEAVIEST_KG:e}, in kg"
            )))
        };
        match (self.total, self.payload_kg) {
            (Some((kg, option)), _) if !(kg > 0.0 && kg <= HEAVIEST_KG) => {
                refuse(option, kg, "positive")
            }
            (_, kg) if !(0.0..=HEAVIEST_KG).contains(&kg) => {
                refuse("--payload", kg, "no less than 0")
            }
            _ => Ok(()),
        }
    }
}

impl Part {
    /// Gives what is drawn a mass, so that it is known.
    fn fill(&mut self, mass: f64) {
        if self.drawn.mass > 0.0 {
            self.known.add(&self.drawn.scaled(mass / self.drawn.mass));
            self.drawn = Body::default();
        }
    }
}

/// Writes a body into its joint.
fn put(joint: &mut ModelJoint, body: &Body) {
    let inertia = body.central_inertia();
    joint.mass_kg = tidy([body.mass])[0];
    joint.centre_of_mass_m = tidy(body.centre_of_mass().into());
    joint.inertia_kg_m2 = tidy(INERTIA_ORDER.map(|at| inertia[at]));
}

/// The body that a joint carries.
fn of_joint(joint: &ModelJoint) -> Body {
    let mut inertia = Matrix3::zeros();
    for ((row, column), own) in INERTIA_ORDER.into_iter().zip(joint.inertia_kg_m2) {
        (inertia[(row, column)], inertia[(column, row)]) = (own, own);
    }
    Body::new(joint.mass_kg, &Translation3::from(joint.centre_of_mass_m).into(), &inertia)
}

/// Why the text of a URDF file cannot be imported without a TCP: the links to choose from, or what is wrong with the file.
pub(crate) fn without_tcp(text: &str) -> UrdfError {
    let links = || {
        let robot = Robot::read(text, Shapes::Unused)?;
        let tree = Tree::new(&robot)?;
        Ok(UrdfError::NoTcp { ends: tree.ends(), links: tree.names() })
    };
    links().unwrap_or_else(|fault| fault)
}

/// Signs that a checked model is not that of the robot. The pedestal is left out.
pub(crate) fn doubts(model: &Model) -> Vec<Doubt> {
    let moving = Model { joints: model.driven().cloned().collect(), ..model.clone() };
    moving.chain().map_or_else(|_| Vec::new(), |chain| plausibility::doubts(&chain, &moving))
}

/// The doubts about a checked model, but for what is right for some robots: one sentence each.
pub(crate) fn warnings(model: &Model) -> Vec<String> {
    let doubts = doubts(model).into_iter().filter(|doubt| !doubt.is_choice);
    doubts.map(|doubt| doubt.to_string()).collect()
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests;
