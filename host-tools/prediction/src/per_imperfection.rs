//! Derivatives of the dynamic stiffness and of the loads by an imperfection: central differences, one-sided where it cannot be less.

use flexid_core::chain::linearise::LinearisationError;
use flexid_core::refine::Mechanics;
use nalgebra::{Complex, DMatrix};

use crate::assembly::Matrices;
use crate::bushings::Bushings;
use crate::dynamics::Place;
use crate::robot::Robot;

/// Shift of an imperfection for a difference, in its standard deviations. Chosen: the error of a central difference grows with its square.
const SHIFT: f64 = 0.1;

/// Derivatives by an imperfection.
#[derive(Clone, Debug)]
pub(crate) struct PerImperfection {
    /// Of the mass matrix; `None` if it stays.
    mass: Option<DMatrix<f64>>,
    /// Of the stiffness beside that of the bushings; `None` if it stays.
    stiffness: Option<DMatrix<f64>>,
    /// Of the damping beside that of the bushings; `None` if it stays.
    damping: Option<DMatrix<f64>>,
    /// Of the loads of unit forces and torques at the tool.
    pub(crate) tip: DMatrix<f64>,
    /// The mechanics on both sides, if the bushings differ.
    sides: Option<[Mechanics; 2]>,
    /// Distance of the sides.
    by: f64,
}

impl PerImperfection {
    /// By imperfection `index`, whose standard deviation is `std`. The bushings are compared at `place`.
    pub(crate) fn new(
        robot: &Robot,
        pose: &[f64],
        index: usize,
        std: f64,
        place: Place,
    ) -> Result<Self, LinearisationError> {
        let up = SHIFT * std;
        let down = up.min(robot.room_below(index));
        let side = |shift: f64| robot.mechanics(pose, Some((index, shift)));
        let sides = [side(up)?, side(-down)?];
        let by = up + down;
        let [above, below] = sides.each_ref().map(Matrices::new);
        let Matrices { mass, stiffness, damping, tip } = above.difference(&below, by);
        let changed = |own: DMatrix<f64>| own.iter().any(|entry| *entry != 0.0).then_some(own);
        let [up, down] = sides.each_ref().map(|side| Bushings::new(side, place));
        let sides = (up != down).then_some(sides);
        let [mass, stiffness, damping] = [mass, stiffness, damping].map(changed);
        Ok(Self { mass, stiffness, damping, tip, sides, by })
    }

    /// `vᵀ ∂Z v`. `parts` are the real parts of v and, in further columns, the imaginary ones.
    pub(crate) fn of_stiffness(
        &self,
        place: Place,
        v: &DMatrix<Complex<f64>>,
        parts: &DMatrix<f64>,
    ) -> DMatrix<Complex<f64>> {
        let columns = v.ncols();
        let times = |matrix: &DMatrix<f64>| {
            let product = matrix * parts;
            DMatrix::from_fn(v.nrows(), columns, |i, j| {
                Complex::new(product[(i, j)], product[(i, columns + j)])
            })
        };
        let mut loads = DMatrix::zeros(v.nrows(), columns);
        if let (Some(mass), Place::At(s)) = (&self.mass, place) {
            loads += times(mass) * (s * s);
        }
        if let (Some(damping), Place::At(s)) = (&self.damping, place) {
            loads += times(damping) * s;
        }
        if let Some(stiffness) = &self.stiffness {
            loads += times(stiffness);
        }
        if let Some(sides) = &self.sides {
            let [up, down] = sides.each_ref().map(|side| Bushings::new(side, place).loads(v));
            loads += (up - down).unscale(self.by);
        }
        v.transpose() * loads
    }
}
