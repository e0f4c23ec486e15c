//! Parameters: 6 stiffnesses and 6 dampings of every joint, and the bounds they lie in.

use core::error::Error;
use core::f64::consts::TAU;
use core::fmt;

use heapless::Vec;

use crate::chain::Chain;
use crate::{DOF, DOF_NAMES, MAX_JOINTS};

/// Most parameters: 12 per joint.
pub const MAX_PARAMETERS: usize = 2 * DOF * MAX_JOINTS;

/// Ranges whose ends differ by more than this factor are searched on the scale of the fourth root.
const WIDE: f64 = 1000.0;

/// Lowest and highest natural frequency of a bushing with all that it carries, Hz. A robot softer than the lower one would not hold
/// its own weight (it sags by g/ω² = 6 cm). A bushing harder than the upper one does not bend in any band that is fitted.
pub const NATURAL_HZ: [f64; 2] = [2.0, 2000.0];
/// Lowest and highest damping ratio of a bushing with all that it carries. Modes of robots that mill have some per cent; the range
/// is ten times wider on both sides.
pub const DAMPING_RATIO: [f64; 2] = [1e-3, 0.3];

/// A parameter is on an end of its range up to this relative distance from it.
const ON_END: f64 = 1e-9;

/// The springs and dampers of one joint, in the order `tx ty tz rx ry rz`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bushing {
    /// Stiffnesses, N/m for translations, Nm/rad for rotations.
    pub stiffness: [f64; DOF],
    /// Dampings, Ns/m for translations, Nms/rad for rotations.
    pub damping: [f64; DOF],
}

/// One bushing per joint, base first.
pub type Bushings = Vec<Bushing, MAX_JOINTS>;

/// Ranges of the parameters of one joint, `[lower, upper]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ranges {
    /// Ranges of the stiffnesses, N/m for translations, Nm/rad for rotations.
    pub stiffness: [[f64; 2]; DOF],
    /// Ranges of the dampings, Ns/m for translations, Nms/rad for rotations.
    pub damping: [[f64; 2]; DOF],
}

/// Ranges of the parameters of a chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Ranges of each joint, base first; those beyond the last joint of a chain have no meaning.
    pub joints: [Ranges; MAX_JOINTS],
}

/// A range that cannot be searched: not `0 < lower < upper < ∞`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EmptyBounds {
    /// Number of the joint, from 0, base first.
    pub joint: usize,
    /// True if it is the range of a damping; else it is that of a stiffness.
    pub damping: bool,
    /// Degree of freedom, 0..6.
    pub dof: usize,
}

impl fmt::Display for EmptyBounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = if self.damping { "damping" } else { "stiffness" };
        let (joint, dof) = (self.joint + 1, DOF_NAMES[self.dof]);
        write!(f, "range of joint {joint}'s {dof} {kind}: must be 0 < lower < upper, both finite")
    }
}

impl Error for EmptyBounds {}

/// This number of fractions fits no chain: a chain has 12 for each of 1 to [`MAX_JOINTS`] joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterCount(pub usize);

impl fmt::Display for ParameterCount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} parameters: a chain has 12 for each of 1 to {MAX_JOINTS} joints", self.0)
    }
}

impl Error for ParameterCount {}

/// An end of a range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Least value of a parameter.
    Lower,
    /// Largest value of a parameter.
    Upper,
}

impl End {
    /// The end of the range `[lower, upper]` that a value lies on, or beyond; `None` inside.
    pub fn reached([lower, upper]: [f64; 2], value: f64) -> Option<Self> {
        if value <= lower * (1.0 + ON_END) {
            Some(Self::Lower)
        } else if value >= upper * (1.0 - ON_END) {
            Some(Self::Upper)
        } else {
            None
        }
    }
}

impl Bounds {
    /// Bounds that are the same for every joint, and differ between translations and rotations only.
    ///
    /// # Errors
    ///
    /// Returns an error for the first range that is not `0 < lower < upper < ∞`.
    pub fn new(
        stiffness_translation: [f64; 2],
        stiffness_rotation: [f64; 2],
        damping_translation: [f64; 2],
        damping_rotation: [f64; 2],
    ) -> Result<Self, EmptyBounds> {
        let spread = |translation, rotation| {
            core::array::from_fn(|dof| if dof < 3 { translation } else { rotation })
        };
        let bounds = Self::alike(Ranges {
            stiffness: spread(stiffness_translation, stiffness_rotation),
            damping: spread(damping_translation, damping_rotation),
        });
        bounds.check().map(|()| bounds)
    }

