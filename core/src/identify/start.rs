//! Points at which the starts begin.

use rand_core::Rng;

use crate::parameters::Bounds;
use crate::sought::{Coordinate, Coordinates, MAX_UNKNOWNS, Sought};

/// Method of a start to find the basin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Method {
    /// A descent from the lowest frequencies upward ([`super::descent`]).
    Descent,
    /// The paper's incremental random search (its section 4).
    RandomSearch,
}

/// One start in so many is a random search. Chosen: the two methods fail on different robots, and the minimum of a wrong model is reached by both
/// before it is believed. A descent takes a tenth of the time.
const RANDOM_SEARCH: u32 = 4;
/// Part of the bounds' logarithms, about their middle, in which the stiffnesses of later descents begin: of six decades nearly five. Chosen: from
/// parts of 0.6 and 1 about as many descents find the basin.
const SPREAD: f64 = 0.8;

impl Method {
    /// Method of a start, by how many went before it on the same records.
    pub(super) fn after(starts: u32) -> Self {
        if starts % RANDOM_SEARCH == RANDOM_SEARCH - 1 { Self::RandomSearch } else { Self::Descent }
    }
}

/// Start of the first descent: the middle of the bounds.
pub(super) fn middle(bounds: &Bounds, sought: &Sought) -> Coordinates {
    sought.coordinates(&bounds.middle(sought.joints()))
}

/// Start of a later descent: each stiffness anywhere about the middle, with its damping ratio.
pub(super) fn elsewhere(bounds: &Bounds, sought: &Sought, generator: &mut impl Rng) -> Coordinates {
    let mut start = middle(bounds, sought);
    let mut step = [0.0; MAX_UNKNOWNS];
    let ranges = sought.ranges(&start, bounds);
    for (unknown, [value, lower, upper]) in ranges.into_iter().enumerate().take(sought.unknowns()) {
        let Some(Coordinate::Stiffness { joint, dof }) = sought.coordinate(unknown) else {
            continue;
        };
        let uniform = f64::from(generator.next_u32()) / f64::from(u32::MAX);
        step[unknown] = SPREAD * (uniform - 0.5) * (upper - lower);
        if let Some(damping) = sought.unknown(Coordinate::Damping { joint, dof }) {
            let [middle, least, most] = ranges[damping];
            let stiffness = value + step[unknown];
            step[damping] = typical_damping([least, most], [lower, upper], stiffness) - middle;
        }
    }
    sought.advance(&mut start, &step);
    start
}

/// The logarithm of the damping whose ratio, `d/√k`, is that of the bounds' middle; on the nearest bound if that lies outside. All by
/// logarithms.
pub(super) fn typical_damping(damping: [f64; 2], bounds: [f64; 2], stiffness: f64) -> f64 {
    let [least, most] = damping;
    let middle = 0.5 * (least + most) - 0.25 * (bounds[0] + bounds[1]);
    (middle + 0.5 * stiffness).clamp(least, most)
}

/// Changes the stiffness of one unknown to this logarithm, within its bounds, and makes its damping [typical](typical_damping).
pub(super) fn with_stiffness(
    sought: &Sought,
    bounds: &Bounds,
    from: &Coordinates,
    unknown: usize,
    logarithm: f64,
) -> Coordinates {
    let ranges = sought.ranges(from, bounds);
    let [value, lower, upper] = ranges[unknown];
    let mut step = [0.0; MAX_UNKNOWNS];
    let logarithm = logarithm.clamp(lower, upper);
    step[unknown] = logarithm - value;
    let damping = match sought.coordinate(unknown) {
        Some(Coordinate::Stiffness { joint, dof }) => {
            sought.unknown(Coordinate::Damping { joint, dof })
        }
        _ => None,
    };
    if let Some(damping) = damping {
        let [value, least, most] = ranges[damping];
        step[damping] = typical_damping([least, most], [lower, upper], logarithm) - value;
    }
    let mut changed = *from;
    sought.advance(&mut changed, &step);
    changed
}

#[cfg(test)]
pub(super) mod tests {
    use proptest::prelude::*;
    use rand_core::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::DOF;

    /// Two joints, and bounds of six decades.
    pub(in crate::identify) fn two_joints() -> (Sought, Bounds) {
        let sought = Sought::new(2).unwrap();
        (sought, Bounds::new([1e4, 1e10], [1e3, 1e9], [1e1, 1e7], [1.0, 1e6]).unwrap())
    }

    /// Each parameter of [`two_joints`] at a place within its bounds, from 0 to 1.
    pub(in crate::identify) fn within_the_bounds(places: &[f64; 24]) -> Coordinates {
        let (sought, bounds) = two_joints();
        let (lower, upper) = bounds.logarithms(2);
        let mut within = middle(&bounds, &sought);
        for (index, place) in places.iter().enumerate() {
            within[index] = lower[index] + place * (upper[index] - lower[index]);
        }
        within
    }

    proptest! {
        /// The stiffness has the logarithm that is given, its damping ratio lies in the middle, both within the bounds; nothing else
        /// has changed.
        #[test]
        fn one_stiffness_and_its_damping_change(
            bushing in 0..12_usize, logarithm in 5.0..20.0_f64, places in prop::array::uniform24(0.0..1.0_f64),
        ) {
            let (sought, bounds) = two_joints();
            let (lower, upper) = bounds.logarithms(2);
            let from = within_the_bounds(&places);
            let k = 2 * DOF * (bushing / DOF) + bushing % DOF;
            let d = k + DOF;
            let changed = with_stiffness(&sought, &bounds, &from, k, logarithm);
            prop_assert!((changed[k] - logarithm.clamp(lower[k], upper[k])).abs() < 1e-9);
            let middle = |index: usize| 0.5 * (lower[index] + upper[index]);
            let typical = middle(d) + 0.5 * (changed[k] - middle(k));
            prop_assert!((changed[d] - typical.clamp(lower[d], upper[d])).abs() < 1e-9);
            for other in (0..24).filter(|other| ![k, d].contains(other)) {
                prop_assert!((changed[other] - from[other]).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn one_start_in_four_is_a_random_search() {
        let searches = (0..8).filter(|starts| Method::after(*starts) == Method::RandomSearch);
        assert!(searches.eq([3, 7]));
    }

    /// Every start lies in the middle four fifths of the bounds of stiffness, and anywhere there, with the damping ratio of the
    /// middle.
    #[test]
    fn later_descents_begin_about_the_middle() {
        let (sought, bounds) = two_joints();
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let width = libm::log(1e6);
        let middle = middle(&bounds, &sought);
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for _ in 0..200 {
            let start = elsewhere(&bounds, &sought, &mut random);
            let off = |parameter: usize| (start[parameter] - middle[parameter]) / width;
            for bushing in 0..12 {
                let k = 2 * DOF * (bushing / DOF) + bushing % DOF;
                (least, most) = (least.min(off(k)), most.max(off(k)));
                assert!((off(k + DOF) - 0.5 * off(k)).abs() < 1e-12);
            }
        }
        assert!((-0.4..-0.399).contains(&least), "{least}");
        assert!((0.399..0.4).contains(&most), "{most}");
    }
}
