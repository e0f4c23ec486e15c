//! The checked model of a robot. `flexid model import` writes its file, and everything else reads it.

use std::path::Path;

use flexid_core::MAX_JOINTS;
use flexid_core::chain::{Chain, ChainError, Joint, JointKind, Link};
use nalgebra::{Isometry3, Matrix3, Translation3, Unit, UnitQuaternion, Vector3};
use serde::{Deserialize, Deserializer, Serialize};

use crate::input::{self, BadInput};

/// Heaviest link that is accepted, kg.
const HEAVIEST_KG: f64 = 1e6;

const HEADER: &str = "\
# A robot as flexid sees it: a chain of joints from the base to the tool centre point (TCP).
# SI units: m, kg, kg m^2; angles in rad. origin_* is the pose of the joint's frame at angle (or stroke) 0
# in the frame of the joint before, or of the base; rpy turns about the fixed axes x, then y, then z.
# inertia_kg_m2 = [ixx, iyy, izz, ixy, ixz, iyz], about the centre of mass, along the joint frame's axes.
# The tcp stands in the last joint's frame.
# A joint of kind \"fixed\" gives way like any other, but has no drive: no axis, no limits, no angle. A pedestal is one.

";

/// A serial robot, as in its file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// Name of the robot.
    pub name: String,
    /// Joints with the links that they carry, base first.
    #[serde(rename = "joint")]
    pub joints: Vec<ModelJoint>,
    /// Tool centre point, where the tool cuts. The sensors sit there unless `[mounting]` in `EDGE.toml` places them elsewhere.
    pub tcp: Tcp,
    /// How far the bodies of the links may be off, where the import guessed them: in place of what is typical, unless `[accuracy]` in
    /// `EDGE.toml` states it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<MassAccuracy>,
}

/// How far the bodies of the links may be off, one standard deviation each.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MassAccuracy {
    /// Mass of each link, relative, at most 0.5.
    pub link_mass: f64,
    /// Its moments of inertia beside its mass, as a logarithm, at most 1.
    pub link_inertia: f64,
    /// Its centre of mass along each axis, m, at most 0.5.
    pub centre_of_mass_m: f64,
}

/// One joint and its link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelJoint {
    /// Name of the joint, as in the URDF.
    pub name: String,
    /// Motion of the drive.
    pub kind: Kind,
    /// Origin of the joint frame in the frame of the joint before, m.
    pub origin_xyz_m: [f64; 3],
    /// Orientation of the joint frame in the frame of the joint before: turns about the fixed axes x, then y, then z, rad.
    pub origin_rpy_rad: [f64; 3],
    /// Axis of the drive in the joint frame, of any length but zero. Zero, and left out of the file, for a fixed joint.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub axis: [f64; 3],
    /// Lower and upper limit of the angle (rad) or stroke (m). Infinite where there is no limit. Zero, and left out of the file, for a
    /// fixed joint.
    #[serde(default, skip_serializing_if = "is_zero", deserialize_with = "limits")]
    pub limits: [f64; 2],
    /// Mass of the link, kg.
    pub mass_kg: f64,
    /// Centre of mass of the link, in the joint frame, m.
    pub centre_of_mass_m: [f64; 3],
    /// Inertia of the link, `[ixx, iyy, izz, ixy, ixz, iyz]`, about the centre of mass, along the joint frame's axes, kg m².
    pub inertia_kg_m2: [f64; 6],
}

/// Motion of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// The drive turns about the axis.
    Revolute,
    /// The drive slides along the axis.
    Prismatic,
    /// There is no drive.
    Fixed,
}

/// The tool centre point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tcp {
    /// Name of the link from which the TCP was taken.
    pub name: String,
    /// Position in the last joint's frame, m.
    pub xyz_m: [f64; 3],
    /// Orientation in the last joint's frame: turns about the fixed axes x, then y, then z, rad.
    pub rpy_rad: [f64; 3],
}

