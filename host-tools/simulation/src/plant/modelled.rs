//! The imperfections with which a model is the robot of a plant.

use flexid_core::chain::{Chain, JointKind};
use flexid_core::imperfection::{BASE_OVER_MOVING, Imperfection, REFERENCE_HZ};
use flexid_pipeline::robot::FoundValue;

use super::{Joints, Pedestal, Plant, Robot};

impl Plant {
    /// Imperfections of the robot `chain` with which it moves as this plant does, in small motions about a pose. Joints are those of
    /// [`Joints::at`] the [`REFERENCE_HZ`]; the body of a pedestal is a point. `None` if the plant has what no imperfection describes: a link
    /// that bends, a pedestal below the model's own, joints that are not linear, or joints that warm up.
    pub fn imperfections(&self, chain: &Chain) -> Option<Vec<FoundValue>> {
        let Joints { friction, backlash, cubic_rad, warm_up_per_cut, .. } = self.joints;
        let beyond = [friction, backlash, cubic_rad, warm_up_per_cut];
        let stands_on_fixed = chain.joints().first()?.kind == JointKind::Fixed;
        if self.bending.is_some()
            || self.pedestal.is_some() && stands_on_fixed
            || beyond.iter().any(|own| *own != 0.0)
        {
            return None;
        }
        let mut all: Vec<(Imperfection, f64)> = Vec::new();
        let Robot { mass, inertia, centre_of_mass_m, joint_angle_rad, elastic_centre_m, .. } =
            &self.robot;
        all.extend((0..).zip(mass).map(|(link, own)| (Imperfection::Mass(link), own.ln())));
        all.extend((0..).zip(inertia).map(|(link, own)| (Imperfection::Inertia(link), own.ln())));
        all.extend(along_axes(centre_of_mass_m, Imperfection::CentreOfMass));
        all.extend(along_axes(elastic_centre_m, Imperfection::ElasticCentre));
        let is_driven = |joint: &usize| chain.joints()[*joint].kind != JointKind::Fixed;
        let driven: Vec<usize> = (0..chain.joints().len()).filter(is_driven).collect();
        let angles = driven.iter().zip(joint_angle_rad);
        all.extend(angles.map(|(&joint, own)| (Imperfection::JointAngle(joint), *own)));
        for axis in 0..3 {
            all.push((Imperfection::ToolTurn(axis), self.tool.angle_rad[axis]));
            all.push((Imperfection::ToolCentrePoint(axis), self.tool.tcp_m[axis]));
        }
        all.push((Imperfection::Hysteresis, self.joints.hysteretic_at(REFERENCE_HZ)));
        all.extend(driven.iter().map(|&joint| (Imperfection::Servo(joint), self.joints.servo)));
        all.push((Imperfection::Load, self.joints.loaded_per_knm / 1e3));
        if let Some(hose) = self.hose {
            all.push((Imperfection::Hose, hose.stiffness_n_per_m));
            all.push((Imperfection::HoseDamping, hose.damping_ns_per_m));
        }
        if let Some(Pedestal { mass_kg, stiffness, damping }) = self.pedestal {
            let moving: f64 = chain.joints().iter().map(|joint| joint.link.mass).sum();
            all.push((Imperfection::BaseMass, (mass_kg / (BASE_OVER_MOVING * moving)).ln()));
            for (dof, (k, d)) in stiffness.into_iter().zip(damping).enumerate() {
                all.push((Imperfection::Ground(dof), 1.0 / k));
                all.push((Imperfection::GroundDamping(dof), d / (k * k)));
            }
        }
        all.retain(|(_, value)| *value != 0.0);
        let found = |(imperfection, value)| FoundValue { imperfection, value };
        Some(all.into_iter().map(found).collect())
    }
}

/// The imperfections of vectors, one for each joint, base first.
fn along_axes(
    vectors: &[[f64; 3]],
    of: fn(usize, usize) -> Imperfection,
) -> impl Iterator<Item = (Imperfection, f64)> {
    (0..).zip(vectors).flat_map(move |(joint, vector)| {
        (0..).zip(vector).map(move |(axis, value)| (of(joint, axis), *value))
    })
}

