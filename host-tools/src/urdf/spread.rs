//! The mass of a data sheet, spread over the links of an arm whose file has none.
//!
//! A joint must carry what is beyond it, and gear, motor and casting grow with that. So each link has a share in proportion to the way
//! along the arm from its joint to the last joint, and a twentieth of the whole way, as wrists have gears, too. It is a solid
//! cylinder around the line from its joint to the next, with a radius of a tenth of the whole way.

use flexid_core::imperfection::BASE_OVER_MOVING;
use flexid_pipeline::model::{ModelJoint, Tcp};
use nalgebra::{Matrix3, Vector3};

use super::{INERTIA_ORDER, Spread, tidy};

/// Part of the whole way that each link has besides: the part with which the masses of the published arms in the tests are nearest.
const OWN: f64 = 0.05;
/// Radius of the cylinders over the whole way: with it the moments of inertia of these arms are right in the mean.
const RADIUS: f64 = 0.1;

/// Gives the joints of an arm whose links have no mass what is left of `total_kg`, the mass by the data sheet. A fifth of what moves
/// is that of the base. Links with a mass, such as a spindle, keep it.
///
/// # Errors
/// Nothing is left for the links without a mass, or there is none. The error says so, and the mend.
pub(super) fn spread(
    joints: &mut [ModelJoint],
    tcp: &Tcp,
    total_kg: f64,
) -> Result<Spread, String> {
    let known: f64 = joints.iter().map(|joint| joint.mass_kg).sum();
    let left = total_kg / (1.0 + BASE_OVER_MOVING) - known;
    if joints.iter().all(|joint| joint.mass_kg > 0.0) {
        return Err(format!(
            "--mass {total_kg}: every moving link has a mass in the file, {known:.1} kg in all: leave --mass out, or take <inertial> out of \
             the links whose masses are wrong"
        ));
    }
    if left.is_nan() || left <= 0.0 {
        return Err(format!(
            "--mass {total_kg}: the links with a mass have {known:.1} kg, so that nothing is left for the others (a sixth is the base's): \
             give the robot's own mass by its data sheet, with the tool's"
        ));
    }
    // From each joint to the next, and from the last one to the tool.
    let next = joints.iter().skip(1).map(|joint| joint.origin_xyz_m).chain([tcp.xyz_m]);
    let lines: Vec<Vector3<f64>> = next.map(Vector3::from).collect();
    let arm = &lines[..joints.len() - 1];
    let whole = match arm.iter().map(Vector3::norm).sum::<f64>() {
        // A single joint, or joints that all cut in one point.
        0.0 => lines.iter().map(Vector3::norm).sum(),
        whole => whole,
    };
    if whole == 0.0 {
        return Err(format!(
            "--mass {total_kg}: all joints and the tip lie in one point, so that the arm has no length to spread it over: give masses in the file"
        ));
    }
    let beyond = |index: usize| arm[index..].iter().map(Vector3::norm).sum::<f64>() + OWN * whole;
    let massless = || (0..joints.len()).filter(|&index| joints[index].mass_kg == 0.0);
    let all: f64 = massless().map(beyond).sum();
    let shares: Vec<_> = massless().map(|index| (index, left * beyond(index) / all)).collect();
    for (index, mass) in shares {
        // The last link is a flange, and no arm leads to the tip.
        let line = arm.get(index).copied().unwrap_or_default();
        let radius = RADIUS * whole;
        let inertia = cylinder(mass, line, radius);
        let joint = &mut joints[index];
        joint.mass_kg = tidy([mass])[0];
        joint.centre_of_mass_m = tidy((0.5 * line).into());
        joint.inertia_kg_m2 = tidy(INERTIA_ORDER.map(|at| inertia[at]));
    }
    Ok(Spread { mass: 0.3, inertia: 0.5, centre_of_mass_m: 0.05 * whole })
}

