//! The dynamic stiffness of a robot at a pose, and its derivatives.
//!
//! ```text
//! Z(s) = s² M + K_g + diag z(s)        H(s) = Pᵀ Z⁻¹ P        e = Z⁻¹ P
//! ∂H = −eᵀ ∂Z e + ∂Pᵀ e + eᵀ ∂P
//! ```
//!
//! H is what the tool moves, translation and rotation, per force and torque there. The derivatives by the logarithm of a stiffness or a
//! damping have a single entry of ∂Z; the change of the sag with a stiffness is left out. Those by an imperfection are central
//! differences of the matrices.

use std::f64::consts::TAU;

use flexid_core::chain::linearise::LinearisationError;
use flexid_core::receptance;
use flexid_core::refine::Mechanics;
use nalgebra::{Complex, DMatrix, DVector};

use crate::assembly::Matrices;
use crate::robot::{OF_JOINT, Robot};

/// Shift of an imperfection for a difference, in its standard deviations. Chosen: the error of a central difference grows with its square.
const SHIFT: f64 = 0.1;

/// A robot at a pose.
#[derive(Clone, Debug)]
pub struct Dynamics<'a> {
    robot: &'a Robot,
    pose: Vec<f64>,
    mechanics: Mechanics,
    matrices: Matrices,
    /// By each imperfection; `None` for one without uncertainty.
    per_imperfection: Vec<Option<PerImperfection>>,
}

/// Derivatives by an imperfection.
#[derive(Clone, Debug)]
struct PerImperfection {
    /// Of the matrices.
    matrices: Matrices,
    /// The mechanics on both sides, by which the impedances differ.
    sides: [Mechanics; 2],
    /// Distance of the sides.
    by: f64,
}

/// Where the dynamic stiffness is evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Place {
    /// At this complex frequency, rad/s.
    At(Complex<f64>),
    /// At rest, with the stiffnesses that the bushings have at this frequency, rad/s.
    Static(f64),
}

/// H and e.
#[derive(Clone, Debug)]
pub(crate) struct Response {
    /// H, over the loads that were asked for.
    pub(crate) value: DMatrix<Complex<f64>>,
    /// e, a column per load.
    elongations: DMatrix<Complex<f64>>,
}

