//! What is identified: 6 stiffnesses and 6 dampings of every joint, and the bounds they lie in.

use heapless::Vec;

use crate::{DOF, MAX_JOINTS};

/// Most parameters: 12 per joint.
pub const MAX_PARAMETERS: usize = 2 * DOF * MAX_JOINTS;

/// The springs and dampers of one joint, in the order `tx ty tz rx ry rz`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bushing {
    /// N/m for translations, Nm/rad for rotations.
    pub stiffness: [f64; DOF],
    /// Ns/m for translations, Nms/rad for rotations.
    pub damping: [f64; DOF],
}

/// One bushing per joint, base first.
pub type Bushings = Vec<Bushing, MAX_JOINTS>;

/// The ranges that the parameters are sought in, the same for every joint, `[lower, upper]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// N/m for translations, Nm/rad for rotations.
    pub stiffness: [[f64; 2]; DOF],
    /// Ns/m for translations, Nms/rad for rotations.
    pub damping: [[f64; 2]; DOF],
}

/// A range that cannot be searched: not `0 < lower < upper < ∞`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EmptyBounds {
    /// Whether it is the damping's range, else the stiffness's.
    pub damping: bool,
    /// Degree of freedom, 0..6.
    pub dof: usize,
}

impl Bounds {
    /// Bounds that differ between translations and rotations only.
    pub fn new(
        stiffness_translation: [f64; 2],
        stiffness_rotation: [f64; 2],
        damping_translation: [f64; 2],
        damping_rotation: [f64; 2],
    ) -> Result<Self, EmptyBounds> {
        let spread = |translation, rotation| {
            core::array::from_fn(|dof| if dof < 3 { translation } else { rotation })
        };
        let bounds = Self {
            stiffness: spread(stiffness_translation, stiffness_rotation),
            damping: spread(damping_translation, damping_rotation),
        };
        bounds.check().map(|()| bounds)
    }

    /// Whether every range is `0 < lower < upper < ∞`.
    pub fn check(&self) -> Result<(), EmptyBounds> {
        for (damping, ranges) in [(false, &self.stiffness), (true, &self.damping)] {
            for (dof, &[lower, upper]) in ranges.iter().enumerate() {
                if !(0.0 < lower && lower < upper && upper.is_finite()) {
                    return Err(EmptyBounds { damping, dof });
                }
            }
        }
        Ok(())
    }

    /// Parameters from `fractions` of the bounds, 0 to 1: joint by joint, six stiffnesses, then six dampings.
    pub fn bushings(&self, fractions: &[f32]) -> Bushings {
        let within =
            |fraction: f32, [lower, upper]: [f64; 2]| lower + f64::from(fraction) * (upper - lower);
        let (joints, _) = fractions.as_chunks::<{ 2 * DOF }>();
        joints
            .iter()
            .map(|joint| Bushing {
                stiffness: core::array::from_fn(|dof| within(joint[dof], self.stiffness[dof])),
                damping: core::array::from_fn(|dof| within(joint[DOF + dof], self.damping[dof])),
            })
            .collect()
    }

    /// Logarithms of the lower and upper ends for a chain of `joints`, in the order of [`logarithms`].
    pub(crate) fn logarithms(
        &self,
        joints: usize,
    ) -> ([f64; MAX_PARAMETERS], [f64; MAX_PARAMETERS]) {
        let end = |which: usize| {
            let bushing = Bushing {
                stiffness: self.stiffness.map(|range| range[which]),
                damping: self.damping.map(|range| range[which]),
            };
            let bushings: Bushings = (0..joints).map(|_| bushing).collect();
            logarithms(&bushings)
        };
        (end(0), end(1))
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
