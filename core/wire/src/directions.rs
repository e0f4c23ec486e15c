//! Combinations of unknowns that the data determine badly.

use core::fmt;

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::text::Label;
use crate::words::Enumeration;

/// Largest number of directions that are reported.
pub const MAX_DIRECTIONS: usize = 8;
/// Largest number of unknowns that a direction names.
pub const MAX_SHARES: usize = 6;

/// Least share of an unknown that a line names, as a part of the largest share.
const NAMED: f32 = 1.0 / 3.0;
/// Largest relative standard deviation that a line gives.
const LARGEST: f64 = 10.0;

/// A combination of unknowns that the data determine badly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct WeakDirection {
    /// Standard deviation along the direction: relative for parameters, whose logarithms are sought, and in units of the
    /// prior's standard deviation for nuisances; `None` if the data do not determine the direction at all.
    pub relative_std: Option<f64>,
    /// Unknowns with the largest components, largest first.
    pub shares: Vec<Share, MAX_SHARES>,
    /// True if one of the [`named`] unknowns is a nuisance.
    pub of_nuisance: bool,
}

/// Component of one unknown in a direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Share {
    /// Name of the unknown, one of [`Correlations::unknowns`](crate::confidence::Correlations::unknowns).
    pub name: Label,
    /// Component of the direction, whose length is 1 over all unknowns.
    pub weight: f32,
}

/// Returns the unknowns whose share is at least a third of the largest share: those that a line names.
pub fn named<T>(shares: impl Iterator<Item = (T, f32)> + Clone) -> impl Iterator<Item = T> {
    let largest = shares.clone().map(|(_, weight)| weight.abs()).fold(0.0, f32::max);
    shares.filter(move |(_, weight)| weight.abs() >= NAMED * largest).map(|(unknown, _)| unknown)
}

/// For example `joint_1 tx stiffness and joint_2 tx stiffness trade off in these poses (standard deviation 31 %)`. The
/// deviation is that of the combination. The line has none if it names a nuisance.
impl fmt::Display for WeakDirection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shares = self.shares.iter().map(|share| (&share.name, share.weight));
        let names: Vec<&Label, MAX_SHARES> = named(shares).collect();
        let alone = names.len() == 1;
        Enumeration { named: &names, more: 0 }.fmt(f)?;
        if alone && self.relative_std.is_none() {
            return f.write_str(" is not determined at all");
        }
        let what = if alone { "is hardly determined by" } else { "trade off in" };
        write!(f, " {what} these poses (")?;
        match self.relative_std {
            None => f.write_str("not determined at all")?,
            // The deviation is in units of the prior's, so that a percentage would have no meaning.
            Some(_) if self.of_nuisance => f.write_str("hardly better than [calibration]")?,
            Some(deviation) if deviation > LARGEST => {
                write!(f, "standard deviation over {:.0} %", 100.0 * LARGEST)?;
            }
            Some(deviation) => write!(f, "standard deviation {:.0} %", 100.0 * deviation)?,
        }
        f.write_str(")")
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;
    use crate::text::clipped;

    #[test]
    fn a_direction_is_described_by_its_large_shares() {
        let (a, b, c) = ("joint_1 tx stiffness", "joint_2 tx stiffness", "joint_2 rz damping");
        let cases: [(&[(&str, f32)], _, _, _); 6] = [
            (
                &[(a, 0.8), (b, -0.55), (c, 0.2)],
                Some(0.312),
                false,
                "joint_1 tx stiffness and joint_2 tx stiffness trade off in these poses (standard deviation 31 %)",
            ),
            (
                &[(c, 0.99), (a, 0.1)],
                Some(0.42),
                false,
                "joint_2 rz damping is hardly determined by these poses (standard deviation 42 %)",
            ),
            (
                &[(a, 0.6), (b, 0.6), (c, 0.5)],
                None,
                false,
                "joint_1 tx stiffness, joint_2 tx stiffness and joint_2 rz damping trade off in \
                 these poses (not determined at all)",
            ),
            (
                &[(a, 1.0)],
                Some(50.0),
                false,
                "joint_1 tx stiffness is hardly determined by these poses (standard deviation over 1000 %)",
            ),
            (&[(a, 1.0)], None, false, "joint_1 tx stiffness is not determined at all"),
            (
                &[("force gain x", 0.7), ("acceleration gain x", -0.7)],
                Some(1.0),
                true,
                "force gain x and acceleration gain x trade off in these poses \
                 (hardly better than [calibration])",
            ),
        ];
        for (shares, relative_std, of_nuisance, expected) in cases {
            let share = |&(name, weight): &(&str, f32)| Share { name: clipped(name), weight };
            let shares = shares.iter().map(share).collect();
            let direction = WeakDirection { relative_std, shares, of_nuisance };
            assert_eq!(direction.to_string(), expected);
        }
    }
}
