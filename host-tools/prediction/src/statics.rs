//! Static compliance at the tool, and its deflection under a force.

use nalgebra::{DMatrix, DVector, Vector6};
use serde::Serialize;

use crate::dynamics::Dynamics;
use crate::estimate::Estimate;

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
        let wrench = Vector6::from(wrench);
        let value = &compliance.value * wrench;
        let per: Vec<DVector<f64>> = compliance.gradient.iter().map(|own| own * wrench).collect();
        let of = |row: usize| {
            let gradient = DVector::from_iterator(per.len(), per.iter().map(|own| own[row]));
            Estimate::new(value[row], self.robot().std_of(&gradient))
        };
        Deflection {
            translation: std::array::from_fn(of),
            rotation: std::array::from_fn(|axis| of(3 + axis)),
        }
    }

    /// The compliance with its standard deviations.
    pub fn compliance_estimates(&self, compliance: &Compliance) -> [[Estimate; 6]; 6] {
        let Compliance { value, gradient } = compliance;
        std::array::from_fn(|row| {
            std::array::from_fn(|column| {
                let per = gradient.iter().map(|own| own[(row, column)]);
                let per = DVector::from_iterator(gradient.len(), per);
                Estimate::new(value[(row, column)], self.robot().std_of(&per))
            })
        })
    }
}