impl<'a> Dynamics<'a> {
    pub(crate) fn new(robot: &'a Robot, pose: &[f64]) -> Result<Self, LinearisationError> {
        let mechanics = robot.mechanics(pose, None)?;
        let matrices = Matrices::new(mechanics.chain());
        let shifted = |(index, std): (usize, f64)| {
            if std == 0.0 {
                return Ok(None);
            }
            let by = SHIFT * std;
            let up = robot.mechanics(pose, Some((index, by)))?;
            let down = robot.mechanics(pose, Some((index, -by)))?;
            let [above, below] = [&up, &down].map(|side| Matrices::new(side.chain()));
            let matrices = above.difference(&below, 2.0 * by);
            Ok(Some(PerImperfection { matrices, sides: [up, down], by: 2.0 * by }))
        };
        let per_imperfection = robot.imperfection_stds().enumerate().map(shifted);
        let per_imperfection = per_imperfection.collect::<Result<Vec<_>, _>>()?;
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

    pub(crate) fn matrices(&self) -> &Matrices {
        &self.matrices
    }

    /// Where static stiffnesses are read: at the lower edge of the band, the lowest frequency that the records show.
    pub(crate) fn at_rest(&self) -> Place {
        let [lower, _] = self.robot.band_hz();
        Place::Static(TAU * lower)
    }

    /// Impedances of all springs and of all dampers.
    pub(crate) fn impedances(&self, place: Place) -> [DVector<Complex<f64>>; 2] {
        impedances(&self.mechanics, place)
    }

    /// Z.
    pub(crate) fn stiffness(&self, place: Place) -> DMatrix<Complex<f64>> {
        let [springs, dampers] = self.impedances(place);
        let Matrices { mass, gravity, .. } = &self.matrices;
        let mut z = assembled(mass, gravity, place);
        for (i, impedance) in (springs + dampers).iter().enumerate() {
            z[(i, i)] += impedance;
        }
        z
    }

    /// H for the first `loads` of the three forces and three torques. `None` where Z has no inverse.
    pub(crate) fn response(&self, place: Place, loads: usize) -> Option<Response> {
        let tip = self.tip(loads);
        let elongations = self.stiffness(place).lu().solve(&tip)?;
        Some(Response { value: tip.transpose() * &elongations, elongations })
    }

    /// ∂H by each coordinate of the robot.
    pub(crate) fn gradient(&self, place: Place, response: &Response) -> Vec<DMatrix<Complex<f64>>> {
        let e = &response.elongations;
        let loads = e.ncols();
        let mut gradient = self.per_coordinate(place, e);
        let first = gradient.len() - self.per_imperfection.len();
        for (own, total) in self.per_imperfection.iter().zip(&mut gradient[first..]) {
            let Some(own) = own else { continue };
            let tip = own.matrices.tip.columns(0, loads).map(Complex::from);
            let moved = tip.transpose() * e;
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
        let [springs, dampers] = self.impedances(place);
        let mut all = Vec::with_capacity(self.robot.coordinates());
        for joint in 0..self.size() / 6 {
            for impedances in [&springs, &dampers] {
                for row in 6 * joint..6 * joint + 6 {
                    let row_of = v.row(row);
                    all.push(row_of.transpose() * row_of * impedances[row]);
                }
            }
        }
        debug_assert_eq!(all.len() % OF_JOINT, 0);
        for own in &self.per_imperfection {
            let Some(own) = own else {
                all.push(DMatrix::zeros(v.ncols(), v.ncols()));
                continue;
            };
            let mut z = assembled(&own.matrices.mass, &own.matrices.gravity, place);
            let [up, down] = own.sides.each_ref().map(|side| {
                let [springs, dampers] = impedances(side, place);
                springs + dampers
            });
            for (i, change) in (up - down).iter().enumerate() {
                z[(i, i)] += change / Complex::from(own.by);
            }
            all.push(v.transpose() * z * v);
        }
        all
    }

    /// Loads of unit forces and torques at the tool, the first `loads` of them.
    fn tip(&self, loads: usize) -> DMatrix<Complex<f64>> {
        self.matrices.tip.columns(0, loads).map(Complex::from)
    }
}

/// `s² M + K_g`.
fn assembled(mass: &DMatrix<f64>, gravity: &DMatrix<f64>, place: Place) -> DMatrix<Complex<f64>> {
    match place {
        Place::At(s) => mass.map(|entry| s * s * entry) + gravity.map(Complex::from),
        Place::Static(_) => gravity.map(Complex::from),
    }
}

fn impedances(mechanics: &Mechanics, place: Place) -> [DVector<Complex<f64>>; 2] {
    let s = match place {
        Place::At(s) => s,
        Place::Static(omega) => Complex::new(0.0, omega),
    };
    let at = receptance::Complex { re: s.re, im: s.im };
    let joints = (0..mechanics.joints()).map(|joint| mechanics.impedance(joint, at));
    let [mut springs, mut dampers] = [Vec::new(), Vec::new()];
    for [of_springs, of_dampers] in joints {
        springs.extend(of_springs.map(|z| Complex::new(z.re, z.im)));
        dampers.extend(of_dampers.map(|z| Complex::new(z.re, z.im)));
    }
    if let Place::Static(_) = place {
        // What dissipates gives no load at rest. Hysteresis and drives leave the stiffness that they have at this frequency.
        springs.iter_mut().zip(&mut dampers).for_each(|(spring, damper)| {
            *spring = Complex::from(spring.re);
            *damper = Complex::from(damper.re);
        });
    }
    [DVector::from_vec(springs), DVector::from_vec(dampers)]
}
