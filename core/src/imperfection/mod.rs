//! Imperfections: what is off by a little in every plant. `refine::plant` fits them; any fit seeks those that its
//! [`Sought`](crate::sought::Sought) names, each with a prior of its own.
//!
//! A plant is never quite the one that the configuration describes: a mass, a mounting angle or a joint angle differs by a little.
//! Each [`Imperfection`] has a value p, whose prior is a normal distribution about zero; [`Accuracies`] give its standard deviation. Of
//! those that [cannot be negative](Imperfection::is_positive) only the half above zero counts.
//! A fit projects the imperfections out with their priors, as it projects out the seams. Where the data determine an imperfection,
//! it is thereby sought; where they do not, it widens the intervals of the parameters that it affects (a _considered_ parameter:
//! Schmidt, "Application of state-space methods to navigation problems", 1966; Bierman, _Factorization Methods for Discrete
//! Sequential Estimation_, 1977, chapter 8).
//!
//! A row of [`FACTS`] has all facts of a kind, and a row of [`ENTRIES`] those of its accuracy: configuration, reports and exports read them.
//! A further kind has its physics in `refine::plant`, its advice in `flexid_wire::accuracy`, and its place in the simulator's plant.

mod accuracies;
mod correction;
mod kinds;

use heapless::Vec;

pub use accuracies::{Accuracies, ENTRIES, Entry, Form, SensorAccuracies};
pub(crate) use correction::Correction;
pub(crate) use kinds::KINDS;
pub use kinds::{
    FACTS, Facts, GROUND_LAG, Group, Imperfection, Place, SPREAD_OVER_INERTIA, Sensor, Stated,
    possible,
};

use crate::chain::{Chain, JointKind};
use crate::search::MAX_EXPERIMENTS;

/// Frequency at which stiffness and damping are stated where they depend on it, Hz, whatever the band. Chosen: on a logarithmic scale the
/// middle of the modes of a milling robot's drives and tool, 8 to 50 Hz, and of the usual band, 2 to 200 Hz.
pub const REFERENCE_HZ: f64 = 20.0;
/// Mass of a base over that of the moving links. The published file of a KUKA iiwa 14 has 0.29, that of a Universal Robots UR10e 0.14.
pub const BASE_OVER_MOVING: f64 = 0.2;
/// Largest number of imperfections of a chain.
pub const MAX_IMPERFECTIONS: usize = {
    let (mut sum, mut kind) = (0, 0);
    while kind < KINDS {
        sum += FACTS[kind].most;
        kind += 1;
    }
    sum
};

/// An imperfection that a fit has found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundImperfection {
    /// The imperfection.
    pub imperfection: Imperfection,
    /// Standard deviation of its prior, in the unit of the [`Imperfection`]: its accuracy times [`Imperfection::prior_over_accuracy`], or that with
    /// which it is sought.
    pub prior: f64,
    /// Most likely value, in the same unit.
    pub value: f64,
    /// Standard deviation of that value, in the same unit.
    pub deviation: f64,
}

impl Imperfection {
    /// Returns whether a robot of this chain can have it, in one of the records that a fit takes.
    pub fn is_of(self, chain: &Chain) -> bool {
        let is_with_another = self.facts().stated == Stated::WithAnother;
        is_with_another || possible(&chain.kinds(), MAX_EXPERIMENTS).any(|own| own == self)
    }

    /// Standard deviation of its prior over its accuracy.
    pub fn prior_over_accuracy(self) -> f64 {
        self.facts().prior_over_accuracy
    }

    /// Returns whether it cannot be less than zero.
    pub fn is_positive(self) -> bool {
        self.facts().is_positive
    }

    /// The sign with which its value is the exponent of what a force, as read, moves in proportion to; 0 where it is no logarithm. Compliances, inverse
    /// masses and gains that are larger by one factor leave the readings what they are.
    pub(crate) fn exponent(self) -> f64 {
        match self {
            Self::Gain(Sensor::Force, _) => 1.0,
            _ if self.facts().is_factor => -1.0,
            _ => 0.0,
        }
    }

    /// Returns whether it changes how the robot moves, and not only what its sensors read or a single record.
    pub fn is_of_robot(self) -> bool {
        match self.facts().group {
            Group::Geometry | Group::Impedance | Group::Ground | Group::Hose => true,
            Group::Reading | Group::Mounting | Group::Record => false,
        }
    }

    /// Returns whether it is one of record number `record` alone.
    pub(crate) fn is_of_record(self, record: usize) -> bool {
        matches!(self, Self::RecordDelay(own) | Self::RecordStiffness(own) if own == record)
    }

    /// Returns whether it is one of all stiffnesses in a record other than number `record`.
    pub(crate) fn is_of_another_record(self, record: usize) -> bool {
        matches!(self, Self::RecordStiffness(own) if own != record)
    }