/// Why a model cannot be used. The error names the joint that is wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// The model has too few or too many joints.
    #[error("has {0} joints: flexid identifies 1 to {MAX_JOINTS}")]
    JointCount(usize),
    /// A number is NaN or infinite.
    #[error("{place}: {key} has a number that is not finite")]
    NotFinite {
        /// Place of the number: `joint "joint_1"` or `tcp`.
        place: String,
        /// Key in the file.
        key: &'static str,
    },
    /// No joint has a drive.
    #[error("has fixed joints alone: the robot's joints are \"revolute\" or \"prismatic\"")]
    NoDrive,
    /// A fixed joint has what describes a drive.
    #[error(
        "joint {joint:?}: {key} is that of a drive, and a fixed joint has none: remove {key}, or change kind"
    )]
    Fixed {
        /// Name of the joint.
        joint: String,
        /// Key in the file.
        key: &'static str,
    },
    /// An axis has no direction.
    #[error("joint {0:?}: axis is [0, 0, 0]: must have a direction")]
    Axis(String),
    /// The lower limit is not below the upper limit.
    #[error("joint {joint:?}: limits are [{}, {}]: the lower must be below the upper", limits[0], limits[1])]
    Limits {
        /// Name of the joint.
        joint: String,
        /// Limits as given, rad (m).
        limits: [f64; 2],
    },
    /// A link has no mass, or is heavier than any robot.
    #[error("joint {joint:?}: mass_kg is {mass_kg}: must be positive, and at most 1e6")]
    Mass {
        /// Name of the joint.
        joint: String,
        /// Mass as given, kg.
        mass_kg: f64,
    },
    /// No body has this inertia.
    #[error(
        "joint {0:?}: no body has this inertia_kg_m2: the principal moments must be positive, \
         none above the sum of the two others"
    )]
    Inertia(String),
    /// Two joints have the same name.
    #[error("joint {0:?}: the name is there twice")]
    Twice(String),
    /// An accuracy is negative, or too large for a fit.
    #[error("[accuracy] {key} is {value}: must be 0 to {most}, one standard deviation")]
    Accuracy {
        /// Key in the file.
        key: &'static str,
        /// Value as given.
        value: f64,
        /// Largest value.
        most: f64,
    },
}

impl Model {
    /// Reads a model file and checks it.
    ///
    /// # Errors
    /// The error is one line that names the file, the line or the joint, and the correction.
    pub fn load(file: &Path) -> Result<Self, BadInput> {
        Self::parse(file, &input::read_regular(file)?)
    }

    /// Parses `text`, the content of the model file `file`, and checks it.
    ///
    /// # Errors
    /// The errors are those of [`Model::load`].
    pub fn parse(file: &Path, text: &str) -> Result<Self, BadInput> {
        let model: Self = input::parse_toml(file, text)?;
        model.chain().map_err(|error| BadInput::new(file, error))?;
        Ok(model)
    }

    /// Returns the text of the model's file. Its heading explains the units.
    ///
    /// # Errors
    /// A model that [`Model::chain`] accepts gives no error.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        Ok(HEADER.to_string() + &toml::to_string(self)?)
    }

    /// Returns the driven joints, base first. A pose has one angle (or stroke) for each.
    pub fn driven(&self) -> impl Iterator<Item = &ModelJoint> + Clone {
        self.joints.iter().filter(|joint| joint.kind != Kind::Fixed)
    }

    /// Returns the chain on which core works.
    ///
    /// # Errors
    /// The error names the joint that is wrong.
    pub fn chain(&self) -> Result<Chain, ModelError> {
        for (index, joint) in self.joints.iter().enumerate() {
            joint.check()?;
            if self.joints[..index].iter().any(|other| other.name == joint.name) {
                return Err(ModelError::Twice(joint.name.clone()));
            }
        }
        if !self.joints.is_empty() && self.driven().next().is_none() {
            return Err(ModelError::NoDrive);
        }
        finite("tcp", "xyz_m", &self.tcp.xyz_m)?;
        finite("tcp", "rpy_rad", &self.tcp.rpy_rad)?;
        self.accuracy.as_ref().map_or(Ok(()), MassAccuracy::check)?;
        let joints: Vec<Joint> = self.joints.iter().map(ModelJoint::joint).collect();
        let name = |index: usize| self.joints[index].name.clone();
        Chain::new(&joints, pose(self.tcp.xyz_m, self.tcp.rpy_rad)).map_err(|error| match error {
            ChainError::JointCount(count) => ModelError::JointCount(count),
            ChainError::Mass(index) => {
                ModelError::Mass { joint: name(index), mass_kg: self.joints[index].mass_kg }
            }
            ChainError::Inertia(index) => ModelError::Inertia(name(index)),
            ChainError::NotFinite(index) => ModelError::NotFinite {
                place: index.map_or("tcp".into(), |index| format!("joint {:?}", name(index))),
                key: "its pose",
            },
        })
    }
}

