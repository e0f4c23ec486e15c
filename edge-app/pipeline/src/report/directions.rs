//! Combinations of unknowns that the data determine poorly, in words.

use flexid_core::sought::{Coordinate, Sought};
use flexid_core::verdict::Direction;
use flexid_wire::confidence::{Share, WeakDirection};
use flexid_wire::text::clipped;

use super::residuals::Residuals;
use crate::names::enumerate;

/// Least share of an unknown that is named in a direction, as a part of the largest share.
const NAMED: f32 = 1.0 / 3.0;
/// Room for the names of unknowns, bytes. The line has 400.
const ROOM: usize = 240;

/// How poorly the data determine a direction.
#[derive(Clone, Copy, Debug)]
enum Told {
    /// The direction has this relative standard deviation.
    Relative(f64),
    /// The direction names a nuisance, which is in units of its prior's deviation. A percentage would have no meaning.
    AsBefore,
    /// The data do not determine the direction at all.
    Not,
}

/// Describes a direction in words. `names` are those of all unknowns.
pub(super) fn weak_direction(
    direction: &Direction,
    sought: &Sought,
    names: &[String],
    residuals: Residuals,
) -> WeakDirection {
    let with_name = |&(unknown, weight): &(u8, f32)| {
        names.get(usize::from(unknown)).map(|name| (name.as_str(), weight))
    };
    let shares: Vec<(&str, f32)> = direction.shares.iter().filter_map(with_name).collect();
    let deviation = residuals.inflate(direction.deviation);
    let told = match deviation {
        None => Told::Not,
        Some(_) if names_a_nuisance(direction, sought) => Told::AsBefore,
        Some(deviation) => Told::Relative(deviation),
    };
    WeakDirection {
        relative_std: deviation,
        text: clipped(words(&shares, told)),
        shares: shares
            .into_iter()
            .map(|(name, weight)| Share { name: clipped(name), weight })
            .collect(),
    }
}

/// Returns the number of directions that name parameters only. Other poses would determine them.
pub(super) fn of_parameters(sought: &Sought, directions: &[Direction]) -> usize {
    directions.iter().filter(|direction| !names_a_nuisance(direction, sought)).count()
}

fn names_a_nuisance(direction: &Direction, sought: &Sought) -> bool {
    let parameter = |unknown: u8| {
        matches!(
            sought.coordinate(unknown.into()),
            Some(Coordinate::Stiffness { .. } | Coordinate::Damping { .. })
        )
    };
    named(&direction.shares).any(|unknown| !parameter(unknown))
}

/// Returns the unknowns whose share is large enough to be named.
fn named<T: Copy>(shares: &[(T, f32)]) -> impl Iterator<Item = T> {
    let largest = shares.iter().map(|(_, weight)| weight.abs()).fold(0.0, f32::max);
    let takes_part = move |(_, weight): &&(T, f32)| weight.abs() >= NAMED * largest;
    shares.iter().filter(takes_part).map(|(who, _)| *who)
}

fn words(shares: &[(&str, f32)], told: Told) -> String {
    let names: Vec<&str> = named(shares).collect();
    let how_badly = match told {
        Told::Not if names.len() == 1 => return format!("{} is not told at all", names[0]),
        Told::Not => "not told at all".to_owned(),
        Told::AsBefore => "hardly better than [calibration]".to_owned(),
        Told::Relative(deviation) if deviation > 10.0 => "over 1000 %".to_owned(),
        Told::Relative(deviation) => format!("{:.0} %", 100.0 * deviation),
    };
    let what = if names.len() > 1 { "trade off in" } else { "is hardly told by" };
    format!("{} {what} these poses ({how_badly})", enumerate(&names, ROOM))
}

#[cfg(test)]
mod tests {
    use flexid_core::calibration::Nuisances;
    use flexid_wire::text::Text;

    use super::*;

    #[test]
    fn a_direction_is_told_by_those_who_matter() {
        let (a, b, c) = ("joint_1 tx stiffness", "joint_2 tx stiffness", "joint_2 rz damping");
        let cases = [
            (
                vec![(a, 0.8), (b, -0.55), (c, 0.2)],
                Told::Relative(0.312),
                "joint_1 tx stiffness and joint_2 tx stiffness trade off in these poses (31 %)",
            ),
            (
                vec![(c, 0.99), (a, 0.1)],
                Told::Relative(0.42),
                "joint_2 rz damping is hardly told by these poses (42 %)",
            ),
            (
                vec![(a, 0.6), (b, 0.6), (c, 0.5)],
                Told::Not,
                "joint_1 tx stiffness, joint_2 tx stiffness and joint_2 rz damping trade off in \
                 these poses (not told at all)",
            ),
            (
                vec![(a, 1.0)],
                Told::Relative(50.0),
                "joint_1 tx stiffness is hardly told by these poses (over 1000 %)",
            ),
        ];
        for (shares, told, expected) in cases {
            assert_eq!(words(&shares, told), expected);
        }
    }

    #[test]
    fn the_longest_line_fits() {
        for length in 1..=ROOM - 2 {
            let name = "j".repeat(length);
            let shares = [(name.as_str(), 0.4); 6];
            for told in [Told::Relative(1e9), Told::Relative(3.0), Told::AsBefore, Told::Not] {
                for count in 1..=6 {
                    let text = words(&shares[..count], told);
                    assert!(text.len() <= Text::new().capacity(), "{}: {text}", text.len());
                    assert!(text.ends_with(')') || text.ends_with(" at all"), "{text}");
                }
            }
        }
    }

    /// The data never separate a gain of the force from one of the acceleration. The prior alone keeps them, to 5 % each.
    #[test]
    fn of_nuisances_no_percentage_is_told() {
        let nuisances = Nuisances {
            acceleration_gain: Some(0.05),
            force_gain: Some(0.05),
            ..Nuisances::default()
        };
        let sought = Sought::new(1, &nuisances).unwrap();
        let names: Vec<String> =
            (0..sought.unknowns()).map(|number| format!("u{number}")).collect();
        let direction = |deviation, shares: &[(u8, f32)]| Direction {
            deviation,
            shares: shares.iter().copied().collect(),
        };
        let gains = direction(1.0, &[(12, 0.7), (15, -0.7)]);
        let damping = direction(1.0, &[(11, 0.9), (12, 0.2)]);
        let text = |direction: &Direction| {
            let residuals = Residuals::noise(1.0);
            weak_direction(direction, &sought, &names, residuals).text.to_string()
        };
        assert_eq!(
            text(&gains),
            "u12 and u15 trade off in these poses (hardly better than [calibration])"
        );
        assert_eq!(text(&damping), "u11 is hardly told by these poses (100 %)");
        assert_eq!(of_parameters(&sought, &[gains, damping]), 1);
    }
}
