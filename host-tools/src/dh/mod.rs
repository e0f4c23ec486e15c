//! A robot as a table of Denavit-Hartenberg parameters, for those who have no URDF.
//!
//! A row is a joint with its link, or a fixed frame such as a tool. The frame of row i is the one that the convention gives it, and mass
//! data of the row are in that frame:
//!
//! | convention                    | frame i in frame i − 1                             | joint i turns about, slides along |
//! | ----------------------------- | -------------------------------------------------- | --------------------------------- |
//! | standard (Denavit-Hartenberg) | turn z by θ, move z by d, move x by a, turn x by α | z of frame i − 1                  |
//! | modified (Craig)              | turn x by α, move x by a, turn z by θ, move z by d | z of frame i                      |

mod column;
mod error;
mod table;
mod value;

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

use crate::urdf::{self, Base, Imported, Inertial, Joint, Link, Masses, Robot, UrdfError};
pub use error::DhError;
pub(crate) use table::is_table;
use table::{Kind, Row, Table};

/// The convention of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Convention {
    /// Denavit and Hartenberg: frame i at the far end of link i
    Standard,
    /// Craig, Khalil and Dombre: frame i at joint i
    Modified,
}

/// Name of the link before the first row.
const GROUND: &str = "world";

/// Name of the link after the last row, which no row has.
fn tip(table: &Table) -> &'static str {
    if table.rows.iter().any(|row| row.name == "tcp") { "tip" } else { "tcp" }
}

/// Reads the chain of a table, which is CSV or TOML, up to the link `tcp`: the frame after the last row if none is named. A table in CSV has the
/// robot's `name` from outside.
///
/// # Errors
/// The error names the line or the joint, and the mend.
pub fn import(
    text: &str,
    name: &str,
    convention: Convention,
    tcp: Option<&str>,
    base: Base,
    masses: &Masses<'_>,
) -> Result<Imported, DhError> {
    let table = Table::read(text, name)?;
    let imported =
        urdf::import_robot(&robot(&table, convention), tcp.unwrap_or(tip(&table)), base, masses);
    imported.map_err(|error| {
        let message = match error {
            UrdfError::NoMass(links) => {
                let names: Vec<String> = links.into_iter().map(|(_, joint)| joint).collect();
                format!(
                    "no mass on {}: add columns mass [kg], cx, cy, cz [m] and ixx, iyy, izz, ixy, ixz, iyz [kg m2] in the frame of the row, or --total-mass \
                     KG, the robot's mass by its data sheet",
                    names.join(", ")
                )
            }
            error => error.to_string(),
        };
        DhError { line: None, message }
    })
}

/// The links and joints of a table. The frame of a link is its joint's: in the standard convention that of the row before, turned by the joint.
fn robot(table: &Table, convention: Convention) -> Robot {
    let mut links = vec![Link::new(GROUND, None)];
    let mut joints = Vec::new();
    let mut parent = GROUND.to_owned();
    // From the frame of the link before to that of its row.
    let mut before = Isometry3::identity();
    for row in &table.rows {
        let (to_joint, to_row) = match convention {
            Convention::Standard => (Isometry3::identity(), along_z(row) * along_x(row)),
            Convention::Modified => (along_x(row) * along_z(row), Isometry3::identity()),
        };
        let inertial = row.body.as_ref().map(|body| Inertial {
            mass: body.mass,
            centre: to_row * Isometry3::from(Translation3::from(body.centre)),
            inertia: {
                let [xx, yy, zz, xy, xz, yz] = body.inertia;
                Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
            },
        });
        let link = row.name.clone();
        joints.push(joint(&row.name, row.kind, &parent, &link, before * to_joint, row.limits));
        links.push(Link::new(&link, inertial));
        (parent, before) = (link, to_row);
    }
    joints.push(joint("tcp_mount", Kind::Fixed, &parent, tip(table), before, None));
    links.push(Link::new(tip(table), None));
    Robot { name: table.name.clone(), links, joints }
}

fn joint(
    name: &str,
    kind: Kind,
    parent: &str,
    child: &str,
    origin: Isometry3<f64>,
    limits: Option<[f64; 2]>,
) -> Joint {
    let kind = match kind {
        Kind::Revolute => "revolute",
        Kind::Prismatic => "prismatic",
        Kind::Fixed => urdf::FIXED,
    };
    Joint {
        name: name.to_owned(),
        kind: kind.to_owned(),
        parent: parent.to_owned(),
        child: child.to_owned(),
        origin,
        axis: Vector3::z(),
        limits,
        leader: None,
    }
}

/// A turn by θ about z and a move by d along it, in any order.
fn along_z(row: &Row) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), row.theta);
    Isometry3::from_parts(Translation3::new(0.0, 0.0, row.d), turn)
}

/// A turn by α about x and a move by a along it, in any order.
fn along_x(row: &Row) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), row.alpha);
    Isometry3::from_parts(Translation3::new(row.a, 0.0, 0.0), turn)
}

#[cfg(test)]
mod tests;
