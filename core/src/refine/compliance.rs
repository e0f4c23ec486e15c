//! Steps along compliances.
//!
//! Springs in series trade off along `1/k₁ + 1/k₂ = const`: straight in the compliances c = 1/k, and a bend in ln k, along
//! which steps gain little. What a bushing adds to the receptance is, to the first order in its damping, `1/(k + s d) = c − s d c²`:
//! straight in c and in b = d c². A step of the linearised problem, a of ln k and a_d of ln d, is taken as one of these:
//!
//! ```text
//! c ← c (1 − a)     b ← b (1 + a_d − 2 a)     Δln k = −ln(1 − a)     Δln d = ln(1 + a_d − 2 a) + 2 Δln k
//! ```

use super::proposal::{Room, Step};
use crate::linear::normal::Derivatives;
use crate::sought::{Coordinate, Coordinates, MAX_UNKNOWNS, Sought};

/// Least part of a compliance that a step leaves. Chosen: no step makes a spring more than five times as stiff, which is as far as it is linear.
const LEAST_COMPLIANCE: f64 = 0.2;
/// Least and largest factor on b in a step. Chosen: as for [`LEAST_COMPLIANCE`].
const LOSS: [f64; 2] = [0.2, 5.0];

/// How far each unknown may go: a stiffness by the relative fall of its compliance, the others by their logarithms or
/// nuisances by themselves. `ranges` are those of [`Sought::ranges`].
pub(crate) fn room(sought: &Sought, ranges: &[[f64; 3]; MAX_UNKNOWNS], longest: f64) -> Room {
    let mut room = ranges.map(|[value, lower, upper]| {
        [(lower - value).clamp(-longest, 0.0), (upper - value).clamp(0.0, longest)]
    });
    for (unknown, room) in room.iter_mut().enumerate().take(sought.unknowns()) {
        if is_stiffness(sought, unknown) {
            *room = room.map(|logarithm| 1.0 - libm::exp(-logarithm));
        }
    }
    room
}

/// The step of the logarithms that a step of the linearised problem is, within `ranges`.
pub(crate) fn logarithms(sought: &Sought, ranges: &[[f64; 3]; MAX_UNKNOWNS], step: &Step) -> Step {
    let mut moved = *step;
    for unknown in 0..sought.unknowns() {
        let [value, lower, upper] = ranges[unknown];
        let within = |step: f64| step.clamp((lower - value).min(0.0), (upper - value).max(0.0));
        let stiffen = |a: f64| -libm::log((1.0 - a).max(LEAST_COMPLIANCE));
        moved[unknown] = match sought.coordinate(unknown) {
            Some(Coordinate::Stiffness { .. }) => within(stiffen(step[unknown])),
            Some(Coordinate::Damping { joint, dof }) => {
                let own = sought.unknown(Coordinate::Stiffness { joint, dof });
                let a = own.map_or(0.0, |own| step[own]);
                let [least, most] = LOSS;
                let loss = (1.0 + step[unknown] - 2.0 * a).clamp(least, most);
                within(libm::log(loss) + 2.0 * stiffen(a))
            }
            _ => step[unknown],
        };
    }
    moved
}

/// The unknowns as compliances c, as b, as gains of the force, inverse masses and inverse gains of the acceleration, and as the other nuisances, at
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

    /// Derivative of a nuisance that has this value by its unknown.
    fn slope(&self, nuisance: Option<Coordinate>, value: f64) -> f64 {
        match nuisance.map_or(0.0, |own| exponent(self.sought, own)) {
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

/// The factor on the value of a nuisance in the exponent of what a force, as read, moves in proportion to; 0 where it is no logarithm.
fn exponent(sought: &Sought, nuisance: Coordinate) -> f64 {
    let sign = match nuisance {
        Coordinate::ForceGain(_) => 1.0,
        Coordinate::AccelerationGain(_) | Coordinate::Mass(_) => -1.0,
        _ => 0.0,
    };
    sign * sought.width(nuisance)
}

/// The unknown stiffness of the bushing whose damping this unknown is.
fn stiffness_of(sought: &Sought, unknown: usize) -> Option<usize> {
    match sought.coordinate(unknown)? {
        Coordinate::Damping { joint, dof } => sought.unknown(Coordinate::Stiffness { joint, dof }),
        _ => None,
    }
}

fn is_stiffness(sought: &Sought, unknown: usize) -> bool {
    matches!(sought.coordinate(unknown), Some(Coordinate::Stiffness { .. }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::Nuisances;

    const WIDE: [[f64; 3]; MAX_UNKNOWNS] = [[0.0, -50.0, 50.0]; MAX_UNKNOWNS];

    fn moved(step: [f64; 2]) -> [f64; 2] {
        let sought = Sought::new(1, &Nuisances::default()).unwrap();
        let mut whole = [0.0; MAX_UNKNOWNS];
        let unknown = |coordinate| sought.unknown(coordinate).unwrap();
        let [k, d] = [
            unknown(Coordinate::Stiffness { joint: 0, dof: 2 }),
            unknown(Coordinate::Damping { joint: 0, dof: 2 }),
        ];
        [whole[k], whole[d]] = step;
        let moved = logarithms(&sought, &WIDE, &whole);
        [moved[k], moved[d]]
    }

    /// To the first order a step is that of the logarithms; beyond it a spring's compliance falls by a, its loss as it says.
    #[test]
    fn steps_are_straight_in_compliance_and_loss() {
        let [k, d] = moved([1e-6, -2e-6]);
        assert!((k - 1e-6).abs() < 1e-11 && (d + 2e-6).abs() < 1e-11, "{k:e} {d:e}");
        let (a, a_d) = (-0.7, 0.4);
        let [k, d] = moved([a, a_d]);
        // Of a unit spring and damper: c = 1/k, b = d c².
        let c = libm::exp(-k);
        let b = libm::exp(d) * c * c;
        assert!((c - (1.0 - a)).abs() < 1e-12, "{c}");
        assert!((b - (1.0 + a_d - 2.0 * a)).abs() < 1e-12, "{b}");
        // No further than a fifth.
        assert!((moved([0.99, 0.0])[0] - libm::log(5.0)).abs() < 1e-12);
    }

    /// Of springs and dampers, of a damper whose spring is fixed, and of nuisances.
    #[test]
    fn derivatives_of_compliance_and_loss_equal_finite_differences() {
        let own = Some(0.2);
        let all = Nuisances {
            delay: own,
            acceleration_gain: own,
            force_gain: own,
            misalignment: own,
            mass: own,
        };
        let mut sought = Sought::new(1, &all).unwrap();
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

    /// A step to the end of a room ends at the end of the range.
    #[test]
    fn the_room_ends_where_the_range_does() {
        let sought = Sought::new(1, &Nuisances::default()).unwrap();
        let mut ranges = WIDE;
        ranges[0] = [0.0, -0.3, 0.4];
        let room = room(&sought, &ranges, 1.0);
        for (end, expected) in room[0].into_iter().zip([-0.3, 0.4]) {
            let mut step = [0.0; MAX_UNKNOWNS];
            step[0] = end;
            assert!((logarithms(&sought, &ranges, &step)[0] - expected).abs() < 1e-12);
        }
    }
}
