//! Elements between the two sides of one degree of freedom: their laws, and their past.
//!
//! An element acts on the elongation x from rest, so that the static equilibrium stays that of the springs. What depends on the
//! past is advanced once a step of the integration.

use flexid_core::motion::{Coordinates, State};

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
    /// A spring k in series with a slider that holds up to a limit (Jenkins).
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

/// Loads of all `elements` at `state`, `seconds` after the last step, added to those of each coordinate. `rest` are the elongations at rest.
pub fn add_loads(
    elements: &[Element],
    rest: &Coordinates,
    state: &State,
    seconds: f64,
    loads: &mut Coordinates,
) {
    for element in elements {
        let (joint, dof) = (element.joint, element.dof);
        let x = state.elongation[joint][dof] - rest[joint][dof];
        loads[joint][dof] += element.load(x, seconds);
    }
}

/// Ends a step of `seconds` at `state`.
pub fn advance(elements: &mut [Element], rest: &Coordinates, state: &State, seconds: f64) {
    for element in elements {
        let (joint, dof) = (element.joint, element.dof);
        let x = state.elongation[joint][dof] - rest[joint][dof];
        (element.load, element.elongation) = (element.load(x, seconds), x);
    }
}
