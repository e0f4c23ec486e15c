//! Static compliance at the tool, and its deflection under a force.

use nalgebra::{DMatrix, DVector, Vector3, Vector6};
use serde::Serialize;

use super::at_pose::Dynamics;
use super::estimate::{Estimate, PositiveEstimate};

/// Displacement of the tool for loads there. Both are three translations, then three rotations, along the axes of the tool centre point.
#[derive(Clone, Debug)]
pub struct Compliance {
    /// m/N, rad/N, m/Nm, rad/Nm.
    value: DMatrix<f64>,
    /// By each coordinate of the robot.
    gradient: Vec<DMatrix<f64>>,
}

/// Displacement of the tool per force, along a direction in which it moves as the force points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipalCompliance {
    /// m/N.
    pub compliance: PositiveEstimate,
    /// Unit vector along the axes of the tool centre point. Its largest component is positive.
    pub direction: [f64; 3],
    /// Standard deviation of the direction, rad. It has no limit where another direction is as soft.
    pub direction_std: f64,
}

/// Deflection of the tool, along its axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Deflection {
    /// Translation, m.
    pub translation: [Estimate; 3],
    /// Rotation, rad.
    pub rotation: [Estimate; 3],
}

impl Deflection {
    /// The deflection with these three translations and three rotations.
    pub fn of(all: &[Estimate]) -> Self {
        let at =
            |first: usize| Estimate::beside_length(std::array::from_fn(|axis| all[first + axis]));
        Self { translation: at(0), rotation: at(3) }
    }

    /// Length of the translation, m.
    pub fn distance(&self) -> f64 {
        Vector3::from(self.translation.map(|own| own.value)).norm()
    }
}

