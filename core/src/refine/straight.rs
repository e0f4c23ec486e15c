//! Coordinates in which what the data leave open is straight: compliances of springs in series, and a common factor.

use crate::linear::normal::Derivatives;
use crate::sought::{Coordinate, Coordinates, MAX_UNKNOWNS, Sought};

/// The unknowns as compliances c, as b, as gains of the force, inverse masses and inverse gains of the acceleration, and as the other imperfections, at
/// some coordinates. Springs in series, and a common factor on all that the readings do not show, are straight in them.
pub(super) struct Straight<'a> {
    sought: &'a Sought,
    values: [f64; MAX_UNKNOWNS],
}

impl<'a> Straight<'a> {
    pub(super) fn at(sought: &'a Sought, coordinates: &Coordinates) -> Self {
        let own = sought.values(coordinates);
        let mut values = own;
        for unknown in 0..sought.unknowns() {
            values[unknown] = match sought.coordinate(unknown) {
                Some(Coordinate::Stiffness { .. }) => libm::exp(-own[unknown]),
                Some(Coordinate::Damping { .. }) => {
                    let stiffness = stiffness_of(sought, unknown).map_or(0.0, |k| own[k]);
                    libm::exp(own[unknown] - 2.0 * stiffness)
                }
                Some(other) => match exponent(sought, other) {
                    0.0 => own[unknown],
                    exponent => libm::exp(exponent * own[unknown]),
                },
                None => own[unknown],
            };
        }
        Self { sought, values }
    }

    /// Value of each.
    pub(super) fn values(&self) -> &[f64] {
        &self.values[..self.sought.unknowns()]
    }

    /// Goes to the coordinates where they have these values.
    pub(super) fn go_to(sought: &Sought, values: &[f64], coordinates: &mut Coordinates) {
        let mut unknowns = [0.0; MAX_UNKNOWNS];
        for (unknown, value) in values.iter().enumerate() {
            unknowns[unknown] = match sought.coordinate(unknown) {
                Some(Coordinate::Stiffness { .. }) => -libm::log(*value),
                Some(Coordinate::Damping { .. }) => {
                    let compliance = stiffness_of(sought, unknown).map_or(1.0, |k| values[k]);
                    libm::log(value / (compliance * compliance))
                }
                Some(other) => match exponent(sought, other) {
                    0.0 => *value,
                    exponent => libm::log(*value) / exponent,
                },
                None => *value,
            };
        }
        for (index, unknown) in sought.sought() {
            coordinates[index] = unknowns[unknown];
        }
    }

    /// Derivative of an imperfection that has this value by its unknown.
    fn slope(&self, imperfection: Option<Coordinate>, value: f64) -> f64 {
        match imperfection.map_or(0.0, |own| exponent(self.sought, own)) {
            0.0 => 1.0,
            exponent => exponent * value,
        }
    }

    /// Derivatives of each by the unknowns.
    pub(super) fn by_unknowns(&self) -> impl Iterator<Item = Derivatives> {
        (0..self.sought.unknowns()).map(|own| self.of_one(own))
    }

    /// Derivatives of each unknown by them.
    pub(super) fn of_unknowns(&self) -> impl Iterator<Item = Derivatives> {
        (0..self.sought.unknowns()).map(|unknown| self.of_unknown(unknown))
    }

    fn of_one(&self, own: usize) -> Derivatives {
        let value = self.values[own];
        match self.sought.coordinate(own) {
            Some(Coordinate::Stiffness { .. }) => [(own, -value)].into_iter().collect(),
            Some(Coordinate::Damping { .. }) => {
                let by_stiffness = stiffness_of(self.sought, own).map(|k| (k, -2.0 * value));
                [(own, value)].into_iter().chain(by_stiffness).collect()
            }
            other => [(own, self.slope(other, value))].into_iter().collect(),
        }
    }

    fn of_unknown(&self, unknown: usize) -> Derivatives {
        let per = |own: usize| 1.0 / self.values[own];
        match self.sought.coordinate(unknown) {
            Some(Coordinate::Stiffness { .. }) => [(unknown, -per(unknown))].into_iter().collect(),
            Some(Coordinate::Damping { .. }) => {
                let by_compliance = stiffness_of(self.sought, unknown).map(|k| (k, -2.0 * per(k)));
                [(unknown, per(unknown))].into_iter().chain(by_compliance).collect()
            }
            other => {
                let by = 1.0 / self.slope(other, self.values[unknown]);
                [(unknown, by)].into_iter().collect()
            }
        }
    }
}

/// The factor on the value of an imperfection in the exponent of what a force, as read, moves in proportion to; 0 where it is no logarithm.
fn exponent(sought: &Sought, coordinate: Coordinate) -> f64 {
    let Coordinate::Imperfection(imperfection) = coordinate else { return 0.0 };
    let own = sought.imperfections().iter().find(|(own, _)| *own == imperfection);
    own.map_or(0.0, |(_, prior)| imperfection.exponent() * prior)
}

/// The unknown stiffness of the bushing whose damping this unknown is.
fn stiffness_of(sought: &Sought, unknown: usize) -> Option<usize> {
    match sought.coordinate(unknown)? {
        Coordinate::Damping { joint, dof } => sought.unknown(Coordinate::Stiffness { joint, dof }),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of springs and dampers, of a damper whose spring is fixed, and of imperfections.
    #[test]
    fn derivatives_of_compliance_and_loss_equal_finite_differences() {
        let mut sought = Sought::new(1).unwrap();
        for key in ["delay_s", "acceleration_gain", "force_gain", "link_mass"] {
            sought.seek(key, 0.2).unwrap();
        }
        sought.fix(Coordinate::Stiffness { joint: 0, dof: 1 }, 2.0).unwrap();
        let mut coordinates = [0.0; MAX_UNKNOWNS];
        for (index, value) in coordinates.iter_mut().enumerate() {
            *value = 0.3 - 0.05 * index as f64;
        }
        let straight = Straight::at(&sought, &coordinates);
        let moved = |unknown: usize, by: f64| {
            let (mut moved, mut step) = (coordinates, [0.0; MAX_UNKNOWNS]);
            step[unknown] = by;
            sought.advance(&mut moved, &step);
            Straight::at(&sought, &moved).values
        };
        let mut back = [0.5; MAX_UNKNOWNS];
        Straight::go_to(&sought, straight.values(), &mut back);
        for (index, unknown) in sought.sought() {
            assert!((back[index] - coordinates[index]).abs() < 1e-12, "{unknown}");
        }
        let mut product = [[0.0; MAX_UNKNOWNS]; MAX_UNKNOWNS];
        for own in 0..sought.unknowns() {
            let derivatives = straight.of_one(own);
            for unknown in 0..sought.unknowns() {
                let numeric = (moved(unknown, 1e-5)[own] - moved(unknown, -1e-5)[own]) / 2e-5;
                let ours = derivatives.iter().find(|(other, _)| *other == unknown);
                let ours = ours.map_or(0.0, |(_, by)| *by);
                assert!((ours - numeric).abs() < 1e-8, "{own} {unknown}: {ours} {numeric}");
            }
            for (unknown, by) in straight.of_one(own) {
                for (other, back) in straight.of_unknown(unknown) {
                    product[own][other] += by * back;
                }
            }
        }
        for (own, row) in product.iter().enumerate().take(sought.unknowns()) {
            for (other, value) in row.iter().enumerate() {
                let expected = f64::from(own == other);
                assert!((value - expected).abs() < 1e-12, "{own} {other}: {value}");
            }
        }
    }
}
