//! Findings from result files.

use flexid_core::imperfection::Imperfection;
use flexid_pipeline::dynamics::OF_JOINT;
use nalgebra::{DMatrix, DVector};

use super::epoch::{Epoch, Posterior};
use crate::document::Found;
use crate::parameter::Place;
use crate::reference;

/// An error that findings share, and the largest standard deviation that one of them states for it.
struct Common {
    imperfection: Imperfection,
    prior: f64,
}

/// What each finding says of the parameters at these places, stated at `hz`, and of the errors that all of them share, which are those that
/// `are_shared` names. Other errors are each finding's own. `None` if the factor of one is singular, which that of a checked result is not.
pub(crate) fn epochs(
    findings: &[&Found],
    hz: f64,
    places: &[Place],
    are_shared: impl Fn(Imperfection) -> bool,
) -> Option<Vec<Epoch>> {
    let common = common(findings, hz, are_shared);
    let each = findings.iter().map(|found| posterior(found, hz, places, &common));
    each.map(|posterior| Epoch::new(&posterior, common.len())).collect()
}

/// The errors that findings share, each once.
fn common(findings: &[&Found], hz: f64, are_shared: impl Fn(Imperfection) -> bool) -> Vec<Common> {
    let mut all: Vec<Common> = Vec::new();
    let shared = findings.iter().filter_map(|found| shared(found, hz));
    let own = shared.flat_map(|shared| &shared.imperfections);
    for own in own.filter(|own| are_shared(own.imperfection)) {
        match all.iter_mut().find(|known| known.imperfection == own.imperfection) {
            Some(known) => known.prior = known.prior.max(own.prior),
            None => all.push(Common { imperfection: own.imperfection, prior: own.prior }),
        }
    }
    all
}

/// What a finding shares with others. `None` of one that does not state it for the parameters at this frequency.
fn shared(found: &Found, hz: f64) -> Option<&flexid_pipeline::shared::Shared> {
    found.shared.as_ref().filter(|_| found.robot.reference_hz() == hz)
}

fn posterior(found: &Found, hz: f64, places: &[Place], common: &[Common]) -> Posterior {
    let restated = reference::at(found, hz);
    let logarithms: Vec<Option<(f64, f64)>> = places
        .iter()
        .map(|place| {
            let std = place.determined(&restated.joints)?;
            Some((place.of(&restated.joints).0.ln(), std))
        })
        .collect();
    let Some(shared) = shared(found, hz) else {
        // Everything is its own.
        let stds = logarithms.iter().map(|own| own.map_or(0.0, |(_, std)| std));
        return Posterior {
            columns: Vec::new(),
            priors: Vec::new(),
            errors: DVector::zeros(0),
            factor: DMatrix::from_diagonal(&DVector::from_iterator(places.len(), stds)),
            logarithms,
            widening: 1.0,
        };
    };
    let place_of =
        |imperfection| common.iter().position(|known| known.imperfection == imperfection);
    let own = shared.imperfections.iter().enumerate();
    let own = own.filter_map(|(row, own)| Some((row, own, place_of(own.imperfection)?)));
    let own: Vec<_> = own.collect();
    let all = shared.imperfections.len();
    let size = all + OF_JOINT * found.joints.len();
    let rows: Vec<usize> = own.iter().map(|(row, ..)| *row).chain(all..size).collect();
    Posterior {
        columns: own.iter().map(|(.., place)| *place).collect(),
        priors: own.iter().map(|(_, own, place)| own.prior / common[*place].prior).collect(),
        errors: DVector::from_iterator(
            own.len(),
            own.iter().map(|(_, own, _)| own.value / own.prior),
        ),
        logarithms,
        factor: of_rows(&shared.factor, size, &rows),
        widening: shared.widening,
    }
}

/// Factor of these rows and columns of a covariance whose lower triangular factor, of so many rows, is given row by row.
fn of_rows(factor: &[f32], size: usize, rows: &[usize]) -> DMatrix<f64> {
    let whole = DMatrix::from_fn(rows.len(), size, |row, column| match column <= rows[row] {
        true => f64::from(factor[rows[row] * (rows[row] + 1) / 2 + column]),
        false => 0.0,
    });
    if rows.len() == size {
        return whole;
    }
    // L = R^T Q^T of these rows: the covariance is R^T R, and small variances stay.
    whole.transpose().qr().r().transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a covariance without those between them, of which one is a multiple of another.
    #[test]
    fn some_rows_have_a_factor_of_their_covariance() {
        let factor = [2.0, 1.0, 3.0, -1.0, 0.5, 0.25, 4.0, 2.0, 0.0, 0.0];
        let all = DMatrix::from_fn(4, 4, |row, column| match column <= row {
            true => f64::from(factor[row * (row + 1) / 2 + column]),
            false => 0.0,
        });
        let covariance = &all * all.transpose();
        assert_eq!(of_rows(&factor, 4, &[0, 1, 2, 3]), all);
        let rows = [0, 2, 3];
        let own = of_rows(&factor, 4, &rows);
        let found = &own * own.transpose();
        let expected = DMatrix::from_fn(3, 3, |i, j| covariance[(rows[i], rows[j])]);
        assert!(
            (found - expected).amax() < 1e-12
                && own.upper_triangle() == DMatrix::from_diagonal(&own.diagonal()),
            "{own}"
        );
    }
}
