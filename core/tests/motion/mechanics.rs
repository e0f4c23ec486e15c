//! Poses of a chain with displaced bushings, and the energies that follow from them by differences: nothing
//! but products of poses.

use flexid_core::chain::Chain;
use flexid_core::motion::{Coordinates, State};
use flexid_core::parameters::Bushing;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// Step of the differences, s.
const H: f64 = 1e-4;

/// Poses of all links, and of the TCP, in the base.
pub(crate) fn poses(chain: &Chain, pose: &[f64], elongation: &Coordinates) -> Vec<Isometry3<f64>> {
    let mut frame = Isometry3::identity();
    let mut poses = Vec::new();
    for ((joint, &angle), q) in chain.joints().iter().zip(pose).zip(elongation) {
        frame *= joint.frame(angle);
        frame *= Translation3::new(q[0], q[1], q[2]);
        for axis in 0..3 {
            frame *= UnitQuaternion::from_scaled_axis(Vector3::ith(axis, q[3 + axis]));
        }
        poses.push(frame);
    }
    poses.push(frame * chain.tcp());
    poses
}

/// J, from differences of order 4.
pub(crate) fn kinetic_energy(chain: &Chain, pose: &[f64], state: &State) -> f64 {
    let at = |steps: f64| {
        let mut moved = state.elongation;
        moved.iter_mut().zip(&state.rate).for_each(|(q, rate)| *q += steps * H * rate);
        poses(chain, pose, &moved)
    };
    let [further_back, back, now, ahead, further] = [-2.0, -1.0, 0.0, 1.0, 2.0].map(at);
    let slope = |of: &dyn Fn(&Isometry3<f64>) -> Vector3<f64>, link: usize| {
        let near = of(&ahead[link]) - of(&back[link]);
        let far = of(&further[link]) - of(&further_back[link]);
        (8.0 * near - far) / (12.0 * H)
    };
    let links = chain.joints().iter().enumerate();
    links
        .map(|(index, joint)| {
            let link = &joint.link;
            let centre =
                |frame: &Isometry3<f64>| (frame * Point3::from(link.centre_of_mass)).coords;
            let velocity = slope(&centre, index);
            // Link axes, as the inertia.
            let turn = |frame: &Isometry3<f64>| {
                (now[index].rotation.inverse() * frame.rotation).scaled_axis()
            };
            let spin = slope(&turn, index);
            0.5 * link.mass * velocity.norm_squared() + 0.5 * spin.dot(&(link.inertia * spin))
        })
        .sum()
}

/// Energy of springs and gravity, J.
pub(crate) fn potential_energy(
    chain: &Chain,
    pose: &[f64],
    gravity: Vector3<f64>,
    bushings: &[Bushing],
    state: &State,
) -> f64 {
    let poses = poses(chain, pose, &state.elongation);
    let mut energy = 0.0;
    for (index, (joint, bushing)) in chain.joints().iter().zip(bushings).enumerate() {
        let centre = poses[index] * Point3::from(joint.link.centre_of_mass);
        energy -= joint.link.mass * gravity.dot(&centre.coords);
        for dof in 0..6 {
            energy += 0.5 * bushing.stiffness[dof] * state.elongation[index][dof].powi(2);
        }
    }
    energy
}

/// Power that the dampers turn to heat, W.
pub(crate) fn dissipation(bushings: &[Bushing], state: &State) -> f64 {
    let rates = state.rate.iter().flat_map(|rate| rate.iter());
    let dampings = bushings.iter().flat_map(|bushing| bushing.damping);
    rates.zip(dampings).map(|(rate, damping)| damping * rate * rate).sum()
}
