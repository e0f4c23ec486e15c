//! The mass of a data sheet, spread over the links of an arm whose file has none.
//!
//! A joint must carry what is beyond it, and gear, motor and casting grow with that. So each link has a share in proportion to the way
//! along the arm from its joint to the last joint, and a twentieth of the whole way, as wrists have gears, too. It is a solid
//! cylinder around the line from its joint to the next, with a radius of a tenth of the whole way.

use flexid_core::imperfection::BASE_OVER_MOVING;
use flexid_pipeline::model::{MassAccuracy, ModelJoint, Tcp};
use nalgebra::{Matrix3, Vector3};

use super::figures::{INERTIA_ORDER, tidy};

/// Proportions of the bodies.
#[derive(Clone, Copy)]
struct Shape {
    /// Part of the whole way that each link has besides.
    own: f64,
    /// Radius of the cylinders over the whole way.
    radius: f64,
}

/// The shape with which masses and moments of inertia of the published arms in `arms.rs` are nearest, rounded: each of the arms is met as well
/// by the shape that the others give.
const SHAPE: Shape = Shape { own: 0.05, radius: 0.1 };

/// The mass to spread.
pub(super) struct Total<'a> {
    /// The robot by its data sheet, kg.
    pub(super) kg: f64,
    /// The tool, if that is beside it, kg.
    pub(super) beside: f64,
    /// The name of it on the command line.
    pub(super) option: &'a str,
}

/// Gives the joints of an arm whose links have no mass what is left of the `total`. A fifth of what moves is that of the base. Links with a
/// mass, such as a spindle, keep it.
///
/// # Errors
/// Nothing is left for the links without a mass, or there is none. The error says so, and the mend.
pub(super) fn spread(
    joints: &mut [ModelJoint],
    tcp: &Tcp,
    total: &Total,
) -> Result<MassAccuracy, String> {
    spread_as(joints, tcp, total, SHAPE)
}

/// [`spread`] with bodies of any shape.
fn spread_as(
    joints: &mut [ModelJoint],
    tcp: &Tcp,
    total: &Total,
    shape: Shape,
) -> Result<MassAccuracy, String> {
    let &Total { kg: total_kg, beside, option } = total;
    let known: f64 = joints.iter().map(|joint| joint.mass_kg).sum::<f64>() - beside;
    let left = total_kg / (1.0 + BASE_OVER_MOVING) - known;
    if joints.iter().all(|joint| joint.mass_kg > 0.0) {
        return Err(format!(
            "{option} {total_kg}: every moving link has a mass in the file, {known:.1} kg in all: leave {option} out, or take the \
             masses that are wrong out of it"
        ));
    }
    if left.is_nan() || left <= 0.0 {
        return Err(format!(
            "{option} {total_kg}: the links with a mass have {known:.1} kg, so that nothing is left for the others (a sixth is the base's): \
             give the robot's mass by its data sheet"
        ));
    }
    let Some(arm) = Arm::new(joints, tcp) else {
        return Err(format!(
            "{option} {total_kg}: all joints and the tip lie in one point, so that the arm has no length to spread it over: give masses in the file"
        ));
    };
    let massless = || (0..joints.len()).filter(|&index| joints[index].mass_kg == 0.0);
    let all: f64 = massless().map(|index| arm.beyond(index, shape.own)).sum();
    let shares: Vec<_> =
        massless().map(|index| (index, left * arm.beyond(index, shape.own) / all)).collect();
    for (index, mass) in shares {
        // The last link is a flange, and no arm leads to the tip.
        let line = arm.lines.get(index).copied().unwrap_or_default();
        let radius = shape.radius * arm.whole;
        let inertia = cylinder(mass, line, radius);
        let joint = &mut joints[index];
        joint.mass_kg = tidy([mass])[0];
        joint.centre_of_mass_m = tidy((0.5 * line).into());
        joint.inertia_kg_m2 = tidy(INERTIA_ORDER.map(|at| inertia[at]));
    }
    Ok(accuracy(arm.whole))
}

/// The way along an arm.
pub(super) struct Arm {
    /// From each joint to the next.
    lines: Vec<Vector3<f64>>,
    /// Length of the arm, m.
    pub(super) whole: f64,
}

impl Arm {
    /// The arm of these joints. `None` if all of them and the tip lie in one point.
    pub(super) fn new(joints: &[ModelJoint], tcp: &Tcp) -> Option<Self> {
        let next = joints.iter().skip(1).map(|joint| joint.origin_xyz_m);
        let lines: Vec<Vector3<f64>> = next.map(Vector3::from).collect();
        let whole = match lines.iter().map(Vector3::norm).sum::<f64>() {
            // A single joint, or joints that all cut in one point.
            0.0 => Vector3::from(tcp.xyz_m).norm(),
            whole => whole,
        };
        (whole > 0.0).then_some(Self { lines, whole })
    }

