//! A MATLAB script for Simscape Multibody.
//!
//! The follower frame of a Bushing Joint translates along the axes x, y and z of the base frame, then turns about x, the new y
//! and the new z: the bushing's kinematic order. The products of inertia of an Inertia block are the elements of the tensor,
//! in the order yz, zx, xy.
//!
//! Source: MathWorks documentation, _Bushing Joint_, _Rigid Transform_, _Inertia_, _Specifying Custom Inertias_.

use nalgebra::Isometry3;

use crate::assembly::Assembly;
use crate::body::Body;
use crate::remark;
use crate::text::{number, numbers, symmetric};

const FUNCTIONS: &str = include_str!("simscape_functions.m");
/// Longest name of a model that is written. MATLAB allows 63 characters.
const LONGEST_NAME: usize = 48;

/// Returns the text of the file.
pub(crate) fn write(assembly: &Assembly) -> String {
    let heading: String = assembly.heading.iter().map(|line| format!("% {line}\n")).collect();
    let joints: String = assembly.bodies.iter().map(joint).collect();
    format!(
        "{heading}\
         %\n\
         % It needs Simscape Multibody. The names of blocks and parameters are those of published scripts for R2025b and of\n\
         % MathWorks' converter of first-generation models. This script has not been tried in MATLAB.\n\n\
         model = '{model}';\n\
         port = new_model(model, [{gravity}]);\n\n\
         {joints}\
         {tcp}\
         add_tcp(model, port, tcp);\n\
         Simulink.BlockDiagram.arrangeSystem(model);\n\
         open_system(model);\n\n\
         {FUNCTIONS}",
        model = identifier(&assembly.name),
        gravity = numbers(assembly.gravity, " "),
        tcp = pose("tcp", &assembly.tcp),
    )
}

fn joint(body: &Body) -> String {
    let remarks = body
        .remarks
        .iter()
        .cloned()
        .chain(body.report.iter().flat_map(|report| remark::of_joint(report)));
    let remarks: String = remarks.map(|line| format!("% {}: {line}\n", body.name)).collect();
    let [xx, yy, zz, xy, xz, yz] = symmetric(&body.link.inertia);
    let entries = [
        ("mass", number(body.link.mass)),
        ("centre_of_mass", list(body.link.centre_of_mass.iter().copied())),
        ("moments", list([xx, yy, zz])),
        ("products", list([yz, xz, xy])),
        ("stiffness", list(body.finite_stiffness())),
        ("damping", list(body.bushing.damping)),
        ("rest", list(body.sag.into_iter().flatten())),
    ];
    let entries: String =
        entries.iter().map(|(key, value)| format!("joint.{key} = {value};\n")).collect();
    format!(
        "{remarks}joint.name = '{name}';\n{pose}{entries}port = add_joint(model, port, joint);\n\n",
        name = body.name.replace('\'', "''"),
        pose = pose("joint", &body.frame),
    )
}

/// Returns orientation and position as two fields of a structure.
fn pose(structure: &str, pose: &Isometry3<f64>) -> String {
    let matrix = pose.rotation.to_rotation_matrix();
    let rows: Vec<_> =
        matrix.matrix().row_iter().map(|row| numbers(row.iter().copied(), " ")).collect();
    let translation = list(pose.translation.vector.iter().copied());
    format!(
        "{structure}.rotation = [{}];\n{structure}.translation = {translation};\n",
        rows.join("; ")
    )
}

fn list(values: impl IntoIterator<Item = f64>) -> String {
    format!("[{}]", numbers(values, " "))
}

/// Returns a name that MATLAB allows for a model.
fn identifier(name: &str) -> String {
    let allowed = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let name: String = name.chars().map(allowed).take(LONGEST_NAME).collect();
    format!("flexid_{name}")
}
