//! A Python script for Drake.
//!
//! A `LinearBushingRollPitchYaw` measures space-fixed turns about x, y and z, of its frame C in its frame A. With the link's
//! frame as A and the drive's as C they are the turns of the bushing about x, the new y and the new z, negated. It measures the
//! translation along axes halfway between both frames: that differs from the bushing's by half the turn.
//!
//! Source: Drake documentation, class `LinearBushingRollPitchYaw`.

use nalgebra::Isometry3;

use crate::assembly::Assembly;
use crate::body::Body;
use crate::remark;
use crate::text::{number, numbers, symmetric};

const FUNCTIONS: &str = include_str!("drake_functions.py");

/// Returns the text of the file.
pub(crate) fn write(assembly: &Assembly) -> String {
    let heading: String = assembly.heading.iter().map(|line| format!("# {line}\n")).collect();
    let joints: String = assembly.bodies.iter().map(joint).collect();
    format!(
        "{heading}{FUNCTIONS}\n\n\
         NAME = {name}\n\
         GRAVITY = [{gravity}]  # along the axes of the base, m/s^2\n\
         JOINTS = [\n{joints}]\n\
         TCP = {{{tcp}}}  # in the frame of the last link\n\n\
         if __name__ == \"__main__\":\n    main()\n",
        name = quoted(&assembly.name),
        gravity = numbers(assembly.gravity, ", "),
        tcp = pose(&assembly.tcp),
    )
}

fn joint(body: &Body) -> String {
    let remarks = body
        .remarks
        .iter()
        .cloned()
        .chain(body.report.iter().flat_map(|report| remark::of_joint(report)));
    let remarks: String = remarks.map(|line| format!("    # {}: {line}\n", body.name)).collect();
    let list = |values: &[f64]| format!("[{}]", numbers(values.iter().copied(), ", "));
    let (stiffness, damping) = (body.finite_stiffness(), body.bushing.damping);
    format!(
        "{remarks}    {{\n        \
             \"name\": {name},\n        \
             {pose},\n        \
             \"mass\": {mass},\n        \
             \"centre_of_mass\": {centre},\n        \
             \"inertia\": {inertia},\n        \
             \"force_stiffness\": {force_stiffness},\n        \
             \"force_damping\": {force_damping},\n        \
             \"torque_stiffness\": {torque_stiffness},\n        \
             \"torque_damping\": {torque_damping},\n    \
         }},\n",
        name = quoted(&body.name),
        pose = pose(&body.frame),
        mass = number(body.link.mass),
        centre = list(body.link.centre_of_mass.as_slice()),
        inertia = list(&symmetric(&body.link.inertia)),
        force_stiffness = list(&stiffness[..3]),
        force_damping = list(&damping[..3]),
        torque_stiffness = list(&stiffness[3..]),
        torque_damping = list(&damping[3..]),
    )
}

/// Returns orientation and position as two entries of a dictionary.
fn pose(pose: &Isometry3<f64>) -> String {
    let matrix = pose.rotation.to_rotation_matrix();
    let rows = matrix.matrix().row_iter();
    let rows: Vec<_> =
        rows.map(|row| format!("[{}]", numbers(row.iter().copied(), ", "))).collect();
    let translation = numbers(pose.translation.vector.iter().copied(), ", ");
    format!("\"rotation\": [{}], \"translation\": [{translation}]", rows.join(", "))
}

/// Returns one line of text as a literal.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}