    /// Bounds from the inertias of the chain alone. Each bushing by itself, with all that its joint carries, has a natural
    /// frequency within [`NATURAL_HZ`] and a damping ratio within [`DAMPING_RATIO`]: `k = m ω²`, `d = 2 ζ m ω`.
    pub fn of(chain: &Chain) -> Self {
        let ranges = |inertia: &[f64; DOF]| Ranges {
            stiffness: inertia.map(|m| NATURAL_HZ.map(|f| m * (TAU * f) * (TAU * f))),
            damping: inertia.map(|m| {
                core::array::from_fn(|end| 2.0 * DAMPING_RATIO[end] * m * TAU * NATURAL_HZ[end])
            }),
        };
        let carried = chain.carried();
        // The ranges of joints that the chain does not have are never used.
        Self {
            joints: core::array::from_fn(|joint| ranges(carried.get(joint).unwrap_or(&[1.0; DOF]))),
        }
    }

    /// Bounds that are the same for every joint.
    pub fn alike(ranges: Ranges) -> Self {
        Self { joints: [ranges; MAX_JOINTS] }
    }

    /// Checks that every range is `0 < lower < upper < ∞`.
    ///
    /// # Errors
    ///
    /// Returns an error for the first range that is not.
    pub fn check(&self) -> Result<(), EmptyBounds> {
        for (joint, own) in self.joints.iter().enumerate() {
            for (damping, ranges) in [(false, &own.stiffness), (true, &own.damping)] {
                for (dof, &[lower, upper]) in ranges.iter().enumerate() {
                    if !(0.0 < lower && lower < upper && upper.is_finite()) {
                        return Err(EmptyBounds { joint, damping, dof });
                    }
                }
            }
        }
        Ok(())
    }

    /// Parameters from `fractions` of the bounds, 0 to 1: joint by joint, six stiffnesses, then six dampings.
    ///
    /// The scale is linear, as in the paper. Bounds wider than a factor of a thousand give hardly more than the order of magnitude,
    /// and there the scale is that of the fourth root. With bounds ten times wider on both sides than the reference scenario's,
    /// that scale finds 30 robots of 30, the linear scale 12 of 20. Within the scenario's bounds the linear scale finds more at the
    /// first start (59 of 60, the fourth root 55), and the logarithm less than either (63 of 100).
    ///
    /// # Errors
    ///
    /// Returns an error if the number of fractions is not twelve for each of 1 to [`MAX_JOINTS`] joints.
    pub fn bushings(&self, fractions: &[f32]) -> Result<Bushings, ParameterCount> {
        let (joints, rest) = fractions.as_chunks::<{ 2 * DOF }>();
        if !rest.is_empty() || !(1..=MAX_JOINTS).contains(&joints.len()) {
            return Err(ParameterCount(fractions.len()));
        }
        Ok(self.within(fractions))
    }

    /// [`bushings`](Self::bushings) without the check of the number; fractions beyond [`MAX_JOINTS`] joints are left out.
    pub(crate) fn within(&self, fractions: &[f32]) -> Bushings {
        let root = |value: f64| libm::sqrt(libm::sqrt(value));
        let within = |fraction: f32, [lower, upper]: [f64; 2]| {
            let between = |lower: f64, upper: f64| lower + f64::from(fraction) * (upper - lower);
            if upper > WIDE * lower {
                let root = between(root(lower), root(upper));
                (root * root * root * root).clamp(lower, upper)
            } else {
                between(lower, upper)
            }
        };
        let (joints, _) = fractions.as_chunks::<{ 2 * DOF }>();
        joints
            .iter()
            .zip(&self.joints)
            .map(|(joint, own)| Bushing {
                stiffness: core::array::from_fn(|dof| within(joint[dof], own.stiffness[dof])),
                damping: core::array::from_fn(|dof| within(joint[DOF + dof], own.damping[dof])),
            })
            .collect()
    }

