//! The robot with the imperfections that the fit has found, as far as another program can carry them.
//!
//! Springs and dampers are those at one frequency ω:
//!
//! ```text
//! k = Re z(iω)        d = Im z(iω)/ω
//! ```
//!
//! z is the impedance of a bushing, with the growth of its drive and with hysteresis. The ground is a bushing of its own below the first
//! joint, whose link is the base: `z = 1/(c − iω e)`, c the compliance and e its damping.

use std::f64::consts::TAU;

use flexid_core::chain::Link;
use flexid_core::imperfection::{GROUND_LAG, Group, Imperfection};
use flexid_core::parameters::{Bushing, Bushings};
use flexid_core::receptance::Complex;
use flexid_core::refine::Mechanics;
use flexid_pipeline::names::DOF_NAMES;
use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::body::{Body, RIGID};
use crate::error::ExportError;
use crate::robot::{Robot, check};

/// Name of the body of the base.
const GROUND: &str = "flexid_ground";
/// Largest radius of gyration of the base, m. The fit takes the base as a point, and other programs need an inertia. Chosen: that of a base
/// of half a metre.
const GYRATION_M: f64 = 0.3;
/// Least natural frequency of the turns of the base on its ground, in upper edges of the band. Chosen: at the edge its inertia then changes the
/// compliance of the ground by 1.6 %.
const ABOVE: f64 = 8.0;
/// Relative difference of a value that is rounding.
const ROUNDING: f64 = 1e-9;

/// The bushings of the robot as they are exported: those at [`Robot::at_hz`], or those of the fit where the robot does not come to rest.
///
/// # Errors
/// Those of [`export`](crate::export).
pub fn bushings(robot: &Robot) -> Result<Bushings, ExportError> {
    let chain = robot.model.chain()?;
    check(robot, &chain)?;
    let mut bushings: Bushings = robot
        .joints
        .iter()
        .map(|joint| Bushing { stiffness: joint.stiffness, damping: joint.damping })
        .collect();
    let gravity = Vector3::from(robot.gravity_m_per_s2);
    let Robot { reference_hz, pose, imperfections, .. } = robot;
    let Ok(mechanics) =
        Mechanics::new(&chain, gravity, *reference_hz, pose, &bushings, imperfections)
    else {
        return Ok(bushings);
    };
    let omega = TAU * robot.at_hz;
    for (joint, bushing) in bushings.iter_mut().enumerate() {
        let [springs, dampers] = mechanics.impedance(joint, Complex { re: 0.0, im: omega });
        for dof in 0..6 {
            let z =
                [springs[dof].re + dampers[dof].re, (springs[dof].im + dampers[dof].im) / omega];
            let own = [&mut bushing.stiffness[dof], &mut bushing.damping[dof]];
            for (own, value) in own.into_iter().zip(z) {
                if (value - *own).abs() > ROUNDING * *own {
                    *own = value;
                }
            }
        }
    }
    Ok(bushings)
}

/// The base on its ground, of a robot with these bodies and a base of this mass, kg, under `gravity`, m/s². `None` on rigid ground.
pub(crate) fn ground<'a>(
    robot: &Robot,
    bodies: &[Body],
    mass: f64,
    gravity: Vector3<f64>,
) -> Option<Body<'a>> {
    let value = |wanted: Imperfection| {
        robot.imperfections.iter().find(|(own, _)| *own == wanted).map_or(0.0, |(_, value)| *value)
    };
    let dofs = [0, 1, 2, 3, 4, 5];
    let compliance = dofs.map(|dof| value(Imperfection::Ground(dof)));
    if compliance.iter().all(|c| *c < RIGID) {
        return None;
    }
    let omega = TAU * robot.at_hz;
    // Stiffness and damping.
    let of = |dof: usize| -> [f64; 2] {
        let (c, e) = (compliance[dof], value(Imperfection::GroundDamping(dof)));
        if c < RIGID {
            // In formats that cannot leave rigid ground out, it is as lossy as one that gives way.
            return [f64::INFINITY, GROUND_LAG / RIGID];
        }
        let size = c * c + omega * omega * e * e;
        [c / size, e / size]
    };
    let [stiffness, damping] = [0, 1].map(|part| dofs.map(|dof| of(dof)[part]));
    let compliance = compliance.map(|c| if c < RIGID { 0.0 } else { c });
    let softest = compliance[3..].iter().copied().fold(RIGID, f64::max);
    let highest = TAU * ABOVE * robot.band_hz[1];
    let inertia = (mass * GYRATION_M * GYRATION_M).min(1.0 / (softest * highest * highest));
    let (mut force, mut torque) = (mass * gravity, Vector3::zeros());
    let mut place = Isometry3::identity();
    for body in bodies {
        place *= body.frame;
        let centre = place * nalgebra::Point3::from(body.link.centre_of_mass);
        let weight = body.link.mass * gravity;
        force += weight;
        torque += centre.coords.cross(&weight);
    }
    let rigid: Vec<&str> =
        dofs.into_iter().filter(|dof| compliance[*dof] == 0.0).map(|dof| DOF_NAMES[dof]).collect();
    let links: f64 = bodies.iter().map(|body| body.link.mass).sum();
    let load: Vec<f64> = force.iter().chain(torque.iter()).copied().collect();
    Some(Body {
        name: GROUND.to_owned(),
        frame: Isometry3::identity(),
        link: Link {
            mass,
            centre_of_mass: Vector3::zeros(),
            inertia: Matrix3::identity() * inertia,
        },
        bushing: Bushing { stiffness, damping },
        report: None,
        sag: Some(dofs.map(|dof| compliance[dof] * load[dof])),
        remarks: vec![format!(
            "the base on its ground, which gives way as the fit has found, but for {}; its mass, {mass:.1} kg beside {links:.1} kg of the links, and an \
             inertia of {inertia:.2} kg m^2 are assumed",
            if rigid.is_empty() {
                "nothing".to_owned()
            } else {
                format!("{}, where it is rigid", rigid.join(", "))
            }
        )],
    })
}

/// Lines on the imperfections for the head of a file, of a robot that comes to rest or not.
pub(crate) fn heading(robot: &Robot, stands: bool) -> Vec<String> {
    let found = |is_wanted: fn(&Imperfection) -> bool| {
        robot.imperfections.iter().filter(move |(own, value)| is_wanted(own) && *value != 0.0)
    };
    let mut lines = Vec::new();
    let places =
        found(|own| own.facts().group == Group::Geometry || matches!(own, Imperfection::Ground(_)));
    if places.count() > 0 {
        lines.push(
            "Masses, places and ground are those of the model with the imperfections that the fit has found, at this pose: they differ from those of \
             the model's file."
                .to_owned(),
        );
    }
    let depends = found(|own| own.facts().group == Group::Impedance);
    if depends.count() > 0 && stands {
        lines.push(format!(
            "Springs and dampers are those at {:.1} Hz under the load at this pose: hysteresis, and drives that stiffen with frequency and load, make them \
             differ from the identified parameters, and from those at other frequencies.",
            robot.at_hz
        ));
    }
    lines.extend(robot.note.map(str::to_owned));
    let hose: Vec<f64> = found(|own| matches!(own, Imperfection::Hose)).map(|(_, k)| *k).collect();
    if let Some(stiffness) = hose.first() {
        lines.push(format!(
            "What pulls on the tool from the ground, such as hoses, {stiffness:.0} N/m, is left out."
        ));
    }
    lines
}