impl MassAccuracy {
    /// Checks that each value is one that `[accuracy]` of a configuration may have.
    fn check(&self) -> Result<(), ModelError> {
        let Self { link_mass, link_inertia, centre_of_mass_m } = *self;
        let mut all = [
            ("link_mass", link_mass, 0.5),
            ("link_inertia", link_inertia, 1.0),
            ("centre_of_mass_m", centre_of_mass_m, 0.5),
        ]
        .into_iter();
        match all.find(|(_, value, most)| !(0.0..=*most).contains(value)) {
            Some((key, value, most)) => Err(ModelError::Accuracy { key, value, most }),
            None => Ok(()),
        }
    }
}

impl ModelJoint {
    fn check(&self) -> Result<(), ModelError> {
        let place = format!("joint {:?}", self.name);
        finite(&place, "origin_xyz_m", &self.origin_xyz_m)?;
        finite(&place, "origin_rpy_rad", &self.origin_rpy_rad)?;
        finite(&place, "axis", &self.axis)?;
        finite(&place, "mass_kg", &[self.mass_kg])?;
        if self.mass_kg > HEAVIEST_KG {
            return Err(ModelError::Mass { joint: self.name.clone(), mass_kg: self.mass_kg });
        }
        finite(&place, "centre_of_mass_m", &self.centre_of_mass_m)?;
        finite(&place, "inertia_kg_m2", &self.inertia_kg_m2)?;
        if self.kind == Kind::Fixed {
            let given = [("axis", !is_zero(&self.axis)), ("limits", !is_zero(&self.limits))];
            return match given.into_iter().find(|(_, is_given)| *is_given) {
                Some((key, _)) => Err(ModelError::Fixed { joint: self.name.clone(), key }),
                None => Ok(()),
            };
        }
        if Vector3::from(self.axis).norm() == 0.0 {
            return Err(ModelError::Axis(self.name.clone()));
        }
        let [lower, upper] = self.limits;
        if lower.is_nan() || upper.is_nan() || lower >= upper {
            return Err(ModelError::Limits { joint: self.name.clone(), limits: self.limits });
        }
        Ok(())
    }

    fn joint(&self) -> Joint {
        let [ixx, iyy, izz, ixy, ixz, iyz] = self.inertia_kg_m2;
        Joint {
            origin: pose(self.origin_xyz_m, self.origin_rpy_rad),
            axis: match self.kind {
                Kind::Fixed => Vector3::z_axis(),
                Kind::Revolute | Kind::Prismatic => Unit::new_normalize(self.axis.into()),
            },
            kind: match self.kind {
                Kind::Revolute => JointKind::Revolute,
                Kind::Prismatic => JointKind::Prismatic,
                Kind::Fixed => JointKind::Fixed,
            },
            link: Link {
                mass: self.mass_kg,
                centre_of_mass: self.centre_of_mass_m.into(),
                inertia: Matrix3::new(ixx, ixy, ixz, ixy, iyy, iyz, ixz, iyz, izz),
            },
        }
    }
}

/// Limits of a joint. JSON has no infinity, and writes `null` where there is no limit.
fn limits<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; 2], D::Error> {
    let [lower, upper] = <[Option<f64>; 2]>::deserialize(deserializer)?;
    Ok([lower.unwrap_or(f64::NEG_INFINITY), upper.unwrap_or(f64::INFINITY)])
}

fn is_zero<const N: usize>(numbers: &[f64; N]) -> bool {
    *numbers == [0.0; N]
}

fn finite(place: &str, key: &'static str, numbers: &[f64]) -> Result<(), ModelError> {
    if numbers.iter().all(|number| number.is_finite()) {
        Ok(())
    } else {
        Err(ModelError::NotFinite { place: place.to_string(), key })
    }
}

