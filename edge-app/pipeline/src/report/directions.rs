//! Combinations of unknowns that the data determine poorly.

use flexid_core::sought::{Coordinate, Sought};
use flexid_core::verdict::Direction;
use flexid_wire::directions::{Share, WeakDirection, named};
use flexid_wire::text::Label;

use super::residuals::Residuals;

/// Makes the message of a direction. `names` are those of all unknowns.
pub(super) fn weak_direction(
    direction: &Direction,
    sought: &Sought,
    names: &[Label],
    residuals: Residuals,
) -> WeakDirection {
    let share = |&(unknown, weight): &(u8, f32)| {
        let name = names.get(usize::from(unknown))?.clone();
        Some(Share { name, weight })
    };
    WeakDirection {
        relative_std: residuals.inflate(direction.deviation),
        shares: direction.shares.iter().filter_map(share).collect(),
        of_nuisance: names_a_nuisance(direction, sought),
    }
}

/// Returns the number of directions that name parameters only. Other poses would determine them.
pub(super) fn of_parameters(sought: &Sought, directions: &[Direction]) -> usize {
    directions.iter().filter(|direction| !names_a_nuisance(direction, sought)).count()
}

fn names_a_nuisance(direction: &Direction, sought: &Sought) -> bool {
    let is_nuisance = |unknown: u8| {
        matches!(sought.coordinate(unknown.into()), None | Some(Coordinate::Imperfection(_)))
    };
    named(direction.shares.iter().copied()).any(is_nuisance)
}

#[cfg(test)]
mod tests {
    use flexid_wire::text::clipped;

    use super::*;

    /// The data never separate a gain of the force from one of the acceleration. The prior alone keeps them, to 5 % each.
    #[test]
    fn of_nuisances_no_percentage_is_reported() {
        let mut sought = Sought::new(1).unwrap();
        sought.seek("acceleration_gain", 0.05).unwrap();
        sought.seek("force_gain", 0.05).unwrap();
        let names: Vec<Label> =
            (0..sought.unknowns()).map(|number| clipped(format_args!("u{number}"))).collect();
        let direction = |deviation, shares: &[(u8, f32)]| Direction {
            deviation,
            shares: shares.iter().copied().collect(),
        };
        let gains = direction(1.0, &[(12, 0.7), (15, -0.7)]);
        let damping = direction(1.0, &[(11, 0.9), (12, 0.2)]);
        let text = |direction: &Direction| {
            let residuals = Residuals::noise(1.0);
            weak_direction(direction, &sought, &names, residuals).to_string()
        };
        assert_eq!(
            text(&gains),
            "u12 and u15 trade off in these poses (hardly better than [calibration])"
        );
        assert_eq!(
            text(&damping),
            "u11 is hardly determined by these poses (standard deviation 100 %)"
        );
        assert_eq!(of_parameters(&sought, &[gains, damping]), 1);
    }
}
