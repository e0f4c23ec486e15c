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
    /// Of these three translations and three rotations.
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

    /// What moves with the deflection d under a wrench, as `matrix` d.
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