fn pose(xyz: [f64; 3], [roll, pitch, yaw]: [f64; 3]) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::from(xyz),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    )
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    fn model() -> Model {
        let joint = |name: &str| ModelJoint {
            name: name.to_string(),
            kind: Kind::Revolute,
            origin_xyz_m: [0.0, 0.0, 0.5],
            origin_rpy_rad: [FRAC_PI_2, 0.0, FRAC_PI_2],
            axis: [0.0, 0.0, 2.0],
            limits: [-3.0, 3.0],
            mass_kg: 10.0,
            centre_of_mass_m: [0.1, 0.0, 0.0],
            inertia_kg_m2: [1.0, 1.2, 1.1, 0.1, 0.0, -0.1],
        };
        let tcp = Tcp { name: "tool0".to_string(), xyz_m: [1.0, 0.0, 0.0], rpy_rad: [0.0; 3] };
        Model { name: "arm".to_string(), joints: vec![joint("a"), joint("b")], tcp, accuracy: None }
    }

    fn guess(link_mass: f64) -> MassAccuracy {
        MassAccuracy { link_mass, link_inertia: 0.4, centre_of_mass_m: 0.06 }
    }

    fn fix(joint: &mut ModelJoint) {
        (joint.kind, joint.axis, joint.limits) = (Kind::Fixed, [0.0; 3], [0.0; 2]);
    }

    #[test]
    fn what_is_written_is_read_again() {
        let mut model = model();
        fix(&mut model.joints[1]);
        let text = model.to_toml().unwrap();
        assert!(text.starts_with("# A robot"));
        // A fixed joint has neither.
        assert_eq!([text.matches("axis =").count(), text.matches("limits =").count()], [1, 1]);
        assert_eq!(Model::parse(Path::new("m.toml"), &text).unwrap(), model);
        assert_eq!(model.chain().unwrap().driven(), 1);
        assert!(!text.contains("accuracy"));
        model.accuracy = Some(guess(0.3));
        assert_eq!(Model::parse(Path::new("m.toml"), &model.to_toml().unwrap()).unwrap(), model);
    }

    #[test]
    fn a_joint_without_limits_is_read_again_from_either_format() {
        let mut model = model();
        model.joints[0].limits = [f64::NEG_INFINITY, f64::INFINITY];
        model.joints[1].limits = [-1.0, f64::INFINITY];
        assert_eq!(Model::parse(Path::new("m.toml"), &model.to_toml().unwrap()).unwrap(), model);
        let json = serde_json::to_string(&model).unwrap();
        assert_eq!(serde_json::from_str::<Model>(&json).unwrap(), model);
    }

    #[test]
    fn rpy_turns_about_fixed_axes() {
        // First a quarter turn about x takes y to z. Then a quarter turn about the fixed z leaves it there.
        let chain = model().chain().unwrap();
        let turned = chain.joints()[0].origin.rotation * Vector3::y();
        assert!((turned - Vector3::z()).norm() < 1e-12);
        assert_eq!(chain.joints()[0].axis.into_inner(), Vector3::z());
    }

    #[test]
    fn mistakes_name_the_joint() {
        type Mistake = fn(&mut Model);
        let table: [(Mistake, &str); 14] = [
            (|m| m.joints.clear(), "has 0 joints: flexid identifies 1 to 7"),
            (|m| m.joints[1].mass_kg = -1.0, r#"joint "b": mass_kg is -1: must be positive"#),
            (|m| m.joints[1].name = "a".into(), r#"joint "a": the name is there twice"#),
            (|m| m.joints[0].axis = [0.0; 3], r#"joint "a": axis is [0, 0, 0]"#),
            (|m| m.joints[0].limits = [1.0, -1.0], r#"joint "a": limits are [1, -1]"#),
            (|m| m.joints[0].limits = [f64::NAN, 1.0], r#"joint "a": limits are [NaN, 1]"#),
            (|m| m.joints[1].origin_xyz_m[2] = f64::NAN, r#"joint "b": origin_xyz_m has a number"#),
            (|m| m.joints[1].inertia_kg_m2[0] = 9.0, r#"joint "b": no body has this inertia"#),
            (
                |m| m.joints[0].kind = Kind::Fixed,
                r#"joint "a": axis is that of a drive, and a fixed joint has none: remove axis"#,
            ),
            (
                |m| (m.joints[0].kind, m.joints[0].axis) = (Kind::Fixed, [0.0; 3]),
                r#"joint "a": limits is that of a drive"#,
            ),
            (|m| m.joints.iter_mut().for_each(fix), "has fixed joints alone: the robot's"),
            (|m| m.tcp.xyz_m[0] = f64::INFINITY, "tcp: xyz_m has a number that is not finite"),
            (|m| m.accuracy = Some(guess(0.6)), "[accuracy] link_mass is 0.6: must be 0 to 0.5"),
            (|m| m.accuracy = Some(guess(f64::NAN)), "[accuracy] link_mass is NaN: must be 0"),
        ];
        for (mistake, message) in table {
            let mut model = model();
            mistake(&mut model);
            let error = model.chain().unwrap_err().to_string();
            assert!(error.starts_with(message), "{error:?} should start with {message:?}");
        }
    }

    #[test]
    fn a_misspelt_key_is_named_with_its_line_and_its_unit() {
        let text = model().to_toml().unwrap().replace("mass_kg", "mass");
        let error = Model::parse(Path::new("m.toml"), &text).unwrap_err();
        assert_eq!(
            error.to_string(),
            "m.toml:17: [[joint]] mass: unknown key `mass`: did you mean `mass_kg` (in kg)?"
        );
    }
}
