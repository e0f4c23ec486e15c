//! Values of the coordinates, and what they are: parameters, imperfections, values and bounds of the unknowns.

use heapless::Vec;

use super::{Coordinate, MAX_SOUGHT, MAX_UNKNOWNS, Role, Sought};
use crate::imperfection::{FoundImperfection, Imperfection};
use crate::parameters::{Bounds, Bushings, MAX_PARAMETERS, from_logarithms, logarithms};
use crate::verdict::Covariance;

/// Standard deviation of what may be anywhere between two bounds.
pub(crate) fn deviation_between(lower: f64, upper: f64) -> f64 {
    (upper - lower) / libm::sqrt(12.0)
}

/// One value per coordinate.
pub(crate) type Coordinates = [f64; MAX_UNKNOWNS];

/// Least standard deviation of the prior of a stiffness' logarithm. Chosen: a factor of e, so that none passes for known by its prior alone.
const LEAST_EXPECTED: f64 = 1.0;

/// An unknown stiffness and its prior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Expected {
    /// Number of the unknown.
    pub(crate) unknown: usize,
    /// Distance from the middle of the prior, in its standard deviations.
    pub(crate) value: f64,
    /// Derivative of that by the unknown.
    pub(crate) slope: f64,
}

impl Sought {
    /// Sets fixed parameters to their values, and tied parameters to the value of the first of them.
    pub fn impose(&self, bushings: &mut Bushings) {
        *bushings = self.bushings(&self.coordinates(bushings));
    }

    /// Coordinates of a guess, without imperfections.
    pub(crate) fn coordinates(&self, guess: &Bushings) -> Coordinates {
        let mut coordinates = [0.0; MAX_UNKNOWNS];
        coordinates[..MAX_PARAMETERS].copy_from_slice(&logarithms(guess));
        let mut shared = [None; MAX_UNKNOWNS];
        for (coordinate, role) in coordinates.iter_mut().zip(&self.roles) {
            match *role {
                Role::Absent => {}
                Role::Fixed(value) => *coordinate = libm::log(value),
                Role::Sought(unknown) => {
                    *coordinate = *shared[usize::from(unknown)].get_or_insert(*coordinate);
                }
            }
        }
        coordinates
    }

    /// Parameters at `coordinates`. Fixed parameters have exactly the value at which they are fixed.
    pub(crate) fn bushings(&self, coordinates: &Coordinates) -> Bushings {
        let logarithms = coordinates.first_chunk().unwrap_or(&[0.0; MAX_PARAMETERS]);
        let mut bushings = from_logarithms(logarithms, self.joints);
        let values = bushings.iter_mut().flat_map(|b| b.stiffness.iter_mut().chain(&mut b.damping));
        for (value, role) in values.zip(&self.roles) {
            if let Role::Fixed(fixed) = role {
                *value = *fixed;
            }
        }
        bushings
    }

    /// The imperfections that are sought, each with its value at `coordinates`.
    pub(crate) fn imperfections_at(
        &self,
        coordinates: &Coordinates,
    ) -> impl Iterator<Item = (Imperfection, f64)> {
        let values = coordinates[MAX_PARAMETERS..].iter();
        self.imperfections.iter().zip(values).map(|(&(own, prior), value)| (own, prior * value))
    }

    /// The imperfections that are sought, with their values at `coordinates` and standard deviations.
    pub(crate) fn found(
        &self,
        coordinates: &Coordinates,
        covariance: &Covariance,
    ) -> Vec<FoundImperfection, MAX_SOUGHT> {
        let values = self.imperfections_at(coordinates).zip(&self.imperfections).enumerate();
        let found = |(place, ((imperfection, value), &(_, prior)))| {
            let deviation = prior * covariance.deviation(self.parameters + place);
            FoundImperfection { imperfection, prior, value, deviation }
        };
        values.map(found).collect()
    }

    /// Value of each unknown.
    pub(crate) fn values(&self, coordinates: &Coordinates) -> [f64; MAX_UNKNOWNS] {
        let mut values = [0.0; MAX_UNKNOWNS];
        for (index, unknown) in self.sought() {
            values[unknown] = coordinates[index];
        }
        values
    }

    /// Value, lower bound and upper bound of each unknown. Imperfections have no bounds.
    pub(crate) fn ranges(
        &self,
        coordinates: &Coordinates,
        bounds: &Bounds,
    ) -> [[f64; 3]; MAX_UNKNOWNS] {
        let (lower, upper) = bounds.logarithms(self.joints);
        let mut ranges = [[0.0, f64::NEG_INFINITY, f64::INFINITY]; MAX_UNKNOWNS];
        for (index, unknown) in self.sought() {
            let range = &mut ranges[unknown];
            range[0] = coordinates[index];
            if index < MAX_PARAMETERS {
                range[1] = range[1].max(lower[index]);
                range[2] = range[2].min(upper[index]);
            }
        }
        ranges
    }