/// Inertia of a solid cylinder around `line` about its centre, kg m². One without a length is a ball with the same sum of moments.
fn cylinder(mass: f64, line: Vector3<f64>, radius: f64) -> Matrix3<f64> {
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

    use super::*;

    /// Published arms: masses of the links, kg, and lengths from each joint to the next, m.
    const ARMS: [(&str, &[f64], &[f64]); 20] = [
        (
            "iiwa 14",
            &[5.76, 6.35, 3.5, 3.5, 3.5, 1.8, 1.2],
            &[0.203, 0.204, 0.215, 0.184, 0.215, 0.081],
        ),
        ("IRB 120", &[3.07, 3.91, 2.94, 1.33, 0.546, 0.137], &[0.29, 0.27, 0.07, 0.302, 0.072]),
        (
            "iiwa 7",
            &[3.45, 3.48, 4.06, 3.48, 2.16, 2.35, 3.13],
            &[0.19, 0.21, 0.19, 0.21, 0.199, 0.101],
        ),
        (
            "Gen3",
            &[2.01, 1.11, 1.11, 0.895, 0.654, 0.654, 0.314],
            &[0.128, 0.21, 0.21, 0.209, 0.106, 0.106],
        ),
        (
            "Sawyer",
            &[5.32, 4.5, 1.73, 2.47, 1.04, 1.53, 0.329],
            &[0.255, 0.2, 0.263, 0.178, 0.277, 0.152],
        ),
        ("UR10", &[7.78, 12.93, 3.87, 1.96, 1.96, 0.202], &[0.221, 0.636, 0.572, 0.115, 0.116]),
        ("UR3", &[2.0, 3.42, 1.26, 0.8, 0.8, 0.35], &[0.12, 0.261, 0.213, 0.085, 0.085]),
        ("UR5", &[3.7, 8.39, 2.27, 1.22, 1.22, 0.188], &[0.136, 0.442, 0.392, 0.093, 0.095]),
        ("UR16e", &[7.37, 10.45, 4.32, 2.18, 2.03, 0.907], &[0.0, 0.478, 0.4, 0.12, 0.117]),
        (
            "KR 210",
            &[1385.5, 958.62, 710.03, 173.73, 72.17, 6.32],
            &[0.549, 1.259, 0.977, 0.542, 0.193],
        ),
        (
            "SIA10D",
            &[13.75, 5.23, 4.71, 3.15, 3.03, 2.39, 0.637],
            &[0.0, 0.36, 0.0, 0.36, 0.0, 0.155],
        ),
        ("RX160", &[45.36, 51.27, 19.75, 15.29, 0.548, 0.038], &[0.15, 0.825, 0.0, 0.625, 0.11]),
        ("RX160L", &[45.36, 51.27, 19.75, 27.64, 0.548, 0.038], &[0.15, 0.825, 0.0, 0.925, 0.11]),
        ("IRB 1200", &[11.84, 17.54, 7.46, 2.74, 0.63, 0.137], &[0.0, 0.448, 0.042, 0.451, 0.082]),
        ("KR 5", &[5.77, 4.65, 4.36, 2.07, 0.328, 0.079], &[0.18, 0.6, 0.12, 0.62, 0.0]),
        ("TX60", &[6.99, 4.29, 4.53, 2.17, 0.163, 0.008], &[0.0, 0.291, 0.0, 0.31, 0.07]),
        ("TX60L", &[6.99, 5.21, 4.53, 3.48, 0.163, 0.008], &[0.0, 0.4, 0.0, 0.45, 0.07]),
        ("TX90", &[16.93, 12.99, 7.5, 4.54, 0.569, 0.031], &[0.05, 0.428, 0.0, 0.425, 0.1]),
        ("TX90L", &[16.93, 14.35, 7.5, 6.42, 0.569, 0.031], &[0.05, 0.502, 0.0, 0.55, 0.1]),
        ("TX90XL", &[16.93, 17.79, 7.5, 7.92, 0.569, 0.031], &[0.05, 0.652, 0.0, 0.65, 0.1]),
    ];

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

    /// The accuracy that is stated is that of these arms. A mass that weighs more counts more.
    #[test]
    fn masses_of_published_arms_are_off_by_what_is_stated() {
        let mut squares = 0.0;
        for (name, masses, lengths) in ARMS {
            let (mut joints, tcp) = arm(&vec![0.0; masses.len()], lengths);
            let moving: f64 = masses.iter().sum();
            let spread = spread(&mut joints, &tcp, 1.2 * moving).unwrap();
            let found: Vec<f64> = joints.iter().map(|joint| joint.mass_kg).collect();
            assert!((found.iter().sum::<f64>() / moving - 1.0).abs() < 1e-9, "{name}");
            assert!((spread.centre_of_mass_m - 0.05 * lengths.iter().sum::<f64>()).abs() < 1e-12);
            let last = masses.len() - 1;
            let all: f64 = found[..last].iter().sum();
            let off = masses.iter().zip(&found).take(last);
            squares += off.map(|(m, own)| own / all * (m / own - 1.0).powi(2)).sum::<f64>();
        }
        let off = (squares / ARMS.len() as f64).sqrt();
        assert!((0.30..0.32).contains(&off), "{off}");
    }

    #[test]
    fn a_spindle_keeps_its_mass_and_the_bodies_are_cylinders_along_the_arm() {
        let (mut joints, tcp) = arm(&[0.0, 0.0, 12.0], &[0.6, 0.4]);
        spread(&mut joints, &tcp, 1.2 * 112.0).unwrap();
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
        for (masses, lengths, tip, total, mend) in [
            (
                [1.0, 2.0],
                0.5,
                TIP,
                10.0,
                "every moving link has a mass in the file, 3.0 kg in all: leave",
            ),
            ([0.0, 2.0], 0.5, TIP, 2.0, "nothing is left for the others"),
            ([0.0, 2.0], 0.5, TIP, f64::NAN, "give the robot's own mass"),
            ([0.0, 2.0], 0.5, TIP, -5.0, "give the robot's own mass"),
            ([0.0, 0.0], 0.0, [0.0; 3], 10.0, "lie in one point"),
        ] {
            let (mut joints, tcp) = arm(&masses, &[lengths]);
            let error = spread(&mut joints, &Tcp { xyz_m: tip, ..tcp }, total).unwrap_err();
            assert!(error.starts_with("--mass ") && error.contains(mend), "{error}");
        }
    }
}