    /// The way from a joint to the last one, and `own` of the whole: what grows with the mass of a link.
    fn beyond(&self, index: usize, own: f64) -> f64 {
        let beyond = self.lines.iter().skip(index).map(Vector3::norm);
        beyond.sum::<f64>() + own * self.whole
    }

    /// The masses of links as they are spread, relative.
    pub(super) fn share(&self, index: usize) -> f64 {
        self.beyond(index, SHAPE.own)
    }
}

/// How far masses that were spread over an arm of this length, m, may be off: root mean squares over 20 published arms of six and seven joints,
/// each met by a shape that the others give. Last links are left out, since what counts there is the tool.
fn accuracy(whole: f64) -> MassAccuracy {
    MassAccuracy { link_mass: 0.31, link_inertia: 0.69, centre_of_mass_m: of_length(0.053, whole) }
}

/// An accuracy of this part of an arm's length, with two significant digits, none of which promises more than it, m. At most what a fit can do
/// with.
pub(super) fn of_length(part: f64, whole: f64) -> f64 {
    let accuracy = (part * whole).clamp(1e-4, 0.5);
    let scale = 10_f64.powf(1.0 - accuracy.log10().floor());
    // What calculation adds to two digits is none.
    (accuracy * scale * (1.0 - 1e-9)).ceil() / scale
}

/// Inertia of a solid cylinder around `line` about its centre, kg m². One without a length is a ball with the same sum of moments.
pub(super) fn cylinder(mass: f64, line: Vector3<f64>, radius: f64) -> Matrix3<f64> {
    let length = line.norm();
    let square = radius * radius;
    if length == 0.0 {
        return Matrix3::identity() * (mass * square / 3.0);
    }
    let along = line / length;
    let across = mass * (length * length / 12.0 + square / 4.0);
    Matrix3::identity() * across + along * along.transpose() * (mass * square / 2.0 - across)
}

#[cfg(test)]
mod tests {
    use flexid_pipeline::model::Kind;

    use super::super::arms::{ARMS, Arm};
    use super::*;

