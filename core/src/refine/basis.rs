//! What is known of an experiment.

/// Known part of an experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// It has been done.
    Measured,
    /// Its force is planned. Its acceleration is the modelled one, at a seam of zero.
    Planned,
}

/// Use of the equations of a record that a fit does not have.
#[derive(Clone, Copy, Debug)]
pub(super) enum Asked {
    /// The equations that it would have in a fit.
    Fit,
    /// Its Fisher information, at the force as it is.
    Information(Basis),
}

impl Asked {
    pub(super) fn basis(self) -> Basis {
        match self {
            Self::Fit => Basis::Measured,
            Self::Information(basis) => basis,
        }
    }
}