    /// Stiffnesses with a prior. Of a logarithm that may lie anywhere from a to b, the middle is `(a + b)/2` and the standard deviation
    /// `(b − a)/√12`.
    pub(crate) fn expected(
        &self,
        coordinates: &Coordinates,
        bounds: &Bounds,
    ) -> impl Iterator<Item = Expected> {
        let ranges = self.expects_stiffnesses.then(|| self.ranges(coordinates, bounds));
        let unknowns = if ranges.is_some() { self.parameters } else { 0 };
        (0..unknowns).filter_map(move |unknown| {
            let Coordinate::Stiffness { .. } = self.coordinate(unknown)? else { return None };
            let [value, lower, upper] = ranges?[unknown];
            let slope = 1.0 / deviation_between(lower, upper).max(LEAST_EXPECTED);
            Some(Expected { unknown, value: (value - 0.5 * (lower + upper)) * slope, slope })
        })
    }

    /// Moves coordinates by a step of the unknowns.
    pub(crate) fn advance(&self, coordinates: &mut Coordinates, step: &[f64]) {
        for (index, unknown) in self.sought() {
            coordinates[index] += step[unknown];
        }
    }

    /// Unknowns with a prior, each with its value in units of the prior's standard deviation.
    pub(crate) fn priors(&self, coordinates: &Coordinates) -> impl Iterator<Item = (usize, f64)> {
        let values = coordinates[MAX_PARAMETERS..].iter().take(self.imperfections.len());
        values.enumerate().map(|(place, value)| (self.parameters + place, *value))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::DOF;
    use crate::parameters::Bushing;

    proptest! {
        /// The derivative of the prior's residual is that of finite differences; fixed stiffnesses, dampings and imperfections have none, and
        /// tied stiffnesses share one.
        #[test]
        fn the_slope_of_a_prior_equals_finite_differences(
            at in prop::array::uniform24(1.0..30.0_f64),
            decades in 0.1..8.0_f64,
        ) {
            let range = [1e3, 1e3 * 10.0_f64.powf(decades)];
            let bounds = Bounds::new(range, range, range, range).unwrap();
            let mut sought = Sought::new(2).unwrap();
            sought.seek("delay_s", 1e-3).unwrap();
            let stiffness = |joint, dof| Coordinate::Stiffness { joint, dof };
            sought.fix(stiffness(0, 1), 1e5).unwrap();
            sought.tie(stiffness(1, 2), stiffness(0, 2)).unwrap();
            let mut coordinates = [0.0; MAX_UNKNOWNS];
            coordinates[..24].copy_from_slice(&at);
            prop_assert_eq!(sought.expected(&coordinates, &bounds).count(), 0);
            sought.expect_stiffnesses();
            let all: std::vec::Vec<Expected> = sought.expected(&coordinates, &bounds).collect();
            prop_assert_eq!(all.len(), 10);
            for (number, own) in all.iter().enumerate() {
                let moved = |by: f64| {
                    let (mut moved, mut step) = (coordinates, [0.0; MAX_UNKNOWNS]);
                    step[own.unknown] = by;
                    sought.advance(&mut moved, &step);
                    sought.expected(&moved, &bounds).nth(number).unwrap().value
                };
                let slope = (moved(1e-3) - moved(-1e-3)) / 2e-3;
                prop_assert!((slope / own.slope - 1.0).abs() < 1e-9, "{} {}", slope, own.slope);
                prop_assert!(own.slope <= 1.0);
            }
        }
    }

    #[test]
    fn what_is_fixed_comes_back_as_it_was_given() {
        let mut sought = Sought::new(2).unwrap();
        let (stiffness, damping) =
            (Coordinate::Stiffness { joint: 1, dof: 3 }, Coordinate::Damping { joint: 0, dof: 5 });
        // exp(ln(x)) differs from x for both values.
        sought.fix(stiffness, 6.0e7).unwrap();
        sought.fix(damping, 1.9e3).unwrap();
        let guess = Bushing { stiffness: [1e7; DOF], damping: [1e4; DOF] };
        let mut bushings = Bushings::from_iter([guess; 2]);
        sought.impose(&mut bushings);
        let found = sought.bushings(&sought.coordinates(&bushings));
        for bushings in [bushings, found] {
            assert_eq!((bushings[1].stiffness[3], bushings[0].damping[5]), (6.0e7, 1.9e3));
            assert!((bushings[0].stiffness[3] / 1e7 - 1.0).abs() < 1e-14);
        }
    }
}
