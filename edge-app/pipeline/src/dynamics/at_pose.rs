//! The dynamic stiffness of a robot at a pose, and its derivatives.
//!
//! ```text
//! Z(s) = s² M + s D + K + B(s)        H(s) = Pᵀ Z⁻¹ P        e = Z⁻¹ P
//! ∂H = −eᵀ ∂Z e + ∂Pᵀ e + eᵀ ∂P
//! ```
//!
//! B is that of the [bushings](super::bushings), and q are their elongations, which differ from e where the ground gives way.
//!
//! H is what the tool moves, translation and rotation, per force and torque there. The derivatives by the logarithm of a stiffness or a
//! damping have a single entry of ∂Z; the change of the sag with a stiffness is left out. Those by an imperfection are central
//! differences of the matrices.

use std::f64::consts::TAU;

use flexid_core::chain::linearise::LinearisationError;
use flexid_core::refine::Mechanics;
use nalgebra::{Complex, DMatrix};

use super::assembly::Matrices;
use super::bushings::Bushings;
use super::per_imperfection::PerImperfection;
use super::place::Place;
use super::robot::{OF_JOINT, Robot};

/// A robot at a pose.
#[derive(Clone, Debug)]
pub struct Dynamics<'a> {
    robot: &'a Robot,
    pose: Vec<f64>,
    mechanics: Mechanics,
    matrices: Matrices,
    per_imperfection: PerImperfection,
}

/// H and e.
#[derive(Clone, Debug)]
pub struct Response {
    /// H, over the loads that were asked for.
    pub value: DMatrix<Complex<f64>>,
    /// e, a column per load.
    elongations: DMatrix<Complex<f64>>,
}

impl Robot {
    /// The dynamics at joint angles `pose`, one per driven joint, rad (m).
    ///
    /// # Errors
    /// There is another number of driven joints, or a bushing is too soft for gravity.
    pub fn at(&self, pose: &[f64]) -> Result<Dynamics<'_>, LinearisationError> {
        Dynamics::new(self, pose)
    }
}

impl<'a> Dynamics<'a> {
    pub(crate) fn new(robot: &'a Robot, pose: &[f64]) -> Result<Self, LinearisationError> {
        let mechanics = robot.mechanics(pose, None)?;
        let matrices = Matrices::new(&mechanics);
        // At the reference itself hysteresis and drives change nothing.
        let beside = Place::At(Complex::new(0.0, 2.0 * TAU * robot.reference_hz()));
        let size = matrices.mass.nrows();
        let per_imperfection = PerImperfection::new(robot, pose, size, beside)?;
        Ok(Self { robot, pose: pose.to_vec(), mechanics, matrices, per_imperfection })
    }

    /// The robot.
    pub fn robot(&self) -> &'a Robot {
        self.robot
    }

    /// Joint angles, one per driven joint, rad (m).
    pub fn pose(&self) -> &[f64] {
        &self.pose
    }

    /// Elongations of all bushings together.
    pub(crate) fn size(&self) -> usize {
        self.matrices.mass.nrows()
    }

    pub(crate) fn mechanics(&self) -> &Mechanics {
        &self.mechanics
    }

    pub(crate) fn matrices(&self) -> &Matrices {
        &self.matrices
    }

    /// The place at which static stiffnesses are read: the lower edge of the band, the lowest frequency that the records show.
    pub(crate) fn at_rest(&self) -> Place {
        let [lower, _] = self.robot.band_hz();
        Place::Static(TAU * lower)
    }

    /// Z.
    pub(crate) fn stiffness(&self, place: Place) -> DMatrix<Complex<f64>> {
        let Matrices { mass, stiffness, damping, .. } = &self.matrices;
        let mut z = self.bushings(place).matrix() + stiffness.map(Complex::from);
        if let Place::At(s) = place {
            z += mass.map(|entry| s * s * entry) + damping.map(|entry| s * entry);
        }
        z
    }

    /// B.
    pub(crate) fn bushings(&self, place: Place) -> Bushings {
        Bushings::new(&self.mechanics, place)
    }

    /// H for the first `loads` of the three forces and three torques. `None` where Z has no inverse, or one beyond the range of numbers.
    pub fn response(&self, place: Place, loads: usize) -> Option<Response> {
        let tip = self.tip(loads);
        let elongations = self.stiffness(place).lu().solve(&tip)?;
        if !elongations.iter().all(|own| own.is_finite()) {
            return None;
        }
        Some(Response { value: tip.transpose() * &elongations, elongations })
    }

    /// ∂H by each coordinate of the robot.
    pub fn gradient(&self, place: Place, response: &Response) -> Vec<DMatrix<Complex<f64>>> {
        let e = &response.elongations;
        let mut gradient = self.per_coordinate(place, e);
        let first = OF_JOINT * self.size() / 6;
        for (index, moved) in self.per_imperfection.of_loads(e) {
            let total = &mut gradient[first + index];
            *total = &moved + moved.transpose() - &*total;
        }
        gradient[..first].iter_mut().for_each(|own| own.neg_mut());
        gradient
    }

    /// `vᵀ ∂Z v` by each coordinate of the robot.
    pub(crate) fn per_coordinate(
        &self,
        place: Place,
        v: &DMatrix<Complex<f64>>,
    ) -> Vec<DMatrix<Complex<f64>>> {
        let bushings = self.bushings(place);
        let elongations = bushings.elongations(v);
        let mut all = Vec::with_capacity(self.robot.coordinates());
        for joint in 0..self.size() / 6 {
            for impedances in [&bushings.springs, &bushings.dampers] {
                for row in 6 * joint..6 * joint + 6 {
                    let row_of = elongations.row(row);
                    all.push(row_of.transpose() * row_of * impedances[row]);
                }
            }
        }
        all.extend(self.per_imperfection.of_stiffness(place, v));
        all
    }

    /// Loads of unit forces and torques at the tool, the first `loads` of them.
    fn tip(&self, loads: usize) -> DMatrix<Complex<f64>> {
        self.matrices.tip.columns(0, loads).map(Complex::from)
    }
}

#[cfg(test)]
mod tests {
    use flexid_core::imperfection::Imperfection;

    use super::super::fixture::{coordinate, found, robot, uncertain};

    /// A band may end at the frequency at which stiffness and damping are stated.
    #[test]
    fn uncertain_hysteresis_counts_in_any_band() {
        let std = |band_hz: [f64; 2]| {
            let mut found = found(0.2, 0.0, 0.0);
            (found.band_hz, found.reference_hz) = (band_hz, Some(20.0));
            let hysteresis = coordinate(&found, Imperfection::Hysteresis);
            let robot = robot(uncertain(found, hysteresis, 0.01), &[1.0; 72]);
            robot.at(&[0.1; 6]).unwrap().receptance(10.0).unwrap().magnitude[0][0].relative_std
        };
        let wide = std([2.0, 200.0]);
        assert!(wide > 0.0);
        assert_eq!(std([2.0, 20.0]), wide);
    }
}
