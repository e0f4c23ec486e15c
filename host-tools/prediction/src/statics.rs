//! Static compliance at the tool, and its deflection under a force.

use nalgebra::{DMatrix, DVector, Vector3, Vector6};
use serde::Serialize;

use crate::dynamics::Dynamics;
use crate::estimate::{Estimate, PositiveEstimate};

/// Displacement of the tool for loads there. Both are three translations, then three rotations, along the axes of the tool centre point.
#[derive(Clone, Debug)]
pub struct Compliance {
    /// m/N, rad/N, m/Nm, rad/Nm.
    value: DMatrix<f64>,
    /// By each coordinate of the robot.
    gradient: Vec<DMatrix<f64>>,
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
    pub(crate) fn of(all: &[Estimate]) -> Self {
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

    /// Displacement under a force along the softest direction, per force there, m/N: the largest eigenvalue of the compliance of
    /// translations. Where two directions are equally soft, the interval is that of one of them.
    pub fn softest(&self, compliance: &Compliance) -> PositiveEstimate {
        let eigen = compliance.value.fixed_view::<3, 3>(0, 0).into_owned().symmetric_eigen();
        let softest = eigen.eigenvalues.imax();
        let (value, along) = (eigen.eigenvalues[softest], eigen.eigenvectors.column(softest));
        // ∂λ = vᵀ ∂C v.
        let per = compliance.gradient.iter();
        let per = per.map(|own| along.dot(&(own.fixed_view::<3, 3>(0, 0) * along)) / value);
        self.positive(value, per.collect())
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
    pub(crate) fn moved(
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