    /// The middle of the bounds, by their logarithms, for a chain of `joints`.
    pub fn middle(&self, joints: usize) -> Bushings {
        let (lower, upper) = self.logarithms(joints);
        from_logarithms(&core::array::from_fn(|i| 0.5 * (lower[i] + upper[i])), joints)
    }

    /// The upper ends of the bounds, for a chain of `joints`: the stiffest robot.
    pub fn stiffest(&self, joints: usize) -> Bushings {
        self.ends(joints, 1)
    }

    /// Logarithms of the lower and upper ends for a chain of `joints`, in the order of [`logarithms`].
    pub(crate) fn logarithms(
        &self,
        joints: usize,
    ) -> ([f64; MAX_PARAMETERS], [f64; MAX_PARAMETERS]) {
        (logarithms(&self.ends(joints, 0)), logarithms(&self.ends(joints, 1)))
    }

    /// The lower (0) or the upper (1) ends for a chain of `joints`.
    fn ends(&self, joints: usize, which: usize) -> Bushings {
        let end = |own: &Ranges| Bushing {
            stiffness: own.stiffness.map(|range| range[which]),
            damping: own.damping.map(|range| range[which]),
        };
        self.joints.iter().take(joints).map(end).collect()
    }
}

/// Logarithms of the parameters: joint by joint, six stiffnesses, then six dampings; zero beyond the last joint.
pub(crate) fn logarithms(bushings: &Bushings) -> [f64; MAX_PARAMETERS] {
    let mut logarithms = [0.0; MAX_PARAMETERS];
    let values =
        bushings.iter().flat_map(|bushing| bushing.stiffness.into_iter().chain(bushing.damping));
    for (logarithm, value) in logarithms.iter_mut().zip(values) {
        *logarithm = libm::log(value);
    }
    logarithms
}

/// The inverse of [`logarithms`].
pub(crate) fn from_logarithms(logarithms: &[f64; MAX_PARAMETERS], joints: usize) -> Bushings {
    let (own, _) = logarithms.as_chunks::<{ 2 * DOF }>();
    own[..joints]
        .iter()
        .map(|joint| Bushing {
            stiffness: core::array::from_fn(|dof| libm::exp(joint[dof])),
            damping: core::array::from_fn(|dof| libm::exp(joint[DOF + dof])),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_does_not_take_a_value_off_its_end() {
        for (value, end) in [
            (1e7 * (1.0 + 1e-14), Some(End::Lower)),
            (1.000001e7, None),
            (1.999999e8, None),
            (2e8 * (1.0 - 1e-14), Some(End::Upper)),
            (3e8, Some(End::Upper)),
        ] {
            assert_eq!(End::reached([1e7, 2e8], value), end, "{value:e}");
        }
    }

    #[test]
    fn fractions_of_no_chain_are_refused() {
        let bounds = Bounds::new([1e7, 2e8], [1e6, 1e8], [1e2, 1e6], [1e1, 5e5]).expect("in order");
        for count in [0, 11, 13, 85, 96] {
            let fractions = std::vec![0.5; count];
            assert_eq!(bounds.bushings(&fractions).err(), Some(ParameterCount(count)));
        }
        assert_eq!(bounds.bushings(&[0.5; 84]).expect("seven joints").len(), 7);
    }

    #[test]
    fn fractions_cover_the_bounds() {
        let bounds = Bounds::new([1e7, 2e8], [1e6, 1e8], [1e2, 1e6], [1e1, 5e5]).expect("in order");
        let at = |fraction: f32| bounds.bushings(&[fraction; 12]).expect("one joint")[0];
        assert_eq!((at(0.0).stiffness[0], at(1.0).stiffness[0]), (1e7, 2e8));
        assert_eq!(at(0.5).stiffness[5], 0.5 * (1e6 + 1e8));
        let ends = [at(0.0).damping[0], at(1.0).damping[0]];
        assert!((ends[0] / 1e2 - 1.0).abs() < 1e-12 && (ends[1] / 1e6 - 1.0).abs() < 1e-12);
        // The mean of the fourth roots 3.162 and 31.62.
        assert!((at(0.5).damping[0] / 91_506.0 - 1.0).abs() < 1e-4, "{}", at(0.5).damping[0]);
    }
}