    fn total(kg: f64) -> Total<'static> {
        Total { kg, beside: 0.0, option: "--mass" }
    }

    const TIP: [f64; 3] = [0.0, 0.1, 0.3];

    fn arm(masses: &[f64], lengths: &[f64]) -> (Vec<ModelJoint>, Tcp) {
        let lengths = [0.0].iter().chain(lengths);
        let joint = |(&mass_kg, &length): (&f64, &f64)| ModelJoint {
            name: "j".into(),
            kind: Kind::Revolute,
            origin_xyz_m: [0.0, length, 0.0],
            origin_rpy_rad: [0.0; 3],
            axis: [0.0, 0.0, 1.0],
            limits: [-3.0, 3.0],
            mass_kg,
            centre_of_mass_m: [0.0; 3],
            inertia_kg_m2: [0.0; 6],
        };
        let tcp = Tcp { name: "tip".into(), xyz_m: TIP, rpy_rad: [0.0; 3] };
        (masses.iter().zip(lengths).map(joint).collect(), tcp)
    }

    /// Links of an arm whose file has masses as they are spread, the accuracy of that, and the length of the arm, m.
    fn spread_over(own: &Arm, shape: Shape) -> (Vec<ModelJoint>, MassAccuracy, f64) {
        let (mut joints, tcp) = arm(&vec![0.0; own.masses.len()], own.lengths);
        let moving: f64 = own.masses.iter().sum();
        let accuracy = spread_as(&mut joints, &tcp, &total(1.2 * moving), shape).unwrap();
        let found: f64 = joints.iter().map(|joint| joint.mass_kg).sum();
        assert!((found / moving - 1.0).abs() < 1e-9, "{}", own.name);
        (joints, accuracy, own.lengths.iter().sum())
    }

    /// Mean square of what is off over the links of an arm but the last: what counts there is the tool. A link that weighs more counts more.
    fn mean_square(joints: &[ModelJoint], off: impl Fn(usize) -> Option<f64>) -> f64 {
        let links = &joints[..joints.len() - 1];
        let all: f64 = links.iter().map(|joint| joint.mass_kg).sum();
        let square =
            |(index, joint): (usize, &ModelJoint)| Some(joint.mass_kg / all * off(index)?.powi(2));
        links.iter().enumerate().filter_map(square).sum()
    }

    /// Errors of the masses, relative.
    fn masses(own: &Arm, shape: Shape) -> f64 {
        let (joints, ..) = spread_over(own, shape);
        mean_square(&joints, |at| Some(own.masses[at] / joints[at].mass_kg - 1.0))
    }

    /// Errors of the moments of inertia beside those of the masses, as logarithms.
    fn inertias(own: &Arm, shape: Shape) -> f64 {
        let (joints, ..) = spread_over(own, shape);
        let off = |at: usize| {
            let ModelJoint { mass_kg, inertia_kg_m2: [xx, yy, zz, ..], .. } = joints[at];
            let size: f64 = own.sizes[at];
            (size > 0.0).then(|| (size * size * mass_kg / (xx + yy + zz)).ln())
        };
        mean_square(&joints, off)
    }

    /// Root mean square of the errors of each arm with the one of these shapes that is best for all others.
    fn left_out(square: fn(&Arm, Shape) -> f64, shapes: &[Shape]) -> f64 {
        let of_arm = |own: &Arm| -> Vec<f64> { shapes.iter().map(|by| square(own, *by)).collect() };
        let squares: Vec<Vec<f64>> = ARMS.iter().map(of_arm).collect();
        let of_others = |out: usize, by: usize| -> f64 {
            let others = squares.iter().enumerate().filter(|(arm, _)| *arm != out);
            others.map(|(_, own)| own[by]).sum()
        };
        let off = |out: usize| {
            let order = |a: &usize, b: &usize| of_others(out, *a).total_cmp(&of_others(out, *b));
            squares[out][(0..shapes.len()).min_by(order).unwrap()]
        };
        ((0..ARMS.len()).map(off).sum::<f64>() / ARMS.len() as f64).sqrt()
    }

    /// The accuracies that are stated are those with which each published arm is met by a shape that the others give. So is the shape
    /// that is used.
    #[test]
    fn published_arms_are_off_by_what_is_stated() {
        let steps = || (4..=24).map(|step| 0.005 * f64::from(step));
        let owns: Vec<Shape> = steps().map(|own| Shape { own, ..SHAPE }).collect();
        let radii: Vec<Shape> = steps().map(|radius| Shape { radius, ..SHAPE }).collect();
        let (_, stated, whole) = spread_over(&ARMS[0], SHAPE);
        for (square, shapes, stated) in [
            (masses as fn(&Arm, Shape) -> f64, owns, stated.link_mass),
            (inertias, radii, stated.link_inertia),
        ] {
            for off in [left_out(square, &shapes), left_out(square, &[SHAPE])] {
                assert!((0.96 * stated..=stated).contains(&off), "{off} {stated}");
            }
        }
        // Along each of three axes.
        let offset = |own: &Arm| {
            let (joints, _, whole) = spread_over(own, SHAPE);
            mean_square(&joints, |at| Some(own.offsets[at] / whole)) / 3.0
        };
        let off = (ARMS.iter().map(offset).sum::<f64>() / ARMS.len() as f64).sqrt();
        let stated = stated.centre_of_mass_m / whole;
        assert!((0.96 * stated..=stated).contains(&off), "{off} {stated}");
    }

    #[test]
    fn a_spindle_keeps_its_mass_and_the_bodies_are_cylinders_along_the_arm() {
        let (mut joints, tcp) = arm(&[0.0, 0.0, 12.0], &[0.6, 0.4]);
        spread(&mut joints, &tcp, &total(1.2 * 112.0)).unwrap();
        let masses: Vec<f64> = joints.iter().map(|joint| joint.mass_kg).collect();
        // Ways of 1 and 0.4 m, and 0.05 m for each.
        let expected = [100.0 * 1.05 / 1.5, 100.0 * 0.45 / 1.5, 12.0];
        masses.iter().zip(expected).for_each(|(m, own)| assert!((m - own).abs() < 1e-9, "{m}"));
        assert_eq!(joints[0].centre_of_mass_m, [0.0, 0.3, 0.0]);
        let [across, along, ..] = joints[0].inertia_kg_m2;
        assert!((along - 70.0 * 0.01 / 2.0).abs() < 1e-9);
        assert!((across - 70.0 * (0.36 / 12.0 + 0.01 / 4.0)).abs() < 1e-9);
        assert_eq!(joints[2].inertia_kg_m2, [0.0; 6]);
    }

    #[test]
    fn a_mass_that_cannot_be_spread_has_a_mend() {
        for (masses, lengths, tip, kg, mend) in [
            (
                [1.0, 2.0],
                0.5,
                TIP,
                10.0,
                "every moving link has a mass in the file, 3.0 kg in all: leave",
            ),
            ([0.0, 2.0], 0.5, TIP, 2.0, "nothing is left for the others"),
            ([0.0, 2.0], 0.5, TIP, f64::NAN, "give the robot's mass"),
            ([0.0, 2.0], 0.5, TIP, -5.0, "give the robot's mass"),
            ([0.0, 0.0], 0.0, [0.0; 3], 10.0, "lie in one point"),
        ] {
            let (mut joints, tcp) = arm(&masses, &[lengths]);
            let tcp = Tcp { xyz_m: tip, ..tcp };
            let error = spread(&mut joints, &tcp, &total(kg)).unwrap_err();
            assert!(error.starts_with("--mass ") && error.contains(mend), "{error}");
        }
    }
}