#[cfg(test)]
mod tests {
    use flexid_core::mounting::Mounting;
    use flexid_core::parameters::Bushing;
    use flexid_pipeline::dynamics;
    use nalgebra::{DMatrix, Matrix3, Vector3};

    use super::*;
    use crate::plant::{Bending, Tool};
    use crate::reference::{mill3, model};
    use crate::true_robot::TrueRobot;

    const POSE: [f64; 3] = [0.2, -0.6, 0.9];

    fn plant() -> Plant {
        Plant {
            tool: Tool { angle_rad: [0.02, -0.01, 0.03], tcp_m: [0.02, -0.01, 0.03] },
            robot: Robot {
                mass: vec![1.3, 0.8, 1.2],
                inertia: vec![1.1, 1.2, 0.8],
                centre_of_mass_m: vec![[0.05, 0.02, -0.03]; 3],
                joint_angle_rad: vec![0.02, -0.03, 0.01],
                elastic_centre_m: vec![[0.05, -0.06, 0.04]; 3],
                ..Robot::default()
            },
            pedestal: Some(Pedestal { mass_kg: 900.0, stiffness: [2e6; 6], damping: [0.0; 6] }),
            ..Plant::default()
        }
    }

    /// Static compliance of the chain that the simulator moves, without gravity: `Σ j jᵀ/k`.
    fn moved(plant: &Plant, bushings: &[Bushing]) -> DMatrix<f64> {
        let (_, chain) = mill3();
        let pose = plant.true_pose(&POSE, 0.0);
        let own = plant.robot(&chain, &pose, bushings, &Mounting::AT_TCP).unwrap();
        let zero = vec![0.0; own.chain.driven()];
        let linear = own.chain.linearise(&zero, Vector3::zeros(), &own.bushings).unwrap();
        let mut sum = Matrix3::zeros();
        for (joint, bushing) in linear.jacobian().iter().zip(&own.bushings) {
            for (column, stiffness) in joint.iter().zip(bushing.stiffness) {
                let column = Vector3::from(*column);
                sum += column * column.transpose() / stiffness;
            }
        }
        DMatrix::from_fn(3, 3, |i, j| sum[(i, j)])
    }

    #[test]
    fn the_model_with_its_imperfections_is_as_soft_as_the_plant() {
        let (scenario, chain) = mill3();
        let plant = plant();
        let imperfections = plant.imperfections(&chain).unwrap();
        let robot = TrueRobot::new(&model(), [0.0; 3], imperfections);
        let robot: dynamics::Robot = robot.of(&scenario.truth, [2.0, 200.0]).unwrap();
        let at = robot.at(&POSE).unwrap();
        let own = at.principal(&at.compliance().unwrap()).map(|own| own.compliance.value);
        let mut expected = moved(&plant, &scenario.truth).symmetric_eigen().eigenvalues;
        expected.as_mut_slice().sort_by(|a, b| b.total_cmp(a));
        let perfect = moved(&Plant::default(), &scenario.truth).symmetric_eigen().eigenvalues.max();
        assert!((expected[0] / perfect - 1.0).abs() > 0.01);
        for (own, expected) in own.iter().zip(&expected) {
            assert!((own / expected - 1.0).abs() < 1e-9, "{own} {expected}");
        }
    }

    #[test]
    fn what_no_imperfection_describes_has_none() {
        let (_, chain) = mill3();
        let bending = Bending { joint: 1, at: 0.5, stiffness: [1e9; 6], damping: [1e5; 6] };
        let bends = Plant { bending: Some(bending), ..plant() };
        assert_eq!(bends.imperfections(&chain), None);
        let joints = Joints { friction: 10.0, ..Joints::default() };
        assert_eq!(Plant { joints, ..plant() }.imperfections(&chain), None);
        assert_eq!(Plant::default().imperfections(&chain), Some(Vec::new()));
    }
}