impl Dynamics<'_> {
    /// The static compliance at the tool. `None` where the robot has no static stiffness.
    pub fn compliance(&self) -> Option<Compliance> {
        let place = self.at_rest();
        let response = self.response(place, 6)?;
        let gradient = self.gradient(place, &response);
        Some(Compliance {
            value: response.value.map(|entry| entry.re),
            gradient: gradient.iter().map(|own| own.map(|entry| entry.re)).collect(),
        })
    }

    /// Deflection under a wrench on the tool: force, N, then torque, Nm, along its axes.
    pub fn deflection(&self, compliance: &Compliance, wrench: [f64; 6]) -> Deflection {
        let all = self.moved(compliance, wrench, &DMatrix::identity(6, 6));
        Deflection::of(&all)
    }

    /// Displacement per force on the tool along the directions in which it moves as the force points, the softest first: eigenvalues and
    /// eigenvectors of the compliance of translations. Where two are equally soft, the intervals are those of one of them.
    pub fn principal(&self, compliance: &Compliance) -> [PrincipalCompliance; 3] {
        let eigen = compliance.value.fixed_view::<3, 3>(0, 0).into_owned().symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        order.map(|own| {
            let (value, along) = (eigen.eigenvalues[own], eigen.eigenvectors.column(own));
            // ∂λ = vᵀ ∂C v, and ∂v has the part wᵀ ∂C v / (λ − μ) along another eigenvector w, of the eigenvalue μ.
            let per = |other: usize, over: f64| {
                let across = eigen.eigenvectors.column(other);
                let of = |own: &DMatrix<f64>| across.dot(&(own.fixed_view::<3, 3>(0, 0) * along));
                compliance.gradient.iter().map(|own| of(own) / over).collect()
            };
            let others = order.into_iter().filter(|other| *other != own);
            let turns = others.map(|other| {
                let over = value - eigen.eigenvalues[other];
                self.robot().std_of(&DVector::from_vec(per(other, over))).powi(2)
            });
            let largest = along[along.iamax()];
            PrincipalCompliance {
                compliance: self.positive(value, per(own, value)),
                direction: std::array::from_fn(|axis| along[axis] * largest.signum()),
                direction_std: turns.sum::<f64>().sqrt(),
            }
        })
    }

    /// The first of [`Dynamics::principal`], m/N.
    pub fn softest(&self, compliance: &Compliance) -> PositiveEstimate {
        let [softest, ..] = self.principal(compliance);
        softest.compliance
    }

    /// Distance that the tool moves under a force on it along its axes, N, m.
    pub fn moved_by(&self, compliance: &Compliance, force: [f64; 3]) -> PositiveEstimate {
        let force = Vector3::from(force);
        let of = |own: &DMatrix<f64>| own.fixed_view::<3, 3>(0, 0) * force;
        let moved = of(&compliance.value);
        let per = compliance.gradient.iter().map(|own| moved.dot(&of(own)) / moved.norm_squared());
        self.positive(moved.norm(), per.collect())
    }

    /// A value whose logarithm has these derivatives.
    fn positive(&self, value: f64, relative: Vec<f64>) -> PositiveEstimate {
        PositiveEstimate::new(value, self.robot().std_of(&DVector::from_vec(relative)))
    }

    /// Quantities `matrix` d that move with the deflection d under a wrench.
    pub fn moved(
        &self,
        compliance: &Compliance,
        wrench: [f64; 6],
        matrix: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        let wrench = Vector6::from(wrench);
        let value = matrix * (&compliance.value * wrench);
        let per: Vec<DVector<f64>> =
            compliance.gradient.iter().map(|own| matrix * (own * wrench)).collect();
        let of = |row: usize| {
            let gradient = DVector::from_iterator(per.len(), per.iter().map(|own| own[row]));
            Estimate::new(value[row], self.robot().std_of(&gradient))
        };
        (0..value.len()).map(of).collect()
    }

    /// The compliance with its standard deviations. An entry says something beside √(C_ii C_jj), below which it is in any robot that stands.
    pub fn compliance_estimates(&self, compliance: &Compliance) -> [[Estimate; 6]; 6] {
        let Compliance { value, gradient } = compliance;
        std::array::from_fn(|row| {
            std::array::from_fn(|column| {
                let per = gradient.iter().map(|own| own[(row, column)]);
                let per = DVector::from_iterator(gradient.len(), per);
                let own = Estimate::new(value[(row, column)], self.robot().std_of(&per));
                let [a, b] = [row, column].map(|own| value[(own, own)].max(0.0));
                own.beside((a * b).sqrt())
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, UnitVector3};
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    use super::super::fixture::{found, robot, uncertain};
    use super::super::robot::OF_JOINT;
    use super::*;
    use crate::robot::FoundRobot;

    /// Step of the logarithm of a stiffness for a central difference.
    const STEP: f64 = 1e-4;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(8), ..ProptestConfig::with_cases(24) })]

        /// Principal compliances are the eigenvalues of the compliance, and their deviations by one stiffness are the differences.
        #[test]
        fn principal_compliances_change_as_their_deviations_say(
            factors in prop::collection::vec(0.5..2.0, 72),
            pose in prop::collection::vec(-1.0..1.0, 6),
            joint in 0_usize..6,
            dof in 0_usize..6,
        ) {
            let index = OF_JOINT * joint + dof;
            // The change of the sag with a stiffness is left out.
            let weightless = || FoundRobot { gravity_m_per_s2: [0.0; 3], ..found(0.0, 0.0, 0.0) };
            let principal = |by: f64| {
                let mut factors = factors.clone();
                factors[index] *= by.exp();
                let robot = robot(uncertain(weightless(), index, 1.0), &factors);
                let at = robot.at(&pose).unwrap();
                let compliance = at.compliance().unwrap();
                let matrix: Matrix3<f64> = compliance.value.fixed_view::<3, 3>(0, 0).into_owned();
                (at.principal(&compliance), matrix)
            };
            let ((own, matrix), (above, _), (below, _)) = (principal(0.0), principal(STEP), principal(-STEP));
            let values = own.map(|own| own.compliance.value);
            prop_assert!(values.is_sorted_by(|a, b| a >= b));
            prop_assume!(values[1] < 0.9 * values[0] && values[2] < 0.9 * values[1]);
            for place in 0..3 {
                let along = Vector3::from(own[place].direction);
                prop_assert!((matrix * along - along * values[place]).norm() < 1e-9 * values[0]);
                let [up, down] = [above[place], below[place]];
                let change = (up.compliance.value / down.compliance.value).ln() / (2.0 * STEP);
                prop_assert!((change.abs() - own[place].compliance.relative_std).abs() < 1e-6);
                let [up, down] = [up, down].map(|own| UnitVector3::new_normalize(own.direction.into()));
                let turn = up.cross(&down).norm() / (2.0 * STEP);
                prop_assert!((turn - own[place].direction_std).abs() < 1e-5, "{turn}");
            }
        }
    }
}
