//! The observation of the last link: the reading of an accelerometer, or a displacement.

use super::complex::{Column, Complex};
use super::filter::Filter;
use super::lanes::{Lanes, Scalar};
use crate::DOF;

/// Three loads on the last link. By reciprocity the displacement that belongs to a load is one that is observed.
pub(crate) type Loads<T> = [[T; DOF]; 3];

/// The observation of a response along three axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Observation<T> {
    /// Reading of an accelerometer, m/s²: `s²` times a translation plus what gravity adds, filtered, and later by the delay.
    Acceleration {
        /// Loads whose displacements are the translations of the accelerometer along its axes.
        translation: Loads<T>,
        /// Loads whose displacements are the changes of gravity along the axes; `None` if it does not feel gravity.
        gravity: Option<Loads<T>>,
        /// Delay of the reading after the force, s.
        delay: T,
        /// Filter of the reading.
        filter: Filter<T>,
    },
    /// Displacement, m. The loads are those whose displacements it is.
    Displacement(Loads<T>),
}

impl<T: Scalar> Observation<T> {
    /// Loads whose displacements are the observation at the complex frequency `s`, one column per axis.
    #[inline(always)]
    pub(crate) fn loads<V: Lanes<Scalar = T>>(&self, s: Complex<V>, loads: &mut [Column<V>; 3]) {
        match self {
            Self::Acceleration { translation, gravity, delay, filter } => {
                let s2 = s * s;
                let is_delayed = delay.to_f64() != 0.0;
                let is_filtered = !filter.is_none();
                // A closure would not be inlined.
                let mut transfer = None;
                if is_delayed || is_filtered {
                    let lag = (-s.scale(s.re.fill(*delay))).exponential();
                    transfer = Some(lag);
                    if is_filtered {
                        transfer = Some(lag * filter.inverse(s).reciprocal());
                    }
                }
                for axis in 0..3 {
                    for i in 0..DOF {
                        let mut load = s2.scale(s.re.fill(translation[axis][i]));
                        if let Some(gravity) = gravity {
                            load.re = load.re + s.re.fill(gravity[axis][i]);
                        }
                        if let Some(transfer) = transfer {
                            load = load * transfer;
                        }
                        loads[axis][i] = load;
                    }
                }
            }
            Self::Displacement(displacement) => {
                for axis in 0..3 {
                    for i in 0..DOF {
                        loads[axis][i] = Complex::zero(s.re);
                        loads[axis][i].re = s.re.fill(displacement[axis][i]);
                    }
                }
            }
        }
    }
}