    /// Returns whether its derivative is that of the model's matrices. Else its derivative is a multiple of readings, forces or impedances.
    pub(crate) fn is_of_model(self) -> bool {
        self.facts().is_of_model
    }
}

/// All imperfections that have an accuracy, each with the standard deviation of its prior, of a robot with these joints, base first, and so
/// many records.
pub(crate) fn all(
    accuracies: &Accuracies,
    joints: &[JointKind],
    records: usize,
) -> Vec<(Imperfection, f64), MAX_IMPERFECTIONS> {
    // The mass of the base has an effect where the ground gives way.
    let gives_way = accuracies.ground_translation > 0.0;
    possible(joints, records)
        .filter(|own| gives_way || *own != Imperfection::BaseMass)
        .map(|own| (own, own.prior(accuracies)))
        .filter(|(_, deviation)| *deviation > 0.0 && deviation.is_finite())
        .collect()
}

/// The effects of a low-pass beside its delay, each with its standard deviation, where the delay has this one, s. Those of a Butterworth low-pass of
/// second order, whose delay is τ, are τ³/6 and τ⁴/8. Chosen: one and a half times those of a delay of 2.3 standard deviations, from which
/// on its accuracy is contradicted.
pub(crate) fn of_low_pass(delay: f64) -> [(Imperfection, f64); 2] {
    let square = delay * delay;
    [
        (Imperfection::Dispersion, 3.0 * square * delay),
        (Imperfection::RollOff, 5.0 * square * square),
    ]
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Matrix3, Unit, Vector3};

    use super::*;
    use crate::MAX_JOINTS;
    use crate::chain::spread::SPREADS;
    use crate::chain::{Joint, Link};

    #[test]
    fn there_is_room_for_all() {
        let joints = [JointKind::Revolute; MAX_JOINTS];
        let mut all = all(&Accuracies::typical(), &joints, MAX_EXPERIMENTS);
        all.extend(of_low_pass(1e-3));
        assert_eq!(all.len(), MAX_IMPERFECTIONS);
        for (kind, facts) in FACTS.iter().enumerate() {
            let count = all.iter().filter(|(own, _)| own.kind() == kind).count();
            assert_eq!(count, facts.most, "{}", facts.name);
        }
        assert!(
            super::all(&Accuracies::default(), &[JointKind::Revolute], MAX_EXPERIMENTS).is_empty()
        );
    }

    /// Tests a robot with as many joints as there may be, and of one on a fixed joint.
    #[test]
    fn a_robot_can_have_what_all_of_it_are() {
        let typical = Accuracies::typical();
        let whole = all(&typical, &[JointKind::Revolute; MAX_JOINTS], MAX_EXPERIMENTS);
        for kinds in
            [&[JointKind::Revolute; MAX_JOINTS][..], &[JointKind::Fixed, JointKind::Revolute]]
        {
            let chain = chain(kinds);
            let own = all(&typical, kinds, MAX_EXPERIMENTS);
            for (imperfection, _) in &whole {
                let expected = own.iter().any(|(other, _)| other == imperfection);
                assert_eq!(imperfection.is_of(&chain), expected, "{imperfection:?}");
            }
        }
        let chain = chain(&[JointKind::Revolute; 2]);
        for beyond in [
            Imperfection::Gain(Sensor::Force, 3),
            Imperfection::Crosstalk(Sensor::Force, 1, 1),
            Imperfection::CentreOfMass(1, 3),
            Imperfection::Inertia(1, SPREADS),
            Imperfection::Inertia(2, 0),
            Imperfection::Ground(6),
            Imperfection::RecordDelay(MAX_EXPERIMENTS),
        ] {
            assert!(!beyond.is_of(&chain), "{beyond:?}");
        }
    }

    fn chain(kinds: &[JointKind]) -> Chain {
        let joint = |&kind: &JointKind| Joint {
            origin: Isometry3::identity(),
            axis: Unit::new_normalize(Vector3::z()),
            kind,
            link: Link {
                mass: 3.0,
                centre_of_mass: Vector3::zeros(),
                inertia: Matrix3::identity(),
            },
        };
        let joints: std::vec::Vec<Joint> = kinds.iter().map(joint).collect();
        Chain::new(&joints, Isometry3::identity()).unwrap()
    }

    #[test]
    fn a_fixed_joint_has_a_body_and_a_bushing_alone() {
        let of = |kind| all(&Accuracies::typical(), &[JointKind::Revolute, kind], 2);
        let of_drive = [Imperfection::JointAngle(1), Imperfection::Servo(1)];
        let mut expected = of(JointKind::Revolute);
        expected.retain(|(imperfection, _)| !of_drive.contains(imperfection));
        assert_eq!(of(JointKind::Fixed), expected);
    }
}
