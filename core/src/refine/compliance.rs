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
use crate::sought::{Coordinate, MAX_UNKNOWNS, Sought};

/// Least part of a compliance that a step leaves. Chosen: no step makes a spring more than five times as stiff, which is as far as it is linear.
const LEAST_COMPLIANCE: f64 = 0.2;
/// Least and largest factor on b in a step. Chosen: as for [`LEAST_COMPLIANCE`].
const LOSS: [f64; 2] = [0.2, 5.0];

/// How far each unknown may go: a stiffness by the relative fall of its compliance, the others by their logarithms or
/// imperfections by themselves. `ranges` are those of [`Sought::ranges`].
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

fn is_stiffness(sought: &Sought, unknown: usize) -> bool {
    matches!(sought.coordinate(unknown), Some(Coordinate::Stiffness { .. }))
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDE: [[f64; 3]; MAX_UNKNOWNS] = [[0.0, -50.0, 50.0]; MAX_UNKNOWNS];

    fn moved(step: [f64; 2]) -> [f64; 2] {
        let sought = Sought::new(1).unwrap();
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

    /// A step to the end of a room ends at the end of the range.
    #[test]
    fn the_room_ends_where_the_range_does() {
        let sought = Sought::new(1).unwrap();
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
