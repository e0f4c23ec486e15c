//! Deviations of joints from linear springs and dampers.

use flexid_core::DOF_NAMES;
use flexid_core::chain::Chain;
use flexid_core::motion::Coordinates;
use flexid_core::parameters::Bushing;
use nalgebra::Vector6;
use serde::Deserialize;
use std::f64::consts::{FRAC_2_PI, TAU};

use super::elements::{Element, Law};
use super::range::between;

/// Deviations of all joints. The drive's degree of freedom is that about (or along) the axis of the joint.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Joints {
    /// Part of each damping that is hysteretic: a loss factor that does not depend on frequency, in place of a viscous damper. Typical:
    /// 1, bolted and geared joints (Nashif, Jones and Henderson, _Vibration Damping_, 1985).
    pub hysteretic: f64,
    /// Frequency at which the hysteretic and the viscous damping are equal, and the stiffness is that of the truth, Hz. Since it is causal,
    /// hysteresis makes a joint softer below: at rest by five times its loss at that frequency.
    pub hysteretic_at_hz: f64,
    /// Growth of the drive's stiffness from low to high frequencies, relative: the position loop is compliant below its bandwidth. Typical:
    /// 0.05 to 0.3 (a proportional position loop of 5 to 20 Hz on a stiff gear).
    pub servo: f64,
    /// Frequency of that growth, Hz. Typical: 10.
    pub servo_hz: f64,
    /// Friction torque of each drive (force of a linear axis), Nm (N). It holds elastically up to this load, and acts on the whole motion of the
    /// drive, its path and its vibration. Typical: 10 to 100 Nm at
    /// the axes of a robot of 200 kg payload, a few per cent of the rated torque.
    pub friction: f64,
    /// Stiffness of the friction before it slips, relative to the drive's: a joint that sticks is as stiff as its gear alone, and stiffer by this
    /// part than one whose drive gives way. Typical: 0.05.
    pub friction_stiffness: f64,
    /// Free play of each drive, rad (m). A drive that gravity loads lies at one flank. Typical: 1.5e-4 to 3e-4 (0.5 to 1 arcmin: RV and cycloidal gears in data sheets).
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
            hysteretic_at_hz: 20.0,
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
    pub(crate) fn check(&self) -> Result<(), String> {
        for (key, value, limits) in [
            ("hysteretic", self.hysteretic, [0.0, 1.0]),
            ("hysteretic_at_hz", self.hysteretic_at_hz, [1.0, 1e3]),
            ("servo", self.servo, [0.0, 10.0]),
            ("servo_hz", self.servo_hz, [1e-3, 1e4]),
            ("friction", self.friction, [0.0, 1e6]),
            ("friction_stiffness", self.friction_stiffness, [0.0, 10.0]),
            ("backlash", self.backlash, [0.0, 0.1]),
            ("cubic_rad", self.cubic_rad, [0.0, 10.0]),
            ("loaded_per_knm", self.loaded_per_knm, [0.0, 0.5]),
            ("warm_up_per_cut", self.warm_up_per_cut, [-0.1, 0.1]),
        ] {
            between(&format!("[joints] {key}"), value, limits)?;
        }
        Ok(())
    }

    /// Bushings of cut number `cut`, from 0, as warm and as loaded as they are. `loads` are those of gravity on each bushing, N and Nm.
    pub fn bushings(
        &self,
        chain: &Chain,
        bushings: &[Bushing],
        loads: &[Vector6<f64>],
        cut: u64,
    ) -> Vec<Bushing> {
        let warm = (1.0 + self.warm_up_per_cut).powf(cut as f64);
        let joints = chain.joints().iter().zip(bushings).zip(loads);
        joints
            .map(|((joint, bushing), load)| {
                let mut own = *bushing;
                own.stiffness.iter_mut().for_each(|k| *k *= warm);
                if let Some(drive) = joint.drive() {
                    own.stiffness[drive] *= 1.0 + self.loaded_per_knm * load[drive].abs() / 1e3;
                }
                own
            })
            .collect()
    }

    /// A bushing of the truth as stiff and as damped as it is at `hz`: `k + 2/π h d ω₀ ln (ω/ω₀)` and `d (1 − h + h ω₀/ω)`, with its part h of
    /// hysteresis and the truth's ω₀.
    pub fn at(&self, bushing: &Bushing, hz: f64) -> Bushing {
        let (part, ratio) = (self.hysteretic, self.hysteretic_at_hz / hz);
        let per_damping = FRAC_2_PI * part * TAU * self.hysteretic_at_hz * -ratio.ln();
        let mut own = *bushing;
        for (k, d) in own.stiffness.iter_mut().zip(&mut own.damping) {
            *k += per_damping * *d;
            *d *= 1.0 + part * (ratio - 1.0);
        }
        own
    }

    /// The viscous dampers that hysteresis leaves of a bushing.
    pub fn viscous(&self, bushing: &Bushing) -> Bushing {
        Bushing { damping: bushing.damping.map(|d| d * (1.0 - self.hysteretic)), ..*bushing }
    }

    /// Checks that hysteresis leaves each bushing at least half of its stiffness at rest.
    pub(super) fn check_bushings(&self, bushings: &[Bushing]) -> Result<(), String> {
        for (joint, bushing) in bushings.iter().enumerate() {
            for (dof, (k, d)) in bushing.stiffness.iter().zip(bushing.damping).enumerate() {
                let taken = self.elastic(self.hysteretic * d);
                if taken > 0.5 * k {
                    return Err(format!(
                        "[joints] hysteretic is {}: joint {} {} would be too soft at rest: at most {:.2}",
                        self.hysteretic,
                        joint + 1,
                        DOF_NAMES[dof],
                        self.hysteretic * 0.5 * k / taken
                    ));
                }
            }
        }
        Ok(())
    }

    /// The least part of a stiffness of these bushings that hysteresis leaves at rest.
    pub(super) fn stiffness_at_rest(&self, bushings: &[Bushing]) -> f64 {
        let pairs = bushings.iter().flat_map(|own| own.stiffness.iter().zip(own.damping));
        pairs.map(|(k, d)| 1.0 - self.elastic(self.hysteretic * d) / k).fold(1.0, f64::min)
    }

    /// The elements of a robot with the bushings of [`Joints::bushings`]. `index` maps its joints to those of the chain that moves, whose
    /// elongations at rest are `rest`.
    pub fn elements(
        &self,
        chain: &Chain,
        bushings: &[Bushing],
        index: &[usize],
        rest: &Coordinates,
    ) -> Vec<Element> {
        let mut elements = Vec::new();
        for ((joint, bushing), &index) in chain.joints().iter().zip(bushings).zip(index) {
            let mut add = |dof: usize, law: Law| elements.push(Element::new(index, dof, law));
            if let Some(drive) = joint.drive() {
                let stiffness = bushing.stiffness[drive];
                if self.servo != 0.0 {
                    let rate = TAU * self.servo_hz;
                    add(drive, Law::Maxwell { stiffness: self.servo * stiffness, rate });
                }
                if self.friction > 0.0 {
                    let stiffness = self.friction_stiffness * stiffness;
                    add(drive, Law::Friction { stiffness, limit: self.friction });
                }
                if self.backlash > 0.0 {
                    let (half, at_rest) = (0.5 * self.backlash, rest[index][drive]);
                    add(drive, Law::Play { stiffness, half, at_rest });
                }
            }
            if self.cubic_rad > 0.0 {
                for dof in 3..6 {
                    let stiffness = bushing.stiffness[dof];
                    add(dof, Law::Cubic { stiffness, at: self.cubic_rad });
                }
            }
            if self.hysteretic > 0.0 {
                for dof in 0..6 {
                    self.hysteresis(self.hysteretic * bushing.damping[dof])
                        .for_each(|law| add(dof, law));
                }
            }
        }
        elements
    }

    /// Maxwell elements that dissipate like a constant loss factor, in place of the damper `damping`: where neighbouring ω_m differ by the factor ρ, the imaginary part of
    /// `Σ g s/(s + ω_m)` is `g π/(2 ln ρ)`, by Poisson's sum to `2 sech(π²/ln ρ)`, 5e-4 for ρ = 3 (after Biot, 1958). A spring takes
    /// back their stiffness at [`Joints::hysteretic_at_hz`].
    pub(super) fn hysteresis(&self, damping: f64) -> impl Iterator<Item = Law> {
        let stiffness = self.branch(damping);
        let spring = std::iter::once(Law::Spring { stiffness: -self.elastic(damping) });
        spring.chain(rates().map(move |rate| Law::Maxwell { stiffness, rate }))
    }

    /// Stiffness g of each of these elements.
    fn branch(&self, damping: f64) -> f64 {
        damping * TAU * self.hysteretic_at_hz * 2.0 * RATIO.ln() / std::f64::consts::PI
    }

    /// Stiffness of all of them together at [`Joints::hysteretic_at_hz`].
    fn elastic(&self, damping: f64) -> f64 {
        let at = TAU * self.hysteretic_at_hz;
        rates().map(|rate| self.branch(damping) * at * at / (at * at + rate * rate)).sum()
    }
}

/// Rates ω_m of the elements of hysteresis, 1/s.
fn rates() -> impl Iterator<Item = f64> {
    let count = ((HIGHEST_HZ / LOWEST_HZ).ln() / RATIO.ln()).ceil() as i32;
    (0..=count).map(|m| TAU * LOWEST_HZ * RATIO.powi(m))
}

/// Range of the rates of hysteresis' elements, Hz: far beyond any band, since an element has a fifth of its largest loss a decade away.
const LOWEST_HZ: f64 = 0.02;
const HIGHEST_HZ: f64 = 20_000.0;
/// Factor between neighbouring rates.
const RATIO: f64 = 3.0;
