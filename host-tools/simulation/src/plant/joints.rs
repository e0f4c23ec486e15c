//! Loads of joints that no linear spring and damper has: each an element between the two sides of one degree of freedom.
//!
//! An element acts on the elongation x from rest, so that the static equilibrium stays that of the springs. What depends on the
//! past is advanced once a step of the integration.

use flexid_core::chain::{Chain, JointKind};
use flexid_core::motion::{Coordinates, State};
use flexid_core::parameters::Bushing;
use flexid_pipeline::model::Model;
use nalgebra::Vector6;
use serde::Deserialize;
use std::f64::consts::TAU;

use super::between;

/// Deviations of all joints. The drive's degree of freedom is that about (or along) the axis of the joint.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Joints {
    /// Part of each damping that is hysteretic: a loss factor that does not depend on frequency, in place of a viscous damper. Typical:
    /// 1, bolted and geared joints (Nashif, Jones and Henderson, _Vibration Damping_, 1985).
    pub hysteretic: f64,
    /// Frequency at which the hysteretic and the viscous damping are equal, and the stiffness is that of the truth, Hz.
    pub hysteretic_at_hz: f64,
    /// Growth of the drive's stiffness from low to high frequencies, relative: the position loop gives way below its bandwidth. Typical:
    /// 0.05 to 0.3 (a proportional position loop of 5 to 20 Hz on a stiff gear).
    pub servo: f64,
    /// Frequency of that growth, Hz. Typical: 10.
    pub servo_hz: f64,
    /// Friction torque of each drive (force of a linear axis), Nm (N). It holds elastically up to this load. Typical: 10 to 100 Nm at
    /// the axes of a robot of 200 kg payload, a few per cent of the rated torque.
    pub friction: f64,
    /// Stiffness of the friction before it slips, relative to the drive's. Typical: 0.05.
    pub friction_stiffness: f64,
    /// Free play of each drive, rad (m). Typical: 1.5e-4 to 3e-4 (0.5 to 1 arcmin: RV and cycloidal gears in data sheets).
    pub backlash: f64,
    /// Elongation at which the cubic part of each rotational spring equals its linear part, rad; 0 for linear springs. Typical: 3e-3, a
    /// harmonic drive that stiffens by 10 % at 1e-3 rad (Tuttle and Seering, IEEE Transactions on Robotics and Automation 12, 1996).
    pub cubic_rad: f64,
    /// Growth of the drive's stiffness with the load of gravity on it, relative per kNm. Typical: 0.01.
    pub loaded_per_knm: f64,
    /// Change of all stiffnesses from one cut to the next, relative. Typical: -0.002, a gear that warms up.
    pub warm_up_per_cut: f64,
}

impl Default for Joints {
    fn default() -> Self {
        Self {
            hysteretic: 0.0,
            hysteretic_at_hz: 40.0,
            servo: 0.0,
            servo_hz: 10.0,
            friction: 0.0,
            friction_stiffness: 0.05,
            backlash: 0.0,
            cubic_rad: 0.0,
            loaded_per_knm: 0.0,
            warm_up_per_cut: 0.0,
        }
    }
}

impl Joints {
    pub(super) fn check(&self, _: &Model) -> Result<(), String> {
        for (key, value, limits) in [
            ("hysteretic", self.hysteretic, [0.0, 1.0]),
            ("hysteretic_at_hz", self.hysteretic_at_hz, [LOWEST_HZ, 1e3]),
            ("servo", self.servo, [-0.9, 10.0]),
            ("servo_hz", self.servo_hz, [1e-3, 1e4]),
            ("friction", self.friction, [0.0, 1e6]),
            ("friction_stiffness", self.friction_stiffness, [0.0, 10.0]),
            ("backlash", self.backlash, [0.0, 0.1]),
            ("cubic_rad", self.cubic_rad, [0.0, 10.0]),
            ("loaded_per_knm", self.loaded_per_knm, [-0.5, 0.5]),
            ("warm_up_per_cut", self.warm_up_per_cut, [-0.1, 0.1]),
        ] {
            between(&format!("[joints] {key}"), value, limits)?;
        }
        Ok(())
    }

