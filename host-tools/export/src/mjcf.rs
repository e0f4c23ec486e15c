//! MuJoCo's XML (MJCF).
//!
//! A body has the frame of its joint, with the drive locked at its angle. Three slides and three hinges along the body's own axes
//! move it. MuJoCo applies the joints of a body in their order, each along the axes that those before have turned: the bushing's
//! kinematic order.
//!
//! Source: MuJoCo documentation, _XML Reference_ (`body/joint`, `body/inertial`, `compiler`, `option`, `keyframe/key`).

use std::io;

use flexid_pipeline::names::DOF_NAMES;
use nalgebra::{Isometry3, Vector3};
use quick_xml::Writer;
use quick_xml::events::{BytesText, Event};

use crate::assembly::Assembly;
use crate::body::Body;
use crate::text::{number, numbers, symmetric};
use crate::{ExportError, remark, step};

/// Radius of the lines that a viewer shows, m.
const RADIUS_M: &str = "0.02";
/// Shortest line that is shown, m.
const SHORTEST_M: f64 = 1e-3;

type Xml = Writer<Vec<u8>>;

/// Returns the text of the file.
pub(crate) fn write(assembly: &Assembly) -> Result<String, ExportError> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    for line in &assembly.heading {
        comment(&mut xml, line)?;
    }
    xml.create_element("mujoco")
        .with_attribute(("model", assembly.name.as_str()))
        .write_inner_content(|xml| model(xml, assembly))?;
    let mut text = xml.into_inner();
    text.push(b'\n');
    String::from_utf8(text).map_err(|error| io::Error::other(error).into())
}

fn model(xml: &mut Xml, assembly: &Assembly) -> io::Result<()> {
    // Inertias as they are stated: neither from geometries, nor balanced.
    let compiler = [
        ("angle", "radian"),
        ("autolimits", "false"),
        ("balanceinertia", "false"),
        ("inertiafromgeom", "false"),
    ];
    element(xml, "compiler", compiler.map(|(key, value)| (key, value.to_string())))?;
    let option = [
        ("gravity", numbers(assembly.gravity, " ")),
        ("timestep", number(step::step_s(assembly))),
        ("integrator", "implicitfast".to_string()),
    ];
    element(xml, "option", option)?;
    xml.create_element("default").write_inner_content(|xml| {
        let joint = [
            ("limited", "false"),
            ("ref", "0"),
            ("springref", "0"),
            ("armature", "0"),
            ("frictionloss", "0"),
        ];
        element(xml, "joint", joint.map(|(key, value)| (key, value.to_string())))?;
        let geom = [
            ("contype", "0"),
            ("conaffinity", "0"),
            ("group", "1"),
            ("mass", "0"),
            ("rgba", "0.4 0.5 0.6 1"),
        ];
        element(xml, "geom", geom.map(|(key, value)| (key, value.to_string())))
    })?;
    xml.create_element("worldbody").write_inner_content(|xml| {
        if let Some(first) = assembly.bodies.first() {
            line(xml, &first.frame.translation.vector)?;
        }
        body(xml, &assembly.bodies, &assembly.tcp)
    })?;
    let of_body = |body: &Body| -> Option<Vec<f64>> {
        let sag = body.sag?;
        Some(body.dofs().map(|dof| sag[dof]).collect())
    };
    let sag: Option<Vec<_>> = assembly.bodies.iter().map(of_body).collect();
    if let Some(sag) = sag {
        xml.create_element("keyframe").write_inner_content(|xml| {
            comment(xml, "static equilibrium under gravity")?;
            let qpos = numbers(sag.into_iter().flatten(), " ");
            element(xml, "key", [("name", "rest".to_string()), ("qpos", qpos)])
        })?;
    }
    Ok(())
}

/// Writes the first body, and within it the others.
fn body(xml: &mut Xml, bodies: &[Body], tcp: &Isometry3<f64>) -> io::Result<()> {
    let Some((first, others)) = bodies.split_first() else {
        let site = pose(tcp).into_iter().chain([("size", RADIUS_M.to_string())]);
        return element(xml, "site", [("name", "tcp".to_string())].into_iter().chain(site));
    };
    let [pos, quat] = pose(&first.frame);
    let link = format!("{}_link", first.name);
    xml.create_element("body")
        .with_attribute(("name", link.as_str()))
        .with_attributes([(pos.0, pos.1.as_str()), (quat.0, quat.1.as_str())])
        .write_inner_content(|xml| {
            for remark in &first.remarks {
                comment(xml, remark)?;
            }
            bushing(xml, first)?;
            let inertial = [
                ("pos", numbers(first.link.centre_of_mass.iter().copied(), " ")),
                ("mass", number(first.link.mass)),
                ("fullinertia", numbers(symmetric(&first.link.inertia), " ")),
            ];
            element(xml, "inertial", inertial)?;
            line(xml, &others.first().map_or(tcp, |next| &next.frame).translation.vector)?;
            body(xml, others, tcp)
        })?;
    Ok(())
}

fn bushing(xml: &mut Xml, body: &Body) -> io::Result<()> {
    for dof in body.dofs() {
        let name = DOF_NAMES[dof];
        for remark in body.report.iter().flat_map(|report| remark::of_dof(report, dof)) {
            comment(xml, &remark)?;
        }
        let attributes = [
            ("name", format!("{}_{name}", body.name)),
            ("type", if dof < 3 { "slide" } else { "hinge" }.to_string()),
            ("axis", ["1 0 0", "0 1 0", "0 0 1"][dof % 3].to_string()),
            ("stiffness", number(body.bushing.stiffness[dof])),
            ("damping", number(body.bushing.damping[dof])),
        ];
        element(xml, "joint", attributes)?;
    }
    Ok(())
}

/// Writes a line from the frame's origin to `end`, for a viewer. It has no mass and no contact.
fn line(xml: &mut Xml, end: &Vector3<f64>) -> io::Result<()> {
    if end.norm() < SHORTEST_M {
        return Ok(());
    }
    let from_to = format!("0 0 0 {}", numbers(end.iter().copied(), " "));
    let attributes =
        [("type", "capsule".to_string()), ("fromto", from_to), ("size", RADIUS_M.to_string())];
    element(xml, "geom", attributes)
}

/// Returns position and orientation (w x y z) as attributes.
fn pose(pose: &Isometry3<f64>) -> [(&'static str, String); 2] {
    let [x, y, z, w] = pose.rotation.coords.into();
    [
        ("pos", numbers(pose.translation.vector.iter().copied(), " ")),
        ("quat", numbers([w, x, y, z], " ")),
    ]
}

/// Writes an element without content.
fn element(
    xml: &mut Xml,
    name: &str,
    attributes: impl IntoIterator<Item = (&'static str, String)>,
) -> io::Result<()> {
    let attributes: Vec<_> = attributes.into_iter().collect();
    let attributes = attributes.iter().map(|(key, value)| (*key, value.as_str()));
    xml.create_element(name).with_attributes(attributes).write_empty()?;
    Ok(())
}

/// Writes a comment. XML allows no two hyphens in a row there, and has no escape for them.
fn comment(xml: &mut Xml, text: &str) -> io::Result<()> {
    let mut text = format!(" {text} ");
    while text.contains("--") {
        text = text.replace("--", "- -");
    }
    xml.write_event(Event::Comment(BytesText::from_escaped(text)))
}
