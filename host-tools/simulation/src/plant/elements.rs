//! Elements between the two sides of one degree of freedom: their laws, and their past.
//!
//! An element acts on the elongation x from rest, so that the static equilibrium stays that of the springs. Friction acts on the whole motion of
//! a drive, its path and x. What depends on the past is advanced once a step of the integration.

use flexid_core::MAX_JOINTS;
use flexid_core::motion::{Coordinates, State};

/// Where a robot is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// Elongations at rest, m and rad.
    pub rest: Coordinates,
    /// Way of each drive from its start along its degree of freedom, rad (m).
    pub driven: [f64; MAX_JOINTS],
}

/// Load of an element, N or Nm, at the elongation x, m or rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// `k x`.
    Spring {
        /// k.
        stiffness: f64,
    },
    /// `k x³/x₁²`.
    Cubic {
        /// k.
        stiffness: f64,
        /// x₁.
        at: f64,
    },
    /// Free play of ± half in series with a spring k, which `K q` holds already. The spring bears its load at rest, `k s`, at one flank:
    /// with `y = x + s ± half` its load is `k (y − clamp(y, ± half))`, less `k (x + s)`.
    Play {
        /// k.
        stiffness: f64,
        /// Half of the play.
        half: f64,
        /// s: elongation of the spring at rest.
        at_rest: f64,
    },
    /// A spring k in series with a slider that holds up to a limit (Jenkins), along the whole way of the drive. A drive that stands sticks: the
    /// joint is then stiffer by k, and as stiff as its gear alone. One that feeds faster than it vibrates slips one way, its load stays at the
    /// limit, and the vibration feels none of it.
    Friction {
        /// k.
        stiffness: f64,
        /// Load that slips.
        limit: f64,
    },
    /// A spring k in series with a damper k/ω: `k s/(s + ω)`.
    Maxwell {
        /// k.
        stiffness: f64,
        /// ω, 1/s.
        rate: f64,
    },
}

/// One element and its past.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Element {
    /// Joint of the chain that moves, from 0.
    joint: usize,
    dof: usize,
    law: Law,
    /// Load and elongation at the end of the last step.
    load: f64,
    elongation: f64,
}

impl Element {
    pub(super) fn new(joint: usize, dof: usize, law: Law) -> Self {
        Self { joint, dof, law, load: 0.0, elongation: 0.0 }
    }

    /// Elongation that the law acts on.
    fn way(&self, place: &Place, state: &State) -> f64 {
        let (joint, dof) = (self.joint, self.dof);
        let x = state.elongation[joint][dof] - place.rest[joint][dof];
        match self.law {
            Law::Friction { .. } => x + place.driven[joint],
            _ => x,
        }
    }

    /// Load at elongation `x`, `seconds` after the last step. The rate is taken to be constant between.
    fn load(&self, x: f64, seconds: f64) -> f64 {
        let moved = x - self.elongation;
        match self.law {
            Law::Spring { stiffness } => stiffness * x,
            Law::Cubic { stiffness, at } => stiffness * x * (x / at) * (x / at),
            Law::Play { stiffness, half, at_rest } => {
                let flank = if at_rest == 0.0 { 0.0 } else { half.copysign(at_rest) };
                let y = x + at_rest + flank;
                stiffness * (y - y.clamp(-half, half) - (x + at_rest))
            }
            Law::Friction { stiffness, limit } => {
                (self.load + stiffness * moved).clamp(-limit, limit)
            }
            Law::Maxwell { stiffness, rate } => {
                let decay = rate * seconds;
                let kept = -(-decay).exp_m1();
                // kept / decay tends to 1 as the step shrinks.
                let part = if decay > 0.0 { kept / decay } else { 1.0 };
                self.load * (1.0 - kept) + stiffness * moved * part
            }
        }
    }
}

/// Loads of all `elements` at `place` and `state`, `seconds` after the last step, added to those of each coordinate.
pub fn add_loads(
    elements: &[Element],
    place: &Place,
    state: &State,
    seconds: f64,
    loads: &mut Coordinates,
) {
    for element in elements {
        loads[element.joint][element.dof] += element.load(element.way(place, state), seconds);
    }
}

/// Ends a step of `seconds` at `place` and `state`.
pub fn advance(elements: &mut [Element], place: &Place, state: &State, seconds: f64) {
    for element in elements {
        let x = element.way(place, state);
        (element.load, element.elongation) = (element.load(x, seconds), x);
    }
}