    /// Bushings of cut number `cut`, from 0. `loads` are those of gravity on each bushing, N and Nm.
    pub fn bushings(
        &self,
        chain: &Chain,
        bushings: &[Bushing],
        loads: &[Vector6<f64>],
        cut: u64,
    ) -> Vec<Bushing> {
        let warm = 1.0 + self.warm_up_per_cut * cut as f64;
        let joints = chain.joints().iter().zip(bushings).zip(loads);
        joints
            .map(|((joint, bushing), load)| {
                let mut own = *bushing;
                own.stiffness.iter_mut().for_each(|k| *k *= warm);
                let drive = drive(joint);
                own.stiffness[drive] *= 1.0 + self.loaded_per_knm * load[drive].abs() / 1e3;
                own.damping.iter_mut().for_each(|d| *d *= 1.0 - self.hysteretic);
                own
            })
            .collect()
    }

    /// The elements of a robot with these `bushings`, whose dampings are those without hysteresis. `index` maps its joints to those of the
    /// chain that moves.
    pub fn elements(&self, chain: &Chain, bushings: &[Bushing], index: &[usize]) -> Vec<Element> {
        let mut elements = Vec::new();
        for ((joint, bushing), &index) in chain.joints().iter().zip(bushings).zip(index) {
            let drive = drive(joint);
            let stiffness = bushing.stiffness[drive];
            let mut add = |dof: usize, law: Law| elements.push(Element::new(index, dof, law));
            if self.servo != 0.0 {
                let rate = TAU * self.servo_hz;
                add(drive, Law::Maxwell { stiffness: self.servo * stiffness, rate });
            }
            if self.friction > 0.0 {
                let stiffness = self.friction_stiffness * stiffness;
                add(drive, Law::Friction { stiffness, limit: self.friction });
            }
            if self.backlash > 0.0 {
                add(drive, Law::Play { stiffness, half: 0.5 * self.backlash });
            }
            if self.cubic_rad > 0.0 {
                for dof in 3..6 {
                    let stiffness = bushing.stiffness[dof];
                    add(dof, Law::Cubic { stiffness, at: self.cubic_rad });
                }
            }
            if self.hysteretic > 0.0 {
                for dof in 0..6 {
                    self.hysteresis(bushing.damping[dof]).for_each(|law| add(dof, law));
                }
            }
        }
        elements
    }

    /// Maxwell elements that dissipate like a constant loss factor: where neighbouring ω_m differ by the factor ρ, the imaginary part of
    /// `Σ g s/(s + ω_m)` is `g π/(2 ln ρ)`, by Poisson's sum to `2 sech(π²/ln ρ)`, 5e-4 for ρ = 3 (after Biot, 1958). A spring takes
    /// back their stiffness at [`Joints::hysteretic_at_hz`].
    pub(super) fn hysteresis(&self, damping: f64) -> impl Iterator<Item = Law> {
        let at = TAU * self.hysteretic_at_hz;
        let loss = self.hysteretic * damping * at;
        let stiffness = loss * 2.0 * RATIO.ln() / std::f64::consts::PI;
        let count = ((HIGHEST_HZ / LOWEST_HZ).ln() / RATIO.ln()).ceil() as i32;
        let rates = (0..=count).map(|m| TAU * LOWEST_HZ * RATIO.powi(m));
        let elastic: f64 =
            rates.clone().map(|rate| stiffness * at * at / (at * at + rate * rate)).sum();
        let spring = std::iter::once(Law::Spring { stiffness: -elastic });
        spring.chain(rates.map(move |rate| Law::Maxwell { stiffness, rate }))
    }
}

/// Range of the rates of hysteresis' elements, Hz: far beyond any band, since each is felt a decade away.
const LOWEST_HZ: f64 = 0.02;
const HIGHEST_HZ: f64 = 20_000.0;
/// Factor between neighbouring rates.
const RATIO: f64 = 3.0;

/// Degree of freedom along (or about) the axis of a joint's drive: that of the axis' largest component.
fn drive(joint: &flexid_core::chain::Joint) -> usize {
    let first = match joint.kind {
        JointKind::Prismatic => 0,
        JointKind::Revolute => 3,
    };
    first + joint.axis.iamax()
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
    /// Takes back `k x` within a free play of ± half.
    Play {
        /// k.
        stiffness: f64,
        /// Half of the play.
        half: f64,
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
            Law::Play { stiffness, half } => -stiffness * x.clamp(-half, half),
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
